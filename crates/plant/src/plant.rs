//! The state of a machine.

use std::ops::ControlFlow;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use vimc4_device::{
    AXES, Fault, FaultNumber, Faulting, Mishap, Point, Running, Segment, SignalId, SwitchSays, Time,
};
use vimc4_motion::Pull;

use crate::faults::Faults;
use crate::machine::is_default;
use crate::slide::{Gear, Slide, Way, index};
use crate::{End, Machine, PlantSignal};

/// The buttons, switches and sensors around a machine, in their true state, not as a port shows
/// them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Panel {
    /// START is pressed.
    pub start: bool,
    /// STOP is pressed.
    pub stop: bool,
    /// ON is pressed.
    pub on: bool,
    /// The cover button is pressed.
    pub cover_button: bool,
    /// The emergency stop is pressed or still latched.
    pub emergency_stop: bool,
    /// The key switch is at automatic, not on test.
    pub automatic: bool,
    /// The cover is closed.
    pub cover_closed: bool,
    /// The power stages are too hot.
    pub overtemperature: bool,
    /// The motor supply voltage is good.
    pub power_ok: bool,
    /// The tool length probe is touched.
    pub probe: bool,
}

impl Default for Panel {
    /// Nothing pressed, key on automatic, cover closed, power good.
    fn default() -> Panel {
        Panel {
            start: false,
            stop: false,
            on: false,
            cover_button: false,
            emergency_stop: false,
            automatic: true,
            cover_closed: true,
            overtemperature: false,
            power_ok: true,
            probe: false,
        }
    }
}

/// A machine with its carriages somewhere and its panel in some state.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plant {
    machine: Arc<Machine>,
    carriage: Point,
    panel: Panel,
    /// User inputs, bit n for input n.
    inputs: u64,
    /// Limit switches held by hand, two bits an axis.
    held: u16,
    /// How much of its backlash each axis has below it.
    #[serde(default, skip_serializing_if = "is_default")]
    play: Point,
    /// Limit switches that are still pressed by their hysteresis, two bits an axis.
    #[serde(default, skip_serializing_if = "is_default")]
    kept: u16,
    /// The axes whose motors have turned upwards last, a bit an axis: new backlash is on the other side.
    /// It is always written, so that a state from before it was kept is known.
    #[serde(default)]
    upwards: u8,
    #[serde(default, skip_serializing_if = "is_default")]
    under_way: UnderWay,
    /// The clock step of the running motion with which a limit switch changes next. It is always
    /// written; a state from before it was kept has [`UNKNOWN`].
    #[serde(default = "unknown")]
    next_switch: Option<u64>,
    #[serde(default, skip_serializing_if = "is_default")]
    faults: Faults,
}

/// How carriages have followed the counters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Followed {
    /// The steps that were lost, in the direction of the counters: how much further each carriage
    /// would be.
    pub lost: Point,
    /// Whether the motor stalled.
    pub stood: [bool; AXES],
    /// The load that made it stall, if one did; a [jam](Plant::jams) is known before.
    pub because: [Option<FaultNumber>; AXES],
}

/// What a bouncing contact does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Contact {
    /// It has changed and begins to bounce, because of these faults.
    Begins(Vec<FaultNumber>),
    /// A limit switch changes.
    Limit(usize, End),
    /// A signal takes a level.
    Signal(PlantSignal, bool),
}

/// Axes whose motors cannot turn, and the faults because of which.
pub type Jams = Vec<(usize, FaultNumber)>;

/// What is known of the running motion besides its segment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct UnderWay {
    /// The number of its clock steps up to which the carriages have followed.
    walked: u64,
    /// The clock step after which the motor of an axis stalls.
    stands: [Option<u64>; AXES],
}

impl Plant {
    /// The machine as it stands at first.
    #[must_use]
    pub fn new(machine: Arc<Machine>) -> Plant {
        let carriage = std::array::from_fn(|axis| machine.axis(axis).start);
        Plant {
            machine,
            carriage,
            panel: Panel::default(),
            inputs: 0,
            held: 0,
            play: [0; AXES],
            kept: 0,
            upwards: 0,
            under_way: UnderWay::default(),
            next_switch: None,
            faults: Faults::default(),
        }
    }

