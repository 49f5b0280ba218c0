//! Why an answer is an error, in words: which switch, value or person caused it, and in brackets
//! the profile value that would have avoided it. The words are made only when events are watched.

use std::slice::EscapeAscii;

use vimc4_device::Grouped;
use vimc4_isel_wire::{
    Addressed, AxisSet, Context, Dialect, Fault, Fractions, Frame, LINE_MAX, Mode, Op, PortTest,
    Text32, WrongAxes, WrongNumber, parse, table,
};
use vimc4_plant::End;

use crate::axes::AXIS_NAMES;
use crate::firmware::Firmware;
use crate::model::{CommandSet, LeaveSwitch};
use crate::program::Validity;
use crate::why::{Breaker, By, COVER_OPEN, Off, Opened, Why};
use crate::wiring::{Output, Wire};

impl Firmware {
    /// A reason in words: a lower-case fragment. `line` is the line that is refused, if it is one.
    pub(crate) fn in_words(&self, why: Why, line: Option<(&[u8], Mode)>) -> String {
        let state = &self.state;
        match why {
            Why::Line(fault) => match line {
                Some((text, mode)) => self.fault_in_words(fault, text, mode),
                None => fault.reply().meaning().to_owned(),
            },
            Why::TooLong => format!("a line of more than {LINE_MAX} characters"),
            Why::NoDiagnosis(code) => {
                format!("this model has no diagnosis {} (diagnosis)", code.escape_ascii())
            }
            Why::NoAxes => format!("no axes are set: {} sets X, Y and Z", self.sent("7")),
            Why::Plane(missing) => {
                format!("the plane of circles needs {missing}, only {} set", are(state.axes))
            }
            Why::NoPlane => format!(
                "a circle needs two of X, Y and Z, only {} set (stored_arcs)",
                are(state.axes)
            ),
            Why::AtRest => "speed 0 Hz for an axis that moves".to_owned(),
            Why::Stages(off @ Off::Switched) => {
                format!("{}{}", off.in_words(), self.stage_command())
            }
            Why::Stages(off) => off.in_words().to_owned(),
            Why::Spindle => format!(
                "the spindle needs the stages, which are off: press ON{}",
                self.stage_command()
            ),
            Why::StagesBehindCover => {
                "the stages cannot be switched on with the cover open and the key on automatic"
                    .to_owned()
            }
            Why::EmergencyInput => {
                format!("emergency stop input: {}", self.input_in_words(state.settings.emergency))
            }
            Why::Cover(opened) => self.cover_in_words(opened),
            Why::Latched(axes) => {
                format!("{} (limit_latch)", self.waits_for_run(axes, "ran onto a limit switch"))
            }
            Why::OnSwitch { axis, end, away } => self.on_switch(axis, end, away),
            Why::Switch { hit, by_hand } => {
                let pressed = if by_hand { " pressed" } else { "" };
                let one = |(axis, hit): (u8, Option<(End, i64)>)| {
                    let (end, at) = hit?;
                    Some(format!("{}{pressed} at step {}", switch(axis, end), Grouped(at)))
                };
                (0..).zip(hit).filter_map(one).collect::<Vec<_>>().join(" and ")
            }
            Why::WrongSwitch { axis, end, referencing } => wrong_switch(axis, end, referencing),
            Why::ReferenceBroken(breaker) => {
                format!("the reference run was broken off by {}", self.breaker_in_words(breaker))
            }
            Why::NoReference(axes, _) => self.no_reference(axes),
            Why::Freed(axes) => {
                format!("{} (after_free)", self.waits_for_run(axes, "left the limit switch by F"))
            }
            Why::ProgramStored => self.program_stored(),
            Why::NothingToStart => self.nothing_to_start().to_owned(),
            Why::Jump { to, other_base } => {
                let lines = state.flash.program.as_ref().map_or(0, |program| program.len());
                let quirk = if other_base { " (cond_branch_base)" } else { "" };
                format!("a jump to line {}, but the last line is {lines}{quirk}", to + 1)
            }
            Why::LoopDepth => {
                let depth = state.model.limits.loop_depth;
                format!("loops are nested more than {depth} deep (loop_depth)")
            }
            Why::MemoryFull(bytes) => {
                let (bytes, size) = (Grouped(bytes.into()), Grouped(state.model.flash.size.into()));
                format!("the program would take {bytes} bytes, the memory has {size} (flash.size)")
            }
            Why::Stopped(by) => self.stopped_in_words(by),
        }
    }

