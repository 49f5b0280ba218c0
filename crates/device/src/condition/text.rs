//! Conditions as people type them.
//!
//! ```text
//! condition = all { "or" all }                all = one { "and" one }
//! one       = "(" condition ")" | state | happening
//! state     = AXIS ("<" | "<=" | "=" | ">=" | ">") PLACE
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

use std::error::Error;
use std::fmt;
use std::str::FromStr;
use std::sync::LazyLock;

use nom::branch::alt;
use nom::bytes::complete::{tag, take_while1};
use nom::character::complete::{char, space0};
use nom::combinator::verify;
use nom::error::{ErrorKind, ParseError};
use nom::sequence::preceded;
use nom::{IResult, Parser};

use serde::{Deserialize, Serialize};

use super::{Condition, Vocabulary};
use crate::{AXES, Device, Point, Signal, SignalId, Time, parse_duration};

/// How deep brackets may be nested.
const DEEPEST: u32 = 32;

/// How much of a wrong text an error shows, characters.
const SHOWN: usize = 80;

/// The words with a meaning of their own where a text could stand.
const RESERVED: [&str; 6] = ["and", "or", "then", "while", "until", "error"];

/// The names that conditions use for the axes and the signals of a device.
///
/// ```
/// # mod cart { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cart/mod.rs")); }
/// # use cart::Cart;
/// use vimc4_device::{Condition, Harness, Names, Time};
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
///
/// let mut cart = Harness::new(Cart::default());
/// let names = Names::of(cart.device());
/// cart.send(b"m100\r");
/// let condition = names.read("x > 30 and at 0.05s or signal stop changes")?;
/// assert_eq!(cart.run_until(&condition), Some(Time::from_millis(50)));
/// assert_eq!(names.write(&condition).to_string(), "x > 30 and at 0.05s or signal stop changes");
///
/// let wrong = names.read("x > far").unwrap_err();
/// assert_eq!(wrong.to_string(), "`x > far` is wrong at `far`: a position in steps, as in `x > -5000`");
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names {
    axes: Vec<(u8, String)>,
    signals: Vec<Signal>,
    can_erase: bool,
    has_any_bit: bool,
    vocabulary: Option<Vocabulary>,
    scales: [Option<Scale>; AXES],
}

/// How far a step of an axis goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Scale {
    /// This many steps …
    pub steps: u32,
    /// … make this many units.
    pub units: u32,
    /// What is counted.
    pub unit: LengthUnit,
}

/// The unit of an axis's travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LengthUnit {
    /// Micrometres; people write `mm`.
    Micrometre,
    /// Degrees, of a turning table; people write `°` or `deg`.
    Degree,
}

/// Without names, signals are numbers, and the first axes are called as nearly everywhere: `x = 5`,
/// `axis4 = 5`, `signal 3 changes`.
static NUMBERS: LazyLock<Names> = LazyLock::new(|| {
    let axes = [(0, "X"), (1, "Y"), (2, "Z"), (3, "A")];
    Names::new(axes.map(|(axis, name)| (axis, name.to_owned())), Vec::new())
});

impl Names {
    /// These axes, each with its index (0 for X), and these signals. An axis may have several
    /// names: it is shown by the first, and understood by all.
    #[must_use]
    pub fn new(axes: impl IntoIterator<Item = (u8, String)>, signals: Vec<Signal>) -> Names {
        Names { axes: axes.into_iter().collect(), signals, ..Names::default() }
    }

    /// Sets whether the device's panel can erase the stored program.
    #[must_use]
    pub fn with_erasing(self, can_erase: bool) -> Names {
        Names { can_erase, ..self }
    }

    /// Those of a device.
    pub fn of<D: Device>(device: &D) -> Names {
        let axes = device.view(device.now()).axes;
        Names::new(axes.into_iter().map(|axis| (axis.index, axis.name)), device.signals())
    }

    /// Names for devices wired in any way, so that any bit of any port may be an input: for text
    /// that is read before its device is known.
    #[must_use]
    pub fn with_any_bit(self) -> Names {
        Names { has_any_bit: true, ..self }
    }

    pub(crate) fn has_any_bit(&self) -> bool {
        self.has_any_bit
    }

    /// The signals.
    #[must_use]
    pub fn signals(&self) -> &[Signal] {
        &self.signals
    }

    /// Whether the panel can erase the stored program.
    #[must_use]
    pub fn can_erase(&self) -> bool {
        self.can_erase
    }

    /// Adds the device's commands, errors and ports: text about anything that can never happen
    /// there is then an error.
    #[must_use]
    pub fn with_vocabulary(self, vocabulary: Option<Vocabulary>) -> Names {
        Names { vocabulary, ..self }
    }

    /// Adds how far a step of each axis goes, so that positions can be in `mm` or `°`.
    #[must_use]
    pub fn with_scales(self, scales: [Option<Scale>; AXES]) -> Names {
        Names { scales, ..self }
    }

