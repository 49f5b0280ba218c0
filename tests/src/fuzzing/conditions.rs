//! Conditions, faults and rules as people type them, and scenarios as files have them.

use std::sync::LazyLock;

use vimc4_catalogue::{Family, Model, bare, machine};
use vimc4_device::{
    Awaits, Condition, Device, Faulting, Names, Rule, Ruling, Scenario, ScenarioNumber, Signal,
    Trigger,
};
use vimc4_language::{read_condition, read_faulting, read_ruling};

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
    let condition = match read_condition(&String::from_utf8_lossy(text), names) {
        Ok(condition) => condition,
        Err(error) => return assert!(!error.expected.is_empty(), "{error}"),
    };
    let written = names.write(&condition).to_string();
    assert_eq!(read_condition(&written, names).as_ref(), Ok(&condition), "{written}");
    let numbered = condition.to_string();
    assert_eq!(read_condition(&numbered, Names::numbered()).as_ref(), Ok(&condition), "{numbered}");
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
    let faulting = match read_faulting(&String::from_utf8_lossy(text), names) {
        Ok(faulting) => faulting,
        Err(error) => return assert!(!error.expected.is_empty(), "{error}"),
    };
    let written = names.write_faulting(&faulting);
    assert_eq!(read_faulting(&written, names).as_ref(), Ok(&faulting), "{written}");
    let numbered = faulting.to_string();
    assert_eq!(read_faulting(&numbered, Names::numbered()).as_ref(), Ok(&faulting), "{numbered}");
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

/// A text is refused with what would be right, or it is a rule or a file of rules that is written as what
/// is read as the same.
///
/// # Panics
///
/// If something does not hold.
pub fn scenario(data: &[u8]) {
    let [which, text @ ..] = data else { return };
    let (names, _) = &NAMES[usize::from(*which) % NAMES.len()];
    let text = String::from_utf8_lossy(text);
    let same = |ruling: Ruling| {
        // TOML has no greater numbers.
        let fits = |rule: &Rule| rule.times.is_none_or(|times| i64::try_from(times).is_ok());
        if let Ruling::Begin(_, scenario) = &ruling
            && scenario.rules.iter().all(fits)
        {
            let file = file(names, scenario);
            let read = vimc4_catalogue::scenario(&file, names);
            assert_eq!(read.is_ok(), fits_a_file(scenario), "{file}{read:?}");
            read.into_iter().for_each(|read| assert_eq!(&read, scenario, "{file}"));
        }
        let written = names.write_ruling(&ruling);
        assert_eq!(read_ruling(&written, names).as_ref(), Ok(&ruling), "{written}");
        let kept = serde_json::to_string(&ruling).unwrap_or_default();
        assert_eq!(serde_json::from_str::<Ruling>(&kept).ok(), Some(ruling), "{kept}");
    };
    match read_ruling(&text, names) {
        Ok(ruling) => same(ruling),
        Err(error) => {
            assert!(!error.expected.is_empty() && text.get(error.span.clone()).is_some(), "{error}")
        }
    }
    match vimc4_catalogue::scenario(&text, names) {
        Ok(scenario) => same(Ruling::Begin(ScenarioNumber(1), scenario)),
        Err(error) => {
            let inside = |span: &std::ops::Range<usize>| text.get(span.clone()).is_some();
            assert!(error.span.as_ref().is_none_or(inside), "{error:?}");
        }
    }
}

/// Whether a file may have these rules: orders may name a rule that comes later, or has come before, but
/// a file has all of them, each by a name of its own, and each can act.
fn fits_a_file(scenario: &Scenario) -> bool {
    let rules = &scenario.rules;
    let count =
        |name: &String| rules.iter().filter(|rule| rule.name.as_ref() == Some(name)).count();
    let unique = |rule: &Rule| rule.name.as_ref().is_none_or(|name| count(name) == 1);
    let awaited = |rule: &Rule| match &rule.trigger {
        Trigger::When(cues) => cues.iter().map(|cue| cue.awaits.clone()).collect(),
        _ => Vec::new(),
    };
    // Who waits for nobody that is left acts, and is left no longer.
    let mut left: Vec<&Rule> = rules.iter().collect();
    let mut before = usize::MAX;
    while left.len() < before {
        before = left.len();
        let waits = |awaits: &Awaits| match awaits {
            Awaits::Rule(name) => {
                let is_left = left.iter().any(|rule| rule.name.as_ref() == Some(name));
                is_left || count(name) == 0
            }
            _ => false,
        };
        let waiting = |rule: &&Rule| awaited(rule).iter().any(waits);
        left = left.iter().copied().filter(waiting).collect();
    }
    rules.len() <= 1_000 && rules.iter().all(unique) && left.is_empty()
}

