//! Rules as text.

use std::fmt::{self, Write};

use super::{Act, Awaits, Cue, Lasts, Rule, Ruling, ScenarioNumber, Trigger};
use crate::duration::Span;
use crate::{Deed, Fault, Faulting, Names, Nth};

impl Names {
    /// Writes a rule so that it is read as the same.
    #[must_use]
    pub fn write_rule(&self, rule: &Rule) -> String {
        let Rule { name, trigger, times, acts } = rule;
        let mut text = String::new();
        // Writing to a string cannot fail.
        if name.is_some() || times.is_some() {
            let name = name.as_ref().map_or_else(String::new, |name| format!(" {name}"));
            let times = match times {
                None => String::new(),
                Some(1) => " once".to_owned(),
                Some(times) => format!(" {times} times"),
            };
            let _ = write!(text, "rule{name}{times} ");
        }
        text.push_str(&self.write_trigger(trigger));
        let _ = write!(text, ": {}", self.write_acts(acts));
        text
    }

    /// What a rule does, as it stands behind the colon.
    #[must_use]
    pub fn write_acts(&self, acts: &[Act]) -> String {
        acts.iter().map(|act| self.write_act(act)).collect::<Vec<_>>().join("; ")
    }

    /// What a rule waits for, as it stands before the colon.
    #[must_use]
    pub fn write_trigger(&self, trigger: &Trigger) -> String {
        match trigger {
            Trigger::At(time) => format!("at {}", Span(*time)),
            Trigger::Every { first, span } if first == span => format!("every {}", Span(*span)),
            Trigger::Every { first, span } => {
                format!("at {} every {}", Span(*first), Span(*span))
            }
            Trigger::When(cues) => {
                let cues: Vec<String> = cues.iter().map(|cue| self.write_cue(cue)).collect();
                format!("when {}", cues.join(" then "))
            }
            Trigger::While(condition) => format!("while {}", self.write(condition)),
        }
    }

    fn write_cue(&self, cue: &Cue) -> String {
        let nth = match cue.times {
            0 | 1 => String::new(),
            times => format!("{} ", Nth(times.into())),
        };
        match &cue.awaits {
            Awaits::Condition(condition) => format!("{nth}{}", self.write(condition)),
            Awaits::Rule(name) => format!("{nth}rule {name}"),
            Awaits::Time(span) => Span(*span).to_string(),
        }
    }

    fn write_act(&self, act: &Act) -> String {
        let deed = self.write_deed(&act.deed);
        match (&act.lasts, &act.deed) {
            (None, _) => deed,
            // A fault says itself how long.
            (Some(Lasts::For(span)), Deed::Fault(faulting)) => {
                let mut faulting = (**faulting).clone();
                if let Faulting::Begin(_, fault) = &mut faulting {
                    match fault {
                        Fault::Line(fault) => fault.when.lasts = Some(*span),
                        Fault::Machine(fault) => fault.when.lasts = Some(*span),
                    }
                }
                self.write_deed(&Deed::Fault(faulting.into()))
            }
            (Some(Lasts::For(span)), _) => format!("{deed} for {}", Span(*span)),
            (Some(Lasts::Until(condition)), _) => format!("{deed} until {}", self.write(condition)),
        }
    }

    /// Writes a deed so that it is ordered by the same words.
    #[must_use]
    pub fn write_deed(&self, deed: &Deed) -> String {
        match deed {
            Deed::Fault(faulting) => format!("fault {}", self.write_faulting(faulting)),
            deed => deed.to_string(),
        }
    }

    /// Writes what is done about scenarios so that it is read as the same.
    #[must_use]
    pub fn write_ruling(&self, ruling: &Ruling) -> String {
        match ruling {
            Ruling::Begin(number, scenario) => {
                let mut rules: Vec<String> =
                    scenario.rules.iter().map(|rule| self.write_rule(rule)).collect();
                let single = rules.len() == 1;
                match (*number, single) {
                    (ScenarioNumber::NEXT, true) => {}
                    (number, true) => rules = vec![format!("{number} {}", rules.concat())],
                    (number, false) => rules.insert(0, number.to_string()),
                }
                rules.join("\n")
            }
            Ruling::End(number) => format!("end {number}"),
            Ruling::EndAll => "end all".to_owned(),
        }
    }
}

/// With numbers for signals; [`Names::write_rule`] has their names.
impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&Names::numbered().write_rule(self))
    }
}

/// With numbers for signals; [`Names::write_ruling`] has their names.
impl fmt::Display for Ruling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&Names::numbered().write_ruling(self))
    }
}
