//! What the screen shows of a debugger: gathered from its history around the present.

use std::collections::VecDeque;
use std::ops::ControlFlow;

use vimc4_catalogue::isel::ProgramStatus;
use vimc4_catalogue::{Controller, Details, Machine};
use vimc4_debug::{Debugger, Listing, Replies, Wired};
use vimc4_device::{
    AXES, Device, Event, Motion, Output, Path, Point, Segment, Stamp, Time, View, escape,
};
use vimc4_timeline::recording::MismatchKind;
use vimc4_timeline::{Act, Found, Moment, Place, Sought, Stretch};

use super::screen::{Picture, Side, Stroke, Talk, TimeLine};

/// So many motions are shown before the present, and behind it as many.
const MOTIONS: usize = 600;

/// So many lines of the conversation are shown at most.
const LINES: usize = 120;

/// So many points a motion is drawn with that is not straight.
const POINTS: u64 = 64;

/// What has happened around a moment.
#[derive(Clone, Debug, Default)]
pub(crate) struct Around {
    /// For which it was gathered: the present, the end of the branch, the replies that are shown and
    /// the number of differences.
    at: Option<(Place, Moment, Replies, usize)>,
    pub(crate) talk: Vec<Talk>,
    pub(crate) strokes: Vec<Stroke>,
}

impl Around {
    /// Gathers it anew if one is somewhere else by now, or more is known.
    pub(crate) fn look(&mut self, debugger: &mut Debugger, machine: &Machine) {
        let place = debugger.place();
        let heading = debugger.history().heading();
        let mut branches = debugger.history().branches();
        let end = branches.find(|branch| branch.id == heading).map(|branch| branch.end);
        drop(branches);
        let Some(end) = end else { return };
        let at = (place, end, debugger.shown_replies(), debugger.differences().len());
        if self.at == Some(at) {
            return;
        }
        self.at = Some(at);
        let never = &mut |_: Time| ControlFlow::Continue(());
        let mut before = Gather::default();
        let history = debugger.history_mut();
        history.seek_last_or_here(&mut before, never);
        let mut behind = Gather { is_behind: true, ..Gather::default() };
        behind.stretches.push(Vec::new());
        if history.seek_next(end.at, &mut behind, never) == Found::Here
            || history.present() != place
        {
            history.go_back_to(place);
        }
        history.drain();
        let device = debugger.device();
        let before: Vec<Told> = before.stretches.into_iter().rev().flatten().collect();
        self.talk = before.iter().rev().filter_map(|told| talk(device, told)).take(LINES).collect();
        self.talk.reverse();
        self.show_differences(debugger);
        let behind = behind.stretches.into_iter().flatten();
        self.strokes = strokes(machine, before.iter().cloned().chain(behind));
    }
}

impl Around {
    /// Marks replies that differ from the recording, and shows the recorded ones if those are wanted.
    fn show_differences(&mut self, debugger: &Debugger) {
        let shows_recorded = debugger.shown_replies() == Replies::Recorded;
        let first = self.talk.first().map_or(Time::NEVER, |talk| talk.at);
        let now = debugger.now();
        for mismatch in debugger.differences_on_way() {
            let MismatchKind::Reply { recorded, emulated } = &mismatch.kind else { continue };
            let [said, others] = match shows_recorded {
                true => [recorded, emulated],
                false => [emulated, recorded],
            };
            let other = if shows_recorded { "emulated" } else { "recorded" };
            let at = said.last.or(others.last).unwrap_or(mismatch.at);
            if at < first || at > now {
                continue;
            }
            let meaning = format!("differs: {other} {others}");
            let text = said.to_string();
            let shown = Talk { at, side: Side::Problem, text, meaning, replies_to: None };
            let is_own =
                |talk: &Talk| talk.replies_to.is_some() && talk.replies_to == mismatch.command;
            match self.talk.iter().rposition(is_own).filter(|_| !emulated.bytes.is_empty()) {
                Some(place) => self.talk[place] = shown,
                None => {
                    let place = self.talk.partition_point(|talk| talk.at <= at);
                    self.talk.insert(place, shown);
                }
            }
        }
    }
}

