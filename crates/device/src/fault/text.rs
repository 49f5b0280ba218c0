//! Faults as people type them.

mod machine;

use std::error::Error;
use std::fmt::{self, Write};
use std::str::FromStr;
use std::time::Duration;

use bytes::Bytes;

use super::{
    Awaited, BadByte, Chance, Damage, Fault, FaultNumber, Faulting, Garbling, LineFault, Way, When,
};
use crate::condition::{excerpt, without_names};
use crate::{Condition, Names, escape, parse_duration, show_nanos, unescape};

/// The kinds of faults of the line, as they are typed, and what each does.
const KINDS: [(&str, &str); 12] = [
    ("drop", "bytes do not arrive"),
    ("garble", "other bytes arrive, also with `flip 0x20` or `into ?`"),
    ("duplicate", "bytes arrive twice"),
    ("delay", "bytes arrive later, as in `delay 50ms`"),
    ("insert", r"bytes arrive that nobody sent, as in `insert \xFF`"),
    ("split", "bytes arrive with pauses between them, as in `split 2ms`"),
    ("merge", "bytes are held back and arrive in one piece, as in `merge 16ms`"),
    ("parity", "a bit is turned over; a receiver that looks takes as-is|dropped|zero|marked"),
    ("framing", "a spike is taken for a start bit; the same words may follow"),
    ("cut", "nothing arrives"),
    ("break", "the line is held low, as in `break 250ms`"),
    ("speed", "the host has another speed, as in `speed 9600`"),
];

/// What can be said of when a fault strikes.
const WHEN: &str = "once, `3 times`, always, `every 10th`, `3rd byte`, `5%`, `for 200ms`, \
                    `seed 7`, or `after` and a condition";

/// Why a text is not a fault: where it goes wrong, and what would be right there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaultError {
    text: String,
    /// What follows the place up to which it was read.
    rest: String,
    right: String,
}

impl FaultError {
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

impl fmt::Display for FaultError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        excerpt(f, &self.text, &self.rest, &self.right)
    }
}

impl Error for FaultError {}

impl Names {
    /// Reads a fault.
    ///
    /// # Errors
    ///
    /// If it is none, with the place and what would be right there.
    pub fn read_fault(&self, text: &str) -> Result<Fault, FaultError> {
        whole(text, |words| self.fault(words))
    }

    /// Reads what is done about faults: a fault that begins, with its number before it unless it is
    /// the [next](FaultNumber::NEXT), `end 3` or `end all`.
    ///
    /// # Errors
    ///
    /// If it is none, with the place and what would be right there.
    pub fn read_faulting(&self, text: &str) -> Result<Faulting, FaultError> {
        whole(text, |words| {
            if words.take_if("end") {
                if words.take_if("all") {
                    return Ok(Faulting::EndAll);
                }
                return words.parsed("the number of a fault, or all").map(Faulting::End);
            }
            let number = words.take_parsed().unwrap_or(FaultNumber::NEXT);
            Ok(Faulting::Begin(number, self.fault(words)?))
        })
    }

    /// Writes a fault so that [`read_fault`](Names::read_fault) reads the same.
    #[must_use]
    pub fn write_fault(&self, fault: &Fault) -> String {
        let mut text = String::new();
        match fault {
            Fault::Line(fault) => write_line(&mut text, fault),
            Fault::Machine(fault) => text = self.write_mishap(&fault.mishap),
        }
        self.write_when(&mut text, fault);
        text
    }

    /// Writes what is done about faults so that [`read_faulting`](Names::read_faulting) reads the
    /// same.
    #[must_use]
    pub fn write_faulting(&self, faulting: &Faulting) -> String {
        match faulting {
            Faulting::Begin(FaultNumber::NEXT, fault) => self.write_fault(fault),
            Faulting::Begin(number, fault) => format!("{number} {}", self.write_fault(fault)),
            Faulting::End(number) => format!("end {number}"),
            Faulting::EndAll => "end all".to_owned(),
        }
    }

    fn fault(&self, words: &mut Words<'_>) -> Result<Fault, FaultError> {
        let here = words.rest;
        let kind = words.word().unwrap_or_default();
        match damage(kind, words) {
            Some(damage) => self.line_fault(damage?, words).map(Fault::Line),
            None => {
                if let Some(mishap) = self.mishap(kind, words) {
                    return self.machine_fault(mishap?, words).map(Fault::Machine);
                }
                let kinds: Vec<&str> = kinds().map(|(kind, _)| kind).collect();
                Err(words.wrong_at(here, format!("a kind of fault: {}", kinds.join(", "))))
            }
        }
    }