    fn on_switch(&self, axis: u8, end: End, away: bool) -> String {
        let quirk = if away { " (leave_switch)" } else { "" };
        let opposite = if end == End::Negative { '+' } else { '-' };
        let way = match self.state.model.quirks.leave_switch {
            LeaveSwitch::Refuse => String::new(),
            LeaveSwitch::Away => format!("a move towards {opposite} or "),
        };
        let bit = AxisSet::from_bits(1 << axis).unwrap_or(AxisSet::NONE);
        let run = self.reference_run(bit);
        format!("{bit} is on {}: {way}{run} leaves it{quirk}", switch(axis, end))
    }

    fn cover_in_words(&self, opened: Opened) -> String {
        match opened {
            Opened::Already => COVER_OPEN.to_owned(),
            Opened::Now => "the cover was opened with the key on automatic".to_owned(),
            Opened::Key => "the key was turned to automatic with the cover open".to_owned(),
            Opened::Input => {
                format!("cover input: {}", self.input_in_words(self.state.settings.cover))
            }
        }
    }

    fn stopped_in_words(&self, by: By) -> String {
        let start = self.sent("S");
        match by {
            By::Line => format!("stopped by 253 from the line: {start} goes on"),
            By::Button => format!("stopped by STOP at the panel: {start} goes on"),
            By::ButtonHeld => {
                format!("STOP is held at the panel: release it, {start} goes on (stop_button)")
            }
        }
    }

    fn no_reference(&self, axes: AxisSet) -> String {
        let find = if axes.has(3) && axes != AxisSet::A { "find" } else { "finds" };
        let run = self.reference_run(axes);
        match axes.count() {
            1 => format!("{axes} has no reference point: {run} finds it"),
            _ => format!("{axes} have no reference points: {run} {find} them"),
        }
    }

    /// Axes that only a reference run lets move again, after something has happened to them.
    fn waits_for_run(&self, axes: AxisSet, happened: &str) -> String {
        format!("{axes} {happened} and {} for {}", waits(axes), self.reference_run(axes))
    }

    fn program_stored(&self) -> String {
        let program = self.state.flash.program.as_ref().map(|program| program.validity);
        let there = match program {
            Some(Validity::Invalid) => "a program is stored already, of which a line was refused",
            Some(Validity::Incomplete) => "a program is stored already, which has no end",
            _ => "a program is stored already",
        };
        let eraser = match self.state.model.command_set {
            CommandSet::Imc4 => "the panel".to_owned(),
            _ => self.sent("k"),
        };
        format!("{there}: {eraser} erases it (store_over)")
    }

    /// A reason that ends the stored program: with the line, from 0, at which it ended.
    pub(crate) fn in_words_of_program(&self, why: Why, line: u32) -> String {
        let program = self.state.flash.program.as_ref();
        let text = program.and_then(|program| program.lines.get(line as usize));
        let text = text
            .map_or_else(|| "the end".to_owned(), |line| format!("`{}`", line.text.escape_ascii()));
        format!("line {} of the program, {text}: {}", line + 1, self.in_words(why, None))
    }

    /// How the host switches the stages on, if a port does nothing else.
    fn stage_command(&self) -> String {
        let ports = &self.state.model.ports.write;
        let value = |wires: &Vec<Wire>| match wires.as_slice() {
            [Wire::Output(Output::STAGE)] => Some(1),
            [Wire::Inverted(Output::STAGE)] => Some(0),
            _ => None,
        };
        let command = ports.iter().find_map(|(port, wires)| Some((port, value(wires)?)));
        let command = command.map(|(port, value)| self.sent(&format!("B{port},{value}")));
        command.map(|command| format!(" or send {command}")).unwrap_or_default()
    }

    /// A command as it is sent, with the number that this controller has.
    fn sent(&self, command: &str) -> String {
        format!("@{}{command}", self.state.device)
    }

    /// The commands that drive axes to their reference points: A only alone.
    fn reference_run(&self, axes: AxisSet) -> String {
        let alone = |axes: AxisSet| self.sent(&format!("R{}", axes.bits()));
        match (axes.has(3), axes.without(AxisSet::A)) {
            (true, AxisSet::NONE) => alone(AxisSet::A),
            (true, others) => format!("{} and {}", alone(others), alone(AxisSet::A)),
            (false, others) => alone(others),
        }
    }

    /// What aborted something.
    pub(crate) fn breaker_in_words(&self, breaker: Breaker) -> String {
        match breaker {
            Breaker::Line => "255 from the line".to_owned(),
            Breaker::Input => {
                format!("the abort input: {}", self.input_in_words(self.state.settings.abort))
            }
            Breaker::Stop(By::Line) => "253 from the line (stop_in_move_until)".to_owned(),
            Breaker::Stop(By::Button | By::ButtonHeld) => {
                "STOP at the panel (stop_in_move_until)".to_owned()
            }
        }
    }