/// An event, when it was, and, of a motion that begins, where the carriages were.
#[derive(Clone)]
struct Told {
    stamp: Stamp,
    event: Event,
    carriages: Point,
    /// What a command meant when it was executed.
    meaning: String,
}

/// Where the carriages of all axes are.
pub(crate) fn carriages(view: &View<Details>) -> Point {
    let mut carriages = [0; AXES];
    for axis in &view.axes {
        if let Some(place) = carriages.get_mut(usize::from(axis.index)) {
            *place = axis.carriage;
        }
    }
    carriages
}

/// Takes note of what happens, and finds nothing.
#[derive(Default)]
struct Gather {
    stretches: Vec<Vec<Told>>,
    motions: usize,
    lines: usize,
    /// Going forward it ends with what is enough.
    is_behind: bool,
}

impl Gather {
    fn has_enough(&self) -> bool {
        let has_lines = self.is_behind || self.lines >= LINES;
        self.motions >= MOTIONS && has_lines || self.motions + self.lines >= 20 * MOTIONS
    }
}

impl Sought<Wired> for Gather {
    fn can_be_in(&self, _: &Stretch) -> bool {
        self.is_behind || !self.has_enough()
    }

    fn begin(&mut self, _: &Wired) {
        if !self.is_behind {
            self.stretches.push(Vec::new());
        }
    }

    fn after(&mut self, device: &Wired, _: Act, outputs: &VecDeque<Output>) -> bool {
        let Some(stretch) = self.stretches.last_mut() else { return false };
        for output in outputs {
            let Output::Event(stamp, event) = output else { continue };
            match event {
                Event::Motion(_) => self.motions += 1,
                Event::Port { .. } | Event::Flash { .. } | Event::Baud { .. } => continue,
                _ => self.lines += 1,
            }
            let begins = matches!(event, Event::Motion(Motion::Begins { .. }));
            let carriages =
                if begins { carriages(&device.view(device.now())) } else { Point::default() };
            let meaning = match event {
                Event::Command { bytes, .. } if !self.is_behind => device.explain(bytes),
                _ => String::new(),
            };
            stretch.push(Told { stamp: *stamp, event: event.clone(), carriages, meaning });
        }
        self.is_behind && self.has_enough()
    }
}

/// A line of the conversation.
fn talk(device: &Controller, Told { stamp, event, meaning, .. }: &Told) -> Option<Talk> {
    let (side, text, meaning) = match event {
        Event::Command { bytes, .. } => (Side::Host, escape(bytes), meaning.clone()),
        Event::Ignored { bytes, why } => (Side::Host, escape(bytes), format!("ignored: {why}")),
        Event::Answer { bytes, why: Some(why), .. } => {
            (Side::Problem, escape(bytes.trim_ascii_end()), why.to_string())
        }
        Event::Answer { bytes, .. } => {
            (Side::Controller, escape(bytes.trim_ascii_end()), String::new())
        }
        Event::CutShort { mnemonic, why } => {
            (Side::Problem, mnemonic.to_string(), format!("is cut short: {why}"))
        }
        Event::Line { line, mnemonic } => {
            (Side::World, format!("line {line}"), mnemonic.to_string())
        }
        Event::Switch { axis, positive, active } => {
            let view = device.view(device.now());
            let name = view.axes.get(usize::from(*axis)).map_or("?", |axis| axis.name.as_str());
            let end = if *positive { '+' } else { '-' };
            let state = if *active { "is pressed" } else { "is free" };
            (Side::World, format!("limit switch {name}{end}"), state.to_owned())
        }
        Event::Signal { signal, value } => {
            let signals = device.signals();
            let signal = signals.iter().find(|known| known.id == *signal)?;
            let position = signal.positions.as_ref();
            let position = position.and_then(|names| names.get(usize::try_from(*value).ok()?));
            let value = position.cloned().unwrap_or_else(|| value.to_string());
            (Side::World, format!("{} {value}", signal.name), String::new())
        }
        Event::Warning(warning) => (Side::Problem, "warning".to_owned(), warning.to_string()),
        _ => return None,
    };
    let replies_to = match event {
        Event::Answer { .. } => stamp.command,
        _ => None,
    };
    Some(Talk { at: stamp.at, side, text, meaning, replies_to })
}

