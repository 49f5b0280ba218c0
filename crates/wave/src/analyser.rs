//! The logic analyser: what happens in a device goes in as it happens, and is drawn in order of time.

use std::borrow::Cow;
use std::collections::VecDeque;

use bytes::Bytes;
use vimc4_device::{
    Activity, Device, Event, Fact, Input, Kinds, Motion, Point, Time, View, escape, show_nanos,
};
use vimc4_motion::{Path, Segment};

use crate::pens::Pens;
use crate::pulses::Pulses;
use crate::scene::{Drives, Id, Kind, Scene, Span, Track, Value};
use crate::sheet::Sheet;
use crate::uart::{Uart, span};

/// Whether characters take their time on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pacing {
    /// They take none: what is sent is there. Characters are drawn from then on, as the line would
    /// have them, one after the other.
    Ideal,
    /// They take ten bits each: what comes is drawn from when it was sent, and what leaves up to
    /// when its stop bit has passed.
    Paced,
}

/// A logic analyser at a device. Show it every input with [`given`](Analyser::given), everything that
/// comes out with [`see`](Analyser::see) and [`sent`](Analyser::sent), and then the device itself with
/// [`look`](Analyser::look), after each single cause. It draws as time goes on and keeps only what is
/// not yet over.
pub struct Analyser {
    scene: Scene,
    pens: Pens,
    pacing: Pacing,
    /// How far time has come, as everywhere here in the time of the drawing: see [`drawn`](Analyser::drawn).
    now: Time,
    /// How much longer the device has lived than its own time says, in nanoseconds, because it was put
    /// back; and since when in the drawing.
    ahead: u64,
    since: Time,
    /// What is to be drawn once everything before it is.
    waiting: VecDeque<(Time, Seen)>,
    pulses: Pulses,
    receives: Uart,
    transmits: Uart,
    /// When limit switches will change if the running motion goes on as it does.
    crossings: VecDeque<(Time, Id, bool)>,
    /// The last value of each signal that is not drawn by pulses or wires.
    values: Vec<Option<Owned>>,
    baud: u32,
    /// More than activity and place may have changed.
    is_stale: bool,
    activity: Option<(Activity, Time)>,
    command: Option<(String, Time)>,
    line: Option<(String, Time)>,
    /// Steps of the clock drawn so far.
    steps: u64,
}

enum Seen {
    Event(Event),
    Picture(Picture),
}

/// The device at one moment.
struct Picture {
    activity: Activity,
    /// The counters, where nothing moves.
    position: Option<Point>,
    values: Vec<(Id, Owned)>,
    crossings: VecDeque<(Time, Id, bool)>,
}

#[derive(Clone, Debug, PartialEq)]
enum Owned {
    Bit(bool),
    Byte(u8),
    Number(i64),
    Text(Cow<'static, str>),
}

impl Owned {
    fn as_value(&self) -> Value<'_> {
        match self {
            Owned::Bit(bit) => Value::Bit(*bit),
            Owned::Byte(byte) => Value::Byte(*byte),
            Owned::Number(number) => Value::Number(*number),
            Owned::Text(text) => Value::Text(text),
        }
    }
}

impl Analyser {
    /// The kinds of events that it looks at.
    pub const KINDS: Kinds = Kinds::COMMAND
        .and(Kinds::ANSWER)
        .and(Kinds::MOTION)
        .and(Kinds::PORT)
        .and(Kinds::LINE)
        .and(Kinds::SIGNAL)
        .and(Kinds::FAULT)
        .and(Kinds::WARNING);

    /// Begins to draw a device on these sheets, as it is now.
    pub fn new<D: Device>(
        device: &D,
        pacing: Pacing,
        drives: impl Fn(&View<D::Details>) -> Drives,
        sheets: Vec<Box<dyn Sheet>>,
    ) -> Analyser {
        let scene = Scene::of(device);
        let now = device.now();
        let mut pens = Pens::new(sheets);
        pens.begin(&scene, now);
        let (receives, transmits) =
            (Uart::new(scene.places.receive), Uart::new(scene.places.transmit));
        let mut analyser = Analyser {
            values: vec![None; scene.signals.len()],
            scene,
            pens,
            pacing,
            now,
            ahead: 0,
            since: now,
            waiting: VecDeque::new(),
            pulses: Pulses::default(),
            receives,
            transmits,
            crossings: VecDeque::new(),
            baud: device.baud(),
            is_stale: true,
            activity: None,
            command: None,
            line: None,
            steps: 0,
        };
        analyser.draw_beginning();
        analyser.find_again(device, None);
        analyser.look(device, drives);
        analyser.draw(now);
        analyser
    }