    /// What stopped a program that START has begun, and what goes on with it.
    pub(crate) fn pause_in_words(&self, by: By) -> String {
        let by = match by {
            By::Line => "253 from the line",
            By::Button => "STOP at the panel",
            By::ButtonHeld => "STOP, which is held at the panel",
        };
        format!("{by}: START or {} goes on with it", self.sent("S"))
    }

    fn input_in_words(&self, PortTest { port, mask, value }: PortTest) -> String {
        let reads = self.read_port(port);
        format!("port {port} reads {reads}; with mask {mask} it should be {}", value & mask)
    }

    /// Why there is nothing to go on with, and no program that `S` could begin.
    pub(crate) fn nothing_to_start(&self) -> &'static str {
        let program = self.state.flash.program.as_ref().map(|program| program.validity);
        match program {
            None => "no motion was stopped, and no program is stored",
            Some(Validity::Incomplete) => "no motion was stopped, and the program has no end",
            Some(Validity::Invalid) => {
                "no motion was stopped, and a line of the program was refused when it was stored"
            }
            Some(Validity::Valid) => {
                "no motion was stopped; the program is begun with START (start_at_rest)"
            }
        }
    }

    /// What is wrong with a line, with what would be right.
    fn fault_in_words(&self, fault: Fault, text: &[u8], mode: Mode) -> String {
        let stored = self.state.flash.program.as_ref().map(|program| program.len());
        let context = self.state.context(stored.filter(|_| mode == Mode::Stored));
        let dialect = self.state.model.command_set.dialect();
        let Ok(Addressed::Frame(frame)) = parse(text, dialect, mode, self.state.device) else {
            let incomplete = || self.incomplete_in_words(text);
            return no_command_in_words(fault, text, dialect, mode, self.state.device)
                .or_else(incomplete)
                .unwrap_or_else(|| format!("{}: no command begins like this", shown(text)));
        };
        let field = fault.field().unwrap_or(0);
        let sent = frame.field(field).unwrap_or_default();
        let words = match fault {
            Fault::Count { right, or } => {
                let takes = match (right, or) {
                    (0, 0) => "no numbers".to_owned(),
                    (1, 1) => "1 number".to_owned(),
                    _ if right == or => format!("{right} numbers"),
                    _ => format!("{right} or {or} numbers"),
                };
                let axes = if depends_on_axes(frame.op()) {
                    format!(" with {}", self.state.axes)
                } else {
                    String::new()
                };
                format!(
                    "{}{axes} takes {takes}, {}",
                    frame.spec().title,
                    came(&frame, right.into(), or.into())
                )
            }
            Fault::CountWithoutAxes => format!("{} without axes", frame.spec().title),
            Fault::Text => format!("the text has more than {} characters", Text32::MAX),
            Fault::Speed { low, high, .. } => {
                let speed = frame.number(field, context.fractions).unwrap_or_default();
                let (low, high) = (Grouped(low.into()), Grouped(high.into()));
                format!("speed {} Hz: {low} to {high} Hz are right", Grouped(speed))
            }
            Fault::Number { wrong, .. } => number_in_words(wrong, sent, &frame, &context),
            Fault::Axes { wrong, .. } => {
                let sent = sent.escape_ascii();
                match wrong {
                    WrongAxes::NoConfiguration if context.any_axes => {
                        format!("{sent} is not a set of axes: 1 to 8 are right")
                    }
                    WrongAxes::NoConfiguration => {
                        format!(
                            "{sent} is not a set of axes: 1 (X), 3 (X+Y), 7 (X+Y+Z) and 8 (A) are right"
                        )
                    }
                    WrongAxes::NoSet => {
                        format!(
                            "{sent} is not a set of axes here: 1 to 7 (X, Y, Z) or 8 (A) are right"
                        )
                    }
                    WrongAxes::NotConfigured(missing) => {
                        format!("{missing} {} not set, only {}", is(missing), are(self.state.axes))
                    }
                    WrongAxes::NotSingle => format!("{sent} is more than one axis"),
                }
            }
            Fault::NoAddress | Fault::NoCommand | Fault::NotStorable => {
                fault.reply().meaning().to_owned()
            }
        };
        match self.decisive_value(fault, &frame, &context) {
            Some(value) => format!("{words} ({value})"),
            None => words,
        }
    }

    /// What is missing, or may follow, where a direct command has been begun and not ended.
    fn incomplete_in_words(&self, text: &[u8]) -> Option<String> {
        let shown = shown(text);
        let mut rest = text.iter().filter(|byte| **byte != b' ').skip_while(|byte| **byte == b'@');
        rest.next().filter(|byte| byte.is_ascii_digit()).filter(|_| text.contains(&b'@'))?;
        match (rest.next(), rest.next()) {
            (None, _) => Some(format!("{shown}: a command is missing, as in {}", self.sent("P"))),
            (Some(b'D'), code) => {
                let codes: Vec<&str> =
                    self.state.model.diagnosis.keys().map(String::as_str).collect();
                let codes = match codes.as_slice() {
                    [codes @ .., last] if !codes.is_empty() => {
                        format!("{} or {last}", codes.join(", "))
                    }
                    codes => codes.concat(),
                };
                let speeds = matches!(code, Some(b'0'..=b'9')).then_some(" (capital_d)");
                let speeds = speeds.unwrap_or_default();
                Some(format!("{shown}: after D comes what is asked for, {codes}{speeds}"))
            }
            (Some(b'I'), code) => {
                let table = table(self.state.model.command_set.dialect(), Mode::Direct);
                let inits = table.iter().filter_map(|spec| spec.mnemonic.strip_prefix("@I"));
                let inits: Vec<&str> = inits.filter(|code| !code.is_empty()).collect();
                let there =
                    code.is_none_or(|code| !inits.iter().any(|it| it.as_bytes() == [*code]));
                let inits = inits.join(" ");
                there.then(|| format!("{shown}: after I comes one of the letters {inits}"))
            }
            _ => None,
        }
    }

    /// The profile key with which, set differently, this would have been right.
    fn decisive_value(
        &self,
        fault: Fault,
        frame: &Frame<'_>,
        context: &Context<'_>,
    ) -> Option<&'static str> {
        // A mistake that stays at the same place does not count as mended.
        let mends = |context: Context<'_>| match frame.decode(&context) {
            Ok(_) => true,
            Err(other) => (other.reply(), other.field()) != (fault.reply(), fault.field()),
        };
        let with = |change: Change| {
            let mut other = context.clone();
            change(&mut other);
            mends(other)
        };
        let values: [(&str, Change); 5] = [
            ("fractional_numbers", |c| c.fractions = Fractions::Truncate),
            ("bit_values", |c| c.any_bit_value = true),
            ("axis_codes", |c| c.any_axes = true),
            ("resting_speed", |c| c.zero_at_rest = true),
            ("cond_bit_base", |c| c.bit_base_one = !c.bit_base_one),
        ];
        if let Some((name, _)) = values.into_iter().find(|(_, change)| with(*change)) {
            return Some(name);
        }
        let Fault::Speed { low, high, .. } = fault else { return None };
        if (low..=high) != context.speeds {
            return None;
        }
        let speed = frame.number(fault.field()?, context.fractions)?;
        Some(if speed < i64::from(low) { "speed_min" } else { "speed_max" })
    }
}