    fn line_fault(&self, damage: Damage, words: &mut Words<'_>) -> Result<LineFault, FaultError> {
        let given = match words.peek() {
            "to-host" => Some(Way::ToHost),
            "to-controller" => Some(Way::ToController),
            "both" => Some(Way::Both),
            _ => None,
        };
        let usual = match damage {
            Damage::Cut | Damage::Speed(_) => Some(Way::Both),
            Damage::Break(_) => Some(Way::ToController),
            _ => None,
        };
        if given.is_some() {
            words.word();
        }
        let Some(way) = given.or(usual) else {
            return Err(words.wrong("to-host, to-controller or both"));
        };
        let run = words.counted("bytes").or_else(|| words.counted("byte"));
        let run = match run {
            Some(0) => return Err(words.wrong("at least 1 byte")),
            Some(run) => u32::try_from(run).unwrap_or(u32::MAX),
            None => 1,
        };
        let often = if damage.lasts() { None } else { Some(1) };
        Ok(LineFault { damage, way, run, when: self.read_when(often, words)? })
    }

    /// Reads when a fault strikes, up to the end: so `often` if nothing else is said.
    pub(super) fn read_when(
        &self,
        often: Option<u64>,
        words: &mut Words<'_>,
    ) -> Result<When, FaultError> {
        let mut when = When::ALWAYS;
        // Whoever says which of many, or for how long, does not mean the first alone.
        let (mut times, mut first, mut many) = (None, None, false);
        while !words.is_empty() {
            if words.take_if("after") || words.take_if("when") {
                when.after = self.awaited(words)?;
            } else if words.take_if("while") {
                let here = words.rest;
                let condition = self.waited_for(here, words)?;
                if condition.has_happenings() {
                    let right = "a state, which lasts, as in `while x > 1000`";
                    return Err(words.wrong_at(here, right));
                }
                when.during = Some(Box::new(condition));
                words.rest = "";
            } else if words.take_if("once") {
                times = Some(Some(1));
            } else if words.take_if("always") {
                times = Some(None);
            } else if let Some(number) = words.counted("times") {
                if number == 0 {
                    return Err(words.wrong("at least once"));
                }
                times = Some(Some(number));
            } else if words.take_if("every") {
                let right = "which of them, as in `every 10th`";
                when.every = words.ordinal().ok_or_else(|| words.wrong(right))?;
                many = true;
            } else if words.take_if("for") {
                when.lasts = Some(words.time("for 200ms")?);
                many = true;
            } else if words.take_if("seed") {
                when.seed = words.parsed("a number, as in `seed 7`")?;
            } else if let Some(chance) = words.chance() {
                when.chance = chance;
                many = true;
            } else if let Some(nth) = words.nth_byte() {
                first = Some(nth);
            } else {
                return Err(words.wrong(WHEN));
            }
        }
        // Every tenth are the tenth, the twentieth and so on.
        when.first = first.unwrap_or(when.every);
        when.times = times.unwrap_or(if many { None } else { often });
        Ok(when)
    }

    fn awaited(&self, words: &mut Words<'_>) -> Result<Vec<Awaited>, FaultError> {
        let mut awaited = Vec::new();
        loop {
            let times = match words.peek_ordinal() {
                Some(times) => {
                    words.word();
                    u32::try_from(times).unwrap_or(u32::MAX)
                }
                None => 1,
            };
            let (text, rest) = up_to(words.rest, &["then", "while"]);
            let condition = self.waited_for(text, words)?;
            awaited.push(Awaited { condition, times });
            words.rest = rest.trim_start();
            if !words.take_if("then") {
                return Ok(awaited);
            }
        }
    }

    /// The condition that is a text with which what is left begins.
    fn waited_for(&self, text: &str, words: &Words<'_>) -> Result<Condition, FaultError> {
        self.awaited_condition(text.trim()).map_err(|(left, right)| {
            let text = text.trim_end();
            let at = text.len() - left.len().min(text.len());
            words.wrong_at(words.rest.get(at..).unwrap_or_default(), right)
        })
    }

    /// A condition; the beginning of a command alone says that it is that command.
    fn awaited_condition(&self, text: &str) -> Result<Condition, (String, String)> {
        let condition = match text.starts_with(['@', '!']) {
            true => self.read(&format!("command {text}")),
            false => self.read(text),
        };
        condition.map_err(|error| (error.rest().to_owned(), error.right().to_owned()))
    }

