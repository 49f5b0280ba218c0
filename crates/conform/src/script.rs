//! The script of a session: one action a line.

use std::fmt;

use vimc4_catalogue::{Effects, Family};
use vimc4_device::{Deed, Ruling, parse_duration, unescape_first};
use vimc4_language::{Order, Sort, Verb};

/// One line of a script.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// The line of the session's file, from 1.
    pub line: usize,
    /// The line as it is written.
    pub text: String,
    /// What it says.
    pub action: Action,
}

/// What a line of a script says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// `> LINE` and `>> BYTES`: these bytes are sent. They start the stopwatch.
    Send(Vec<u8>),
    /// `! 253`, `! 254`, `! 255`: a control byte is sent. It leaves the stopwatch alone.
    Control(u8),
    /// `< REPLY`: this is what must come next.
    Expect(Expected),
    /// `silent`: the controller comes to rest and has sent nothing more.
    Rest,
    /// `silent 200ms`: nothing comes for a while.
    Silent(u64),
    /// `wait 50ms`: time passes.
    Wait(u64),
    /// `mark`: starts the stopwatch.
    Mark,
    /// `set`, `press`, `hold`, `release`, `cover open`, `input 0.3 1`, `power off`: something is
    /// done at the machine, in the words of the orders to a running emulator.
    Do(Deed),
    /// `when x > 1000: press stop`, `at 2s: power off for 100ms`, `rule end all`: from now on a rule
    /// does something, said as people say it to an emulator that runs.
    Rule(Ruling),
    /// `reset`: all rules and all faults end.
    Reset,
    /// `store pattern.cnc`: every line of that program is sent and answered 0. It stands for the
    /// actions that [`store`] makes of its text.
    Store(String),
    /// Between two rows of a table: a controller fresh from the factory takes the place of the
    /// one before.
    New,
    /// `restart`: the emulator dies and starts again with the flash image it left.
    Restart,
    /// `position 280 0 0`: the step counters, as many axes as are given.
    Position(Vec<i64>),
    /// `carriage 280 0 0`: where the carriages really are.
    Carriage(Vec<i64>),
    /// `port in 0 = C0`, `port out 0 = 20`.
    Port {
        /// Whether it is a port the host reads.
        input: bool,
        /// Its number.
        port: u16,
        /// Its value.
        value: u8,
    },
    /// `baud 9600`: the speed of the line.
    Baud(u32),
    /// `warning steps-lost`: such a warning has come since the last such line.
    Warning(String),
    /// `why limit switch X+ at step 24,001`: the last error was explained with these words.
    Why(String),
}

/// What must come, and when.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Expected {
    /// The literal parts, with anything between two of them. One part means exactly these bytes.
    pub parts: Vec<Vec<u8>>,
    /// When its last byte comes on the stopwatch, and how much earlier or later it may come, ns.
    pub at: Option<(u64, u64)>,
    /// The most bytes it may have.
    pub max: Option<usize>,
}

/// What a script needs, besides a line that carries bytes, of the code that plays it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// A clock of the model: exact times are compared.
    pub clock: bool,
    /// A look inside: positions, ports, warnings.
    pub view: bool,
    /// Hands at the panel, at the inputs and at the mains switch.
    pub operator: bool,
    /// What it may do to the machine and to the controller's memory.
    pub effects: Effects,
}

/// Why a line does not belong in a script.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ScriptError {
    /// What is wrong; what would be right.
    pub message: String,
}

impl ScriptError {
    fn new(wrong: impl fmt::Display, right: impl fmt::Display) -> ScriptError {
        ScriptError { message: format!("{wrong}; {right}") }
    }
}

/// The words of a script that are not deeds.
const OWN: [&str; 15] = [
    ">", ">>", "<", "!", "silent", "wait", "mark", "store", "restart", "position", "carriage",
    "port", "baud", "warning", "why",
];

