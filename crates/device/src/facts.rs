//! When conditions hold, computed from facts that can be forecast.

use crate::{Condition, Fact, Time};

/// A span of time with at most one running motion, for which it can be computed when facts hold: a
/// [device](crate::Device) until its next cause, or a recorded stretch.
pub trait Facts {
    /// The beginning of the span.
    fn now(&self) -> Time;

    /// Its end, which is not part of it; `None` if there is none.
    fn wake(&self) -> Option<Time>;

    /// Whether the device is idle at its beginning.
    fn is_idle(&self) -> bool;

    /// The first instant from `from` on at which a fact holds; instants beyond the end are ignored.
    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time>;

    /// The instant by which the facts have taken every combination of values that they will take
    /// from `from` on; `None` if that is at the end.
    fn comes_round(&self, from: Time) -> Option<Time> {
        let _ = from;
        None
    }
}

impl Condition {
    /// The first instant from `from`, which is in the span, at which this holds by states alone. A
    /// happening holds at no instant.
    pub fn begins(&self, facts: &(impl Facts + ?Sized), from: Time) -> Option<Time> {
        first(facts, self, from)
    }

    /// The first instant from `from`, which is in the span, at which this does not hold by states
    /// alone.
    pub fn ends(&self, facts: &(impl Facts + ?Sized), from: Time) -> Option<Time> {
        lapse(facts, self, from)
    }
}

/// The rest of a span, from an instant of it on.
struct Ahead<'f, F: ?Sized> {
    facts: &'f F,
    from: Time,
    wake: Option<Time>,
}

impl<F: Facts + ?Sized> Ahead<'_, F> {
    fn contains(&self, at: &Time) -> bool {
        *at == self.from || self.wake.is_none_or(|wake| *at < wake)
    }

    /// The first instant at which a fact holds.
    fn fact(&self, fact: Fact) -> Option<Time> {
        self.facts.first_time(&fact, self.from).filter(|at| self.contains(at))
    }

    fn axis(&self, axis: u8, low: i64, high: i64) -> Option<Time> {
        self.fact(Fact::Axis { axis, low, high })
    }

    fn below(&self, axis: u8, position: i64) -> Option<Time> {
        self.axis(axis, i64::MIN, position.checked_sub(1)?)
    }

    fn above(&self, axis: u8, position: i64) -> Option<Time> {
        self.axis(axis, position.checked_add(1)?, i64::MAX)
    }
}

/// The first instant from `from`, which is in the span up to the wake-up time, at which a condition
/// holds by states alone.
pub(crate) fn first<F: Facts + ?Sized>(
    facts: &F,
    condition: &Condition,
    from: Time,
) -> Option<Time> {
    let ahead = Ahead { facts, from, wake: facts.wake() };
    match *condition {
        Condition::AxisAt { axis, position } => ahead.axis(axis, position, position),
        Condition::AxisBelow { axis, position } => ahead.below(axis, position),
        Condition::AxisAbove { axis, position } => ahead.above(axis, position),
        Condition::Outside { ref low, ref high } => (0..)
            .zip(low.iter().zip(high))
            .flat_map(|(axis, (low, high))| [ahead.below(axis, *low), ahead.above(axis, *high)])
            .flatten()
            .min(),
        Condition::PortBit { port, bit, level } => ahead.fact(Fact::PortBit { port, bit, level }),
        Condition::Limit { axis, positive, active } => {
            ahead.fact(Fact::Limit { axis, positive, active })
        }
        Condition::SignalIs { signal, value } => ahead.fact(Fact::Signal { signal, value }),
        // Something may be due right now.
        Condition::Idle => {
            (facts.is_idle() && ahead.wake.is_none_or(|wake| wake > facts.now())).then_some(from)
        }
        Condition::At(time) => Some(time.max(from)).filter(|at| ahead.contains(at)),
        Condition::All(ref parts) => first_of_all(facts, parts, from),
        Condition::Any(ref parts) => parts.iter().filter_map(|part| first(facts, part, from)).min(),
        Condition::Command { .. }
        | Condition::Answered { .. }
        | Condition::Answer { .. }
        | Condition::Error { .. }
        | Condition::Line { .. }
        | Condition::SignalChanges { .. } => None,
    }
}

/// The first instant at which all parts hold. No part holds before its own first instant, so the
/// search can continue from the latest of these: from one beginning of a span in which a part holds
/// to the next, and never from step to step.
fn first_of_all<F: Facts + ?Sized>(facts: &F, parts: &[Condition], from: Time) -> Option<Time> {
    first_of_latest(facts, parts, from, |mut latest| {
        for part in parts {
            latest = first(facts, part, latest)?;
        }
        Some(latest)
    })
}

/// The first instant from `from`, which is in the span up to the wake-up time, at which a condition
/// does not hold by states alone.
pub(crate) fn lapse<F: Facts + ?Sized>(
    facts: &F,
    condition: &Condition,
    from: Time,
) -> Option<Time> {
    let ahead = Ahead { facts, from, wake: facts.wake() };
    let is_combined = matches!(condition, Condition::All(_) | Condition::Any(_));
    if !is_combined && first(facts, condition, from) != Some(from) {
        return Some(from);
    }
    match *condition {
        Condition::AxisAt { axis, position } => {
            [ahead.below(axis, position), ahead.above(axis, position)].into_iter().flatten().min()
        }
        Condition::AxisBelow { axis, position } => ahead.above(axis, position.saturating_sub(1)),
        Condition::AxisAbove { axis, position } => ahead.below(axis, position.saturating_add(1)),
        Condition::Outside { ref low, ref high } => {
            first_of_latest(facts, &[], from, |mut latest| {
                for (axis, (low, high)) in (0..).zip(low.iter().zip(high)) {
                    let (low, high) = (*low, *high);
                    let anywhere = Fact::Axis { axis, low: i64::MIN, high: i64::MAX };
                    let is_there = facts.first_time(&anywhere, latest).is_some();
                    if is_there && (low, high) != (i64::MIN, i64::MAX) {
                        let inside = facts.first_time(&Fact::Axis { axis, low, high }, latest);
                        latest = inside.filter(|at| ahead.contains(at))?;
                    }
                }
                Some(latest)
            })
        }
        Condition::PortBit { port, bit, level } => {
            ahead.fact(Fact::PortBit { port, bit, level: !level })
        }
        Condition::Limit { axis, positive, active } => {
            ahead.fact(Fact::Limit { axis, positive, active: !active })
        }
        Condition::All(ref parts) => parts.iter().filter_map(|part| lapse(facts, part, from)).min(),
        Condition::Any(ref parts) => first_of_latest(facts, parts, from, |mut latest| {
            for part in parts {
                latest = lapse(facts, part, latest)?;
            }
            Some(latest)
        }),
        // What no motion changes stays the same for the whole span.
        _ => None,
    }
}

/// The instant at which the latest of several leads to itself: all parts hold there. After all
/// times named in `parts`, and a full round of the device, nothing new can be found.
fn first_of_latest<F: Facts + ?Sized>(
    facts: &F,
    parts: &[Condition],
    mut from: Time,
    mut latest: impl FnMut(Time) -> Option<Time>,
) -> Option<Time> {
    let mut round = None;
    loop {
        let next = latest(from)?;
        if next == from {
            return Some(from);
        }
        let named = || parts.iter().filter_map(Condition::latest_time).fold(next, Time::max);
        let round = round.get_or_insert_with(|| facts.comes_round(named()));
        if round.is_some_and(|round| next > round) {
            return None;
        }
        from = next;
    }
}
