//! The orders that a device takes, for people.

use vimc4_device::{Names, Signal, SignalKind, Vocabulary};

use crate::fault::kinds;
use crate::panel::{button_names, input_example};
use crate::verb::{Verb, row};

/// The orders that the device takes, one line each; orders for what it does not have are left
/// out.
#[must_use]
pub fn help(names: &Names) -> String {
    let mut lines = Vec::new();
    for verb in Verb::all().filter(|verb| verb.is_of(names)) {
        if verb == Verb::Turn {
            for switch in names.signals() {
                if let Some([first, second]) = &switch.positions {
                    let order = format!("{} {first}|{second}", switch.name);
                    lines.push(row(&order, &format!("the {}", switch.about)));
                }
            }
            continue;
        }
        for form in verb.forms() {
            let about = remark(verb, names).map(|remark| format!("{}{remark}", form.about));
            lines.push(row(&verb.typed(form), about.as_deref().unwrap_or(form.about)));
        }
    }
    lines.join("\n")
}

/// The full help of a verb: a line for each of its forms, and what its words stand for.
#[must_use]
pub fn help_on(verb: Verb, names: &Names) -> String {
    let forms = verb.forms().iter().map(|form| {
        let about = remark(verb, names).map(|remark| format!("{}{remark}", form.about));
        row(&verb.typed(form), about.as_deref().unwrap_or(form.about))
    });
    let mut lines: Vec<String> = forms.collect();
    if verb == Verb::Fault {
        lines.push("FAULT is one of these, and then which way and when:".to_owned());
        lines.extend(kinds().chain(FORMS_OF_FAULTS).map(|(form, about)| row(form, about)));
    }
    if verb.is_of_rules() {
        lines.push("All of these are rules:".to_owned());
        lines.extend(FORMS_OF_RULES.iter().map(|(form, about)| row(form, about)));
    }
    if verb == Verb::RunUntil {
        lines.push(
            "CONDITION is one of these, or several with `and`, `or` and brackets:".to_owned(),
        );
        lines.extend(forms_of_conditions(names).iter().map(|(form, about)| row(form, about)));
    }
    lines.join("\n")
}

/// The signals, a line each: name, values, and what it does.
#[must_use]
pub fn list_signals(names: &Names) -> String {
    let line = |signal: &Signal| {
        let values = match (&signal.kind, &signal.positions) {
            (_, Some([first, second])) => format!("{first}|{second}"),
            (SignalKind::Analogue { low, high }, _) => format!("{low}..{high}"),
            _ => "0|1".to_owned(),
        };
        format!("{:<16}  {values:<12}  {}", signal.name, signal.about)
    };
    names.signals().iter().map(line).collect::<Vec<_>>().join("\n")
}

/// The help of a verb for this device.
fn remark(verb: Verb, names: &Names) -> Option<String> {
    let latching = names.signals().iter().filter(|signal| signal.latches);
    let latching: Vec<_> = latching.map(|signal| signal.name.as_str()).collect();
    match verb {
        Verb::Press => {
            let stays = match latching.as_slice() {
                [] => String::new(),
                names => format!("; {} stays pressed until released", names.join(", ")),
            };
            Some(format!(": {}{stays}", button_names(names)))
        }
        Verb::Release if !latching.is_empty() => Some(format!(", or {}", latching.join(", "))),
        Verb::Input => input_example(names).map(|example| format!(", as in `input {example} 1`")),
        _ => None,
    }
}

/// The forms of a condition, and what each says.
fn forms_of_conditions(names: &Names) -> Vec<(String, String)> {
    let axes = names.shown_axes();
    let axis = axes.first().map_or("x", String::as_str);
    let listed = |list: Option<String>| list.map_or(String::new(), |list| format!(": {list}"));
    let known = names.vocabulary();
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

/// What follows the kind of a fault, and what it says.
const FORMS_OF_FAULTS: [(&str, &str); 6] = [
    ("to-host|to-controller", "which way, or both; `2 bytes` for several in a row"),
    ("once|3 times|always", "how often; once if nothing is said, but what is cut stays cut"),
    ("every 10th, 3rd byte", "which bytes"),
    ("5%, seed 7", "with a probability; equal seeds"),
    ("for 200ms", "for how long"),
    (
        "after CONDITION",
        "from when on, as in `after x > 1000` or `after @A then 2nd answered`; it stands last, and \
         `help run until` has the conditions",
    ),
];

/// The forms of a rule, and what each says.
const FORMS_OF_RULES: [(&str, &str); 12] = [
    ("at 2s: ORDER", "once, so long after the rule was given"),
    ("every 100ms: ORDER", "again and again; `at 2s every 100ms: ORDER` begins later"),
    (
        "when x > 1000: ORDER",
        "whenever this happens or becomes so; `help run until` has the conditions",
    ),
    ("when 2nd @0A: ORDER", "each second time"),
    ("when @0A then 5ms: ORDER", "one after the other; a time is a pause"),
    ("when rule jam: ORDER", "whenever the rule of that name acts"),
    ("while x > 1000: ORDER", "as long as this is so; what the order changes is set back then"),
    ("rule jam once when …", "a name and how often, `once` or `3 times`; both may be left out"),
    ("press stop; power off", "several orders at the same instant"),
    ("power off for 100ms", "an order that is undone after a time"),
    ("hold stop until idle", "and one that is undone when something happens or is so"),
    ("rule end 3", "what rules have changed is set back when they end; `rule end all`, `reset`"),
];