/// The motions as they are drawn: the ways of the carriages, wherever the counters count from.
fn strokes(machine: &Machine, events: impl Iterator<Item = Told>) -> Vec<Stroke> {
    let signs: Point = std::array::from_fn(|axis| if machine.axis(axis).inverted { -1 } else { 1 });
    let mut strokes = Vec::new();
    let mut open: Option<(Time, Point, Box<Segment>)> = None;
    for Told { stamp, event, carriages, .. } in events {
        let Event::Motion(motion) = event else { continue };
        match motion {
            Motion::Begins { segment, .. } => open = Some((stamp.at, carriages, segment)),
            Motion::Changes { segment } => {
                if let Some((_, _, running)) = &mut open {
                    *running = segment;
                }
            }
            Motion::Ends { steps } => {
                if let Some((at, origin, segment)) = open.take() {
                    strokes.push(stroke(at, &origin, &signs, &segment, steps));
                }
            }
        }
    }
    if let Some((at, origin, segment)) = open {
        let steps = segment.profile.steps();
        strokes.push(stroke(at, &origin, &signs, &segment, steps));
    }
    strokes
}

fn stroke(at: Time, origin: &Point, signs: &Point, segment: &Segment, steps: u64) -> Stroke {
    let points = match segment.path {
        Path::Line(_) => 1,
        _ => POINTS.min(steps.max(1)),
    };
    let point = |number: u64| {
        let k = (u128::from(steps) * u128::from(number) / u128::from(points)) as u64;
        let offset = segment.path.at(k);
        let place = std::array::from_fn(|axis| origin[axis] + signs[axis] * offset[axis]);
        (at.after_nanos(segment.profile.time_of(k)), place)
    };
    Stroke { points: (0..=points).map(point).collect() }
}

/// The lines that are most telling now: those of the program that runs, of the file, or the commands.
pub(crate) fn listing(debugger: &mut Debugger) -> Listing {
    let details = debugger.device().details();
    let status = details.program().map(|program| program.status);
    let runs = matches!(status, Some(ProgramStatus::Running | ProgramStatus::Paused));
    let program = debugger.program().filter(|program| !program.lines.is_empty());
    match (program, debugger.file()) {
        (Some(program), _) if runs => program,
        (_, Some(file)) => file,
        (Some(program), None) => program,
        (None, None) => debugger.commands(),
    }
}

/// The history as a line.
pub(crate) fn time_line(debugger: &Debugger) -> TimeLine {
    let history = debugger.history();
    let heading = history.heading();
    let branches: Vec<_> = history.branches().collect();
    let begin = branches.first().map(|branch| branch.first.at).unwrap_or_default();
    let on = branches.iter().find(|branch| branch.id == heading);
    let end = on.map(|branch| branch.end.at).unwrap_or_default().max(debugger.now());
    let partings = branches.iter().filter_map(|branch| branch.parted);
    TimeLine {
        begin,
        now: debugger.now(),
        end,
        read: debugger.share_read(),
        branch: on.map(|branch| branch.name.clone()).unwrap_or_default(),
        branches: branches.len(),
        snapshots: history.snapshots(heading).map(|moment| moment.at).collect(),
        partings: partings.map(|place| place.moment.at).collect(),
        differences: debugger.differences_on_way().map(|own| own.at).collect(),
        marks: debugger
            .marks()
            .iter()
            .map(|(name, mark)| (name.clone(), mark.place.moment.at))
            .collect(),
    }
}

/// Everything that the screen shows of it. The rest of the picture is the screen's own.
pub(crate) fn show(debugger: &mut Debugger, around: &mut Around, picture: &mut Picture) {
    around.look(debugger, &picture.machine);
    picture.talk.clone_from(&around.talk);
    picture.strokes.clone_from(&around.strokes);
    picture.signals = debugger.device().signals();
    picture.command = debugger.executing().map(|command| command.to_string());
    picture.listing = listing(debugger);
    picture.line = time_line(debugger);
    picture.watches = debugger
        .watches()
        .into_iter()
        .map(|(expression, value)| {
            let value = value.map_or_else(|error| error.to_string(), |value| value.to_string());
            format!("{expression} = {value}")
        })
        .collect();
}