    /// How far a step of an axis goes, if that is known.
    #[must_use]
    pub fn scale(&self, axis: u8) -> Option<Scale> {
        *self.scales.get(usize::from(axis))?
    }

    /// A command that begins so or has this mnemonic; a letter alone also stands for a command with
    /// a sign before the letter.
    ///
    /// # Errors
    ///
    /// If the model has no such command; with those it has.
    pub fn command(&self, like: &str) -> Result<Condition, ConditionError> {
        let known = |like: &str| self.knows(like, Vocabulary::has_command);
        let signed = format!("@{like}");
        let like = match known(like) {
            true => like,
            false if known(&signed) => &signed,
            false => {
                let known = self.vocabulary.as_ref().map(Vocabulary::commands_in_words);
                let right = format!("what a command begins with: {}", known.unwrap_or_default());
                let (text, rest) = (format!("command {like}"), like.to_owned());
                return Err(ConditionError { text, rest, right });
            }
        };
        Ok(Condition::Command { like: Some(like.to_owned()) })
    }

    /// Whether a command has this mnemonic: `@A`, and not `@0A5000`.
    ///
    /// # Errors
    ///
    /// If the model has no such command; with the mnemonics of those it has.
    pub fn mnemonic(&self, like: &str) -> Result<(), String> {
        if self.knows(like, Vocabulary::has_mnemonic) {
            return Ok(());
        }
        Err(self.vocabulary.as_ref().map(Vocabulary::commands_in_words).unwrap_or_default())
    }

    /// An answer that is an error: this one, or any.
    ///
    /// # Errors
    ///
    /// If the model has no such error; with those it has.
    pub fn error(&self, code: Option<&str>) -> Result<Condition, ConditionError> {
        if let Some(code) = code.filter(|code| !self.knows(code, Vocabulary::has_error)) {
            let known = self.vocabulary.as_ref().map(Vocabulary::errors_in_words);
            let right = format!("an error of this model: {}", known.unwrap_or_default());
            let (text, rest) = (format!("answer error {code}"), code.to_owned());
            return Err(ConditionError { text, rest, right });
        }
        Ok(Condition::Error { code: code.map(str::to_owned) })
    }