/// Reads one line of a script; nothing for an empty line or a comment. `> LINE -> REPLY` is two
/// actions.
///
/// # Errors
///
/// If it is none of the known words or their values make no sense.
pub(crate) fn parse_line(text: &str) -> Result<Vec<Action>, ScriptError> {
    let text = without_comment(text);
    let (word, rest) = text.split_once(' ').map_or((text, ""), |(w, r)| (w, r.trim()));
    let values: Vec<&str> = rest.split_whitespace().collect();
    let one = match word {
        "" => return Ok(vec![]),
        ">" => {
            let (line, reply) = match rest.split_once("->") {
                Some((line, reply)) => (line.trim_end(), Some(expected(reply.trim())?)),
                None => (rest, None),
            };
            let mut bytes = unescape(line)?;
            bytes.push(b'\r');
            let mut actions = vec![Action::Send(bytes)];
            actions.extend(reply.map(Action::Expect));
            return Ok(actions);
        }
        ">>" if rest.is_empty() => {
            return Err(ScriptError::new("nothing to send", ">> \\x0D sends a byte"));
        }
        ">>" => Action::Send(unescape(rest)?),
        "<" => Action::Expect(expected(rest)?),
        "!" => match rest {
            "253" | "254" | "255" => Action::Control(number(rest)?),
            other => {
                let wrong = format!("{other:?} is not a control byte");
                return Err(ScriptError::new(wrong, "! 253, ! 254 and ! 255 are"));
            }
        },
        "silent" if rest.is_empty() => Action::Rest,
        "silent" => Action::Silent(duration(rest)?),
        "wait" => Action::Wait(duration(rest)?),
        "mark" => Action::Mark,
        "store" => Action::Store(rest.to_owned()),
        "restart" => Action::Restart,
        "position" => Action::Position(numbers(&values)?),
        "carriage" => Action::Carriage(numbers(&values)?),
        "port" => match values.as_slice() {
            [way @ ("in" | "out"), port, "=", value] => Action::Port {
                input: *way == "in",
                port: number(port)?,
                value: u8::from_str_radix(value, 16).map_err(|_| {
                    ScriptError::new(format!("{value:?} is not a byte"), "two hex digits are")
                })?,
            },
            _ => {
                return Err(ScriptError::new(
                    "a port has a way, a number and a value",
                    "port in 0 = C0",
                ));
            }
        },
        "baud" => Action::Baud(number(rest)?),
        "warning" => Action::Warning(rest.to_owned()),
        "why" => Action::Why(rest.to_owned()),
        _ => ordered(text)?,
    };
    if matches!(word, "mark" | "restart") && !rest.is_empty() {
        return Err(ScriptError::new(
            format!("{word} takes no arguments"),
            format!("remove {rest:?}"),
        ));
    }
    Ok(vec![one])
}

/// Every line of a program, sent and answered 0.
///
/// # Errors
///
/// If a line has an invalid escape.
pub fn store(program: &str) -> Result<Vec<(String, Action)>, ScriptError> {
    let lines = program.lines().map(str::trim).filter(|line| !line.is_empty());
    let steps = lines.map(|line| {
        let text = format!("> {line} -> 0");
        Ok(parse_line(&text)?.into_iter().map(move |action| (text.clone(), action)))
    });
    Ok(steps.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
}

/// What these actions need of the code that plays them on a controller of this family.
#[must_use]
pub fn needs<'a>(family: Family, actions: impl IntoIterator<Item = &'a Action>) -> Needs {
    let mut needs = Needs::default();
    let mut sent = Vec::new();
    let mut effects = Effects::default();
    for action in actions {
        match action {
            Action::Send(bytes) => sent.extend_from_slice(bytes),
            Action::Expect(expected) => needs.clock |= expected.at.is_some(),
            Action::Wait(_) | Action::Mark => needs.clock = true,
            Action::Do(deed) => {
                needs.operator = true;
                if let Some(name) = deed.signal() {
                    effects = effects.and(family.effects_of_signal(name));
                }
            }
            // A rule sees what happens inside.
            Action::Rule(_) | Action::Reset => (needs.operator, needs.view) = (true, true),
            Action::Position(_)
            | Action::Carriage(_)
            | Action::Port { .. }
            | Action::Baud(_)
            | Action::Restart
            | Action::Warning(_)
            | Action::Why(_) => needs.view = true,
            Action::Control(_)
            | Action::Rest
            | Action::Silent(_)
            | Action::Store(_)
            | Action::New => {}
        }
    }
    needs.effects = effects.and(family.effects_of(&sent));
    needs
}

