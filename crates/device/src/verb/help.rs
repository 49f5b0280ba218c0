//! The orders that a device takes, for people.

use super::table::{Verb, row};
use crate::scenario::help_on_rules;
use crate::{Names, Signal, SignalKind};

impl Names {
    /// The orders that the device takes, one line each; orders for what it does not have are left
    /// out.
    #[must_use]
    pub fn help(&self) -> String {
        let mut lines = Vec::new();
        for verb in Verb::all().filter(|verb| self.has(*verb)) {
            if verb == Verb::Turn {
                for switch in self.signals() {
                    if let Some([first, second]) = &switch.positions {
                        let order = format!("{} {first}|{second}", switch.name);
                        lines.push(row(&order, &format!("the {}", switch.about)));
                    }
                }
                continue;
            }
            for form in verb.forms() {
                let about = self.remark(verb).map(|remark| format!("{}{remark}", form.about));
                lines.push(row(&verb.typed(form), about.as_deref().unwrap_or(form.about)));
            }
        }
        lines.join("\n")
    }

    /// The full help of a verb: a line for each of its forms, and what its words stand for.
    #[must_use]
    pub fn help_on(&self, verb: Verb) -> String {
        let forms = verb.forms().iter().map(|form| {
            let about = self.remark(verb).map(|remark| format!("{}{remark}", form.about));
            row(&verb.typed(form), about.as_deref().unwrap_or(form.about))
        });
        let mut lines: Vec<String> = forms.collect();
        if verb == Verb::Fault {
            lines.push("FAULT is one of these, and then which way and when:".to_owned());
            lines.extend(Names::help_on_faults().iter().map(|(form, about)| row(form, about)));
        }
        if matches!(verb, Verb::When | Verb::While | Verb::At | Verb::Every | Verb::Rule) {
            lines.push("All of these are rules:".to_owned());
            lines.extend(help_on_rules().iter().map(|(form, about)| row(form, about)));
        }
        if verb == Verb::RunUntil {
            lines.push(
                "CONDITION is one of these, or several with `and`, `or` and brackets:".to_owned(),
            );
            lines.extend(self.help_on_conditions().iter().map(|(form, about)| row(form, about)));
        }
        lines.join("\n")
    }

    /// The signals, a line each: name, values, and what it does.
    #[must_use]
    pub fn list(&self) -> String {
        let line = |signal: &Signal| {
            let values = match (&signal.kind, &signal.positions) {
                (_, Some([first, second])) => format!("{first}|{second}"),
                (SignalKind::Analogue { low, high }, _) => format!("{low}..{high}"),
                _ => "0|1".to_owned(),
            };
            format!("{:<16}  {values:<12}  {}", signal.name, signal.about)
        };
        self.signals().iter().map(line).collect::<Vec<_>>().join("\n")
    }

    /// The help of a verb for this device.
    fn remark(&self, verb: Verb) -> Option<String> {
        let latching = self.signals().iter().filter(|signal| signal.latches);
        let latching: Vec<_> = latching.map(|signal| signal.name.as_str()).collect();
        match verb {
            Verb::Press => {
                let stays = match latching.as_slice() {
                    [] => String::new(),
                    names => format!("; {} stays pressed until released", names.join(", ")),
                };
                Some(format!(": {}{stays}", self.button_names()))
            }
            Verb::Release if !latching.is_empty() => Some(format!(", or {}", latching.join(", "))),
            Verb::Input => {
                self.input_example().map(|example| format!(", as in `input {example} 1`"))
            }
            _ => None,
        }
    }
}
