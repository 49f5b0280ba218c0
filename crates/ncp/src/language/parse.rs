//! From a line to its command.
//!
//! A line is read from left to right. A faulty word is reported and skipped, and reading goes on
//! with the next, so that all mistakes of a line are reported at once. A line with an error has no
//! command.

use std::ops::RangeInclusive;

use vimc4_isel_wire::Plane;
use vimc4_motion::Turn;

use super::command::{
    Accessory, DrillWords, Groups, Instruction, JobLine, LETTERS, Placed, Span, SpindleWords, Word,
};
use super::lenient;
use super::problem::Problem;
use super::reader::Reader;
use super::reference::{self, CommandInfo, Form};
use super::token;
use super::value::Value;

/// The registers for work-piece zeros.
const REGISTERS: RangeInclusive<u8> = 1..=8;

/// Reads a line, given without its end, and reports what is wrong with it, and where.
pub fn parse<'t>(line: &'t str, report: &mut dyn FnMut(Span, Problem)) -> JobLine<'t> {
    let mut reader = Reader::new(line, report);
    let number = reader.line_number();
    let sound = !reader.failed();
    let (command, harmless) = reader.command();
    let passed = reader.pass_over();
    let comment = reader.rest().strip_prefix(';').map(str::trim);
    // The text skipped here may be anything, except a comment in brackets, which was reported.
    let harmless = sound && harmless && passed.start == passed.end;
    JobLine { number, command, comment, harmless }
}