    /// Reads a condition.
    ///
    /// # Errors
    ///
    /// If it is not a condition; with the place and what would be right there.
    pub fn read(&self, text: &str) -> Result<Condition, ConditionError> {
        let wrong = |error: nom::Err<Wrong<'_>>| {
            let (rest, right) = match error {
                nom::Err::Error(Wrong { rest, right })
                | nom::Err::Failure(Wrong { rest, right }) => (rest, right),
                nom::Err::Incomplete(_) => ("", String::new()),
            };
            ConditionError { text: text.trim().to_owned(), rest: rest.trim().to_owned(), right }
        };
        let (rest, condition) = self.any(text, 0).map_err(wrong)?;
        match rest.trim_start() {
            "" => Ok(condition),
            rest => Err(wrong(failure(rest, "`and`, `or`, or nothing more"))),
        }
    }

    /// Shows a condition with these names.
    #[must_use]
    pub fn write<'a>(&'a self, condition: &'a Condition) -> Named<'a> {
        Named { names: self, condition }
    }

    // --- reading ---

    fn any<'t>(&self, input: &'t str, depth: u32) -> Parsed<'t, Condition> {
        joined(input, "or", Condition::Any, |input| self.all(input, depth))
    }

    fn all<'t>(&self, input: &'t str, depth: u32) -> Parsed<'t, Condition> {
        joined(input, "and", Condition::All, |input| self.one(input, depth))
    }

    fn one<'t>(&self, input: &'t str, depth: u32) -> Parsed<'t, Condition> {
        let input = input.trim_start();
        if let Ok((inner, _)) = symbol('(', input) {
            if depth == DEEPEST {
                return Err(failure(input, "fewer brackets within each other"));
            }
            let (rest, condition) = self.any(inner, depth + 1)?;
            let (rest, _) = symbol(')', rest).map_err(|_| failure(rest, "`and`, `or`, or `)`"))?;
            return Ok((rest, condition));
        }
        let Ok((rest, first)) = word(input) else { return Err(failure(input, FORMS)) };
        if let Some(axis) = self.axis(first) {
            return self.comparison(axis, first, rest);
        }
        match first.to_ascii_lowercase().as_str() {
            "idle" => Ok((rest, Condition::Idle)),
            "always" => Ok((rest, Condition::All(Vec::new()))),
            "never" => Ok((rest, Condition::Any(Vec::new()))),
            "at" => {
                let right = "a time with its unit, as in `at 1.5s` or `at 250ms`";
                let (rest, time) = expected(rest, right, time)?;
                Ok((rest, Condition::At(time)))
            }
            "outside" => self.outside(rest),
            "port" => self.port(rest),
            "limit" => self.limit(rest),
            "signal" => self.signal(rest),
            "command" => {
                let (rest, like) = self.known(rest, Vocabulary::has_command, |known| {
                    format!("what a command begins with: {}", known.commands_in_words())
                })?;
                Ok((rest, Condition::Command { like }))
            }
            "answered" => {
                let (rest, like) = self.known(rest, Vocabulary::has_mnemonic, |known| {
                    format!("a command without its numbers: {}", known.commands_in_words())
                })?;
                Ok((rest, Condition::Answered { like }))
            }
            "answer" => self.answer(rest),
            "line" if self.vocabulary.as_ref().is_some_and(|known| !known.stores) => {
                Err(failure(input, "another condition: this model stores no programs"))
            }
            "line" => {
                let right = "the number of a line, from 1, as in `line 12`";
                if optional_word(rest).is_none() {
                    return Ok((rest, Condition::Line { line: None }));
                }
                let number = |word: &str| word.parse().ok().filter(|line| *line > 0);
                let (rest, line) = expected(rest, right, number)?;
                Ok((rest, Condition::Line { line: Some(line) }))
            }
            _ => {
                if let Some(signal) = self.about_signal(input) {
                    return Err(failure(input, format!("`{signal}`, if that is meant")));
                }
                let axes = match self.shown_axes().as_slice() {
                    [] => String::new(),
                    axes => format!(", where axes are {}", axes.join(", ")),
                };
                Err(failure(input, format!("{FORMS}{axes}")))
            }
        }
    }

    fn outside<'t>(&self, input: &'t str) -> Parsed<'t, Condition> {
        const RIGHT: &str = "an axis and its limits, as in `outside x -5..5 y 0..` ";
        let (mut low, mut high): (Point, Point) = ([i64::MIN; AXES], [i64::MAX; AXES]);
        let mut given = [false; AXES];
        let mut input = input;
        loop {
            let axis = optional_word(input).and_then(|(rest, name)| Some((rest, self.axis(name)?)));
            let Some((rest, axis)) = axis else { break };
            let (index, axis) = (axis, usize::from(axis));
            if given.get(axis).is_none_or(|given| *given) {
                return Err(failure(input, "each axis once"));
            }
            let (rest, (least, most)) =
                expected(rest, RIGHT.trim_end(), |word| self.range(index, word))?;
            if least > most {
                return Err(failure(input, "limits of which the first is not the larger one"));
            }
            (low[axis], high[axis], given[axis]) = (least, most, true);
            input = rest;
        }
        if given.contains(&true) {
            Ok((input, Condition::Outside { low, high }))
        } else {
            Err(failure(input, RIGHT.trim_end()))
        }
    }

    /// `-5..5`, `..5`, `-5..`, `0mm..12.5mm` or `..`; the limits are inclusive.
    fn range(&self, axis: u8, word: &str) -> Option<(i64, i64)> {
        let (low, high) = word.split_once("..")?;
        let limit = |text: &str, none: i64| match text {
            "" => Some((none, none)),
            text => place(text, self.scale(axis)),
        };
        Some((limit(low, i64::MIN)?.1, limit(high, i64::MAX)?.0))
    }

    /// `< 5`, `= 5mm` and the like, or only `5`.
    fn comparison<'t>(&self, axis: u8, name: &str, input: &'t str) -> Parsed<'t, Condition> {
        let input = input.trim_start();
        let mut operator =
            alt((tag::<_, _, Wrong<'_>>("<="), tag(">="), tag("<"), tag(">"), tag("=")));
        let (place_of, operator) = operator.parse(input).unwrap_or((input, "="));
        let name = name.to_lowercase();
        let right = match self.scale(axis).map(|scale| scale.unit) {
            None => format!("a position in steps, as in `{name} {operator} -5000`"),
            Some(unit) => {
                let unit = if unit == LengthUnit::Micrometre { "mm" } else { "°" };
                format!(
                    "a position in steps or {unit}, as in `{name} {operator} -5000` or \
                     `{name} {operator} -12.5{unit}`"
                )
            }
        };
        let read = |word: &str| place(word, self.scale(axis));
        let (rest, (low, high)) = expected(place_of, &right, read)?;
        let condition = match operator {
            "<" => Condition::AxisBelow { axis, position: high },
            ">" => Condition::AxisAbove { axis, position: low },
            "<=" => Condition::AxisBelow { axis, position: low.saturating_add(1) },
            ">=" => Condition::AxisAbove { axis, position: high.saturating_sub(1) },
            _ if low < high => {
                let right = format!(
                    "a position at which there is a step: {low} and {high} steps are around it"
                );
                return Err(failure(place_of, right));
            }
            _ => Condition::AxisAt { axis, position: low },
        };
        Ok((rest, condition))
    }

    fn limit<'t>(&self, input: &'t str) -> Parsed<'t, Condition> {
        let switch = |word: &str| {
            let (axis, positive) = match word.strip_suffix('+') {
                Some(axis) => (axis, true),
                None => (word.strip_suffix('-')?, false),
            };
            Some((self.axis(axis)?, positive))
        };
        let right = "a limit switch, as in `limit x+` or `limit z- off`";
        let (rest, (axis, positive)) = expected(input, right, switch)?;
        let (rest, active) = match optional_word(rest) {
            None => (rest, true),
            Some(_) => expected(rest, "on or off", level)?,
        };
        Ok((rest, Condition::Limit { axis, positive, active }))
    }

    fn signal<'t>(&self, input: &'t str) -> Parsed<'t, Condition> {
        let input = input.trim_start();
        let known = self.signal_at(input);
        let (rest, id) = match known {
            Some(signal) => (&input[signal.name.len()..], signal.id),
            None => {
                let number = |word: &str| word.parse().ok().map(SignalId);
                expected(input, "the name of a signal, as in `signal stop changes`", number)?
            }
        };
        let right = "`is` and a value, `changes`, or `changes to` and a value, as in `signal stop \
                     changes`";
        let (rest, verb) = expected(rest, right, |word| {
            let verbs = ["is", "changes"];
            verbs.into_iter().find(|verb| verb.eq_ignore_ascii_case(word))
        })?;
        let value = |rest: &'t str| {
            let right = known.map_or_else(|| "a value".to_owned(), Signal::values_in_words);
            expected(rest, &right, |word| match known {
                Some(signal) => signal.value_of(word),
                None => word.parse().ok(),
            })
        };
        if verb == "is" {
            let (rest, value) = value(rest)?;
            return Ok((rest, Condition::SignalIs { signal: id, value }));
        }
        match keyword("to", rest) {
            Ok((rest, _)) => {
                let (rest, value) = value(rest)?;
                Ok((rest, Condition::SignalChanges { signal: id, to: Some(value) }))
            }
            Err(_) => Ok((rest, Condition::SignalChanges { signal: id, to: None })),
        }
    }

    /// The signal with whose name a text begins.
    pub(crate) fn signal_at(&self, input: &str) -> Option<&Signal> {
        let named = |signal: &&Signal| {
            let name = input.get(..signal.name.len());
            let after = input.get(signal.name.len()..).unwrap_or_default();
            name.is_some_and(|name| name.eq_ignore_ascii_case(&signal.name))
                && (after.is_empty() || after.starts_with([' ', '\t']))
        };
        self.signals.iter().filter(named).max_by_key(|signal| signal.name.len())
    }

    /// The condition about a signal that is given only by its name and perhaps a value.
    fn about_signal(&self, input: &str) -> Option<String> {
        let signal = self.signal_at(input)?;
        let value = word(&input[signal.name.len()..]).ok().map(|(_, value)| value);
        Some(match value.filter(|value| signal.value_of(value).is_some()) {
            Some(value) => format!("signal {} is {value}", signal.name),
            None => format!("signal {} changes", signal.name),
        })
    }

    /// A text that means something to the device, or anything between quotation marks.
    fn known<'t>(
        &self,
        input: &'t str,
        is_known: impl Fn(&Vocabulary, &str) -> bool,
        right: impl Fn(&Vocabulary) -> String,
    ) -> Parsed<'t, Option<String>> {
        let (rest, found) = text(input)?;
        match (&found, &self.vocabulary) {
            (Some(text), Some(known)) if symbol('"', input).is_err() && !is_known(known, text) => {
                Err(failure(input, right(known)))
            }
            _ => Ok((rest, found)),
        }
    }

    /// Whether a text means something to the device, as far as that is known.
    fn knows(&self, text: &str, is_known: impl Fn(&Vocabulary, &str) -> bool) -> bool {
        self.vocabulary.as_ref().is_none_or(|known| is_known(known, text))
    }

    fn port<'t>(&self, input: &'t str) -> Parsed<'t, Condition> {
        let right = "a port, a bit and a level, as in `port 2 bit 0 on`";
        let (rest, port) = expected(input, right, |word| word.parse().ok())?;
        if let Some(known) = self.vocabulary.as_ref().filter(|known| !known.ports.contains(&port)) {
            return Err(failure(input, format!("a port to read: {}", known.ports_in_words())));
        }
        let (rest, _) = keyword("bit", rest).map_err(|_| failure(rest, right))?;
        let bit = |word: &str| word.parse().ok().filter(|bit| *bit < 8);
        let (rest, bit) = expected(rest, "a bit, 0 to 7", bit)?;
        let (rest, level) = expected(rest, "on or off", level)?;
        Ok((rest, Condition::PortBit { port, bit, level }))
    }

    fn answer<'t>(&self, input: &'t str) -> Parsed<'t, Condition> {
        if let Ok((rest, _)) = keyword("error", input) {
            let (rest, code) = self.known(rest, Vocabulary::has_error, |known| {
                format!("an error of this model: {}", known.errors_in_words())
            })?;
            return Ok((rest, Condition::Error { code }));
        }
        match text(input)? {
            (rest, Some(text)) => Ok((rest, Condition::Answer { text })),
            (rest, None) => Err(failure(
                rest,
                "an answer, as in `answer 0`, `answer error` or `answer error 2`",
            )),
        }
    }

    /// An axis by its name, or by its index.
    #[must_use]
    pub fn axis(&self, name: &str) -> Option<u8> {
        let mut axes = self.axes.iter();
        let named = axes.find(|(_, known)| known.eq_ignore_ascii_case(name));
        named.map(|(axis, _)| *axis).or_else(|| {
            let index = name.strip_prefix("axis")?.parse().ok()?;
            (usize::from(index) < AXES).then_some(index)
        })
    }

    /// The names that the axes are shown by, in small letters, in their order.
    #[must_use]
    pub fn shown_axes(&self) -> Vec<String> {
        let mut axes: Vec<u8> = self.axes.iter().map(|(axis, _)| *axis).collect();
        axes.sort_unstable();
        axes.dedup();
        // Names of the second group may equal names of the first.
        let mut names: Vec<String> = Vec::new();
        for name in axes.into_iter().map(|axis| self.axis_name(axis)) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// How a condition can begin, and what it is then.
    pub(crate) fn conditions(&self) -> Vec<(String, &'static str)> {
        let axes = self.shown_axes();
        let mut begins: Vec<_> =
            axes.iter().map(|axis| (format!("{axis} "), "where an axis is, in steps")).collect();
        let limits =
            axes.iter().flat_map(|axis| ["-", "+"].map(|end| format!("limit {axis}{end}")));
        begins.extend(limits.map(|limit| (limit, "a limit switch is active")));
        let signals = self.signals.iter().map(|signal| format!("signal {} ", signal.name));
        begins.extend(signals.map(|signal| (signal, "a signal has a value, or changes")));
        let others = [
            ("outside ", "an axis is outside of limits"),
            ("port ", "a bit of a port has a level"),
            ("at ", "a time has come"),
            ("command ", "a command begins"),
            ("answered ", "a command is answered"),
            ("answer ", "an answer comes"),
            ("answer error", "an error is answered"),
            ("line ", "a line of the stored program begins"),
        ];
        let known = self.vocabulary.as_ref();
        let has = |begin: &str| match begin {
            "port " => known.is_none_or(|known| !known.ports.is_empty()),
            "line " => known.is_none_or(|known| known.stores),
            _ => true,
        };
        let others = others.into_iter().filter(|(begin, _)| has(begin));
        begins.extend(others.map(|(begin, about)| (begin.to_owned(), about)));
        begins
    }

    /// What can follow the beginnings of a condition, where that can be listed.
    pub(crate) fn listed_conditions(&self) -> Vec<(&'static str, String, &'static str)> {
        let Some(known) = &self.vocabulary else { return Vec::new() };
        let bits = |port: &u16| {
            let port = *port;
            (0..8).map(move |bit| format!("{port} bit {bit} "))
        };
        let bits: Vec<_> = known.ports.iter().flat_map(bits).collect();
        let listed = [
            ("command ", &known.commands, "a command begins"),
            ("answered ", &known.commands, "a command is answered"),
            ("answer error ", &known.errors, "an error is answered"),
            ("port ", &bits, "a bit of a port has a level"),
        ];
        let lines = listed.into_iter();
        lines
            .flat_map(|(begin, words, about)| {
                words.iter().map(move |word| (begin, word.clone(), about))
            })
            .collect()
    }

    /// The forms of a condition, and what each says.
    pub(crate) fn help_on_conditions(&self) -> Vec<(String, String)> {
        let axes = self.shown_axes();
        let axis = axes.first().map_or("x", String::as_str);
        let listed = |list: Option<String>| list.map_or(String::new(), |list| format!(": {list}"));
        let known = self.vocabulary.as_ref();
        let commands = listed(known.map(Vocabulary::commands_in_words));
        let errors = listed(known.map(Vocabulary::errors_in_words));
        let mut forms = vec![
            (
                format!("{axis} < -5000"),
                format!("where an axis is, with <, <=, =, >= or >; axes are {}", axes.join(", ")),
            ),
            (
                format!("outside {axis} -5..5"),
                "an axis is outside of limits; several may follow".to_owned(),
            ),
            (format!("limit {axis}+ on|off"), "a limit switch".to_owned()),
            ("signal NAME is VALUE".to_owned(), "what `signals` lists has a value".to_owned()),
            (
                "signal NAME changes".to_owned(),
                "it takes another value; `changes to VALUE`: this one".to_owned(),
            ),
            (
                "idle".to_owned(),
                "nothing moves, and no command and no program is carried out".to_owned(),
            ),
            ("at 1.5s".to_owned(), "a time has come".to_owned()),
            ("command TEXT".to_owned(), format!("a command begins, or any without TEXT{commands}")),
            ("answered TEXT".to_owned(), "a command is answered, or any without TEXT".to_owned()),
            ("answer TEXT".to_owned(), "an answer is this".to_owned()),
            (
                "answer error CODE".to_owned(),
                format!("an error is answered, or any without CODE{errors}"),
            ),
        ];
        if known.is_none_or(|known| !known.ports.is_empty()) {
            let ports = listed(known.map(Vocabulary::ports_in_words));
            forms.push(("port 2 bit 0 on|off".to_owned(), format!("a bit of a port{ports}")));
        }
        if known.is_none_or(|known| known.stores) {
            let about = "a line of the stored program begins, or any without a number";
            forms.push(("line 12".to_owned(), about.to_owned()));
        }
        forms
    }

    // --- writing ---

    /// Whether there is such an axis, 0 for X.
    #[must_use]
    pub fn has_axis(&self, axis: u8) -> bool {
        self.axes.iter().any(|(known, _)| *known == axis)
    }

    /// What an axis is called, in small letters.
    #[must_use]
    pub fn axis_name(&self, axis: u8) -> String {
        let named = self.axes.iter().find(|(index, _)| *index == axis);
        named.map_or_else(|| format!("axis{axis}"), |(_, name)| name.to_lowercase())
    }

    pub(crate) fn signal_named(&self, id: SignalId) -> Option<&Signal> {
        self.signals.iter().find(|signal| signal.id == id)
    }

    pub(crate) fn signal_name(&self, id: SignalId) -> String {
        self.signal_named(id).map_or_else(|| id.0.to_string(), |signal| signal.name.clone())
    }

    fn value_name(&self, id: SignalId, value: i32) -> String {
        let positions = self.signal_named(id).and_then(|signal| signal.positions.as_ref());
        let place = usize::try_from(value).ok();
        let name = positions.and_then(|names| names.get(place?));
        name.map_or_else(|| value.to_string(), Clone::clone)
    }
}