    /// What is drawn.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// How many steps of the clock have been drawn.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    // --- what goes in ---

    /// Something went into the device.
    pub fn given(&mut self, at: Time, input: Input<'_>) {
        let at = self.drawn(at);
        if at < self.now {
            return;
        }
        match input {
            Input::Bytes(bytes) => {
                self.receives.push(at, self.baud, &Bytes::copy_from_slice(bytes));
            }
            Input::Wake => {}
            _ => self.is_stale = true,
        }
    }

    /// The device has been put into another state by somebody, and is in that now. What was drawn stays,
    /// and time in the drawing goes on from there, though that of the device may have gone back: what a
    /// device lives is drawn in the order in which it lives it. A note says so.
    pub fn restored<D: Device>(
        &mut self,
        device: &D,
        by: &str,
        drives: impl Fn(&View<D::Details>) -> Drives,
    ) {
        let at = self.now;
        self.draw(at);
        // A step that is due right then has been made.
        self.run_pulses(at.after_nanos(1));
        self.pulses.forget();
        self.end_state(at);
        self.end_command(at);
        self.end_line(at);
        self.crossings.clear();
        self.put(at, self.scene.places.command, Owned::Text("".into()));
        self.put(at, self.scene.places.answer, Owned::Text("".into()));
        let own = device.now();
        self.ahead = at.nanos_since(own);
        (self.now, self.since) = (self.drawn(own), self.drawn(own));
        let by = if by.is_empty() { String::new() } else { format!(" by {by}") };
        let time = show_nanos(own.as_nanos());
        self.note(at, self.scene.places.note, format!("put back{by} to {time}"));
        let before = *self.pulses.counters();
        self.find_again(device, Some(before));
        self.look(device, drives);
    }

    /// Bytes have left on the line.
    pub fn sent(&mut self, at: Time, bytes: &Bytes) {
        let at = self.drawn(at);
        if at < self.now {
            return;
        }
        let begins = match self.pacing {
            Pacing::Ideal => at,
            // The bytes leave one by one, when their stop bits have passed.
            Pacing::Paced => {
                let nanos = span(10 * bytes.len() as u64, self.baud);
                Time::from_nanos(at.as_nanos().saturating_sub(nanos)).max(self.since)
            }
        };
        self.transmits.push(begins, self.baud, bytes);
        self.come_to(at);
    }

    /// Something happened in the device.
    pub fn see(&mut self, at: Time, event: &Event) {
        let at = self.drawn(at);
        if at < self.now || !Analyser::KINDS.contain(event.kind()) {
            return;
        }
        if !matches!(event, Event::Motion(_) | Event::Line { .. }) {
            self.is_stale = true;
        }
        self.waiting.push_back((at, Seen::Event(event.clone())));
        self.come_to(at);
    }

    /// The device as it is now, after a cause or an input with everything that came of it.
    pub fn look<D: Device>(&mut self, device: &D, drives: impl Fn(&View<D::Details>) -> Drives) {
        let now = self.drawn(device.now());
        if now < self.now {
            return;
        }
        let running = device.running().is_some();
        let activity = device.activity();
        let before = self.activity.map(|(before, _)| before);
        // What such an activity was about may have changed with it.
        let tells = |activity| !matches!(activity, Activity::Move | Activity::ProgramMove);
        self.is_stale |= before != Some(activity) && (tells(activity) || before.is_some_and(tells));
        self.baud = device.baud();
        let mut values = Vec::new();
        if std::mem::take(&mut self.is_stale) {
            self.whole(device, &drives, &mut values);
        }
        let crossings = self.switches(device, running, &mut values);
        let position = (!running).then(|| device.position(device.now()));
        self.waiting
            .push_back((now, Seen::Picture(Picture { activity, position, values, crossings })));
        self.come_to(now);
    }

    /// Writes everything that has been drawn so far.
    pub fn flush(&mut self) {
        self.pens.flush();
    }

