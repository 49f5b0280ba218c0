//! Faults of the machine as people type them.

use std::time::Duration;

use super::words::{FaultError, Span, Words};
use super::{Mishap, SwitchSays};
use crate::{Names, SignalId};

/// The kinds of faults of the machine, as they are typed, and what each does.
pub(super) const KINDS: [(&str, &str); 8] = [
    (
        "switch",
        "a limit switch fails: `switch x- pressed|released|missing`, `switch x- late 30`, `switch x swapped`",
    ),
    ("backlash", "an axis has play, in steps, as in `backlash x 12`"),
    ("load", "an axis has more to pull, in Hz/ms, as in `load z 50`"),
    ("jam", "the motor of an axis cannot turn, as in `jam x`"),
    ("push", "a carriage is moved by hand, as in `push x -40`"),
    (
        "hold",
        "a signal has a value, whatever it is set to, as in `hold overtemperature` or `hold power-ok 0`",
    ),
    ("bounce", "a contact goes back so many times, so long apart, as in `bounce limit x- 5 2ms`"),
    ("power-off", "the mains are off"),
];

impl Names {
    /// What goes wrong with the machine after the word for its kind; `None` if that is no such word.
    pub(super) fn mishap(
        &self,
        kind: &str,
        words: &mut Words<'_>,
    ) -> Option<Result<Mishap, FaultError>> {
        Some(match kind {
            "switch" => self.switch(words),
            "backlash" => self
                .axis_and(words, "steps, as in `backlash x 12`")
                .map(|(axis, steps)| Mishap::Backlash { axis, steps }),
            "load" => self
                .axis_and(words, "an acceleration in Hz/ms, as in `load z 50`")
                .map(|(axis, pull)| Mishap::Load { axis, pull }),
            "jam" => self.an_axis(words).map(Mishap::Jam),
            "push" => self
                .axis_and(words, "steps of the machine, as in `push x -40`")
                .map(|(axis, steps)| Mishap::Push { axis, steps }),
            "brown-out" => match self.signals().iter().find(|signal| signal.name == "power-ok") {
                Some(signal) => Ok(Mishap::Hold { signal: signal.id, value: 0 }),
                None => Err(words.wrong("another kind: nothing here tells of the motor supply")),
            },
            "hold" => self.hold(words),
            "bounce" => self.bounce(words),
            "power-off" => Ok(Mishap::Power),
            _ => return None,
        })
    }

    fn hold(&self, words: &mut Words<'_>) -> Result<Mishap, FaultError> {
        let signal = self.a_signal(words)?;
        let value = match self.signal_named(signal) {
            Some(known) => {
                let value = known.value_of(words.peek());
                if value.is_none() && words.peek().parse::<i64>().is_ok() {
                    return Err(words.wrong(known.values_in_words()));
                }
                value
            }
            None => words.peek().parse().ok(),
        };
        if value.is_some() {
            words.word();
        }
        Ok(Mishap::Hold { signal, value: value.unwrap_or(1) })
    }

    fn switch(&self, words: &mut Words<'_>) -> Result<Mishap, FaultError> {
        let right = "a limit switch or an axis, as in `switch x- pressed` or `switch x swapped`";
        let here = words.rest;
        let word = words.word().unwrap_or_default();
        if let Some(axis) = self.axis(word) {
            return match words.take_if("swapped") {
                true => Ok(Mishap::Swapped(axis)),
                false => Err(words.wrong("swapped, or a + or - behind the axis")),
            };
        }
        let (axis, positive) = match (word.strip_suffix('+'), word.strip_suffix('-')) {
            (Some(axis), _) => (axis, true),
            (_, Some(axis)) => (axis, false),
            _ => (word, false),
        };
        let axis = self.axis(axis).filter(|_| word.ends_with(['+', '-']));
        let Some(axis) = axis else { return Err(words.wrong_at(here, right)) };
        let says = if words.take_if("pressed") || words.take_if("closed") {
            SwitchSays::Pressed
        } else if words.take_if("released") || words.take_if("open") {
            SwitchSays::Released
        } else if words.take_if("missing") {
            SwitchSays::Nothing
        } else if words.take_if("late") {
            SwitchSays::Late(words.parsed("steps, as in `switch x- late 30`")?)
        } else {
            return Err(words.wrong("pressed, released, missing or late"));
        };
        Ok(Mishap::Switch { axis, positive, says })
    }

    fn bounce(&self, words: &mut Words<'_>) -> Result<Mishap, FaultError> {
        let signal = self.a_signal(words)?;
        let here = words.rest;
        let right = "how many times, up to 255, and how long apart, as in `bounce limit x- 5 2ms`";
        let times = words.take_parsed().filter(|times| *times > 0);
        let Some(times) = times else { return Err(words.wrong_at(here, right)) };
        let period = words.time("bounce limit x- 5 2ms")?;
        if period == Duration::ZERO {
            return Err(words.wrong_at(here, "a time apart, as in `bounce limit x- 5 2ms`"));
        }
        Ok(Mishap::Bounce { signal, times, period })
    }

    fn an_axis(&self, words: &mut Words<'_>) -> Result<u8, FaultError> {
        match self.axis(words.peek()) {
            Some(axis) => {
                words.word();
                Ok(axis)
            }
            None => Err(words.wrong(match self.shown_axes().as_slice() {
                [] => "an axis".to_owned(),
                axes => format!("an axis: {}", axes.join(", ")),
            })),
        }
    }

    fn axis_and<T: std::str::FromStr>(
        &self,
        words: &mut Words<'_>,
        right: &str,
    ) -> Result<(u8, T), FaultError> {
        Ok((self.an_axis(words)?, words.parsed(right)?))
    }

    fn a_signal(&self, words: &mut Words<'_>) -> Result<SignalId, FaultError> {
        if let Some(signal) = self.signal_at(words.rest) {
            let rest = words.rest.get(signal.name.len()..).unwrap_or_default();
            words.rest = rest.trim_start();
            return Ok(signal.id);
        }
        let number = words.take_parsed().map(SignalId);
        number.ok_or_else(|| words.wrong("the name of a signal, as in `hold estop`"))
    }

    /// Writes what goes wrong so that it is read as the same.
    pub(super) fn write_mishap(&self, mishap: &Mishap) -> String {
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