/// The names for an unknown device.
pub(crate) fn without_names() -> &'static Names {
    &NUMBERS
}

/// What a condition can be.
const FORMS: &str = "a condition, such as `x = 2500`, `z < -5000`, `outside x 0..100`, \
    `port 2 bit 0 on`, `limit x+`, `signal stop changes`, `idle`, `at 1.5s`, `command @A`, \
    `answered @A`, `answer 0`, `answer error` or `line 12`";

/// Reads a condition in which signals are numbers.
impl FromStr for Condition {
    type Err = ConditionError;

    fn from_str(text: &str) -> Result<Condition, ConditionError> {
        NUMBERS.read(text)
    }
}

/// With numbers for signals; [`Names::write`] has their names.
impl fmt::Display for Condition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", NUMBERS.write(self))
    }
}

/// A condition with the names of a device: [`Names::write`].
#[derive(Clone, Copy, Debug)]
pub struct Named<'a> {
    names: &'a Names,
    condition: &'a Condition,
}

impl fmt::Display for Named<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Named { names, condition } = *self;
        match *condition {
            Condition::AxisAt { axis, position } => {
                write!(f, "{} = {position}", names.axis_name(axis))
            }
            Condition::AxisBelow { axis, position } => {
                write!(f, "{} < {position}", names.axis_name(axis))
            }
            Condition::AxisAbove { axis, position } => {
                write!(f, "{} > {position}", names.axis_name(axis))
            }
            Condition::Outside { ref low, ref high } => {
                f.write_str("outside")?;
                let limits = || (0..).zip(low.iter().zip(high));
                let open = |limits: &(u8, (&i64, &i64))| limits.1 == (&i64::MIN, &i64::MAX);
                let all_open = limits().all(|limits| open(&limits));
                for (axis, (low, high)) in limits() {
                    if open(&(axis, (low, high))) && !(all_open && axis == 0) {
                        continue;
                    }
                    write!(f, " {} ", names.axis_name(axis))?;
                    if *low != i64::MIN {
                        write!(f, "{low}")?;
                    }
                    f.write_str("..")?;
                    if *high != i64::MAX {
                        write!(f, "{high}")?;
                    }
                }
                Ok(())
            }
            Condition::PortBit { port, bit, level } => {
                write!(f, "port {port} bit {bit} {}", if level { "on" } else { "off" })
            }
            Condition::Limit { axis, positive, active } => {
                let end = if positive { '+' } else { '-' };
                write!(f, "limit {}{end}{}", names.axis_name(axis), if active { "" } else { " off" })
            }
            Condition::SignalIs { signal, value } => {
                write!(f, "signal {} is ", names.signal_name(signal))?;
                f.write_str(&names.value_name(signal, value))
            }
            Condition::Idle => f.write_str("idle"),
            Condition::At(time) => {
                let nanos = time.as_nanos();
                let text = format!("{}.{:09}", nanos / 1_000_000_000, nanos % 1_000_000_000);
                write!(f, "at {}s", text.trim_end_matches('0').trim_end_matches('.'))
            }
            Condition::Command { ref like } => {
                let known = |text: &str| names.knows(text, Vocabulary::has_command);
                happening(f, "command", like.as_deref(), known)
            }
            Condition::Answered { ref like } => {
                let known = |text: &str| names.knows(text, Vocabulary::has_mnemonic);
                happening(f, "answered", like.as_deref(), known)
            }
            Condition::Answer { ref text } => happening(f, "answer", Some(text), |_| true),
            Condition::Error { ref code } => {
                let known = |text: &str| names.knows(text, Vocabulary::has_error);
                happening(f, "answer error", code.as_deref(), known)
            }
            Condition::Line { line: None } => f.write_str("line"),
            Condition::Line { line: Some(line) } => write!(f, "line {line}"),
            Condition::SignalChanges { signal, to } => {
                write!(f, "signal {} changes", names.signal_name(signal))?;
                match to {
                    Some(value) => write!(f, " to {}", names.value_name(signal, value)),
                    None => Ok(()),
                }
            }
            Condition::All(ref parts) if parts.is_empty() => f.write_str("always"),
            Condition::Any(ref parts) if parts.is_empty() => f.write_str("never"),
            Condition::All(ref parts) => self.list(f, parts, " and ", |part| {
                matches!(part, Condition::All(parts) | Condition::Any(parts) if parts.len() > 1)
            }),
            Condition::Any(ref parts) => self.list(f, parts, " or ", |part| {
                matches!(part, Condition::Any(parts) if parts.len() > 1)
            }),
        }
    }
}