    /// Draws the rest, up to this time, and ends.
    pub fn finish(mut self, at: Time) {
        let at = self.drawn(at).max(self.now);
        self.draw(at);
        // A step that is due right then has been made.
        self.run_pulses(at.after_nanos(1));
        self.pulses.forget();
        self.crossings.clear();
        while self.next_due() != Time::NEVER {
            self.draw_next(Time::NEVER);
        }
        self.end_state(at);
        self.end_command(at);
        self.end_line(at);
        self.pens.end(at);
    }

    // --- what is seen of a device ---

    /// Everything that is seen of it, without what its activity and motions tell.
    fn whole<D: Device>(
        &self,
        device: &D,
        drives: &impl Fn(&View<D::Details>) -> Drives,
        values: &mut Vec<(Id, Owned)>,
    ) {
        let view = device.view(device.now());
        let Drives { motors, spindle } = drives(&view);
        let places = &self.scene.places;
        values.push((places.power, Owned::Bit(view.powered)));
        values.push((places.spindle, Owned::Bit(spindle)));
        values.push((places.baud, Owned::Number(view.baud.into())));
        for (axis, place) in view.axes.iter().zip(&places.axes) {
            values.push((place.enable, Owned::Bit(motors && axis.configured)));
        }
        for port in &view.ports {
            if let Some(place) = places.ports.get(&(port.port, port.input)) {
                values.push((*place, Owned::Byte(port.value)));
            }
        }
        for signal in &view.signals {
            let place = places.signals.get(&signal.id);
            let (Some(place), Some(value)) = (place, signal.value) else { continue };
            let kind = self.scene.signals.get(*place).map(|signal| signal.kind);
            values.push((
                *place,
                match kind {
                    Some(Kind::Bit) => Owned::Bit(value != 0),
                    _ => Owned::Number(value.into()),
                },
            ));
        }
    }

    /// The limit switches as they are, and when they will change while the motion runs.
    fn switches<D: Device>(
        &self,
        device: &D,
        running: bool,
        values: &mut Vec<(Id, Owned)>,
    ) -> VecDeque<(Time, Id, bool)> {
        let (now, mut crossings) = (device.now(), Vec::new());
        let until = device.wake().unwrap_or(Time::NEVER);
        for place in &self.scene.places.axes {
            for (positive, id) in [false, true].into_iter().zip(place.limits) {
                let axis = place.axis as u8;
                let first =
                    |active, from| device.first_time(&Fact::Limit { axis, positive, active }, from);
                let mut active = first(true, now) == Some(now);
                values.push((id, Owned::Bit(active)));
                let mut from = now;
                while running
                    && let Some(at) = first(!active, from).filter(|at| *at > from && *at < until)
                {
                    (active, from) = (!active, at);
                    crossings.push((self.drawn(at), id, active));
                }
            }
        }
        crossings.sort_unstable();
        crossings.into()
    }

    /// Goes on from where the device is, whatever was before. The counters are drawn that are not as
    /// before.
    fn find_again<D: Device>(&mut self, device: &D, before: Option<Point>) {
        let now = device.now();
        self.is_stale = true;
        if let Some(running) = device.running() {
            let made = running.steps_at(now);
            let (here, offset) = (device.position(now), running.segment.path.at(made));
            let origin = std::array::from_fn(|axis| here[axis] - offset[axis]);
            let segment = Box::new(running.segment.clone());
            self.pulses.begin(self.drawn(running.began), origin, segment, made);
        } else {
            self.pulses.put(device.position(now));
        }
        let places = self.scene.places.axes.clone();
        for place in &places {
            let counter = |counters: &Point| counters.get(place.axis).copied().unwrap_or_default();
            let now = counter(self.pulses.counters());
            if before.as_ref().is_none_or(|before| counter(before) != now) {
                self.pens.set(self.now, place.position, Value::Number(now));
            }
        }
    }

    // --- drawing ---