/// A scenario as a file has it, each rule in its parts.
fn file(names: &Names, scenario: &Scenario) -> String {
    let mut rules = Vec::new();
    for rule in &scenario.rules {
        let (trigger, acts) = (names.write_trigger(&rule.trigger), names.write_acts(&rule.acts));
        let mut table = toml::Table::new();
        let mut has = |key: &str, value: &str| table.insert(key.to_owned(), value.into());
        match (&rule.trigger, trigger.split_once(" every ")) {
            (Trigger::Every { .. }, Some((first, span))) => {
                has("at", first.trim_start_matches("at "));
                has("every", span);
            }
            _ => {
                let (word, rest) = trigger.split_once(' ').unwrap_or((&trigger, ""));
                has(word, rest);
            }
        }
        has("do", &acts);
        rule.name.iter().for_each(|name| drop(has("name", name)));
        let times = rule.times.and_then(|times| i64::try_from(times).ok());
        times.map(|times| table.insert("times".to_owned(), times.into()));
        rules.push(table);
    }
    toml::Table::from_iter([("rule".to_owned(), rules.into())]).to_string()
}

/// Every form of a rule, in each model's names.
pub(super) fn scenarios() -> Vec<Vec<u8>> {
    const FORMS: [&str; 12] = [
        "when x > 1000: press stop",
        "7 rule jam 3 times when 2nd @0A then 5ms then rule b: fault jam x; power off for 100ms",
        "1\nat 2s: power off until idle\nat 1s every 20ms: fault drop to-host 5% until answered",
        "while x > 5 and y < 3: fault cut",
        "every 100ms: fault insert \"; x\" to-host after command \"a: b\"",
        "end 3",
        "end all",
        "[[rule]]\nwhen = \"x > 5\"\ntimes = 1\ndo = \"power off for 1s; fault end all\"",
        "[[rule]]\nname = \"a\"\nat = '2s'\nevery = \"20ms\"\ndo = \"power on\"",
        "[[rule]]\nwhile = \"\"\"x > far\"\"\"\ndo = \"power off\"",
        "[[rule]]\nat = \"1s\"\nwhen = \"idle\"\ndo = \"power\"",
        "[[rule]]\nwhen = \"\\u0078 > 5\"\ndo = \"dance\"",
    ];
    let each = |number: u8| FORMS.map(|form| [&[number], form.as_bytes()].concat());
    (0..NAMES.len()).flat_map(|number| each(number as u8)).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn every_form_is_read() {
        for text in texts() {
            let (names, _) = &NAMES[usize::from(text[0])];
            read_condition(std::str::from_utf8(&text[1..]).unwrap(), names).unwrap();
        }
    }

    #[test]
    fn every_fault_is_read_by_a_model() {
        let reads =
            |(names, _): &(Names, Vec<Signal>), text: &str| read_faulting(text, names).is_ok();
        for text in faults() {
            let text = std::str::from_utf8(&text[1..]).unwrap();
            assert!(NAMES.iter().any(|names| reads(names, text)), "{text}");
        }
    }

    proptest! {
        /// Random rules in words, as data and as a file are the same.
        #[test]
        fn files_say_what_orders_say(rules in prop::collection::vec(rules(), 1..5), number in 0..9_u32) {
            let (names, _) = &NAMES[0];
            let text = rules.join("\n");
            let read = read_ruling(&text, names);
            prop_assert!(read.is_ok(), "{}: {:?}", text, read);
            scenario(&[&[0], format!("{number}\n{text}").as_bytes()].concat());
        }
    }

    /// Rules as they are typed, of the first model.
    fn rules() -> impl Strategy<Value = String> {
        let pick = |words: &'static [&'static str]| prop::sample::select(words);
        let names = pick(&["", "rule a ", "rule b once ", "rule once ", "rule c-1 7 times "]);
        let conditions =
            pick(&["x > 5", "idle", "x = -3 or y < 8", "command @0A", "answer \"a: b; c\""]);
        let more = pick(&["", " then 5ms", " then rule a", " then 3rd answered then 1.5s"]);
        let trigger = (0..5_u8, conditions, more, 1..5_000_u64, 1..5_000_u64).prop_map(
            |(kind, condition, more, first, span)| match kind {
                0 => format!("at {first}us"),
                1 => format!("every {span}ms"),
                2 => format!("at {first}ms every {span}ms"),
                3 => "while x > 5 and y < 9".to_owned(),
                _ => format!("when 2nd {condition}{more}"),
            },
        );
        let act = pick(&[
            "press stop",
            "power off for 20ms",
            "hold stop until idle",
            "fault jam x for 3ms",
            "fault insert \"; \\x22\" to-host after command \"b: c\"",
            "fault end all",
        ]);
        let acts = prop::collection::vec(act, 1..4).prop_map(|acts| acts.join("; "));
        (names, trigger, acts).prop_map(|(name, trigger, acts)| format!("{name}{trigger}: {acts}"))
    }

    #[test]
    fn every_rule_and_file_is_read_by_a_model() {
        let mut wrong = Vec::new();
        for text in scenarios() {
            let (names, _) = &NAMES[usize::from(text[0]) % NAMES.len()];
            let text = std::str::from_utf8(&text[1..]).unwrap();
            let reads =
                read_ruling(text, names).is_ok() || vimc4_catalogue::scenario(text, names).is_ok();
            if !reads {
                wrong.push(text.to_owned());
            }
        }
        // Those that are wrong on purpose, whatever the model.
        wrong.sort();
        wrong.dedup();
        assert_eq!(wrong.len(), 3, "{wrong:#?}");
    }
}