impl Named<'_> {
    fn list(
        &self,
        f: &mut fmt::Formatter<'_>,
        parts: &[Condition],
        between: &str,
        bracketed: impl Fn(&Condition) -> bool,
    ) -> fmt::Result {
        for (place, part) in parts.iter().enumerate() {
            if place > 0 {
                f.write_str(between)?;
            }
            let part_text = self.names.write(part);
            match parts.len() > 1 && bracketed(part) {
                true => write!(f, "({part_text})")?,
                false => write!(f, "{part_text}")?,
            }
        }
        Ok(())
    }
}

/// A happening, and the text that selects it.
fn happening(
    f: &mut fmt::Formatter<'_>,
    what: &str,
    text: Option<&str>,
    is_known: impl Fn(&str) -> bool,
) -> fmt::Result {
    f.write_str(what)?;
    let Some(text) = text else { return Ok(()) };
    let bare = is_known(text)
        && !text.is_empty()
        && text.chars().all(|c| c.is_ascii_graphic() && is_of_word(c))
        && !text.ends_with(':')
        // It parts orders.
        && !text.contains(';')
        && !RESERVED.iter().any(|word| word.eq_ignore_ascii_case(text));
    if bare {
        return write!(f, " {text}");
    }
    f.write_str(" \"")?;
    for c in text.chars() {
        match c {
            '"' | '\\' => write!(f, "\\{c}")?,
            c if c.is_control() => write!(f, "\\u{{{:x}}}", u32::from(c))?,
            c => write!(f, "{c}")?,
        }
    }
    f.write_str("\"")
}