/// What another profile value changes for a line.
type Change = fn(&mut Context<'_>);

fn number_in_words(
    wrong: WrongNumber,
    sent: &[u8],
    frame: &Frame<'_>,
    context: &Context<'_>,
) -> String {
    let as_sent = sent.escape_ascii();
    match wrong {
        WrongNumber::Unreadable if sent.is_empty() => {
            "a number is missing between the commas".to_owned()
        }
        WrongNumber::Unreadable => format!("{as_sent}: not a number"),
        WrongNumber::Fraction => format!("{as_sent}: this model takes no fractions"),
        WrongNumber::Outside { low, high } if high - low == 1 => {
            format!("{as_sent}: {low} or {high} would be right")
        }
        WrongNumber::Outside { low, high } if low == high => {
            format!("{as_sent}: only {low} would be right")
        }
        WrongNumber::Outside { low, high } => {
            format!("{as_sent}: {} to {} would be right", Grouped(low), Grouped(high))
        }
        WrongNumber::NoSign { zero: true } => format!("{as_sent}: -1, 0 or 1 would be right"),
        WrongNumber::NoSign { zero: false } => format!("{as_sent}: -1 or 1 would be right"),
        WrongNumber::NoBit => {
            format!("{as_sent}: a bit from 0 to 7, or 128 for the whole byte, would be right")
        }
        WrongNumber::NotReadable => format!("{as_sent}: this model has no such port to read"),
        WrongNumber::NotWritable => {
            let port = frame.number(0, context.fractions).and_then(|port| u16::try_from(port).ok());
            match port.filter(|port| context.ports.writes(*port, 0)) {
                None => format!("{as_sent}: this model has no such port to write"),
                Some(port) if !context.ports.writes(port, 2) => {
                    format!("{as_sent}: port {port} takes 0 and 1")
                }
                Some(port) => format!("{as_sent}: port {port} does not take this value"),
            }
        }
        WrongNumber::BeforeProgram => {
            format!("{as_sent}: a jump to before the first line of the program")
        }
        WrongNumber::LoopAhead => {
            format!("{as_sent}: a loop leads back, -1 or less would be right")
        }
        WrongNumber::HelixWithoutArc => {
            format!("{as_sent}: the third axis moves only along steps of the circle, which are 0")
        }
    }
}

/// The models with a command set.
fn models_of(dialect: Dialect) -> &'static str {
    match dialect {
        Dialect::Imc4 => "imc4",
        Dialect::Imc4M => "imc4-m",
        Dialect::ImcXx => "imc-m, imc-mp, imc-s8",
    }
}

