//! Conditions.
//!
//! ```text
//! condition = all { "or" all }                all = one { "and" one }
//! one       = "(" condition ")" | state | happening
//! state     = AXIS ["<" | "<=" | "=" | ">=" | ">"] PLACE
//!           | "outside" AXIS [PLACE] ".." [PLACE] { AXIS [PLACE] ".." [PLACE] }
//!           | "port" NUMBER "bit" BIT ("on" | "off")
//!           | "limit" AXIS("+" | "-") ["on" | "off"]
//!           | "signal" NAME "is" VALUE
//!           | "idle" | "at" TIME | "always" | "never"
//! happening = "command" [TEXT] | "answered" [TEXT] | "answer" TEXT | "answer" "error" [TEXT]
//!           | "line" [NUMBER] | "signal" NAME "changes" ["to" VALUE]
//! ```
//!
//! A PLACE is in steps, or in `mm` or `°` where the machine is known: `-5000`, `-12.5mm`. A TEXT
//! that contains blanks, brackets or comparisons, or is one of the words above, needs quotation
//! marks. So does a text unknown to a device whose commands and errors are known.

use vimc4_device::{
    AXES, Condition, LengthUnit, Names, Point, Scale, Signal, SignalId, Time, Vocabulary,
    parse_duration,
};

use crate::lexer::Read;
use crate::{Lexer, SyntaxError};

/// How deep brackets may be nested.
const DEEPEST: u32 = 32;

/// What a condition can be.
const FORMS: &str = "a condition, such as `x = 2500`, `z < -5000`, `outside x 0..100`, \
    `port 2 bit 0 on`, `limit x+`, `signal stop changes`, `idle`, `at 1.5s`, `command @A`, \
    `answered @A`, `answer 0`, `answer error` or `line 12`";

/// Reads a condition.
///
/// # Errors
///
/// If it is not a condition, or none that can come true for a device with these names.
pub fn read_condition(text: &str, names: &Names) -> Result<Condition, SyntaxError> {
    whole(Lexer::new(text), names)
}

/// Reads a condition that is the whole rest.
pub(crate) fn whole(lexer: Lexer<'_>, names: &Names) -> Read<Condition> {
    Reader { lexer, names }.whole(None)
}

/// Reads a condition that is the whole rest; the beginning of a command alone says that it is that
/// command.
pub(crate) fn awaited(lexer: Lexer<'_>, names: &Names) -> Read<Condition> {
    let mut reader = Reader { lexer, names };
    if !lexer.rest().starts_with(['@', '!']) {
        return reader.whole(None);
    }
    let command = reader.command()?;
    reader.whole(Some(command))
}

/// The condition that a command begins with this text, or has this mnemonic; a letter alone also stands
/// for a command with a sign before the letter.
///
/// # Errors
///
/// If the model has no such command; with those it has.
pub fn known_command(like: &str, names: &Names) -> Result<Condition, SyntaxError> {
    let vocabulary = names.vocabulary();
    let is_known = |like: &str| vocabulary.is_none_or(|known| known.has_command(like));
    let signed = format!("@{like}");
    let like = [like, &signed].into_iter().find(|like| is_known(like)).ok_or_else(|| {
        unknown("command ", like, &vocabulary.map(right_command).unwrap_or_default())
    })?;
    Ok(Condition::Command { like: Some(like.to_owned()) })
}

/// The condition that an answer is this error, or any.
///
/// # Errors
///
/// If the model has no such error; with those it has.
pub fn known_error(code: Option<&str>, names: &Names) -> Result<Condition, SyntaxError> {
    if let (Some(code), Some(known)) = (code, names.vocabulary())
        && !known.has_error(code)
    {
        return Err(unknown("answer error ", code, &right_error(known)));
    }
    Ok(Condition::Error { code: code.map(str::to_owned) })
}

fn unknown(before: &str, word: &str, expected: &str) -> SyntaxError {
    let text = format!("{before}{word}");
    SyntaxError::new(&text, before.len()..text.len(), expected)
}

fn right_command(known: &Vocabulary) -> String {
    format!("what a command begins with: {}", known.commands_in_words())
}

fn right_error(known: &Vocabulary) -> String {
    format!("an error of this model: {}", known.errors_in_words())
}

struct Reader<'t, 'n> {
    lexer: Lexer<'t>,
    names: &'n Names,
}