    /// The same state on another machine.
    #[must_use]
    pub fn on_machine_of(&self, other: &Plant) -> Plant {
        Plant { machine: Arc::clone(&other.machine), ..self.clone() }
    }

    /// Its profile.
    #[must_use]
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// Where the carriages are, steps of the machine.
    #[must_use]
    pub fn carriage(&self) -> Point {
        self.carriage
    }

    /// The panel.
    #[must_use]
    pub fn panel(&self) -> &Panel {
        &self.panel
    }

    /// A user input by number.
    #[must_use]
    pub fn input(&self, number: u8) -> bool {
        self.inputs >> (number & 63) & 1 == 1
    }

    /// What a signal is set to.
    #[must_use]
    pub fn level(&self, signal: PlantSignal) -> bool {
        match signal {
            PlantSignal::Start => self.panel.start,
            PlantSignal::Stop => self.panel.stop,
            PlantSignal::On => self.panel.on,
            PlantSignal::CoverButton => self.panel.cover_button,
            PlantSignal::EmergencyStop => self.panel.emergency_stop,
            PlantSignal::Key => self.panel.automatic,
            PlantSignal::Cover => self.panel.cover_closed,
            PlantSignal::Overtemperature => self.panel.overtemperature,
            PlantSignal::PowerOk => self.panel.power_ok,
            PlantSignal::Probe => self.panel.probe,
            PlantSignal::Limit(axis, end) => self.is_held(axis, end),
            PlantSignal::Input(number) => self.input(number),
        }
    }

    /// Sets a signal; says whether that changed anything.
    pub fn set(&mut self, signal: PlantSignal, level: bool) -> bool {
        let place = match signal {
            PlantSignal::Start => &mut self.panel.start,
            PlantSignal::Stop => &mut self.panel.stop,
            PlantSignal::On => &mut self.panel.on,
            PlantSignal::CoverButton => &mut self.panel.cover_button,
            PlantSignal::EmergencyStop => &mut self.panel.emergency_stop,
            PlantSignal::Key => &mut self.panel.automatic,
            PlantSignal::Cover => &mut self.panel.cover_closed,
            PlantSignal::Overtemperature => &mut self.panel.overtemperature,
            PlantSignal::PowerOk => &mut self.panel.power_ok,
            PlantSignal::Probe => &mut self.panel.probe,
            PlantSignal::Limit(axis, end) => {
                let bit = 1u16 << bit(axis, end);
                let before = self.held;
                self.held = if level { before | bit } else { before & !bit };
                return self.held != before;
            }
            PlantSignal::Input(number) => {
                let bit = 1u64 << (number & 63);
                let before = self.inputs;
                self.inputs = if level { before | bit } else { before & !bit };
                return self.inputs != before;
            }
        };
        core::mem::replace(place, level) != level
    }

    /// Whether a limit switch is held active by hand.
    #[must_use]
    pub fn is_held(&self, axis: usize, end: End) -> bool {
        self.held >> bit(axis, end) & 1 == 1
    }

    // --- axes at an instant ---

    /// An axis at rest, or as it was when the running motion began.
    #[must_use]
    pub fn slide(&self, axis: usize) -> Slide {
        let value = |point: &Point| point.get(axis).copied().unwrap_or(0);
        let kept = [End::Negative, End::Positive].map(|end| self.kept >> bit(axis, end) & 1 == 1);
        Slide { place: value(&self.carriage), play: value(&self.play), kept }
    }

    /// An axis after so many clock steps of a way.
    #[must_use]
    pub fn slide_after(&self, axis: usize, way: &Way<'_>, steps: u64) -> Slide {
        let (gear, mut slide) = (self.gear(axis), self.slide(axis));
        let ends = way.rest(self.under_way.walked, steps);
        let (path, steps) = (ends.path.as_ref(), ends.steps);
        if self.under_way.stands[axis].is_none() {
            let (low, high) = match gear.is_bounded() {
                true => way.between(axis, path.extent(steps)),
                false => (0, 0),
            };
            if gear.follows(&slide, low, high) {
                slide.place += way.signs[axis] * path.at(steps)[axis];
                return slide;
            }
        }
        let sign = way.signs[axis];
        let steps = steps.min(self.makes(axis));
        let _: ControlFlow<()> = path.runs(axis, steps, &mut slide, &mut |slide, run| {
            gear.drive(slide, sign * run.way);
            ControlFlow::Continue(())
        });
        slide
    }