/// Bytes as a script writes them, in which `*` stands for repetition.
#[must_use]
pub fn escape(bytes: &[u8]) -> String {
    vimc4_device::escape(bytes).replace('*', "\\x2A")
}

/// A span of time such as `594.09ms`, in nanoseconds.
fn duration(text: &str) -> Result<u64, ScriptError> {
    let span = parse_duration(text).map_err(|error| {
        let wrong = format!("{text:?} {error}");
        ScriptError::new(wrong, "10ns, 20us, 594.09ms, 1.5s, 2min are times")
    })?;
    Ok(span.as_nanos() as u64)
}

/// A comment begins with `#` at the start of a line or after a blank.
fn without_comment(text: &str) -> &str {
    let trimmed = text.trim();
    if trimmed.starts_with('#') {
        return "";
    }
    trimmed.split(" #").next().unwrap_or_default().trim_end()
}

fn expected(text: &str) -> Result<Expected, ScriptError> {
    let (text, at) = match text.rsplit_once(" at ") {
        Some((text, at)) => {
            let (at, tolerance) = at.split_once('±').unwrap_or((at, "0ns"));
            (text.trim_end(), Some((duration(at.trim())?, duration(tolerance.trim())?)))
        }
        None => (text, None),
    };
    let (text, max) = match text.rsplit_once(" max ") {
        Some((text, max)) => (text.trim_end(), Some(number(max)?)),
        None => (text, None),
    };
    if text.is_empty() {
        return Err(ScriptError::new(
            "no reply is named",
            "write the bytes that must come, as in < 0",
        ));
    }
    let parts = text.split("...").map(unescape).collect::<Result<_, _>>()?;
    Ok(Expected { parts, at, max })
}

fn unescape(text: &str) -> Result<Vec<u8>, ScriptError> {
    let mut bytes = Vec::new();
    let mut rest = text;
    while let Some(at) = rest.find('\\') {
        let (plain, escaped) = rest.split_at(at);
        bytes.extend_from_slice(plain.as_bytes());
        let (byte, after) = unescape_first(escaped).ok_or_else(|| {
            let wrong = escaped.chars().nth(1).unwrap_or(' ');
            let wrong = format!("\"\\{wrong}\" is not an escape");
            ScriptError::new(wrong, "\\r, \\n, \\t, \\\\ and \\xNN are")
        })?;
        rest = after;
        let mut count = 1;
        if let Some(digits) = rest.strip_prefix('*') {
            let end = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
            count = number(&digits[..end])?;
            rest = &digits[end..];
        }
        bytes.extend(std::iter::repeat_n(byte, count));
    }
    bytes.extend_from_slice(rest.as_bytes());
    Ok(bytes)
}

/// An act at the machine, or a rule. Whether the controller in question has the signal is checked
/// during play; here any controller's signals are accepted.
fn ordered(text: &str) -> Result<Action, ScriptError> {
    match Order::read(text, vimc4_catalogue::all_names()) {
        Ok(Some(Order::Do(deed))) => Ok(Action::Do(deed)),
        Ok(Some(Order::Rule(ruling))) => Ok(Action::Rule(ruling)),
        Ok(Some(Order::Reset)) => Ok(Action::Reset),
        Err(error) if error.span.start > 0 => Err(ScriptError { message: error.to_string() }),
        _ => {
            let word = text.split(' ').next().unwrap_or_default();
            Err(ScriptError::new(format!("{word:?} is not a word of a script"), words()))
        }
    }
}