    /// The values of what nothing is known of yet.
    fn draw_beginning(&mut self) {
        let now = self.now;
        for (id, signal) in self.scene.signals.iter().enumerate() {
            let value = match signal.kind {
                Kind::Bit => Value::Bit(false),
                Kind::Byte => Value::Byte(0),
                Kind::Number => Value::Number(0),
                Kind::Text => Value::Text(""),
            };
            let places = &self.scene.places;
            let is_high = [places.receive[0], places.transmit[0]].contains(&id)
                || places.axes.iter().any(|axis| axis.direction == id);
            // What is seen of the device at once comes later in this same instant.
            if is_high {
                self.pens.set(now, id, Value::Bit(true));
            } else if !signal.in_tables
                || id == places.program_line
                || matches!(value, Value::Text(_))
            {
                self.pens.set(now, id, value);
            }
        }
    }

    /// When something is drawn that happens at a time of the device. That is the same time until the
    /// device is put back: then time in the drawing goes on.
    fn drawn(&self, at: Time) -> Time {
        at.after_nanos(self.ahead)
    }

    fn come_to(&mut self, at: Time) {
        self.now = self.now.max(at);
        let late = match self.pacing {
            Pacing::Ideal => 0,
            // A character that leaves is told of when it has left.
            Pacing::Paced => span(11, self.baud),
        };
        self.draw(Time::from_nanos(self.now.as_nanos().saturating_sub(late)));
    }

    /// When something is due next that follows from what was seen.
    fn next_due(&self) -> Time {
        let crossing = self.crossings.front().map_or(Time::NEVER, |(at, ..)| *at);
        self.pulses.due().min(self.receives.due()).min(self.transmits.due()).min(crossing)
    }

    /// Draws what was seen up to then, and what follows from it before then.
    fn draw(&mut self, until: Time) {
        loop {
            let seen = self.waiting.front().map(|(at, _)| *at).filter(|at| *at <= until);
            if let Some(at) = seen.filter(|at| *at <= self.next_due())
                && let Some((_, seen)) = self.waiting.pop_front()
            {
                self.draw_seen(at, seen);
            } else if self.next_due() < seen.unwrap_or(until) {
                self.draw_next(seen.unwrap_or(until));
            } else {
                return;
            }
        }
    }

    /// Draws what is due next, and of the pulses all before `until` that nothing else comes between.
    fn draw_next(&mut self, until: Time) {
        let crossing = self.crossings.front().map_or(Time::NEVER, |(at, ..)| *at);
        let (receives, transmits) = (self.receives.due(), self.transmits.due());
        let other = receives.min(transmits).min(crossing);
        if self.pulses.due() < other {
            self.run_pulses(other.min(until));
        } else if receives == other {
            self.receives.run(&mut self.pens);
        } else if transmits == other {
            self.transmits.run(&mut self.pens);
        } else if let Some((at, id, active)) = self.crossings.pop_front() {
            self.put(at, id, Owned::Bit(active));
        }
    }

    fn run_pulses(&mut self, before: Time) {
        self.pulses.run(before, u64::MAX, &self.scene.places.axes, &mut self.pens);
    }

    /// Draws a value unless it is the last one.
    fn put(&mut self, at: Time, id: Id, value: Owned) {
        if let Some(last) = self.values.get_mut(id)
            && last.as_ref() != Some(&value)
        {
            self.pens.set(at, id, value.as_value());
            *last = Some(value);
        }
    }

    fn draw_seen(&mut self, at: Time, seen: Seen) {
        match seen {
            Seen::Event(event) => self.draw_event(at, event),
            Seen::Picture(Picture { activity, position, values, crossings }) => {
                self.crossings = crossings;
                for (id, value) in values {
                    self.put(at, id, value);
                }
                if self.activity.is_none_or(|(before, _)| before != activity) {
                    self.end_state(at);
                    self.activity = Some((activity, at));
                    let word = Owned::Text(word_of(activity).into());
                    self.put(at, self.scene.places.state, word);
                }
                if let Some(position) = position {
                    self.draw_counters(at, position);
                }
            }
        }
    }

    /// Counters that were set without a motion.
    fn draw_counters(&mut self, at: Time, position: Point) {
        if *self.pulses.counters() == position || self.pulses.is_moving() {
            return;
        }
        for place in &self.scene.places.axes {
            let now = position.get(place.axis);
            if let Some(now) = now.filter(|now| self.pulses.counters().get(place.axis) != Some(now))
            {
                self.pens.set(at, place.position, Value::Number(*now));
            }
        }
        self.pulses.put(position);
    }

