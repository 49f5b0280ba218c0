//! What a device does and has, for people.

use crate::{Activity, AxisView, FaultView, Names, RuleId, RuleView};

/// Where axes are, as people read it: `X 2500 Y 0`. If the controller rests for a reason, also why, and
/// the axes whose counters do not tell where they are: `X 2500 Y 0, limit error; X needs a reference run`.
#[must_use]
pub fn position_in_words(axes: &[AxisView], activity: Activity) -> String {
    let places: Vec<_> =
        axes.iter().map(|axis| format!("{} {}", axis.name, axis.position)).collect();
    let places = places.join(" ");
    let lost = axes.iter().filter(|axis| axis.is_lost()).map(|axis| axis.name.as_str());
    let lost: Vec<&str> = lost.collect();
    match (activity.is_held_up(), lost.as_slice()) {
        (false, _) => places,
        (true, []) => format!("{places}, {activity}"),
        (true, [axis]) => format!("{places}, {activity}; {axis} needs a reference run"),
        (true, axes) => format!("{places}, {activity}; {} need a reference run", axes.join(", ")),
    }
}

/// The faults that a device has, a line each, as people read them: number, stage, how often it has
/// struck, and what it is.
#[must_use]
pub fn faults_in_words(faults: &[FaultView], names: &Names) -> String {
    let line = |view: &FaultView| {
        let FaultView { number, fault, stage, struck } = view;
        let struck = match struck {
            1 => "struck once".to_owned(),
            times => format!("struck {times} times"),
        };
        let stage = format!("{stage}, {struck}");
        format!("{number:<3} {stage:<26}  {}", names.write_fault(fault))
    };
    match faults {
        [] => "nothing is wrong".to_owned(),
        faults => faults.iter().map(line).collect::<Vec<_>>().join("\n"),
    }
}

/// The rules that a device has, a line each, as people read them: number, stage, how often it has
/// acted, and what it is.
#[must_use]
pub fn rules_in_words(rules: &[RuleView], names: &Names) -> String {
    let line = |view: &RuleView| {
        let RuleView { id, rule, stage, acted } = view;
        let acted = match acted {
            1 => "acted once".to_owned(),
            times => format!("acted {times} times"),
        };
        let number = RuleId { name: None, ..id.clone() }.to_string();
        let stage = format!("{stage}, {acted}");
        format!("{number:<5} {stage:<24}  {}", names.write_rule(rule))
    };
    match rules {
        [] => "there are no rules".to_owned(),
        rules => rules.iter().map(line).collect::<Vec<_>>().join("\n"),
    }
}