/// Why a text is no condition.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ConditionError {
    text: String,
    /// What follows the place up to which it was read.
    rest: String,
    right: String,
}

impl ConditionError {
    /// What would be right, for people.
    #[must_use]
    pub fn right(&self) -> &str {
        &self.right
    }

    /// What follows the place up to which it was read.
    pub(crate) fn rest(&self) -> &str {
        &self.rest
    }
}

impl fmt::Display for ConditionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        excerpt(f, &self.text, &self.rest, &self.right)
    }
}

/// Reports where a text goes wrong: at its rest.
pub(crate) fn excerpt(
    f: &mut fmt::Formatter<'_>,
    text: &str,
    rest: &str,
    right: &str,
) -> fmt::Result {
    let short = |text: &str| -> String {
        let mut shown = String::new();
        for c in text.chars().take(SHOWN) {
            // Printable text is shown as it was typed.
            match c {
                '"' | '\'' | '\\' => shown.push(c),
                c => shown.extend(c.escape_debug()),
            }
        }
        if text.chars().nth(SHOWN).is_some() { shown + "…" } else { shown }
    };
    let shown = short(text);
    match rest {
        "" if text.is_empty() => write!(f, "nothing is said: {right}"),
        "" => write!(f, "`{shown}` is not finished: {right}"),
        rest if rest == text => write!(f, "`{shown}` is wrong: {right}"),
        rest => write!(f, "`{shown}` is wrong at `{}`: {right}", short(rest)),
    }
}