impl<'t> Reader<'t, '_> {
    fn line_number(&mut self) -> Option<u64> {
        self.ends();
        let written = self.take(token::line_number)?;
        let number = written.value.parse().ok();
        if number.is_none() {
            self.say(written.span, Problem::TooLarge);
        }
        number
    }

    /// The command, if it can be read, and whether the unreadable part may be left out.
    fn command(&mut self) -> (Option<Placed<Instruction>>, bool) {
        if self.ends() {
            let says_nothing = !lenient::hides_a_command(self.rest());
            self.bracket_comment();
            return (None, says_nothing);
        }
        let Some(name) = self.take(token::name) else {
            let text = self.pass_over();
            self.say(text, Problem::NoCommand);
            return (None, false);
        };
        let Some(info) = reference::find(name.value) else {
            let harmless = lenient::is_no_motion(self.text(self.whole_line(name.span)));
            self.unknown_command(name.span);
            self.pass_over();
            return (None, harmless);
        };
        // The part that is left out with the line must not be another command.
        let rest = self.rest();
        let may_be_left_out = || info.is_accessory() && !lenient::hides_a_command(rest);
        let Some(value) = self.form(info, name.span) else {
            self.pass_over();
            return (None, may_be_left_out());
        };
        let span = self.whole_command(info, name.span);
        let command = (!self.failed()).then_some(Placed { value, span });
        if command.is_none() {
            return (None, may_be_left_out());
        }
        // A comment in brackets is left out, unless there is more between brackets.
        let rest = self.rest();
        let harmless = !self.bracket_comment() || !lenient::hides_a_command(rest);
        (command, harmless)
    }

    /// A name may have digits, though no command has one: `G00`.
    fn unknown_command(&mut self, name: Span) {
        self.take(token::digits);
        let span = self.since(name);
        self.say(span, Problem::UnknownCommand(self.excerpt(span)));
    }

    /// Reports a comment in brackets, up to the end of the line, and skips it.
    fn bracket_comment(&mut self) -> bool {
        let comment = self.take(token::bracket_comment);
        if let Some(comment) = comment {
            self.say(comment.span, Problem::BracketComment);
        }
        comment.is_some()
    }

    /// From the name of a command to its last word, after which nothing else may follow.
    fn whole_command(&mut self, info: &'static CommandInfo, name: Span) -> Span {
        let span = self.until_here(name);
        if !self.failed() && !self.ends() && !self.next_is(token::bracket_comment) {
            let text = self.pass_over();
            self.say(text, Problem::Surplus(info.name));
        }
        span
    }

    /// What follows the name of a command, and with it the command.
    fn form(&mut self, info: &'static CommandInfo, name: Span) -> Option<Instruction> {
        Some(match info.form {
            Form::Plain(command) => command,
            // A comment behind it is one; behind the two others a semicolon is any character.
            Form::Anything(Instruction::End) => {
                self.pass_over();
                Instruction::End
            }
            Form::Anything(command) => self.anything(command, info, name),
            Form::Move(frame, rate) => Instruction::Move(frame, rate, self.axes(info, name)),
            Form::ZeroAt => Instruction::ZeroAt(self.axes(info, name)),
            Form::Acceleration => Instruction::Acceleration(self.axes(info, name)),
            Form::Arc { frame, turn, helix } => {
                let [x, y, z, a, b, c, i, j, k, sweep, ..] = self.words(info);
                if i.or(j).or(k).is_none() {
                    self.missing(info, name, "centre, I or J");
                }
                let (centre, to) = ([i, j, k], [x, y, z, a, b, c]);
                Instruction::Arc { frame, turn, helix, centre, sweep, to }
            }
            Form::Velocity => Instruction::Velocity(self.only_value(info, name)?),
            Form::RapidVelocity => Instruction::RapidVelocity(self.only_value(info, name)?),
            Form::Wait => Instruction::Wait(self.only_value(info, name)?),
            Form::Tool => {
                let number = self.only_value(info, name)?.value.in_thousandths() / 1_000;
                Instruction::Tool(u32::try_from(number).ok()?)
            }
            Form::Plane => Instruction::Plane(self.plane(info, name)?),
            Form::Reference => Instruction::Reference(self.groups(info, name)),
            Form::Limit => {
                let [x, y, z, a, b, c, ..] = self.limits(info, name);
                Instruction::Limit([x, y, z, a, b, c])
            }
            Form::Register => self.register(info, name)?,
            Form::SetPort => {
                let port = self.port(info, name, 'A')?;
                Instruction::SetPort(port.value, self.equal_to(port, u8::MAX)?)
            }
            Form::WaitPort => {
                let port = self.port(info, name, 'E')?;
                Instruction::WaitPort(port.value, self.equal_to(port, u8::MAX)?)
            }
            Form::SetBit(to) => self.set_bit(info, name, to)?,
            Form::WaitBit => {
                let bit = self.port_bit(info, name, 'E')?;
                Instruction::WaitBit(bit.value, self.equal_to(bit, 1)? == 1)
            }
            Form::DrillDefinition => Instruction::DrillDefinition(self.drill_words(info, name)),
            Form::Drill => {
                let [x, y, ..] = self.words(info);
                Instruction::Drill([x, y, None, None, None, None])
            }
            Form::Cylinder => self.cylinder(info, name)?,
            Form::Spindle => self.spindle(info, name),
            Form::Switch(accessory) => self.switch(info, name, accessory),
            Form::Numbered(accessories) => self.numbered(info, name, accessories)?,
            Form::ZeroHere => match self.take(token::standard) {
                Some(_) => Instruction::ZeroStandard,
                None => Instruction::ZeroHere,
            },
            Form::ToolDefinition => {
                self.words(info);
                Instruction::ToolDefinition
            }
        })
    }

    /// A command behind which anything may stand, up to the end of the line.
    fn anything(
        &mut self,
        command: Instruction,
        info: &'static CommandInfo,
        name: Span,
    ) -> Instruction {
        // Postprocessors write all kinds of terms after TYPE: `Spindle:18000r.p.m`.
        let start = name.start + reference::MARK.len() as u32;
        let text = Span { start, ..self.whole_line(name) };
        let hidden = match command {
            Instruction::Mark => lenient::command_in(self.text(text)),
            _ => None,
        };
        if let Some((at, hidden)) = hidden {
            let start = text.start + at as u32;
            let span = Span { start, end: start + hidden.len() as u32 };
            self.say(span, Problem::Swallowed { by: info.name, command: hidden });
        }
        self.pass_over_all();
        command
    }

    /// One of several accessories, by its number.
    fn numbered(
        &mut self,
        info: &'static CommandInfo,
        name: Span,
        accessories: &[Accessory],
    ) -> Option<Instruction> {
        self.ends();
        // The first coolant needs no number.
        let number = match self.next_is(token::digits) {
            false if accessories.contains(&Accessory::Coolant) => 1,
            false => {
                self.missing(info, name, "number");
                return None;
            }
            true => self.count("the number", 1..=accessories.len() as u8)?,
        };
        let place = usize::from(number).checked_sub(1)?;
        Some(self.switch(info, name, *accessories.get(place)?))
    }

    fn axes(&mut self, info: &'static CommandInfo, name: Span) -> [Option<Word>; 6] {
        let [x, y, z, a, b, c, ..] = self.some_words(info, name);
        [x, y, z, a, b, c]
    }

    fn drill_words(&mut self, info: &'static CommandInfo, name: Span) -> DrillWords {
        let [cycle, plane, depth, dwell, speed, first, other, decrease, retreat, lift, safety] =
            self.some_words(info, name);
        DrillWords {
            cycle,
            plane,
            depth,
            dwell,
            speed,
            first,
            other,
            decrease,
            retreat,
            lift,
            safety,
        }
    }

    fn spindle(&mut self, info: &'static CommandInfo, name: Span) -> Instruction {
        let found = self.words(info);
        // Alone it would start the spindle unasked.
        if found.iter().all(Option::is_none) {
            self.missing(info, name, "ON or OFF");
        }
        let [on, off, cw, ccw, rpm, time, ..] = found;
        self.only_one(on, off, ["ON", "OFF"]);
        self.only_one(cw, ccw, ["CW", "CCW"]);
        let turn =
            |word: Option<Word>, value| word.map(|Placed { span, .. }| Placed { value, span });
        let turn = turn(cw, Turn::Clockwise).or(turn(ccw, Turn::Counterclockwise));
        Instruction::Spindle(SpindleWords { off: off.is_some(), turn, rpm, time })
    }

    fn switch(
        &mut self,
        info: &'static CommandInfo,
        name: Span,
        accessory: Accessory,
    ) -> Instruction {
        let [on, off, ..] = self.words(info);
        if on.or(off).is_none() {
            self.missing(info, name, "ON or OFF");
        }
        self.only_one(on, off, ["ON", "OFF"]);
        Instruction::Switch(accessory, on.is_some())
    }

    /// Of two words that contradict each other only one may be there.
    fn only_one(&mut self, one: Option<Word>, other: Option<Word>, names: [&'static str; 2]) {
        if let (Some(one), Some(other)) = (one, other) {
            let later = if one.span.start < other.span.start { other } else { one };
            let [first, second] = names;
            self.say(later.span, Problem::Contradiction(first, second));
        }
    }

    fn plane(&mut self, info: &'static CommandInfo, name: Span) -> Option<Plane> {
        if self.ends() {
            self.missing(info, name, "plane");
            return None;
        }
        let span = self.take(token::solid)?.span;
        match self.text(span).to_ascii_uppercase().as_str() {
            "XY" | "YX" => Some(Plane::Xy),
            "XZ" | "ZX" => Some(Plane::Xz),
            "YZ" | "ZY" => Some(Plane::Yz),
            _ => {
                self.say(span, Problem::UnknownPlane(self.excerpt(span)));
                None
            }
        }
    }

    /// The axes of a reference run; none may be there twice.
    fn groups(&mut self, info: &'static CommandInfo, name: Span) -> Groups {
        let mut groups = Groups::default();
        let mut seen = 0;
        let mut free = groups.iter_mut();
        while !self.ends() {
            let Some(letters) = self.take(token::solid) else { break };
            let group = self.group(letters, &mut seen, info);
            // There are as many groups as axes, and an axis is only in one.
            if let Some(free) = free.next().filter(|_| group != 0) {
                *free = group;
            }
        }
        if seen == 0 {
            self.missing(info, name, "axis");
        }
        groups
    }

    /// A group of a reference run. Only axes that have not been `seen` are in it.
    fn group(&mut self, letters: Placed<&str>, seen: &mut u8, info: &'static CommandInfo) -> u8 {
        let mut group = 0;
        for (at, letter) in letters.value.char_indices() {
            let start = letters.span.start + at as u32;
            let span = Span { start, end: start + letter.len_utf8() as u32 };
            let Some(axis) = axis(letter) else {
                self.say(span, Problem::UnknownAxis(self.excerpt(span)));
                continue;
            };
            if *seen & 1 << axis != 0 {
                let name = info.parameters.get(axis).map_or("", |parameter| parameter.name);
                self.say(span, Problem::GivenTwice(name));
            }
            group |= 1 << axis;
            *seen |= 1 << axis;
        }
        group
    }

    /// A register and either `ACT` or a work-piece zero for it.
    fn register(&mut self, info: &'static CommandInfo, name: Span) -> Option<Instruction> {
        self.ends();
        if !self.next_is(token::digits) {
            self.missing(info, name, "register");
            return None;
        }
        let number = self.count("the number of the register", REGISTERS);
        self.ends();
        Some(if self.take(token::act).is_some() {
            Instruction::Recall(number?)
        } else {
            let zero = self.axes(info, name);
            Instruction::Store(number?, zero)
        })
    }

    /// `SETBIT` may have a value after the bit, which counts then.
    fn set_bit(&mut self, info: &'static CommandInfo, name: Span, to: bool) -> Option<Instruction> {
        let bit = self.port_bit(info, name, 'A')?;
        let to = if to && self.next_is(token::equals) { self.equal_to(bit, 1)? == 1 } else { to };
        Some(Instruction::SetBit(bit.value, to))
    }

    /// The turning axis with its radius, and the linear axis that it replaces.
    fn cylinder(&mut self, info: &'static CommandInfo, name: Span) -> Option<Instruction> {
        let turning = self.axis_of_cylinder(info, name)?;
        let parameter = info.parameters.get(turning.value)?;
        let radius = self.value(parameter.name, parameter.value?, turning.span)?;
        let radius = Placed { span: self.since(turning.span), ..radius };
        if self.ends() {
            if radius.value != Value::ZERO {
                self.missing(info, name, "linear axis to replace");
            }
            return Some(Instruction::Cylinder(turning, radius, None));
        }
        let linear = self.axis_of_cylinder(info, name)?;
        if linear.value > 2 {
            self.say(linear.span, Problem::NotLinear(self.excerpt(linear.span)));
        } else if linear.value == turning.value {
            self.say(linear.span, Problem::GivenTwice(parameter.name));
        }
        Some(Instruction::Cylinder(turning, radius, Some(linear)))
    }

    fn axis_of_cylinder(
        &mut self,
        info: &'static CommandInfo,
        name: Span,
    ) -> Option<Placed<usize>> {
        self.ends();
        let Some(Placed { value, span }) = self.take(token::letters) else {
            self.missing(info, name, "axis");
            return None;
        };
        let mut letters = value.chars();
        let Some(value) = letters.next().and_then(axis).filter(|_| letters.next().is_none()) else {
            self.say(span, Problem::UnknownAxis(self.excerpt(span)));
            return None;
        };
        Some(Placed { value, span })
    }
}

/// The index of an axis.
fn axis(letter: char) -> Option<usize> {
    LETTERS.iter().position(|known| known.eq_ignore_ascii_case(&letter))
}
