//! Faults as text.

use std::fmt::{self, Write};
use std::str::FromStr;

use super::{
    Awaited, BadByte, Chance, Damage, Fault, FaultNumber, Faulting, Garbling, LineFault, Mishap,
    SwitchSays, When,
};
use crate::duration::Span;
use crate::{Names, Nth, SignalId, escape};

impl Names {
    /// Writes a fault so that it is read as the same.
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

    /// Writes an order about faults so that it is read as the same.
    #[must_use]
    pub fn write_faulting(&self, faulting: &Faulting) -> String {
        match faulting {
            Faulting::Begin(FaultNumber::NEXT, fault) => self.write_fault(fault),
            Faulting::Begin(number, fault) => format!("{number} {}", self.write_fault(fault)),
            Faulting::End(number) => format!("end {number}"),
            Faulting::EndAll => "end all".to_owned(),
        }
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

    /// Writes what goes wrong so that it is read as the same.
    fn write_mishap(&self, mishap: &Mishap) -> String {
        let axis = |axis: &u8| self.axis_name(*axis);
        let signal = |signal: &SignalId| self.signal_name(*signal);
        match mishap {
            Mishap::Switch { axis: of, positive, says } => {
                let end = if *positive { '+' } else { '-' };
                let says = match says {
                    SwitchSays::Pressed => "pressed".to_owned(),
                    SwitchSays::Released => "released".to_owned(),
                    SwitchSays::Nothing => "missing".to_owned(),
                    SwitchSays::Late(steps) => format!("late {steps}"),
                };
                format!("switch {}{end} {says}", axis(of))
            }
            Mishap::Swapped(of) => format!("switch {} swapped", axis(of)),
            Mishap::Backlash { axis: of, steps } => format!("backlash {} {steps}", axis(of)),
            Mishap::Load { axis: of, pull } => format!("load {} {pull}", axis(of)),
            Mishap::Jam(of) => format!("jam {}", axis(of)),
            Mishap::Push { axis: of, steps } => format!("push {} {steps}", axis(of)),
            Mishap::Hold { signal: of, value } => format!("hold {} {value}", signal(of)),
            Mishap::Bounce { signal: of, times, period } => {
                format!("bounce {} {times} {}", signal(of), Span(*period))
            }
            Mishap::Power => "power-off".to_owned(),
        }
    }
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

/// With numbers for signals; [`Names::write_fault`] has their names.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&Names::numbered().write_fault(self))
    }
}

/// With numbers for signals; [`Names::write_faulting`] has their names.
impl fmt::Display for Faulting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&Names::numbered().write_faulting(self))
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