impl Reader<'_, '_> {
    /// A condition that is the whole rest, of which the first part may have been read.
    fn whole(&mut self, first: Option<Condition>) -> Read<Condition> {
        let condition = self.any(0, first)?;
        self.lexer.finish("`and`, `or`, or nothing more")?;
        Ok(condition)
    }

    fn any(&mut self, depth: u32, first: Option<Condition>) -> Read<Condition> {
        let mut parts = vec![self.all(depth, first)?];
        while self.lexer.keyword("or") {
            parts.push(self.all(depth, None)?);
        }
        Ok(joined(parts, Condition::Any))
    }

    fn all(&mut self, depth: u32, first: Option<Condition>) -> Read<Condition> {
        let mut parts = vec![first.map_or_else(|| self.one(depth), Ok)?];
        while self.lexer.keyword("and") {
            parts.push(self.one(depth)?);
        }
        Ok(joined(parts, Condition::All))
    }

    fn one(&mut self, depth: u32) -> Read<Condition> {
        let here = self.lexer;
        if self.lexer.sign("(") {
            return self.bracket(here, depth);
        }
        let Some(first) = self.lexer.word() else { return Err(here.wrong(FORMS)) };
        if let Some(axis) = self.names.axis(first) {
            return self.comparison(axis, first);
        }
        match first.to_ascii_lowercase().as_str() {
            "idle" => Ok(Condition::Idle),
            "always" => Ok(Condition::All(Vec::new())),
            "never" => Ok(Condition::Any(Vec::new())),
            "at" => {
                let expected = "a time with its unit, as in `at 1.5s` or `at 250ms`";
                let span = self.lexer.expect(expected, |word| parse_duration(word).ok())?;
                Ok(Condition::At(Time::ZERO + span))
            }
            "outside" => self.outside(),
            "port" => self.port(),
            "limit" => self.limit(),
            "signal" => self.signal(),
            "command" => self.command(),
            "answered" => {
                let like = self.known(Vocabulary::has_mnemonic, |known| {
                    format!("a command without its numbers: {}", known.commands_in_words())
                })?;
                Ok(Condition::Answered { like })
            }
            "answer" => self.answer(),
            "line" => self.line(here),
            _ => Err(self.unknown(here)),
        }
    }

    fn bracket(&mut self, here: Lexer<'_>, depth: u32) -> Read<Condition> {
        if depth == DEEPEST {
            return Err(here.wrong("fewer brackets within each other"));
        }
        let condition = self.any(depth + 1, None)?;
        if !self.lexer.sign(")") {
            return Err(self.lexer.wrong("`and`, `or`, or `)`"));
        }
        Ok(condition)
    }

    /// It begins with no word of a condition.
    fn unknown(&self, here: Lexer<'_>) -> SyntaxError {
        if let Some(meant) = about_signal(here, self.names) {
            return here.wrong(format!("`{meant}`, if that is meant"));
        }
        match self.names.shown_axes().as_slice() {
            [] => here.wrong(FORMS),
            axes => here.wrong(format!("{FORMS}, where axes are {}", axes.join(", "))),
        }
    }

    /// Whether another word follows that does not join conditions.
    fn has_word(&self) -> bool {
        !matches!(self.lexer.peek().to_ascii_lowercase().as_str(), "" | "and" | "or")
    }

    // --- states ---

    /// `< 5`, `= 5mm` and the like, or only `5`.
    fn comparison(&mut self, axis: u8, name: &str) -> Read<Condition> {
        let operator = self.lexer.sign_of(&["<=", ">=", "<", ">", "="]).unwrap_or("=");
        let (name, scale) = (name.to_lowercase(), self.names.scale(axis));
        let expected = match scale.map(|scale| scale.unit) {
            None => format!("a position in steps, as in `{name} {operator} -5000`"),
            Some(unit) => {
                let unit = if unit == LengthUnit::Micrometre { "mm" } else { "°" };
                format!(
                    "a position in steps or {unit}, as in `{name} {operator} -5000` or \
                     `{name} {operator} -12.5{unit}`"
                )
            }
        };
        let here = self.lexer;
        let (low, high) = self.lexer.expect(&expected, |word| place(word, scale))?;
        Ok(match operator {
            "<" => Condition::AxisBelow { axis, position: high },
            ">" => Condition::AxisAbove { axis, position: low },
            "<=" => Condition::AxisBelow { axis, position: low.saturating_add(1) },
            ">=" => Condition::AxisAbove { axis, position: high.saturating_sub(1) },
            _ if low < high => {
                return Err(here.wrong(format!(
                    "a position at which there is a step: {low} and {high} steps are around it"
                )));
            }
            _ => Condition::AxisAt { axis, position: low },
        })
    }