impl Error for ConditionError {}

// --- tokens ---

/// The rest of the text, and what was expected there.
#[derive(Debug)]
struct Wrong<'t> {
    rest: &'t str,
    right: String,
}

impl<'t> ParseError<&'t str> for Wrong<'t> {
    fn from_error_kind(rest: &'t str, _: ErrorKind) -> Wrong<'t> {
        Wrong { rest, right: String::new() }
    }

    fn append(_: &'t str, _: ErrorKind, other: Wrong<'t>) -> Wrong<'t> {
        other
    }
}

type Parsed<'t, T> = IResult<&'t str, T, Wrong<'t>>;

fn failure(rest: &str, right: impl Into<String>) -> nom::Err<Wrong<'_>> {
    nom::Err::Failure(Wrong { rest, right: right.into() })
}

/// Parts joined by a word; a single part stands for itself.
fn joined<'t>(
    input: &'t str,
    between: &str,
    join: impl FnOnce(Vec<Condition>) -> Condition,
    part: impl Fn(&'t str) -> Parsed<'t, Condition>,
) -> Parsed<'t, Condition> {
    let (mut rest, first) = part(input)?;
    let mut parts = vec![first];
    while let Ok((after, _)) = keyword(between, rest) {
        let (next, another) = part(after)?;
        parts.push(another);
        rest = next;
    }
    let one = if parts.len() == 1 { parts.pop() } else { None };
    Ok((rest, one.unwrap_or_else(|| join(parts))))
}