    /// The first step, from `from` on, after which something holds for an axis that depends on its
    /// switches and on where its carriage is between them.
    pub fn first(
        &self,
        axis: usize,
        way: &Way<'_>,
        from: u64,
        holds: impl Fn(&Slide) -> bool,
    ) -> Option<u64> {
        self.first_among(axis, way, from, &holds, self.gear(axis).edges())
    }

    /// The same for conditions that can begin to hold only at these places of the carriage.
    pub(crate) fn first_among(
        &self,
        axis: usize,
        way: &Way<'_>,
        from: u64,
        holds: &impl Fn(&Slide) -> bool,
        places: impl Iterator<Item = i64> + Clone,
    ) -> Option<u64> {
        let (gear, mut slide) = (self.gear(axis), self.slide_after(axis, way, from));
        if holds(&slide) {
            return Some(from);
        }
        let sign = way.signs[axis];
        let rest = way.path.after(from);
        let made = from.saturating_sub(self.under_way.walked);
        let steps = rest.length().min(self.makes(axis).saturating_sub(made));
        let found = rest.runs(axis, steps, &mut slide, &mut |slide, run| {
            let whole = sign * run.way;
            let ahead = places.clone().filter(|place| gear.reaches(*place)).filter_map(|place| {
                let way = gear.way_to(slide, place);
                let within = way != 0 && way.signum() == whole.signum() && way.abs() <= whole.abs();
                let mut there = *slide;
                gear.drive(&mut there, way);
                (within && there.place == place && holds(&there)).then_some(way)
            });
            if let Some(way) = ahead.min_by_key(|way| way.abs()) {
                let step = rest.after(run.from).first_at(axis, sign * way);
                return ControlFlow::Break(step.map(|step| from + run.from + step));
            }
            gear.drive(slide, whole);
            ControlFlow::Continue(())
        });
        match found {
            ControlFlow::Break(step) => step,
            ControlFlow::Continue(()) => None,
        }
    }

    /// The first instant from `from` on at which something of that kind holds while nothing else
    /// happens: on the way of the running segment, or where the axis stands.
    #[must_use]
    pub fn when_first(
        &self,
        axis: usize,
        running: Option<Running<'_>>,
        signs: &Point,
        from: Time,
        holds: impl Fn(&Slide) -> bool,
    ) -> Option<Time> {
        if axis >= AXES {
            return None;
        }
        let Some(running) = running else { return holds(&self.slide(axis)).then_some(from) };
        let way = Way { path: &running.segment.path, signs };
        let made = running.steps_at(from);
        let step = self.first(axis, &way, made, holds)?;
        let profile = &running.segment.profile;
        match step {
            _ if step == made => Some(from),
            _ if step > profile.steps() => None,
            _ => Some(running.began.after_nanos(profile.time_of(step))),
        }
    }

    /// How far the motor of an axis at rest has to go, in one direction, for its carriage to reach
    /// a place; in the direction of the carriage.
    #[must_use]
    pub fn way_to(&self, axis: usize, place: i64) -> i64 {
        self.gear(axis).way_to(&self.slide(axis), place)
    }

    // --- switches ---

    /// Whether there is a limit switch at an end, as the controller is wired to it.
    #[must_use]
    pub fn has_switch(&self, axis: usize, end: End) -> bool {
        let end = self.wired(axis, end);
        self.machine.axis(axis).switch(end).is_some()
            && self.faults.switch_says(axis, end) != Some(SwitchSays::Nothing)
    }

    /// Whether the limit switch of an end is pressed, as the controller is wired to it: by the carriage
    /// or by hand.
    #[must_use]
    pub fn pressed(&self, axis: usize, end: End, slide: &Slide) -> bool {
        let end = self.wired(axis, end);
        let says = || match self.faults.switch_says(axis, end) {
            Some(SwitchSays::Pressed) => true,
            Some(SwitchSays::Released | SwitchSays::Nothing) => false,
            Some(SwitchSays::Late(_)) | None => self.is_on(axis, end, slide),
        };
        match self.faults.is_empty() {
            true => self.is_on(axis, end, slide),
            false => says() != self.faults.is_astray(PlantSignal::Limit(axis, end)),
        }
    }