    fn write_when(&self, text: &mut String, fault: &Fault) {
        let When { after, first, every, chance, times, lasts, during, seed } = fault.when();
        let state = match fault {
            Fault::Line(fault) => fault.damage.lasts(),
            Fault::Machine(_) => true,
        };
        let many = state
            || during.is_some()
            || *every != 1
            || *chance != Chance::CERTAIN
            || lasts.is_some();
        let mut say = |words: fmt::Arguments<'_>| {
            // Writing to a string cannot fail.
            let _ = write!(text, " {words}");
        };
        match times {
            Some(1) => say(format_args!("once")),
            Some(times) => say(format_args!("{times} times")),
            None if !many => say(format_args!("always")),
            None => {}
        }
        if first != every {
            say(format_args!("{} byte", Nth(*first)));
        }
        if *every != 1 {
            say(format_args!("every {}", Nth(*every)));
        }
        if *chance != Chance::CERTAIN {
            let millionths = chance.as_millionths();
            let percent = format!("{}.{:04}", millionths / 10_000, millionths % 10_000);
            say(format_args!("{}%", percent.trim_end_matches('0').trim_end_matches('.')));
        }
        if let Some(lasts) = lasts {
            say(format_args!("for {}", Span(*lasts)));
        }
        if *seed != 0 {
            say(format_args!("seed {seed}"));
        }
        for (place, Awaited { condition, times }) in after.iter().enumerate() {
            say(format_args!("{}", if place == 0 { "after" } else { "then" }));
            if *times != 1 {
                say(format_args!("{}", Nth((*times).into())));
            }
            say(format_args!("{}", self.write(condition)));
        }
        if let Some(condition) = during {
            say(format_args!("while {}", self.write(condition)));
        }
    }

    /// The forms of a fault, and what each says.
    pub(crate) fn help_on_faults() -> Vec<(String, String)> {
        let kinds = kinds().map(|(kind, about)| (kind.to_owned(), about.to_owned()));
        let mut forms: Vec<_> = kinds.collect();
        forms.push((
            "to-host|to-controller".to_owned(),
            "which way, or both; `2 bytes` for several in a row".to_owned(),
        ));
        forms.push((
            "once|3 times|always".to_owned(),
            "how often; once if nothing is said, but what is cut stays cut".to_owned(),
        ));
        forms.push(("every 10th, 3rd byte".to_owned(), "which bytes".to_owned()));
        forms.push(("5%, seed 7".to_owned(), "with a probability; equal seeds".to_owned()));
        forms.push(("for 200ms".to_owned(), "for how long".to_owned()));
        forms.push((
            "after CONDITION".to_owned(),
            "from when on, as in `after x > 1000` or `after @A then 2nd answered`; it stands last, \
             and `help run until` has the conditions"
                .to_owned(),
        ));
        forms
    }
}

/// All kinds of faults, and what each does.
pub(crate) fn kinds() -> impl Iterator<Item = (&'static str, &'static str)> {
    KINDS.into_iter().chain(machine::KINDS)
}

/// What a word and those that belong to it do to the line; `None` if the word is no such kind.
fn damage(kind: &str, words: &mut Words<'_>) -> Option<Result<Damage, FaultError>> {
    Some(match kind {
        "drop" => Ok(Damage::Drop),
        "garble" => garbling(words).map(Damage::Garble),
        "duplicate" => Ok(Damage::Duplicate),
        "delay" => words.time("delay 50ms").map(Damage::Delay),
        "insert" => words.bytes().map(Damage::Insert),
        "split" => words.time("split 2ms").map(Damage::Split),
        "merge" => words.time("merge 16ms").map(Damage::Merge),
        "parity" => Ok(Damage::Parity(bad_byte(words))),
        "framing" => Ok(Damage::Framing(bad_byte(words))),
        "cut" => Ok(Damage::Cut),
        "break" => words.time("break 250ms").map(Damage::Break),
        "speed" => {
            let right = "bits a second, as in `speed 9600`";
            match words.take_parsed::<u32>() {
                Some(speed @ 1..) => Ok(Damage::Speed(speed)),
                _ => Err(words.wrong(right)),
            }
        }
        _ => return None,
    })
}

fn garbling(words: &mut Words<'_>) -> Result<Garbling, FaultError> {
    if words.take_if("flip") {
        let here = words.rest;
        let mask = words.word().unwrap_or_default();
        let mask = match mask.strip_prefix("0x") {
            Some(hex) => u8::from_str_radix(hex, 16).ok(),
            None => mask.parse().ok(),
        };
        let mask = mask.filter(|mask| *mask != 0);
        let right = "the bits to turn over, as in `flip 0x20`";
        return mask.map(Garbling::Flip).ok_or_else(|| words.wrong_at(here, right));
    }
    if words.take_if("into") {
        let here = words.rest;
        return match words.bytes()?.as_ref() {
            [byte] => Ok(Garbling::Into(*byte)),
            _ => Err(words.wrong_at(here, r"one byte, as in `into ?` or `into \xFF`")),
        };
    }
    Ok(Garbling::Bit)
}