/// Why a text does not even begin like a command, if there is more to say.
fn no_command_in_words(
    fault: Fault,
    text: &[u8],
    dialect: Dialect,
    mode: Mode,
    device: u8,
) -> Option<String> {
    let shown = shown(text);
    let is_direct = text.trim_ascii_start().starts_with(b"@");
    let knows = |other: &Dialect| {
        *other != dialect && matches!(parse(text, *other, mode, device), Ok(Addressed::Frame(_)))
    };
    let others: Vec<&str> =
        Dialect::ALL.iter().filter(|other| knows(other)).map(|other| models_of(*other)).collect();
    Some(match fault {
        Fault::NotStorable if is_direct => {
            format!("{shown}: a direct command while a program is being stored")
        }
        _ if !others.is_empty() => {
            format!("{shown}: not a command of this model, but of {}", others.join(", "))
        }
        Fault::NotStorable => format!("{shown}: no command that can be stored begins like this"),
        Fault::NoAddress if parse(text, dialect, Mode::Stored, device).is_ok() => {
            format!(
                "{shown}: a line of a program, but none is being stored: @{device}i begins that"
            )
        }
        Fault::NoAddress => {
            format!(
                "{shown}: a command begins with @ and the number of the controller, as in @{device}P"
            )
        }
        _ => return None,
    })
}

/// A line as it is shown.
fn shown(text: &[u8]) -> EscapeAscii<'_> {
    text.trim_ascii().escape_ascii()
}

/// How many fields came, where another number is right.
fn came(frame: &Frame<'_>, right: usize, or: usize) -> String {
    let fields = || (0..frame.field_count()).filter_map(|place| frame.field(place));
    let full = fields().filter(|field| !field.trim_ascii().is_empty()).count();
    let is_number = |field: &[u8]| field.iter().all(|byte| b"+-.0123456789 ".contains(byte));
    match (full, fields().next()) {
        _ if full == right || full == or => "there is a comma too many".to_owned(),
        // Where no field is allowed, what came need not be numbers.
        (1, Some(text)) if right == 0 && !is_number(text) => {
            format!("{} came", text.trim_ascii().escape_ascii())
        }
        (0, _) => "none came".to_owned(),
        (full, _) => format!("{full} came"),
    }
}

/// Whether the number of fields depends on the axes.
fn depends_on_axes(op: Op) -> bool {
    matches!(op, Op::RelativeMove | Op::AbsoluteMove | Op::ReferenceSpeeds | Op::MoveUntil)
}

fn switch(axis: u8, end: End) -> String {
    let sign = if end == End::Negative { '-' } else { '+' };
    format!("limit switch {}{sign}", AXIS_NAMES[usize::from(axis)])
}

fn wrong_switch(axis: u8, end: Option<End>, referencing: bool) -> String {
    let name = AXIS_NAMES[usize::from(axis)];
    match (end, referencing) {
        (None, _) => format!("both limit switches of {name} are active"),
        (Some(end), true) => format!("the reference run of {name} met {}", switch(axis, end)),
        (Some(end), false) => format!("{name} met {} on its way off the other", switch(axis, end)),
    }
}

fn waits(axes: AxisSet) -> &'static str {
    if axes.count() == 1 { "waits" } else { "wait" }
}

fn is(axes: AxisSet) -> &'static str {
    if axes.count() == 1 { "is" } else { "are" }
}

/// `X is`, `X+Y are`.
fn are(axes: AxisSet) -> String {
    format!("{axes} {}", is(axes))
}
