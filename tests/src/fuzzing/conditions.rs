//! Conditions and faults as people type them.

use std::sync::LazyLock;

use vimc4_catalogue::{Family, Model, bare, machine};
use vimc4_device::{Condition, Device, Faulting, Names, Signal};

/// The names of each built-in model's axes and signals, and those signals.
static NAMES: LazyLock<Vec<(Names, Vec<Signal>)>> = LazyLock::new(|| {
    let named = |name| {
        let (model, machine) = (Model::builtin(name)?, machine("bench").ok()?);
        let controller = bare(&model, &machine, &[]).ok()?;
        Some((Names::of(&controller), controller.signals()))
    };
    Family::ALL.into_iter().flat_map(Family::models).filter_map(named).collect()
});

/// A text is refused with what would be right, or it is a condition that is written as what is read
/// as the same condition, with names and with numbers, for people and for programs.
///
/// The first byte says whose names, what remains is the text.
///
/// # Panics
///
/// If something does not hold.
pub fn condition(data: &[u8]) {
    let [which, text @ ..] = data else { return };
    let (names, _) = &NAMES[usize::from(*which) % NAMES.len()];
    let condition = match names.read(&String::from_utf8_lossy(text)) {
        Ok(condition) => condition,
        Err(error) => return assert!(!error.right().is_empty(), "{error}"),
    };
    let written = names.write(&condition).to_string();
    assert_eq!(names.read(&written).as_ref(), Ok(&condition), "{written}");
    let numbered = condition.to_string();
    assert_eq!(numbered.parse().as_ref(), Ok(&condition), "{numbered}");
    let kept = serde_json::to_string(&condition).unwrap_or_default();
    assert_eq!(serde_json::from_str::<Condition>(&kept).ok(), Some(condition), "{kept}");
}

/// The same of a fault that begins or ends.
///
/// # Panics
///
/// If something does not hold.
pub fn fault(data: &[u8]) {
    let [which, text @ ..] = data else { return };
    let (names, _) = &NAMES[usize::from(*which) % NAMES.len()];
    let faulting = match names.read_faulting(&String::from_utf8_lossy(text)) {
        Ok(faulting) => faulting,
        Err(error) => return assert!(!error.right().is_empty(), "{error}"),
    };
    let written = names.write_faulting(&faulting);
    assert_eq!(names.read_faulting(&written).as_ref(), Ok(&faulting), "{written}");
    let numbered = faulting.to_string();
    assert_eq!(numbered.parse().as_ref(), Ok(&faulting), "{numbered}");
    let kept = serde_json::to_string(&faulting).unwrap_or_default();
    assert_eq!(serde_json::from_str::<Faulting>(&kept).ok(), Some(faulting), "{kept}");
}

/// Every form of a fault there is, in each model's names.
pub(super) fn faults() -> Vec<Vec<u8>> {
    const FORMS: [&str; 24] = [
        "drop to-host once",
        "7 garble flip 0x20 to-controller 2 bytes 3 times every 10th",
        "garble into \"\\xFF\" both 3rd byte 1.5% seed 7",
        "garble to-host for 200ms",
        "duplicate to-host always",
        "delay 50ms to-host after @0A then 2nd answered while x > 5",
        "insert \"0 \\r\" to-host after x > 1000",
        "split 2ms to-host",
        "merge 16ms to-host always",
        "parity marked to-host",
        "framing dropped to-controller",
        "cut",
        "break 250ms",
        "speed 9600",
        "switch x- late 30",
        "switch x swapped",
        "backlash x 12",
        "load x 50",
        "jam x for 1s",
        "push x -40 after at 2s",
        "hold overtemperature",
        "bounce limit x- 5 2ms",
        "power-off while x > 5",
        "end all",
    ];
    let each = |number: u8| FORMS.map(|form| [&[number], form.as_bytes()].concat());
    (0..NAMES.len()).flat_map(|number| each(number as u8)).collect()
}

/// Every form there is, with every model's signals.
pub(super) fn texts() -> Vec<Vec<u8>> {
    const FORMS: &str = "x < 5 and x <= 5 and x = -5 and x >= 5 and x > 5 and axis1 5 or \
        outside x -5..5 y 0.. axis2 ..7 and (idle or at 1.5s or at 250ms) or always and never or \
        port 0 bit 3 on and port 65531 bit 0 off or limit x+ and limit axis1- off or command and \
        command @A and answered \"@0A 5,\\\"\\u{1b}\" or answer 0 and answer error or answer \
        error E06 and line or line 12 or signal 3 changes";
    let forms = |(number, (_, signals)): (usize, &(Names, Vec<Signal>))| {
        let mut text = FORMS.to_owned();
        for Signal { name, .. } in signals {
            text += &format!(" or signal {name} is 1 and signal {name} changes to 0");
        }
        [&[number as u8], text.as_bytes()].concat()
    };
    NAMES.iter().enumerate().map(forms).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_is_read() {
        for text in texts() {
            let (names, _) = &NAMES[usize::from(text[0])];
            names.read(std::str::from_utf8(&text[1..]).unwrap()).unwrap();
        }
    }

    #[test]
    fn every_fault_is_read_by_a_model() {
        let reads =
            |(names, _): &(Names, Vec<Signal>), text: &str| names.read_faulting(text).is_ok();
        for text in faults() {
            let text = std::str::from_utf8(&text[1..]).unwrap();
            assert!(NAMES.iter().any(|names| reads(names, text)), "{text}");
        }
    }
}
