//! Which sessions can be played through a port, and what they would do to a machine behind it.
//!
//! A port shows only bytes and when they come, and behind it may be a real machine whose owner has
//! a program and settings in its memory. So a session is played in the model first. That shows how
//! far it moves, how long it takes, whether it depends on times more exact than a port allows, and
//! whether it depends on the contents of the memory.

use std::fmt;

use toml::{Table, Value};
use vimc4_catalogue::{Controller, Handling, Model};
use vimc4_device::{AXES, Device, Harness, Point, show_nanos};

use crate::format::Session;
use crate::play::{Drive, play_watched};
use crate::player::{Act, PortStep, Timing};
use crate::rehearsal::{Delays, ask, converse, counters, rehearse, rehearse_with_handshake};
use crate::script::{Action, Expected};
use crate::travel::Travel;
use crate::workshop::{self, Workshop};

/// How late a port may be. A session that gives other bytes with one of these delays cannot be
/// played through a port.
const DELAYS: [Delays; 5] = [
    Delays { player: 0, way: [0, 0] },
    Delays { player: 2_000_000, way: [0, 0] },
    Delays { player: 40_000_000, way: [0, 0] },
    Delays { player: 0, way: [2_000_000, 0] },
    Delays { player: 0, way: [0, 2_000_000] },
];

/// What the person at the machine allows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Allowed {
    /// Motions, within the envelope.
    pub moves: bool,
    /// Reference runs, to wherever the reference switches are.
    pub reference: bool,
    /// Switching the spindle, the brake, the motor currents and anything else that is connected.
    pub outputs: bool,
    /// Erasing the stored program, and resetting saved settings to the factory's.
    pub flash: bool,
    /// How far each axis may go from where it is, lowest and highest, steps.
    pub envelope: [(i64, i64); AXES],
    /// How long a session may take, ns.
    pub longest: u64,
}

impl Allowed {
    /// Whether the whole of a travel is allowed.
    #[must_use]
    pub fn contains(&self, travel: &Travel) -> bool {
        let ways = travel.low.iter().zip(&travel.high).zip(&self.envelope);
        ways.into_iter().all(|((low, high), (least, most))| least <= low && high <= most)
    }
}

/// Why a session is not played.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reason {
    /// It is about other models.
    Model,
    /// It is about another value of the profile, this one.
    Profile(String),
    /// It does not hold for this profile, which differs from the built-in one.
    OwnProfile,
    /// It is about a machine other than the bench.
    Machine,
    /// It needs hands at the panel, the inputs or the mains switch.
    Operator,
    /// It checks what only the emulator shows.
    View,
    /// It needs bytes paced by the model.
    Pacing,
    /// It needs times more exact than a port's.
    ExactTime,
    /// It sends more than there is room for, which a port with a handshake does not.
    Handshake,
    /// It leaves the axes at a place that a port cannot know: a reset during a motion.
    Place,
    /// It changes the speed of the line.
    Baud,
    /// It moves while the controller expects its switches elsewhere.
    Switches,
    /// It takes this long, ns.
    Long(u64),
    /// It needs an erased memory, which this model erases at its panel only.
    Panel,
    /// It leaves the envelope, with the ways of the axes.
    Envelope(String),
    /// It may do these things that are not allowed.
    NotAllowed(Vec<&'static str>),
}

impl Reason {
    /// A short name for programs; what holds for one session, and for several.
    fn words(&self) -> (&'static str, &'static str, &'static str) {
        match self {
            Reason::Model => ("model", "is about other models", "are about other models"),
            Reason::Profile(_) => ("profile", "is about", "are about other values of the profile"),
            Reason::OwnProfile => (
                "own-profile",
                "holds for the built-in profile only",
                "hold for the built-in profile only",
            ),
            Reason::Machine => {
                ("machine", "is about a particular machine", "are about a particular machine")
            }
            Reason::Operator => (
                "operator",
                "needs hands at the panel or the inputs",
                "need hands at the panel or the inputs",
            ),
            Reason::View => (
                "view",
                "looks at what only the emulator shows",
                "look at what only the emulator shows",
            ),
            Reason::Pacing => (
                "pacing",
                "is about the times of single bytes",
                "are about the times of single bytes",
            ),
            Reason::ExactTime => (
                "exact-time",
                "needs times more exact than a port's",
                "need times more exact than a port's",
            ),
            Reason::Handshake => (
                "handshake",
                "sends more than a port with a handshake does",
                "send more than a port with a handshake does",
            ),
            Reason::Place => (
                "place",
                "resets a controller that moves, and loses the place",
                "reset a controller that moves, and lose the place",
            ),
            Reason::Baud => {
                ("baud", "changes the speed of the line", "change the speed of the line")
            }
            Reason::Switches => (
                "switches",
                "moves while the switches are expected elsewhere",
                "move while the switches are expected elsewhere",
            ),
            Reason::Long(_) => ("long", "takes", "take longer than --longest"),
            Reason::Panel => (
                "panel",
                "needs a memory that only the panel erases",
                "need a memory that only the panel erases",
            ),
            Reason::Envelope(_) => ("envelope", "leaves the envelope:", "leave the envelope"),
            Reason::NotAllowed(_) => ("not-allowed", "needs --allow", "need --allow"),
        }
    }