    fn outside(&mut self) -> Read<Condition> {
        const EXPECTED: &str = "an axis and its limits, as in `outside x -5..5 y 0..`";
        let (mut low, mut high): (Point, Point) = ([i64::MIN; AXES], [i64::MAX; AXES]);
        let mut given = [false; AXES];
        let names = self.names;
        loop {
            let here = self.lexer;
            let Some(axis) = self.lexer.word_as(|word| names.axis(word)) else { break };
            let (scale, axis) = (names.scale(axis), usize::from(axis));
            if given.get(axis).is_none_or(|given| *given) {
                return Err(here.wrong("each axis once"));
            }
            let (least, most) = self.lexer.expect(EXPECTED, |word| range(word, scale))?;
            if least > most {
                return Err(here.wrong("limits of which the first is not the larger one"));
            }
            (low[axis], high[axis], given[axis]) = (least, most, true);
        }
        match given.contains(&true) {
            true => Ok(Condition::Outside { low, high }),
            false => Err(self.lexer.wrong(EXPECTED)),
        }
    }

    fn port(&mut self) -> Read<Condition> {
        let expected = "a port, a bit and a level, as in `port 2 bit 0 on`";
        let here = self.lexer;
        let port = self.lexer.expect(expected, |word| word.parse().ok())?;
        if let Some(known) = self.names.vocabulary().filter(|known| !known.ports.contains(&port)) {
            return Err(here.wrong(format!("a port to read: {}", known.ports_in_words())));
        }
        if !self.lexer.keyword("bit") {
            return Err(self.lexer.wrong(expected));
        }
        let bit = |word: &str| word.parse().ok().filter(|bit| *bit < 8);
        let bit = self.lexer.expect("a bit, 0 to 7", bit)?;
        let level = self.lexer.expect("on or off", level)?;
        Ok(Condition::PortBit { port, bit, level })
    }

    fn limit(&mut self) -> Read<Condition> {
        let names = self.names;
        let switch = |word: &str| {
            let (axis, positive) = match word.strip_suffix('+') {
                Some(axis) => (axis, true),
                None => (word.strip_suffix('-')?, false),
            };
            Some((names.axis(axis)?, positive))
        };
        let expected = "a limit switch, as in `limit x+` or `limit z- off`";
        let (axis, positive) = self.lexer.expect(expected, switch)?;
        let active = if self.has_word() { self.lexer.expect("on or off", level)? } else { true };
        Ok(Condition::Limit { axis, positive, active })
    }

    fn signal(&mut self) -> Read<Condition> {
        let known = self.lexer.signal(self.names);
        let signal = match known {
            Some(signal) => signal.id,
            None => {
                let expected = "the name of a signal, as in `signal stop changes`";
                self.lexer.expect(expected, |word| word.parse().ok().map(SignalId))?
            }
        };
        if self.lexer.keyword("is") {
            return Ok(Condition::SignalIs { signal, value: self.value(known)? });
        }
        if !self.lexer.keyword("changes") {
            return Err(self.lexer.wrong(
                "`is` and a value, `changes`, or `changes to` and a value, as in `signal stop changes`",
            ));
        }
        let to = if self.lexer.keyword("to") { Some(self.value(known)?) } else { None };
        Ok(Condition::SignalChanges { signal, to })
    }

    fn value(&mut self, known: Option<&Signal>) -> Read<i32> {
        let expected = known.map_or_else(|| "a value".to_owned(), Signal::values_in_words);
        self.lexer.expect(&expected, |word| match known {
            Some(signal) => signal.value_of(word),
            None => word.parse().ok(),
        })
    }

    // --- happenings ---

    fn command(&mut self) -> Read<Condition> {
        let like = self.known(Vocabulary::has_command, right_command)?;
        Ok(Condition::Command { like })
    }

    fn answer(&mut self) -> Read<Condition> {
        if self.lexer.keyword("error") {
            let code = self.known(Vocabulary::has_error, right_error)?;
            return Ok(Condition::Error { code });
        }
        let text = self.text()?.ok_or_else(|| {
            self.lexer.wrong("an answer, as in `answer 0`, `answer error` or `answer error 2`")
        })?;
        Ok(Condition::Answer { text })
    }