    /// Whether a limit switch is really pressed, whatever it reports.
    fn is_on(&self, axis: usize, end: End, slide: &Slide) -> bool {
        self.is_held(axis, end) || self.gear(axis).presses(end, slide)
    }

    /// The switch that is wired to where the controller expects the switch of an end.
    fn wired(&self, axis: usize, end: End) -> End {
        if !self.faults.is_empty() && self.faults.are_swapped(axis) { end.other() } else { end }
    }

    /// The electrical level of a limit switch: 1 is high.
    #[must_use]
    pub fn switch_level(&self, axis: usize, end: End, slide: &Slide) -> bool {
        self.pressed(axis, end, slide) != self.machine.switches_low_active
    }

    // --- switches on the way ---

    /// The first clock step of a way after `from` with which a limit switch changes. `active` says
    /// whether the switch of an end of an axis is active, as the controller sees it.
    #[must_use]
    pub fn switch_ahead(
        &self,
        way: &Way<'_>,
        from: u64,
        active: impl Fn(usize, End, &Slide) -> bool,
    ) -> Option<u64> {
        let (low, high) = way.path.extent(way.path.length());
        let moved = (0..AXES).filter(|axis| low[*axis] != high[*axis]);
        let with_switches = moved.filter(|axis| self.gear(*axis).edges().next().is_some());
        let changes = with_switches.filter_map(|axis| {
            let both = |slide: &Slide| ENDS.map(|end| active(axis, end, slide));
            let before = both(&self.slide_after(axis, way, from));
            self.first(axis, way, from, |slide| both(slide) != before)
        });
        changes.min()
    }

    /// The clock step of the running motion with which a limit switch changes next.
    #[must_use]
    pub fn next_switch(&self) -> Option<u64> {
        self.next_switch
    }

    /// Sets the clock step of the running motion with which a limit switch changes next.
    pub fn expect_switch(&mut self, step: Option<u64>) {
        self.next_switch = step;
    }

    /// Whether this is a state from before the next change of a limit switch was kept.
    #[must_use]
    pub fn is_without_next_switch(&self) -> bool {
        self.next_switch == UNKNOWN
    }

    /// When a limit switch changes next: on the way of the running segment, up to its end.
    #[must_use]
    pub fn switch_due(&self, running: Option<Running<'_>>) -> Option<Time> {
        let Running { segment, began } = running?;
        let step = self.next_switch.filter(|step| *step <= segment.profile.steps())?;
        Some(began.after_nanos(segment.profile.time_of(step)))
    }

    // --- motions ---

    /// A motion begins.
    pub fn sets_out(&mut self, segment: &Segment) {
        self.under_way = UnderWay::default();
        self.next_switch = None;
        self.goes_on(segment, 0);
    }

    /// A motion changes after this many of its clock steps: it brakes, or a fault has begun.
    /// Returns whether that changes how a motor follows.
    pub fn goes_on(&mut self, segment: &Segment, made: u64) -> bool {
        let before = self.under_way.stands;
        self.under_way.stands = std::array::from_fn(|axis| {
            let stood = before[axis].filter(|stands| *stands <= made);
            stood.or_else(|| self.stands(axis, segment, made))
        });
        before != self.under_way.stands
    }

    /// After how many clock steps of a segment, at least `from`, the motor of an axis stalls.
    fn stands(&self, axis: usize, segment: &Segment, from: u64) -> Option<u64> {
        if !self.faults.is_empty() && self.faults.jam(axis).is_some() {
            return Some(from);
        }
        let motor = self.machine.axis(axis).motor.as_ref()?;
        let load = motor.load.saturating_add(self.faults.load(axis));
        segment.exceeds(axis, from, &Pull { curve: &motor.pull, start: motor.start, load })
    }

