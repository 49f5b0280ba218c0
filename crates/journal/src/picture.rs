//! The state of things, as far as the entries tell it.

use std::collections::BTreeMap;

use vimc4_device::{
    AXES, Condition, Deed, Device, Event, Fact, Facts, Motion, Point, Running, Segment, Signal,
    SignalId, Time, View,
};

use crate::{Entry, What};

/// The state of things at a moment: counters, ports and signals.
///
/// It begins with a device and follows the entries. A motion is known from its beginning to its end,
/// so where an axis is in between is computed. A counter that is set while its axis rests, by a
/// reference run or by the power, is known again at the next motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    at: Time,
    axes: [Option<i64>; AXES],
    running: Option<Course>,
    ports: BTreeMap<u16, u8>,
    signals: BTreeMap<SignalId, i32>,
    /// Whether a limit switch of an axis is active, the positive one or the other.
    limits: BTreeMap<(u8, bool), bool>,
    /// Bits of ports that are nothing but a signal.
    wired: BTreeMap<SignalId, (u16, u8)>,
}

/// Beyond any counter.
const FARTHEST: i64 = 1 << 60;

/// A motion that is under way.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Course {
    pub(crate) began: Time,
    pub(crate) origin: Point,
    pub(crate) segment: Box<Segment>,
}

impl Picture {
    /// The picture of a device as it is now.
    pub fn of<D: Device>(device: &D) -> Picture {
        let now = device.now();
        let running = device.running().map(|Running { segment, began }| {
            let (here, way) = (device.position(now), segment.offset_at(now.nanos_since(began)));
            let origin = std::array::from_fn(|axis| here[axis] - way[axis]);
            Course { began, origin, segment: Box::new(segment.clone()) }
        });
        Picture { running, ..Picture::at_rest(&device.view(now), &device.signals()) }
    }

    fn at_rest<D>(view: &View<D>, signals: &[Signal]) -> Picture {
        let mut axes = [None; AXES];
        for axis in &view.axes {
            if let Some(place) = axes.get_mut(usize::from(axis.index)) {
                *place = Some(axis.position);
            }
        }
        let inputs = signals.iter().filter(|signal| signal.terminal.is_some());
        let wired: BTreeMap<_, _> =
            inputs.filter_map(|signal| Some((signal.id, *signal.bits.first()?))).collect();
        let outputs = view.ports.iter().filter(|port| !port.input);
        let mut ports: BTreeMap<_, _> = outputs.map(|port| (port.port, port.value)).collect();
        for port in view.ports.iter().filter(|port| port.input) {
            if wired.values().any(|(wired, _)| *wired == port.port) {
                ports.entry(port.port).or_insert(port.value);
            }
        }
        let values = view.signals.iter().filter_map(|signal| Some((signal.id, signal.value?)));
        let limits = view.axes.iter().flat_map(|axis| {
            let ends = [false, true].into_iter().zip(axis.limits);
            ends.map(|(positive, active)| ((axis.index, positive), active))
        });
        let (signals, limits) = (values.collect(), limits.collect());
        Picture { at: view.at, axes, running: None, ports, signals, limits, wired }
    }

    /// The time it shows.
    #[must_use]
    pub fn at(&self) -> Time {
        self.at
    }

    /// Where the counter of an axis is, 0 for X; `None` if that is not known.
    #[must_use]
    pub fn position(&self, axis: u8) -> Option<i64> {
        self.position_at(usize::from(axis), self.at)
    }

    /// The value of a port, as far as it was written or its inputs are known.
    #[must_use]
    pub fn port(&self, port: u16) -> Option<u8> {
        self.ports.get(&port).copied()
    }

    /// The value of a signal, as far as it has one that lasts.
    #[must_use]
    pub fn signal(&self, signal: SignalId) -> Option<i32> {
        self.signals.get(&signal).copied()
    }

    /// Whether every bit of a port is known, or this one.
    pub(crate) fn knows_bit(&self, port: u16, bit: u8) -> bool {
        let inputs = || self.wired.values().filter(move |(wired, _)| *wired == port);
        self.ports.contains_key(&port)
            && (inputs().next().is_none() || inputs().any(|(_, wired)| *wired == bit))
    }

    pub(crate) fn running(&self) -> Option<&Course> {
        self.running.as_ref()
    }

    pub(crate) fn position_at(&self, axis: usize, at: Time) -> Option<i64> {
        match &self.running {
            Some(course) => Some(course.origin.get(axis)? + course.running().offset(axis, at)),
            None => *self.axes.get(axis)?,
        }
    }

