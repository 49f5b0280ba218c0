//! Faults as people type them.

use std::fmt::{self, Write};
use std::str::FromStr;

use super::words::{FaultError, Span, Words, up_to, whole};
use super::{
    Awaited, BadByte, Chance, Damage, Fault, FaultNumber, Faulting, Garbling, LineFault,
    MachineFault, Mishap, Way, When, mishap,
};
use crate::condition::without_names;
use crate::nth::Nth;
use crate::{Condition, Names, escape};

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

/// The words for when a fault strikes.
const WHEN: &str = "once, `3 times`, always, `every 10th`, `3rd byte`, `5%`, `for 200ms`, \
                    `seed 7`, or `after` or `while` and a condition";

/// The same of a fault of the machine.
const OF_MACHINE: &str = "or nothing: `for 200ms`, or `after` or `while` and a condition";

impl Names {
    /// Reads a fault.
    ///
    /// # Errors
    ///
    /// If it is none, with the place and what would be right there.
    pub fn read_fault(&self, text: &str) -> Result<Fault, FaultError> {
        whole(text, |words| self.fault(words))
    }

    /// Reads an order about faults: a fault that begins, with its number before it unless it is the
    /// [next](FaultNumber::NEXT), `end 3` or `end all`.
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

    /// Writes an order about faults so that [`read_faulting`](Names::read_faulting) reads the same.
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

    /// When a fault of the machine strikes: once, so which of many has no meaning.
    fn machine_fault(
        &self,
        mishap: Mishap,
        words: &mut Words<'_>,
    ) -> Result<MachineFault, FaultError> {
        let here = words.rest;
        let when = self.read_when(None, OF_MACHINE, words)?;
        let plain = When {
            after: when.after.clone(),
            lasts: when.lasts,
            during: when.during.clone(),
            ..When::ALWAYS
        };
        if when != plain {
            let right = "`for 200ms`, or `after` or `while` and a condition: what is wrong with a machine is so \
                         from when it begins until it ends";
            return Err(words.wrong_at(here, right));
        }
        Ok(MachineFault { mishap, when })
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
            return Err(words.wrong(match damage {
                Damage::Parity(BadByte::AsIs) | Damage::Framing(BadByte::AsIs) => {
                    "as-is, dropped, zero or marked, or to-host, to-controller or both"
                }
                _ => "to-host, to-controller or both",
            }));
        };
        let run = words.counted(&["bytes", "byte"], "at least 1 byte")?;
        let run = run.map_or(1, |run| u32::try_from(run).unwrap_or(u32::MAX));
        let often = if damage.lasts() { None } else { Some(1) };
        Ok(LineFault { damage, way, run, when: self.read_when(often, WHEN, words)? })
    }

    /// Reads when a fault strikes, up to the end: so `often` if nothing else is said.
    pub(super) fn read_when(
        &self,
        often: Option<u64>,
        forms: &str,
        words: &mut Words<'_>,
    ) -> Result<When, FaultError> {
        let mut when = When::ALWAYS;
        // Naming which of many, or for how long, means more than the first one.
        let (mut times, mut first, mut many) = (None, None, false);
        while !words.is_empty() {
            let here = words.rest;
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
            } else if let Some(often) = how_often(words)? {
                if times.is_some() {
                    return Err(words.wrong_at(here, "something else: how often is said already"));
                }
                times = Some(often);
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
                return Err(words.amiss().unwrap_or_else(|| words.wrong(forms)));
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

/// How often a fault strikes, where that is said: `once`, `3 times`, or `always`, which is no number.
fn how_often(words: &mut Words<'_>) -> Result<Option<Option<u64>>, FaultError> {
    if words.take_if("once") {
        return Ok(Some(Some(1)));
    }
    if words.take_if("always") {
        return Ok(Some(None));
    }
    Ok(words.counted(&["times"], "at least once")?.map(Some))
}

/// All kinds of faults, and what each does.
pub(crate) fn kinds() -> impl Iterator<Item = (&'static str, &'static str)> {
    KINDS.into_iter().chain(mishap::KINDS)
}

/// What a word and those that belong to it do to the line; `None` if the word is no such kind.
fn damage(kind: &str, words: &mut Words<'_>) -> Option<Result<Damage, FaultError>> {
    Some(match kind {
        "drop" => Ok(Damage::Drop),
        "garble" => garbling(words).map(Damage::Garble),
        "duplicate" => Ok(Damage::Duplicate),
        "delay" => words.time("delay 50ms").map(Damage::Delay),
        "insert" => {
            let right = r#"bytes, as in `insert \xFF` or `insert "0\r"`"#;
            words.bytes(right).map(Damage::Insert)
        }
        "split" => words.time("split 2ms").map(Damage::Split),
        "merge" => words.time("merge 16ms").map(Damage::Merge),
        "parity" => Ok(Damage::Parity(bad_byte(words))),
        "framing" => Ok(Damage::Framing(bad_byte(words))),
        "cut" => Ok(Damage::Cut),
        "break" => words.time("break 250ms").map(Damage::Break),
        "speed" => {
            let here = words.rest;
            match words.take_parsed::<u32>() {
                Some(0) => Err(words.wrong_at(here, "at least 1 bit a second, as in `speed 9600`")),
                Some(speed) => Ok(Damage::Speed(speed)),
                None => Err(words.wrong("bits a second, as in `speed 9600`")),
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
        let right = r"one byte, as in `into ?` or `into \xFF`";
        return match words.bytes(right)?.as_ref() {
            [byte] => Ok(Garbling::Into(*byte)),
            _ => Err(words.wrong_at(here, right)),
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

/// Reads a fault in which signals are numbers.
impl FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Fault, FaultError> {
        without_names().read_fault(text)
    }
}

/// With numbers for signals; [`Names::write_fault`] has their names.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&without_names().write_fault(self))
    }
}

/// Reads an order about faults, with numbers for signals.
impl FromStr for Faulting {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Faulting, FaultError> {
        without_names().read_faulting(text)
    }
}

/// With numbers for signals; [`Names::write_faulting`] has their names.
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

#[cfg(test)]
mod tests;