    /// The machine changes after this many clock steps of a way. Returns how the carriages have followed up to
    /// now, and the [jams](Plant::jams) that have come.
    pub fn changes(
        &mut self,
        way: &Way<'_>,
        segment: &Segment,
        made: u64,
        change: impl FnOnce(&mut Plant),
    ) -> (Followed, Jams) {
        let followed = self.advance(way, made);
        change(self);
        let before = self.under_way.stands;
        self.goes_on(segment, made);
        let mut jams = self.jams(segment, made);
        jams.retain(|(axis, _)| before[*axis].is_none_or(|stands| stands > made));
        (followed, jams)
    }

    /// The jams because of which motors stand from a clock step of a motion on, though it still moves their
    /// axes: axis and fault. Where a motor stalls later because of a load only the end of the motion tells.
    #[must_use]
    pub fn jams(&self, segment: &Segment, from: u64) -> Jams {
        if self.faults.is_empty() {
            return Jams::new();
        }
        let jammed = (0..AXES).filter_map(|axis| Some((axis, self.faults.jam(axis)?)));
        let mut jams: Jams = jammed.collect();
        if !jams.is_empty() {
            let rest = segment.path.after(from);
            let (low, high) = rest.extent(rest.length());
            jams.retain(|(axis, _)| low[*axis] != high[*axis]);
        }
        jams
    }

    /// The carriages have followed the counters for this many steps of a way, which ends there.
    pub fn follow(&mut self, way: &Way<'_>, steps: u64) -> Followed {
        let followed = self.advance(way, steps);
        self.under_way = UnderWay::default();
        self.next_switch = None;
        followed
    }

    /// The same for a way that goes on, where something is about to change.
    pub fn advance(&mut self, way: &Way<'_>, steps: u64) -> Followed {
        let ends = way.rest(self.under_way.walked, steps);
        let (path, made) = (ends.path.as_ref(), ends.steps);
        let offset = path.at(made);
        let mut lost = [0; AXES];
        let mut after = [Slide::default(); AXES];
        for (axis, after) in after.iter_mut().enumerate() {
            let before = self.slide(axis);
            *after = self.slide_after(axis, way, steps);
            let gone = after.place - before.place + after.play - before.play;
            lost[axis] = offset[axis] - way.signs[axis] * gone;
        }
        for axis in (0..AXES).filter(|axis| way.signs[*axis] != 0) {
            let mut up = self.turned_upwards(axis);
            let made = made.min(self.makes(axis));
            let _: ControlFlow<()> = path.runs(axis, made, &mut up, &mut |up, run| {
                if run.way != 0 {
                    *up = way.signs[axis] * run.way > 0;
                }
                ControlFlow::Continue(())
            });
            self.upwards = self.upwards & !(1 << axis) | u8::from(up) << axis;
        }
        let stood = self.under_way.stands.map(|stands| stands.is_some_and(|at| at < steps));
        for (axis, after) in after.into_iter().enumerate() {
            self.put(axis, after);
        }
        self.under_way.walked = steps;
        let because = std::array::from_fn(|axis| {
            (stood[axis] && !self.faults.is_empty()).then(|| self.faults.stalls(axis))?
        });
        Followed { lost, stood, because }
    }

    /// Whether the motor of an axis has turned upwards last.
    fn turned_upwards(&self, axis: usize) -> bool {
        self.upwards >> axis & 1 == 1
    }

    /// Writes down how an axis stands.
    fn put(&mut self, axis: usize, slide: Slide) {
        (self.carriage[axis], self.play[axis]) = (slide.place, slide.play);
        for end in [End::Negative, End::Positive] {
            let bit = 1u16 << bit(axis, end);
            self.kept = if slide.kept[index(end)] { self.kept | bit } else { self.kept & !bit };
        }
    }

    /// How many of the steps that are still to be made the motor of an axis makes.
    fn makes(&self, axis: usize) -> u64 {
        let UnderWay { walked, stands } = &self.under_way;
        stands[axis].map_or(u64::MAX, |stands| stands.saturating_sub(*walked))
    }

