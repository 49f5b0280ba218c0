//! When counters change, while nothing but time passes.

use vimc4_catalogue::Controller;
use vimc4_device::{AXES, Device, Fact, Point, Time};

/// The axes in question, X in bit 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Axes(u32);

impl Axes {
    pub(crate) const ALL: Axes = Axes(u32::MAX);

    pub(crate) fn only(axis: usize) -> Axes {
        Axes(1 << (axis & 31))
    }

    /// Whether any of them has moved.
    pub(crate) fn differ(self, one: &Point, other: &Point) -> bool {
        (0..AXES).any(|axis| self.0 >> axis & 1 == 1 && one[axis] != other[axis])
    }
}

/// The first instant after `from` and before `until` at which one of these counters changes.
pub(crate) fn first_step(device: &Controller, axes: Axes, from: Time, until: Time) -> Option<Time> {
    let begin = from.max(device.now());
    let here = device.position(begin);
    device.running()?;
    let mut first: Option<Time> = None;
    for axis in (0..AXES).filter(|axis| axes.0 >> axis & 1 == 1) {
        let place = here[axis];
        let beyond = [(i64::MIN, place.checked_sub(1)), (place + 1, Some(i64::MAX))];
        for (low, high) in beyond {
            let Some(high) = high else { continue };
            let at = device.first_time(&Fact::Axis { axis: axis as u8, low, high }, begin);
            first = first.into_iter().chain(at).min();
        }
    }
    first.filter(|at| *at > from && *at < until)
}

/// The last instant after the device's present and before `until` at which one of these counters
/// begins to read what it reads then.
pub(crate) fn last_step(device: &Controller, axes: Axes, until: Time) -> Option<Time> {
    let begin = device.now();
    let end = Time::from_nanos(until.as_nanos().checked_sub(1)?);
    device.running()?;
    if end <= begin {
        return None;
    }
    let place = device.position(end);
    let differs = |at: Time| axes.differ(&device.position(at), &place);
    // No axis makes more than one step in a step of the clock. So, going back by twice as much each
    // time, the search cannot miss a change.
    let mut same = end;
    let mut span = 1_u64;
    let mut before = loop {
        let at = Time::from_nanos(end.as_nanos().saturating_sub(span)).max(begin);
        if differs(at) {
            break at;
        }
        if at == begin {
            return None;
        }
        same = at;
        span = span.saturating_mul(2);
    };
    while same.nanos_since(before) > 1 {
        let middle = before.after_nanos(same.nanos_since(before) / 2);
        if differs(middle) {
            before = middle;
        } else {
            same = middle;
        }
    }
    Some(same)
}