fn is_of_word(c: char) -> bool {
    !c.is_whitespace() && !matches!(c, '(' | ')' | '<' | '>' | '=' | '"')
}

fn symbol(wanted: char, input: &str) -> Parsed<'_, char> {
    preceded(space0, char(wanted)).parse(input.trim_start())
}

fn word(input: &str) -> Parsed<'_, &str> {
    preceded(space0, take_while1(is_of_word)).parse(input)
}

fn keyword<'t>(wanted: &str, input: &'t str) -> Parsed<'t, &'t str> {
    verify(word, |word: &str| word.eq_ignore_ascii_case(wanted)).parse(input)
}

/// The next word, if it does not join conditions.
fn optional_word(input: &str) -> Option<(&str, &str)> {
    let (rest, word) = word(input).ok()?;
    let joins = ["and", "or"].iter().any(|other| other.eq_ignore_ascii_case(word));
    (!joins).then_some((rest, word))
}

/// A keyword.
fn expected<'t, T>(
    input: &'t str,
    right: &str,
    meaning: impl FnOnce(&'t str) -> Option<T>,
) -> Parsed<'t, T> {
    let found = word(input).ok().and_then(|(rest, word)| Some((rest, meaning(word)?)));
    found.ok_or_else(|| failure(input, right))
}

fn level(word: &str) -> Option<bool> {
    match word.to_ascii_lowercase().as_str() {
        "on" | "1" => Some(true),
        "off" | "0" => Some(false),
        _ => None,
    }
}

/// A time with its unit, to the nanosecond.
fn time(word: &str) -> Option<Time> {
    Some(Time::ZERO + parse_duration(word).ok()?)
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

/// A word, or anything between quotation marks; nothing before `and`, `or`, a bracket or the end.
fn text(input: &str) -> Parsed<'_, Option<String>> {
    let Ok((mut rest, _)) = symbol('"', input) else {
        return Ok(match optional_word(input) {
            Some((rest, word)) => (rest, Some(word.to_owned())),
            None => (input, None),
        });
    };
    let mut text = String::new();
    loop {
        let mut chars = rest.chars();
        match chars.next() {
            Some('"') => return Ok((chars.as_str(), Some(text))),
            Some('\\') => match escaped(chars.as_str()) {
                Some((after, c)) => {
                    text.push(c);
                    rest = after;
                    continue;
                }
                None => return Err(failure(rest, r#"`\"`, `\\`, `\r`, `\n`, `\t` or `\u{1b}`"#)),
            },
            Some(c) => text.push(c),
            None => return Err(failure(rest, r#"`"` at the end of the text"#)),
        }
        rest = chars.as_str();
    }
}

/// The character after a backslash.
fn escaped(input: &str) -> Option<(&str, char)> {
    let mut chars = input.chars();
    let c = match chars.next()? {
        'r' => '\r',
        'n' => '\n',
        't' => '\t',
        c @ ('"' | '\\') => c,
        'u' => {
            let (number, rest) = chars.as_str().strip_prefix('{')?.split_once('}')?;
            return Some((rest, char::from_u32(u32::from_str_radix(number, 16).ok()?)?));
        }
        _ => return None,
    };
    Some((chars.as_str(), c))
}