    fn draw_event(&mut self, at: Time, event: Event) {
        let places = &self.scene.places;
        let (command, answer, note) = (places.command, places.answer, places.note);
        let line_place = places.program_line;
        match event {
            Event::Command { bytes, .. } => {
                let text = escape(&bytes);
                self.end_command(at);
                self.command = Some((text.clone(), at));
                self.put(at, answer, Owned::Text("".into()));
                self.put(at, command, Owned::Text(text.into()));
            }
            Event::Answer { bytes, why, .. } => {
                let mut text = escape(&bytes);
                if let Some(why) = why {
                    text = format!("{text} {why}");
                }
                self.end_command(at);
                self.moment(Track::Answer, &text, at);
                self.put(at, command, Owned::Text("".into()));
                self.put(at, answer, Owned::Text(text.into()));
            }
            Event::CutShort { why, .. } => {
                self.end_command(at);
                self.put(at, command, Owned::Text("".into()));
                self.note(at, note, why.into_owned());
            }
            Event::Ignored { bytes, why } => {
                self.note(at, note, format!("{} ignored: {why}", escape(&bytes)));
            }
            Event::Line { line, mnemonic } => {
                self.end_line(at);
                self.line = Some((format!("line {line} {mnemonic}"), at));
                self.put(at, line_place, Owned::Number(line.into()));
            }
            Event::Motion(motion) => self.draw_motion(at, motion),
            Event::Warning(warning) => self.note(at, note, warning.to_string()),
            Event::Fault { number, news } => {
                self.note(at, note, format!("fault {number} {news}"));
            }
            Event::Rule { rule, news } => self.note(at, note, format!("rule {rule} {news}")),
            _ => {}
        }
    }

    fn draw_motion(&mut self, at: Time, motion: Motion) {
        match motion {
            Motion::Begins { origin, segment } => {
                self.draw_counters(at, origin);
                self.pulses.begin(at, origin, segment, 0);
            }
            Motion::Changes { segment } => self.pulses.change(segment),
            Motion::Ends { steps } => {
                self.steps += steps;
                let axes = &self.scene.places.axes;
                if let Some((from, segment)) = self.pulses.end(at, steps, axes, &mut self.pens) {
                    let name = shape_of(&segment);
                    let steps = Some(steps);
                    self.pens.span(&Span { track: Track::Motion, name, from, to: at, steps });
                }
            }
        }
    }

    fn note(&mut self, at: Time, place: Id, text: String) {
        self.moment(Track::Note, &text, at);
        self.put(at, place, Owned::Text(text.into()));
    }

    fn moment(&mut self, track: Track, name: &str, at: Time) {
        self.pens.span(&Span { track, name, from: at, to: at, steps: None });
    }

    fn end_state(&mut self, to: Time) {
        if let Some((activity, from)) = self.activity.take() {
            let name = &word_of(activity);
            self.pens.span(&Span { track: Track::State, name, from, to, steps: None });
        }
    }

    fn end_command(&mut self, to: Time) {
        if let Some((name, from)) = self.command.take() {
            let name = &name;
            self.pens.span(&Span { track: Track::Command, name, from, to, steps: None });
        }
    }

    fn end_line(&mut self, to: Time) {
        if let Some((name, from)) = self.line.take() {
            let name = &name;
            self.pens.span(&Span { track: Track::Program, name, from, to, steps: None });
        }
    }
}

/// An activity in one word, as programs have it: `reference-towards-switch`.
fn word_of(activity: Activity) -> String {
    let mut word = String::new();
    for letter in format!("{activity:?}").chars() {
        if letter.is_ascii_uppercase() && !word.is_empty() {
            word.push('-');
        }
        word.push(letter.to_ascii_lowercase());
    }
    word
}

fn shape_of(segment: &Segment) -> &'static str {
    match segment.path {
        Path::Line(_) => "line",
        Path::Arc(_) => "arc",
        Path::Helix(_) => "helix",
        Path::Chain(_) => "chain",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_activity_is_called_as_programs_call_it() {
        for activity in [
            Activity::Off,
            Activity::StartingUp,
            Activity::ReferenceTowardsSwitch,
            Activity::ProgramHaltedOnItself,
        ] {
            let name = serde_json::to_value(activity).unwrap();
            assert_eq!(name, word_of(activity));
        }
    }
}