    /// A short name for programs.
    #[must_use]
    pub fn key(&self) -> &'static str {
        self.words().0
    }

    /// The reason without its particulars, for a count of sessions.
    #[must_use]
    pub fn in_general(&self) -> String {
        let (_, _, several) = self.words();
        match self {
            Reason::NotAllowed(what) => format!("{several} {}", what.join(",")),
            _ => several.to_owned(),
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (_, one, _) = self.words();
        f.write_str(one)?;
        match self {
            Reason::Profile(value) => write!(f, " {value}"),
            Reason::NotAllowed(what) => write!(f, " {}", what.join(",")),
            Reason::Long(nanos) => write!(f, " {}", show_nanos(*nanos)),
            Reason::Envelope(ways) => write!(f, " {ways}"),
            _ => Ok(()),
        }
    }
}

/// The ways of the axes that move, by their names: `X -30…300  Y 0…12`.
#[must_use]
pub fn show_ways(travel: &Travel, axes: &[&str]) -> String {
    let ways = axes.iter().zip(travel.low.iter().zip(&travel.high));
    let moved = ways.filter(|(_, (low, high))| (**low, **high) != (0, 0));
    let ways: Vec<String> =
        moved.map(|(axis, (low, high))| format!("{axis} {low}…{high}")).collect();
    if ways.is_empty() { "nothing moves".to_owned() } else { ways.join("  ") }
}

/// How a session is played through a port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// One after the other, each on a controller that has been reset.
    pub rows: Vec<Row>,
    /// Whether it may set axes in motion.
    pub moves: bool,
    /// How far all rows together go.
    pub travel: Travel,
    /// How long the model needs for it, ns.
    pub takes: u64,
    /// How many times the session gives that a port cannot check.
    pub unchecked: usize,
}

/// What is played from one reset to the next.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// What is sent and seen.
    pub steps: Vec<PortStep>,
    /// Whether the memory must be erased before.
    pub fresh: bool,
    /// Whether the memory may be different afterwards.
    pub writes: bool,
    /// Whether the memory is different afterwards if all goes as written.
    wrote: bool,
    /// Whether the controller is asked for a position that the session looks at.
    asked: bool,
    /// How far it goes.
    pub travel: Travel,
    /// Where the axes are afterwards, from where they were, steps.
    pub end: Point,
    /// After each step of the session, by its number, how far the axes are beyond their counters.
    /// This and the counters give the positions of the axes.
    pub offsets: Vec<(usize, Point)>,
}

/// Chooses sessions for one controller.
#[derive(Debug)]
pub struct Chooser {
    model: Model,
    profile: Table,
    like: Vec<&'static str>,
    timing: Timing,
    handling: Handling,
    bench: Workshop,
    /// The lines that erase this model's memory.
    erase: Vec<&'static str>,
    /// A memory with a program and settings in it, and what erasing it leaves.
    filled: Vec<u8>,
    erased: Vec<u8>,
    /// Whether a command starts the stored program.
    starts: bool,
}

impl Chooser {
    /// Chooses for controllers with this profile.
    ///
    /// # Errors
    ///
    /// If no controller can be made of the profile.
    pub fn new(model: &Model, timing: Timing) -> Result<Chooser, String> {
        let handling = Handling::of(model);
        let bench = Workshop::bench(model)?;
        let mut filling = Harness::new(bench.build(&[])?);
        converse(&mut filling, handling.fill);
        let filled = filling.device().flash_image();
        let mut erasing = Harness::new(bench.build(&filled)?);
        let answers = converse(&mut erasing, handling.erase);
        let erase =
            handling.erase.iter().zip(answers).filter(|(_, answer)| answer == handling.done);
        let erase: Vec<&str> = erase.map(|(line, _)| *line).collect();
        let erased = erasing.device().flash_image();
        let mut starting = Harness::new(bench.build(&filled)?);
        converse(&mut starting, handling.start);
        let starts = counters(starting.device()) != [0; AXES];
        Ok(Chooser {
            model: model.clone(),
            profile: workshop::profile(model)?,
            like: vimc4_catalogue::models_like(model),
            timing,
            handling,
            bench,
            erase,
            filled,
            erased,
            starts,
        })
    }

    /// The lines that erase the memory of this model; none if only the panel can.
    #[must_use]
    pub fn erase(&self) -> &[&'static str] {
        &self.erase
    }

