//! Faults.
//!
//! ```text
//! change = [NUMBER] fault | "end" NUMBER | "end" "all"
//! fault  = KIND … [WAY] [NUMBER "bytes"] { when }
//! WAY    = "to-host" | "to-controller" | "both"
//! ```
//!
//! The kinds are in [`damage`] and [`mishap`], and `when` is in [`when`].

use vimc4_device::{
    BadByte, Damage, Fault, FaultNumber, Faulting, LineFault, MachineFault, Mishap, Names, Way,
    When,
};

use crate::damage::damage;
use crate::lexer::Read;
use crate::mishap::mishap;
use crate::when::{self, OF_MACHINE, WHEN, read_when};
use crate::{Lexer, SyntaxError, damage, mishap};

/// Reads a fault.
///
/// # Errors
///
/// If it is not a fault, or none that a device with these names can have.
pub fn read_fault(text: &str, names: &Names) -> Result<Fault, SyntaxError> {
    fault(Lexer::new(text), names)
}

/// Reads an order about faults: a fault that begins, with its number before it unless it is the
/// [next](FaultNumber::NEXT), `end 3` or `end all`.
///
/// # Errors
///
/// If it is no such order.
pub fn read_faulting(text: &str, names: &Names) -> Result<Faulting, SyntaxError> {
    faulting(Lexer::new(text), names)
}

/// Reads an order about faults that is the whole rest.
pub(crate) fn faulting(mut lexer: Lexer<'_>, names: &Names) -> Read<Faulting> {
    if !lexer.keyword("end") {
        let number = lexer.value().unwrap_or(FaultNumber::NEXT);
        return Ok(Faulting::Begin(number, fault(lexer, names)?));
    }
    let ends = match lexer.keyword("all") {
        true => Faulting::EndAll,
        false => {
            let expected = "the number of a fault, or all";
            Faulting::End(lexer.expect(expected, |word| word.parse().ok())?)
        }
    };
    lexer.finish("nothing more")?;
    Ok(ends)
}

/// All kinds of faults, and what each does.
pub(crate) fn kinds() -> impl Iterator<Item = (&'static str, &'static str)> {
    damage::KINDS.into_iter().chain(mishap::KINDS)
}

fn fault(mut lexer: Lexer<'_>, names: &Names) -> Read<Fault> {
    let here = lexer;
    let kind = lexer.word().unwrap_or_default().to_ascii_lowercase();
    if let Some(damage) = damage(&kind, &mut lexer) {
        return line_fault(damage?, lexer, names).map(Fault::Line);
    }
    if let Some(mishap) = mishap(&kind, &mut lexer, names) {
        return machine_fault(mishap?, lexer, names).map(Fault::Machine);
    }
    let kinds: Vec<&str> = kinds().map(|(kind, _)| kind).collect();
    Err(here.wrong(format!("a kind of fault: {}", kinds.join(", "))))
}

fn line_fault(damage: Damage, mut lexer: Lexer<'_>, names: &Names) -> Read<LineFault> {
    let usual = match damage {
        Damage::Cut | Damage::Speed(_) => Some(Way::Both),
        Damage::Break(_) => Some(Way::ToController),
        _ => None,
    };
    let ways = [Way::ToHost, Way::ToController, Way::Both];
    let given = ways.into_iter().find(|way| lexer.keyword(&way.to_string()));
    let way = given.or(usual).ok_or_else(|| {
        lexer.wrong(match damage {
            Damage::Parity(BadByte::AsIs) | Damage::Framing(BadByte::AsIs) => {
                "as-is, dropped, zero or marked, or to-host, to-controller or both"
            }
            _ => "to-host, to-controller or both",
        })
    })?;
    let run = when::counted(&mut lexer, &["bytes", "byte"], "at least 1 byte")?;
    let run = run.map_or(1, |run| u32::try_from(run).unwrap_or(u32::MAX));
    let often = if damage.lasts() { None } else { Some(1) };
    Ok(LineFault { damage, way, run, when: read_when(often, WHEN, lexer, names)? })
}

/// A fault of the machine strikes once, so which of many has no meaning.
fn machine_fault(mishap: Mishap, lexer: Lexer<'_>, names: &Names) -> Read<MachineFault> {
    let when = read_when(None, OF_MACHINE, lexer, names)?;
    let plain = When {
        after: when.after.clone(),
        lasts: when.lasts,
        during: when.during.clone(),
        ..When::ALWAYS
    };
    if when != plain {
        return Err(lexer.wrong(
            "`for 200ms`, or `after` or `while` and a condition: what is wrong with a machine is so \
             from when it begins until it ends",
        ));
    }
    Ok(MachineFault { mishap, when })
}