    fn line(&mut self, here: Lexer<'_>) -> Read<Condition> {
        if self.names.vocabulary().is_some_and(|known| !known.stores) {
            return Err(here.wrong("another condition: this model stores no programs"));
        }
        if !self.has_word() {
            return Ok(Condition::Line { line: None });
        }
        let number = |word: &str| word.parse().ok().filter(|line| *line > 0);
        let line = self.lexer.expect("the number of a line, from 1, as in `line 12`", number)?;
        Ok(Condition::Line { line: Some(line) })
    }

    /// A text that means something to the device, or anything between quotation marks.
    fn known(
        &mut self,
        is_known: impl Fn(&Vocabulary, &str) -> bool,
        expected: impl Fn(&Vocabulary) -> String,
    ) -> Read<Option<String>> {
        let here = self.lexer;
        let found = self.text()?;
        match (&found, self.names.vocabulary()) {
            (Some(text), Some(known))
                if !here.rest().starts_with('"') && !is_known(known, text) =>
            {
                Err(here.wrong(expected(known)))
            }
            _ => Ok(found),
        }
    }

    /// A word, or anything between quotation marks; nothing before `and`, `or`, a bracket or the end.
    fn text(&mut self) -> Read<Option<String>> {
        let quoted = self.lexer.quoted()?;
        if quoted.is_some() || !self.has_word() {
            return Ok(quoted);
        }
        Ok(self.lexer.word().map(str::to_owned))
    }
}

/// The part, if it is only one; otherwise all of them joined.
fn joined(parts: Vec<Condition>, join: fn(Vec<Condition>) -> Condition) -> Condition {
    match <[Condition; 1]>::try_from(parts) {
        Ok([part]) => part,
        Err(parts) => join(parts),
    }
}

/// The condition about a signal that is given only by its name and perhaps a value.
fn about_signal(mut lexer: Lexer<'_>, names: &Names) -> Option<String> {
    let signal = lexer.signal(names)?;
    Some(match lexer.word().filter(|value| signal.value_of(value).is_some()) {
        Some(value) => format!("signal {} is {value}", signal.name),
        None => format!("signal {} changes", signal.name),
    })
}

fn level(word: &str) -> Option<bool> {
    match word.to_ascii_lowercase().as_str() {
        "on" | "1" => Some(true),
        "off" | "0" => Some(false),
        _ => None,
    }
}

/// `-5..5`, `..5`, `-5..`, `0mm..12.5mm` or `..`; the limits are inclusive.
fn range(word: &str, scale: Option<Scale>) -> Option<(i64, i64)> {
    let (low, high) = word.split_once("..")?;
    let limit = |text: &str, none: i64| match text {
        "" => Some((none, none)),
        text => place(text, scale),
    };
    Some((limit(low, i64::MIN)?.1, limit(high, i64::MAX)?.0))
}

/// The whole numbers around a position: the largest not above it, and the smallest not below it.
type Around = (i64, i64);

/// `-5`, `-5mm`, `0.25mm`, `90°`: where that is in steps.
fn place(word: &str, scale: Option<Scale>) -> Option<Around> {
    if let Ok(steps) = word.parse::<i64>() {
        return Some((steps, steps));
    }
    let Scale { steps, units, unit } = scale?;
    let (number, per_unit) = match unit {
        LengthUnit::Micrometre => (word.strip_suffix("mm")?, 1_000),
        LengthUnit::Degree => (word.strip_suffix('°').or_else(|| word.strip_suffix("deg"))?, 1),
    };
    let (whole, places) = number.split_once('.').unwrap_or((number, ""));
    // No step is finer than a nanometre, so the products cannot overflow.
    if places.len() > 9 || whole.len() > 12 || places.starts_with(['-', '+']) {
        return None;
    }
    let digits: i128 = format!("{whole}{places}").parse().ok()?;
    let over = i128::from(units).checked_mul(10_i128.pow(places.len() as u32))?;
    let exact = digits.checked_mul(per_unit)?.checked_mul(i128::from(steps))?;
    let low = exact.checked_div_euclid(over)?;
    let high = low + i128::from(exact.rem_euclid(over) != 0);
    Some((i64::try_from(low).ok()?, i64::try_from(high).ok()?))
}