    /// How the session is played through a port.
    ///
    /// # Errors
    ///
    /// Why it is not.
    pub fn plan(&self, session: &Session, allowed: &Allowed) -> Result<Plan, Reason> {
        self.fits(session)?;
        let mut plan = self.play(session)?;
        if plan.takes > allowed.longest {
            return Err(Reason::Long(plan.takes));
        }
        for row in &mut plan.rows {
            plan.unchecked += self.rehearse(session, row)?;
        }
        let needs = session.needs().effects;
        let flash = needs.writes_flash || plan.rows.iter().any(|row| row.fresh || row.writes);
        let lacking: Vec<&'static str> = [
            ("moves", needs.moves && !allowed.moves),
            ("reference", needs.reference && !allowed.reference),
            ("outputs", needs.outputs && !allowed.outputs),
            ("flash", flash && !allowed.flash),
        ]
        .into_iter()
        .filter_map(|(what, lacks)| lacks.then_some(what))
        .collect();
        if !lacking.is_empty() {
            return Err(Reason::NotAllowed(lacking));
        }
        if !allowed.contains(&plan.travel) {
            let axes = self.model.axis_names();
            return Err(Reason::Envelope(show_ways(&plan.travel, axes)));
        }
        Ok(plan)
    }

    /// Whether a port is enough, judging by the session's own text.
    fn fits(&self, session: &Session) -> Result<(), Reason> {
        if !session.models.iter().any(|model| self.like.contains(model)) {
            return Err(Reason::Model);
        }
        for (key, value) in leaves(&session.profile) {
            if leaf(&self.profile, &key) != Some(&value) {
                return Err(Reason::Profile(format!("{key} = {value}")));
            }
        }
        let needs = session.needs();
        if needs.operator {
            return Err(Reason::Operator);
        }
        if session.machine.name != "bench" || !session.machine.differs.is_empty() {
            return Err(Reason::Machine);
        }
        if session.line_pacing {
            return Err(Reason::Pacing);
        }
        if needs.effects.switches && needs.effects.moves {
            return Err(Reason::Switches);
        }
        Ok(())
    }

    /// Plays the session in the model and writes down what a port will see of it.
    fn play(&self, session: &Session) -> Result<Plan, Reason> {
        let mut plan = Plan {
            rows: Vec::new(),
            moves: session.needs().effects.moves,
            travel: Travel::default(),
            takes: 0,
            unchecked: 0,
        };
        let mut row = Row::new();
        let mut hindered = None;
        let played = play_watched(
            session,
            Drive::Smooth,
            |f| self.bench.build(f),
            |glance| {
                let action = &session.steps[glance.step].action;
                let takes = glance.ended.nanos_since(glance.began);
                plan.takes += takes;
                if *action == Action::New {
                    plan.rows.push(std::mem::replace(&mut row, Row::new()));
                    return;
                }
                if glance.device.baud() != self.model.baud() {
                    hindered.get_or_insert(Reason::Baud);
                }
                row.travel = glance.travel.clone();
                row.end = glance.travel.place(glance.ended);
                row.wrote = glance.wrote_flash;
                row.asked |= matches!(action, Action::Position(_));
                let counters = counters(glance.device);
                let offset = std::array::from_fn(|axis| row.end[axis] - counters[axis]);
                row.offsets.push((glance.step, offset));
                match self.acts(action, takes, glance.device) {
                    None => drop(hindered.get_or_insert(Reason::View)),
                    Some(acts) => {
                        let step = glance.step;
                        row.steps.extend(acts.into_iter().map(|act| PortStep { step, act, takes }));
                    }
                }
            },
        );
        plan.rows.push(row);
        if let Some(reason) = hindered {
            return Err(reason);
        }
        played.map_err(|_| Reason::OwnProfile)?;
        let writes = session.needs().effects.writes_flash;
        for row in &mut plan.rows {
            plan.travel.include(&row.travel);
            row.writes = writes || row.wrote;
            let step = row.steps.last().map_or(0, |step| step.step);
            row.steps.push(PortStep { step, act: Act::Quiet(self.timing.quiet), takes: 0 });
        }
        Ok(plan)
    }

    /// What a line of a script is at a port; `None` if a port cannot show it.
    fn acts(&self, action: &Action, takes: u64, device: &Controller) -> Option<Vec<Act>> {
        let act = match action {
            Action::Send(bytes) => Act::Send(bytes.clone(), true),
            Action::Control(byte) => Act::Send(vec![*byte], false),
            Action::Expect(expected) => Act::Expect(expected.clone()),
            Action::Rest => Act::Quiet(takes + self.timing.quiet),
            Action::Silent(nanos) => Act::Quiet(*nanos),
            Action::Wait(nanos) => Act::Wait(*nanos),
            Action::Mark => Act::Mark,
            // At rest a controller says where it is.
            Action::Position(wanted) if device.is_idle() => {
                let mut harness = Harness::new(device.clone());
                let answer = converse(&mut harness, &[self.handling.position]).pop()?;
                let places = self.handling.read_position(&answer)?;
                if !places.starts_with(wanted) {
                    return None;
                }
                let line = format!("{}\r", self.handling.position);
                return Some(vec![
                    Act::Send(line.into_bytes(), false),
                    Act::Expect(Expected { parts: vec![answer], at: None, max: None }),
                ]);
            }
            _ => return None,
        };
        Some(vec![act])
    }

    /// Plays a row with a simulated port, late and in time, on memories erased and full. Says
    /// how many times a port cannot check.
    fn rehearse(&self, session: &Session, row: &mut Row) -> Result<usize, Reason> {
        let exactly: Vec<Option<(u64, u64)>> = row.steps.iter_mut().map(take_time).collect();
        let mut off: Vec<u64> = vec![0; exactly.len()];
        let mut offset = None;
        for delays in DELAYS {
            let device = self.build(&[])?;
            let seen = rehearse(device, &row.steps, self.timing, delays);
            let seen = seen.map_err(|_| match delays {
                // Asking where the axes are has disturbed what it was about.
                Delays { player: 0, way: [0, 0] } if row.asked => Reason::View,
                _ => Reason::ExactTime,
            })?;
            if *offset.get_or_insert(seen.offset) != seen.offset {
                return Err(Reason::Place);
            }
            if self.model.has_handshake_lines() {
                // It is unknown whether the port obeys the handshake.
                let seen =
                    rehearse_with_handshake(self.build(&[])?, &row.steps, self.timing, delays);
                seen.map_err(|_| Reason::Handshake)?;
            }
            let expects = row.steps.iter().zip(&exactly).zip(&mut off);
            let expects = expects.filter(|((step, _), _)| matches!(step.act, Act::Expect(_)));
            for (((_, exact), off), (_, at)) in expects.zip(seen.times) {
                if let Some((wanted, _)) = exact {
                    *off = (*off).max(at.abs_diff(*wanted));
                }
            }
        }
        let mut unchecked = 0;
        for ((step, exact), off) in row.steps.iter_mut().zip(exactly).zip(off) {
            // Half of what is tolerated is left to the port.
            match (&mut step.act, exact) {
                (Act::Expect(expected), Some((wanted, within)))
                    if off <= within + self.timing.around(wanted) / 2 =>
                {
                    expected.at = Some((wanted, within));
                }
                (_, Some(_)) => unchecked += 1,
                (_, None) => {}
            }
        }
        let passes = |image: &[u8]| -> Result<bool, Reason> {
            Ok(rehearse(self.build(image)?, &row.steps, self.timing, Delays::default()).is_ok())
        };
        row.fresh = (self.starts && session.needs().effects.starts) || !passes(&self.filled)?;
        let erasable = !self.erase.is_empty() && passes(&self.erased)?;
        if (row.fresh || row.wrote) && !erasable {
            return Err(Reason::Panel);
        }
        Ok(unchecked)
    }

    /// A controller as a client finds it after resetting it.
    fn build(&self, image: &[u8]) -> Result<Controller, Reason> {
        let mut harness = Harness::new(self.bench.build(image).map_err(|_| Reason::OwnProfile)?);
        if self.handling.homing.is_some() {
            ask(&mut harness, self.handling.reset);
            converse(&mut harness, self.handling.ready);
        }
        Ok(harness.into_device())
    }
}