fn bad_byte(words: &mut Words<'_>) -> BadByte {
    let named = BadByte::ALL.into_iter().find(|(_, name)| words.take_if(name));
    named.map_or(BadByte::AsIs, |(bad, _)| bad)
}

fn write_line(text: &mut String, fault: &LineFault) {
    let bytes = |bytes: &[u8]| format!("\"{}\"", escape(bytes).replace('"', "\\x22"));
    let bad = |kind: &str, bad: &BadByte| match bad {
        BadByte::AsIs => kind.to_owned(),
        bad => {
            let named = BadByte::ALL.iter().find(|(known, _)| known == bad);
            format!("{kind} {}", named.map_or("as-is", |(_, name)| name))
        }
    };
    let LineFault { damage, way, run, .. } = fault;
    *text = match damage {
        Damage::Drop => "drop".to_owned(),
        Damage::Garble(Garbling::Bit) => "garble".to_owned(),
        Damage::Garble(Garbling::Flip(mask)) => format!("garble flip 0x{mask:02X}"),
        Damage::Garble(Garbling::Into(byte)) => format!("garble into {}", bytes(&[*byte])),
        Damage::Duplicate => "duplicate".to_owned(),
        Damage::Delay(span) => format!("delay {}", Span(*span)),
        Damage::Insert(inserted) => format!("insert {}", bytes(inserted)),
        Damage::Split(span) => format!("split {}", Span(*span)),
        Damage::Merge(span) => format!("merge {}", Span(*span)),
        Damage::Parity(how) => bad("parity", how),
        Damage::Framing(how) => bad("framing", how),
        Damage::Cut => "cut".to_owned(),
        Damage::Break(span) => format!("break {}", Span(*span)),
        Damage::Speed(baud) => format!("speed {baud}"),
    };
    // Writing to a string cannot fail.
    let _ = write!(text, " {way}");
    if *run != 1 {
        let _ = write!(text, " {run} bytes");
    }
}

/// Reads a fault in which axes and signals are numbers.
impl FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Fault, FaultError> {
        without_names().read_fault(text)
    }
}

/// With numbers for axes and signals; [`Names::write_fault`] has their names.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&without_names().write_fault(self))
    }
}

/// Reads what is done about faults, with numbers for axes and signals.
impl FromStr for Faulting {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Faulting, FaultError> {
        without_names().read_faulting(text)
    }
}

/// With numbers for axes and signals; [`Names::write_faulting`] has their names.
impl fmt::Display for Faulting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&without_names().write_faulting(self))
    }
}

impl FromStr for FaultNumber {
    type Err = std::num::ParseIntError;

    fn from_str(text: &str) -> Result<FaultNumber, Self::Err> {
        match text {
            "terminal" => Ok(FaultNumber::TERMINAL),
            number => number.parse().map(FaultNumber),
        }
    }
}

/// A span of time as it is read.
struct Span(Duration);

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&show_nanos(u64::try_from(self.0.as_nanos()).unwrap_or(u64::MAX)))
    }
}

/// `1st`, `2nd`, `3rd`, `4th`.
struct Nth(u64);

impl fmt::Display for Nth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let end = match (self.0 % 10, self.0 % 100) {
            (_, 11..=13) => "th",
            (1, _) => "st",
            (2, _) => "nd",
            (3, _) => "rd",
            _ => "th",
        };
        write!(f, "{}{end}", self.0)
    }
}

// --- words ---

/// Reads the whole of a text.
fn whole<T>(
    text: &str,
    read: impl FnOnce(&mut Words<'_>) -> Result<T, FaultError>,
) -> Result<T, FaultError> {
    let text = text.trim();
    let mut words = Words { text, rest: text };
    let read = read(&mut words)?;
    match words.rest {
        "" => Ok(read),
        _ => Err(words.wrong("nothing more")),
    }
}

/// A text and what of it is to be read, which begins with no blank.
pub(super) struct Words<'t> {
    text: &'t str,
    rest: &'t str,
}

impl<'t> Words<'t> {
    fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    fn wrong(&self, right: impl Into<String>) -> FaultError {
        self.wrong_at(self.rest, right)
    }