    /// What an axis is built of.
    fn gear(&self, axis: usize) -> Gear {
        let profile = self.machine.axis(axis);
        let mut gear = Gear {
            backlash: i64::from(profile.backlash),
            hysteresis: [i64::from(profile.hysteresis); 2],
            lowest: profile.lowest,
            highest: profile.highest,
            switches: [profile.negative_switch, profile.positive_switch],
        };
        if !self.faults.is_empty() {
            gear.backlash += self.faults.backlash(axis);
            for end in [End::Negative, End::Positive] {
                gear.hysteresis[index(end)] += self.faults.late(axis, end);
            }
        }
        gear
    }

    // --- faults ---

    /// Why a fault cannot make a difference on this machine, for people, if it cannot.
    #[must_use]
    pub fn why_in_vain(&self, fault: &Fault) -> Option<&'static str> {
        let Fault::Machine(fault) = fault else { return None };
        match fault.mishap {
            Mishap::Load { axis, .. } if self.machine.axis(axis.into()).motor.is_none() => Some(
                "the machine profile does not say what the motor of this axis can, so no load is too \
                 much for it",
            ),
            _ => None,
        }
    }

    /// A fault begins. When it ends it gives back what it replaced: the value of a signal that it
    /// holds, or the power. The carriages must have been [advanced](Plant::advance) to the present.
    /// Returns by how much a carriage was pushed.
    pub fn begin_fault(&mut self, number: FaultNumber, mishap: Mishap, instead: i32) -> i64 {
        let mut pushed = 0;
        let instead = match mishap {
            // It bounces when it changes from its present state.
            Mishap::Bounce { signal, .. } => PlantSignal::from_id(signal)
                .is_some_and(|signal| self.contact_is(signal, |axis| self.slide(axis)))
                .into(),
            Mishap::Push { axis, steps } => {
                let axis = usize::from(axis).min(AXES - 1);
                let mut slide = self.slide(axis);
                let stood = slide.place;
                self.gear(axis).carry(&mut slide, steps.clamp(-FURTHEST, FURTHEST));
                self.put(axis, slide);
                pushed = slide.place - stood;
                instead
            }
            Mishap::Backlash { axis, steps } => {
                // The motor pushes the carriage the way it has turned last; the play is behind it.
                let axis = usize::from(axis).min(AXES - 1);
                if self.turned_upwards(axis) {
                    self.play[axis] += i64::from(steps);
                }
                instead
            }
            _ => instead,
        };
        self.faults.begin(number, mishap, instead);
        pushed
    }

    /// A fault ends. Returns what it was, and what it gives back.
    pub fn end_fault(&mut self, number: FaultNumber) -> Option<(Mishap, i32)> {
        let ended = self.faults.end(number)?;
        // With less play, at most all of it is on one side.
        for axis in 0..AXES {
            self.play[axis] = self.play[axis].min(self.gear(axis).backlash);
        }
        Some(ended)
    }

    /// Whether there is any fault.
    #[must_use]
    pub fn has_faults(&self) -> bool {
        !self.faults.is_empty()
    }

    /// What an order about faults means here: the faults that end, and then the one that begins, if
    /// it is one of the machine.
    #[must_use]
    pub fn faulting<'f>(
        &self,
        faulting: &'f Faulting,
    ) -> (Vec<FaultNumber>, Option<(FaultNumber, &'f Mishap)>) {
        match faulting {
            Faulting::Begin(number, Fault::Machine(fault)) => {
                (vec![*number], Some((*number, &fault.mishap)))
            }
            Faulting::Begin(..) => (Vec::new(), None),
            Faulting::End(number) => (vec![*number], None),
            Faulting::EndAll => (self.faults.numbers(), None),
        }
    }

    /// Whether a fault holds a signal that is being set. The new value takes effect when the fault
    /// ends.
    pub fn withholds(&mut self, signal: SignalId, value: i32) -> bool {
        !self.faults.is_empty() && self.faults.withholds(signal, value)
    }

    /// Whether a fault keeps the mains off while they are switched. The new position takes effect
    /// when the fault ends.
    pub fn withholds_power(&mut self, on: bool) -> bool {
        !self.faults.is_empty() && self.faults.withholds_power(on)
    }

    // --- contacts that bounce ---

    /// Whether any contact bounces now.
    #[must_use]
    pub fn bounces(&self) -> bool {
        !self.faults.bouncing.is_empty()
    }

    /// When the next contact bounces or begins to, if no input comes: on the way of the running
    /// segment, or where the axes stand.
    #[must_use]
    pub fn next_contact(
        &self,
        running: Option<Running<'_>>,
        signs: &Point,
        now: Time,
    ) -> Option<Time> {
        if self.faults.is_empty() {
            return None;
        }
        let bouncing = self.faults.bouncing.iter().map(|contact| contact.next);
        let changing = self.faults.bouncers().filter_map(|(signal, was)| match signal {
            PlantSignal::Limit(axis, end) => {
                let changed = |slide: &Slide| self.is_on(axis, end, slide) != was;
                self.when_first(axis, running, signs, now, changed)
            }
            signal => (self.level(signal) != was).then_some(now),
        });
        bouncing.chain(changing).min()
    }

    /// What the contact that is due now does; the axes are at their present positions.
    pub fn contact(
        &mut self,
        now: Time,
        slide: impl Fn(&Plant, usize) -> Slide,
    ) -> Option<Contact> {
        let here = |axis| slide(self, axis);
        let bouncers: Vec<(PlantSignal, bool)> = self.faults.bouncers().collect();
        let changed = bouncers.into_iter().find_map(|(signal, was)| {
            let is = self.contact_is(signal, here);
            (is != was).then_some((signal, is))
        });
        if let Some((signal, is)) = changed {
            return Some(Contact::Begins(self.faults.contact(signal, is, now)));
        }
        Some(match self.faults.bounce(now)? {
            PlantSignal::Limit(axis, end) => Contact::Limit(axis, end),
            signal => Contact::Signal(signal, !self.level(signal)),
        })
    }

    /// A signal was set by its bouncing: that is not a change that makes it bounce again.
    pub fn is_bouncing(&mut self, signal: PlantSignal, level: bool) {
        self.faults.was(signal, level);
    }

    /// Whether a contact is really closed, whatever it reports.
    fn contact_is(&self, signal: PlantSignal, slide: impl Fn(usize) -> Slide) -> bool {
        match signal {
            PlantSignal::Limit(axis, end) => self.is_on(axis, end, &slide(axis)),
            signal => self.level(signal),
        }
    }
}