impl Row {
    fn new() -> Row {
        Row {
            steps: Vec::new(),
            fresh: false,
            writes: false,
            wrote: false,
            asked: false,
            travel: Travel::default(),
            end: [0; AXES],
            offsets: Vec::new(),
        }
    }
}

/// Removes the time that a step names.
fn take_time(step: &mut PortStep) -> Option<(u64, u64)> {
    match &mut step.act {
        Act::Expect(expected) => expected.at.take(),
        _ => None,
    }
}

/// Every value of a profile with its name, as in `quirks.stop_reply`.
pub(crate) fn leaves(table: &Table) -> Vec<(String, Value)> {
    let mut leaves = Vec::new();
    for (key, value) in table {
        match value {
            Value::Table(inner) => {
                let inner = crate::choice::leaves(inner).into_iter();
                leaves.extend(inner.map(|(name, value)| (format!("{key}.{name}"), value)));
            }
            value => leaves.push((key.clone(), value.clone())),
        }
    }
    leaves
}

/// The value of that name in a profile.
pub(crate) fn leaf<'t>(table: &'t Table, name: &str) -> Option<&'t Value> {
    match name.split_once('.') {
        Some((key, rest)) => leaf(table.get(key)?.as_table()?, rest),
        None => table.get(name),
    }
}