    /// Something has happened.
    pub fn apply(&mut self, entry: &Entry) {
        self.at = entry.at;
        match &entry.what {
            What::Event(event) => self.follow(event),
            // The counters may be anywhere after these.
            What::Deed { deed: Deed::Restore, .. } => {
                (self.axes, self.running) = ([None; AXES], None);
                (self.ports, self.signals) = (BTreeMap::new(), BTreeMap::new());
                self.limits.clear();
            }
            What::Deed { deed: Deed::Power(_), .. } => self.axes = [None; AXES],
            What::Deed { .. } => {}
        }
    }

    /// Whether something that is done, and not an event of it, changes how things stand.
    pub(crate) fn is_set_anew_by(what: &What) -> bool {
        matches!(what, What::Deed { deed: Deed::Restore | Deed::Power(_), .. })
    }

    fn follow(&mut self, event: &Event) {
        match event {
            Event::Motion(Motion::Begins { origin, segment }) => {
                self.axes = origin.map(Some);
                let segment = segment.clone();
                self.running = Some(Course { began: self.at, origin: *origin, segment });
            }
            Event::Motion(Motion::Changes { segment }) => {
                if let Some(course) = &mut self.running {
                    course.segment.clone_from(segment);
                }
            }
            Event::Motion(Motion::Ends { steps }) => {
                if let Some(Course { origin, segment, .. }) = self.running.take() {
                    let way = segment.path.at(*steps);
                    self.axes = std::array::from_fn(|axis| Some(origin[axis] + way[axis]));
                }
            }
            Event::Port { port, value } => _ = self.ports.insert(*port, *value),
            Event::Switch { axis, positive, active } => {
                self.limits.insert((*axis, *positive), *active);
            }
            Event::Signal { signal, value } => {
                self.signals.insert(*signal, *value);
                if let Some((port, bit)) = self.wired.get(signal) {
                    let port = self.ports.entry(*port).or_default();
                    let mask = 1_u8 << (bit & 7);
                    *port = if *value == 0 { *port & !mask } else { *port | mask };
                }
            }
            _ => {}
        }
    }

    /// Whether a condition holds at an instant, with something that happens or without.
    pub(crate) fn holds(&self, condition: &Condition, now: Time, event: Option<&Event>) -> bool {
        match condition {
            Condition::All(parts) => parts.iter().all(|part| self.holds(part, now, event)),
            Condition::Any(parts) => parts.iter().any(|part| self.holds(part, now, event)),
            happening if happening.has_happenings() => {
                event.is_some_and(|event| happening.is_seen_in(event))
            }
            state => state.begins(&self.from(now), now) == Some(now),
        }
    }

    /// The span that begins at `now`, in which nothing happens but motions going on.
    pub(crate) fn from(&self, now: Time) -> Span<'_> {
        Span { picture: self, now }
    }
}

impl Course {
    fn running(&self) -> Running<'_> {
        Running { segment: &self.segment, began: self.began }
    }
}

/// See [`Picture::from`].
pub(crate) struct Span<'a> {
    picture: &'a Picture,
    now: Time,
}

impl Facts for Span<'_> {
    fn now(&self) -> Time {
        self.now
    }

    fn wake(&self) -> Option<Time> {
        None
    }

    fn is_idle(&self) -> bool {
        false
    }

    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time> {
        let Picture { axes, running, ports, signals, limits, .. } = self.picture;
        let is_so = match *fact {
            Fact::Axis { axis, low, high } => {
                let axis = usize::from(axis);
                let Some(course) = running else {
                    let is_there = |place: &i64| (low..=high).contains(place);
                    return axes.get(axis)?.filter(is_there).map(|_| from);
                };
                let origin = *course.origin.get(axis)?;
                let within = |offset: i64| (low..=high).contains(&(origin + offset));
                // No motion leads further, and sums cannot overflow.
                let ends = [low, high].map(|end| end.clamp(-FARTHEST, FARTHEST) - origin);
                return course.running().first_time(axis, from, within, ends);
            }
            Fact::PortBit { port, bit, level } => {
                ports.get(&port).is_some_and(|value| (value >> (bit & 7) & 1 == 1) == level)
            }
            Fact::Signal { signal, value } => signals.get(&signal) == Some(&value),
            Fact::Limit { axis, positive, active } => {
                limits.get(&(axis, positive)) == Some(&active)
            }
        };
        is_so.then_some(from)
    }

    fn comes_round(&self, from: Time) -> Option<Time> {
        match &self.picture.running {
            Some(course) => course.running().comes_round(from),
            None => Some(from),
        }
    }
}