/// How a line can begin.
fn words() -> String {
    let deeds = Verb::all().filter(|verb| verb.sort() == Sort::Deed && *verb != Verb::Erase);
    let deeds: Vec<_> = deeds.map(Verb::name).collect();
    format!("a line begins with {}, {}", OWN.join(", "), deeds.join(", "))
}

fn number<T: std::str::FromStr>(text: &str) -> Result<T, ScriptError> {
    text.trim().parse().map_err(|_| {
        ScriptError::new(format!("{text:?} is not a number here"), "write it in decimal digits")
    })
}

fn numbers(values: &[&str]) -> Result<Vec<i64>, ScriptError> {
    if values.is_empty() || values.len() > vimc4_device::AXES {
        return Err(ScriptError::new("one to six axes have values", "position 280 0 0"));
    }
    values.iter().map(|value| number(value)).collect()
}

#[cfg(test)]
mod tests {
    use vimc4_device::show_nanos;

    use super::*;

    #[test]
    fn a_line_and_its_reply_are_two_actions() {
        let actions = parse_line("> @0A5000,10000 -> 0 at 594.09ms # the whole move").unwrap();
        assert_eq!(
            actions,
            [
                Action::Send(b"@0A5000,10000\r".to_vec()),
                Action::Expect(Expected {
                    parts: vec![b"0".to_vec()],
                    at: Some((594_090_000, 0)),
                    max: None
                })
            ]
        );
    }

    #[test]
    fn escapes_and_times_come_back_as_they_were() {
        let bytes: Vec<u8> = (0..=255).collect();
        assert_eq!(unescape(&escape(&bytes)).unwrap(), bytes);
        for nanos in [1, 999, 1_000, 594_090_000, 16_666_667, 60_000_000_000] {
            assert_eq!(duration(&show_nanos(nanos)).unwrap(), nanos);
        }
    }

    #[test]
    fn an_error_says_what_would_be_right() {
        for (line, right) in [
            ("send @01", "a line begins with"),
            ("wait 50", "594.09ms"),
            ("! 252", "! 253"),
            ("cover shut", "open or closed"),
            ("press stpo", "did you mean stop?"),
            ("erase", "a line begins with"),
            ("< ", "< 0"),
            ("> \\q", "\\xNN"),
            ("port in 0", "port in 0 = C0"),
            ("input 3 1", "as in `input 0.2 1`"),
            ("position", "position 280 0 0"),
        ] {
            let error = parse_line(line).unwrap_err();
            assert!(error.message.contains(right), "{line}: {}", error.message);
        }
    }

    #[test]
    fn needs_follow_from_the_script() {
        let of = |family, text: &str| {
            let actions: Vec<_> = text.lines().flat_map(|line| parse_line(line).unwrap()).collect();
            needs(family, &actions)
        };
        let isel = |text| of(Family::Isel, text);
        assert!(isel("> @0 A5,900").effects.moves && !isel("> @0P -> 0000000").effects.moves);
        assert!(isel(">> @0\\x20I\\n\\xFDW").effects.writes_flash);
        let stored = isel("> @0i\n> 7 7\n> p0,1,1\n>> @\n>> 0Ie1").effects;
        assert!(stored.reference && stored.outputs && stored.switches && !stored.moves);
        assert!(isel("press start").operator && isel("press start").effects.moves);
        assert!(isel("< 0 at 5ms").clock);
        assert!(isel("position 3").view);
        let lpkf = |text| of(Family::Lpkf, text);
        assert!(lpkf(">> P\n>> A5,9;").effects.moves && !lpkf("> !ON0").effects.moves);
        assert!(!lpkf("hold start").effects.moves && lpkf("hold start").operator);
    }
}