/// The two ends of an axis.
const ENDS: [End; 2] = [End::Negative, End::Positive];

/// The [next change of a limit switch](Plant::next_switch) in a state from before it was kept: none
/// comes with step 0.
const UNKNOWN: Option<u64> = Some(0);

fn unknown() -> Option<u64> {
    UNKNOWN
}

/// The farthest that a carriage can be pushed.
const FURTHEST: i64 = 1 << 40;

/// The bit of a limit switch.
fn bit(axis: usize, end: End) -> usize {
    axis * 2 + index(end)
}

#[cfg(test)]
mod tests {
    use vimc4_motion::{Path, StraightLine};

    use super::*;

    fn mill() -> Plant {
        Plant::new(Machine::builtin("mill").unwrap())
    }

    #[test]
    fn a_carriage_stays_at_its_stop_and_comes_back_from_there() {
        let mut plant = mill();
        let start = plant.carriage()[0];
        let lowest = plant.machine().axes.x.lowest.unwrap();
        let along_x =
            |way: i64| -> Point { std::array::from_fn(|axis| if axis == 0 { way } else { 0 }) };
        let mut go = |way: i64| {
            let path = Path::Line(StraightLine::new(along_x(way)));
            let lost = plant.follow(&Way { path: &path, signs: &[1; AXES] }, path.length());
            (plant.carriage()[0], lost.lost)
        };
        assert_eq!(go(-(start - lowest) - 100), (lowest, along_x(-100)));
        assert_eq!(go(100), (lowest + 100, along_x(0)));
    }

    #[test]
    fn a_switch_is_pressed_by_the_carriage_or_by_hand() {
        let mut plant = mill();
        let at = |place| Slide { place, ..Slide::default() };
        assert!(!plant.pressed(0, End::Negative, &at(0)));
        assert!(plant.pressed(0, End::Negative, &at(-1)));
        assert!(plant.set(PlantSignal::Limit(0, End::Negative), true));
        assert!(plant.pressed(0, End::Negative, &at(0)));
        assert!(!plant.set(PlantSignal::Limit(0, End::Negative), true));
    }
}