    fn wrong_at(&self, rest: &str, right: impl Into<String>) -> FaultError {
        FaultError { text: self.text.to_owned(), rest: rest.to_owned(), right: right.into() }
    }

    fn peek(&self) -> &'t str {
        self.rest.split_whitespace().next().unwrap_or_default()
    }

    fn word(&mut self) -> Option<&'t str> {
        let word = self.rest.split_whitespace().next()?;
        self.rest = self.rest.get(word.len()..).unwrap_or_default().trim_start();
        Some(word)
    }

    fn take_if(&mut self, wanted: &str) -> bool {
        let is = self.peek().eq_ignore_ascii_case(wanted);
        if is {
            self.word();
        }
        is
    }

    fn take_parsed<T: FromStr>(&mut self) -> Option<T> {
        let parsed = self.peek().parse().ok()?;
        self.word();
        Some(parsed)
    }

    fn parsed<T: FromStr>(&mut self, right: &str) -> Result<T, FaultError> {
        self.take_parsed().ok_or_else(|| self.wrong(right))
    }

    /// A number with a word behind it.
    fn counted(&mut self, unit: &str) -> Option<u64> {
        let here = self.rest;
        let number = self.take_parsed();
        if number.is_some() && self.take_if(unit) {
            return number;
        }
        self.rest = here;
        None
    }

    /// The number that a word such as `10th` says.
    fn peek_ordinal(&self) -> Option<u64> {
        let word = self.peek();
        let number = word.get(..word.len().checked_sub(2)?)?;
        let number = number.parse().ok().filter(|number| *number > 0)?;
        Nth(number).to_string().eq_ignore_ascii_case(word).then_some(number)
    }

    /// `10th`, or `10`.
    fn ordinal(&mut self) -> Option<u64> {
        let plain = || self.peek().parse().ok().filter(|number| *number > 0);
        let number = self.peek_ordinal().or_else(plain)?;
        self.word();
        Some(number)
    }

    fn nth_byte(&mut self) -> Option<u64> {
        let here = self.rest;
        let number = self.peek_ordinal();
        self.word();
        if number.is_some() && self.take_if("byte") {
            return number;
        }
        self.rest = here;
        None
    }

    fn chance(&mut self) -> Option<Chance> {
        let number = self.peek().strip_suffix('%')?;
        let (whole, places) = number.split_once('.').unwrap_or((number, ""));
        let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        if whole.is_empty() || places.len() > 4 || !is_number(whole) || !is_number(places) {
            return None;
        }
        let places = format!("{places:0<4}").parse().ok()?;
        let millionths = whole.parse::<u32>().ok()?.checked_mul(10_000)?.checked_add(places)?;
        (millionths <= 1_000_000).then(|| self.word())?;
        Some(Chance::millionths(millionths))
    }

    fn time(&mut self, example: &str) -> Result<Duration, FaultError> {
        let time = parse_duration(self.peek());
        let time = time.map_err(|_| self.wrong(format!("a time, as in `{example}`")))?;
        self.word();
        Ok(time)
    }

    /// Bytes as [`escape`] writes them, between quotation marks or up to a blank.
    fn bytes(&mut self) -> Result<Bytes, FaultError> {
        let right = r#"bytes, as in `insert \xFF` or `insert "0\r"`"#;
        let (written, rest) = match self.rest.strip_prefix('"') {
            Some(quoted) => quoted.split_once('"').ok_or_else(|| self.wrong(right))?,
            None => self.rest.split_at(self.peek().len()),
        };
        let is_plain = !written.is_empty() && written.bytes().all(|c| matches!(c, b' '..=b'~'));
        let bytes = is_plain.then(|| unescape(written).ok()).flatten();
        let bytes = bytes.ok_or_else(|| self.wrong(right))?;
        self.rest = rest.trim_start();
        Ok(bytes.into())
    }
}

/// A text up to one of some words outside of quotation marks, and what is left from that word on.
fn up_to<'t>(text: &'t str, ends: &[&str]) -> (&'t str, &'t str) {
    let (mut quoted, mut escaped) = (false, false);
    for (at, c) in text.char_indices() {
        if escaped {
            escaped = false;
        } else if quoted && c == '\\' {
            escaped = true;
        } else if c == '"' {
            quoted = !quoted;
        } else if !quoted && c.is_whitespace() {
            let rest = text.get(at..).unwrap_or_default().trim_start();
            if ends.contains(&rest.split_whitespace().next().unwrap_or_default()) {
                return (text.get(..at).unwrap_or_default(), rest);
            }
        }
    }
    (text, "")
}

#[cfg(test)]
mod tests;
