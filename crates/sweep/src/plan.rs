//! Where something can go wrong, and what: a list in which every point has a number.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use vimc4_device::{
    Awaited, Condition, Damage, Device, Fault, Garbling, Grouped, LineFault, MachineFault, Mishap,
    Signal, SignalId, SwitchSays, Way, When,
};

use crate::account::{Account, MotionPlace};

/// How long something of the machine lasts that passes by itself.
const PASSES: Duration = Duration::from_millis(100);

/// How late a byte reaches the controller.
const DELAY: Duration = Duration::from_secs(1);

/// How a byte is garbled: with this bit the other way round a digit, a letter or a sign is none any
/// more.
const GARBLES: u8 = 0x40;

/// How a byte is misread: with this bit the other way round a digit is another digit.
const MISREADS: u8 = 0x01;

/// How many steps are lost.
const LOST: i64 = 20;

/// No line of a command is shown longer than this, in characters.
const SHOWN: usize = 44;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Harm {
    /// A byte does not arrive.
    Dropped,
    /// A byte arrives as one that belongs to no command or answer.
    Garbled,
    /// A byte arrives as one that belongs there as well: a 5 as a 4.
    Misread,
    /// A byte arrives twice.
    Duplicated,
    /// A byte to the host, and what follows it in its answer, arrives only with the next answer. A byte to
    /// the controller arrives a second later; a host whose time stands still does not notice that.
    Delayed,
    /// STOP is pressed.
    Stop,
    /// The emergency stop is pressed.
    EmergencyStop,
    /// The limit switch that the axis moves towards is pressed.
    LimitSwitch,
    /// The power fails.
    PowerOff,
    /// The carriage loses 20 steps, of which the controller knows nothing.
    LostSteps,
}

impl Harm {
    /// All of them with their names.
    pub const ALL: [(Harm, &'static str); 10] = [
        (Harm::Dropped, "dropped"),
        (Harm::Garbled, "garbled"),
        (Harm::Misread, "misread"),
        (Harm::Duplicated, "duplicated"),
        (Harm::Delayed, "delayed"),
        (Harm::Stop, "stop"),
        (Harm::EmergencyStop, "emergency-stop"),
        (Harm::LimitSwitch, "limit-switch"),
        (Harm::PowerOff, "power-off"),
        (Harm::LostSteps, "lost-steps"),
    ];

    /// Those that a host can notice by its answers and the position that it reads.
    #[must_use]
    pub fn usual() -> Vec<Harm> {
        let all = Harm::ALL.into_iter().map(|(harm, _)| harm);
        all.filter(|harm| !matches!(harm, Harm::Misread | Harm::LostSteps)).collect()
    }

    fn modes(self) -> &'static [Mode] {
        match self {
            // What is late stays late, and steps are lost once.
            Harm::Delayed | Harm::LostSteps => &[Mode::Transient, Mode::Compound],
            _ => &[Mode::Transient, Mode::Persistent, Mode::Compound],
        }
    }
}

/// How it goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Once. What the machine has passes after 100 ms of its time.
    Transient,
    /// From then on: with every byte, and without an end.
    Persistent,
    /// Once, and the next byte that the controller sends then is lost as well: a second fault while the
    /// host recovers from the first.
    Compound,
}

impl Mode {
    /// All of them with their names.
    pub const ALL: [(Mode, &'static str); 3] = [
        (Mode::Transient, "transient"),
        (Mode::Persistent, "persistent"),
        (Mode::Compound, "compound"),
    ];
}

/// Where it goes wrong, in the run without a fault. All numbers are from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// A byte to the controller.
    ToController(usize),
    /// A byte to the host.
    ToHost(usize),
    /// A command begins.
    Command(usize),
    /// A motion is so many quarters on its way.
    Motion(usize, u8),
    /// An answer has been given.
    Answer(usize),
}

/// One of all points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Point {
    /// Its number, from 0.
    pub number: u64,
    /// Where.
    pub place: Place,
    /// What.
    pub harm: Harm,
    /// How.
    pub mode: Mode,
}

/// Which points a plan has.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Choice {
    /// What goes wrong.
    pub harms: Vec<Harm>,
    /// How.
    pub modes: Vec<Mode>,
    /// Whether the host is a program: while it thinks, time stands still or jumps.
    pub live: bool,
}

impl Default for Choice {
    fn default() -> Choice {
        let (harms, modes) = (Harm::usual(), Mode::ALL.map(|(mode, _)| mode).to_vec());
        Choice { harms, modes, live: false }
    }
}

/// All points of a session, in order: the bytes to the controller, the bytes to the host, and what
/// happens to the machine at commands, in motions and after answers. Equal sessions have equal plans.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    sections: Vec<Section>,
    stop: Option<SignalId>,
    emergency_stop: Option<SignalId>,
}

/// Places of one sort, each with the same points.
#[derive(Clone, Debug, PartialEq)]
struct Section {
    places: Places,
    variants: Vec<(Harm, Mode)>,
}

/// Places, which are counted where there are many.
#[derive(Clone, Debug, PartialEq)]
enum Places {
    ToController(usize),
    ToHost(usize),
    Listed(Vec<Place>),
}

/// What has been before a snapshot, from which a point is counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Base {
    pub(crate) sent: u64,
    pub(crate) heard: u64,
    pub(crate) begun: u64,
    pub(crate) answered: u64,
}

impl Plan {
    /// All points of a session that went like this without a fault.
    pub fn new<D: Device>(clean: &Account, device: &D, chosen: &Choice) -> Plan {
        let signals = device.signals();
        let stop = signals.iter().find(|signal| signal.name == "stop");
        let emergency_stop = signals.iter().find(|signal| signal.latches);
        let id = |signal: Option<&Signal>| signal.map(|signal| signal.id);
        let (stop, emergency_stop) = (id(stop), id(emergency_stop));
        let motions: Vec<Place> = (0..).zip(&clean.motions).flat_map(quarters).collect();
        let commands: Vec<Place> = (0..clean.commands.len()).map(Place::Command).collect();
        let answers: Vec<Place> = (0..clean.answers.len()).map(Place::Answer).collect();
        // STOP and a switch that is hit too early end a reference run, and the controller reports that all
        // is well: no host can notice that.
        let is_reference = |command: u64| {
            let mut of_command = clean.motions.iter().filter(|motion| motion.command == command);
            of_command.any(|motion| motion.references)
        };
        let can_be_stopped = |place: &&Place| match place {
            Place::Command(command) => !is_reference(*command as u64 + 1),
            Place::Motion(motion, _) => {
                clean.motions.get(*motion).is_some_and(|motion| !motion.references)
            }
            _ => true,
        };
        let stopped = commands.iter().chain(&motions).filter(can_be_stopped).copied().collect();
        let variants = |harms: &[Harm]| {
            let has = |harm: &Harm| match harm {
                Harm::Stop => stop.is_some(),
                Harm::EmergencyStop => emergency_stop.is_some(),
                _ => true,
            };
            let harms = harms.iter().filter(|harm| chosen.harms.contains(harm) && has(harm));
            let modes = |harm: &Harm| {
                let modes = harm.modes().iter().filter(|mode| chosen.modes.contains(mode));
                modes.map(|mode| (*harm, *mode)).collect::<Vec<_>>()
            };
            harms.flat_map(modes).collect::<Vec<_>>()
        };
        let bytes = [Harm::Dropped, Harm::Garbled, Harm::Misread, Harm::Duplicated, Harm::Delayed];
        let to_controller = if chosen.live { &bytes[..4] } else { &bytes[..] };
        let moving = [Harm::EmergencyStop, Harm::PowerOff, Harm::LostSteps];
        let moves = motions.iter().filter(can_be_stopped).copied().collect();
        let section =
            |places: Places, harms: &[Harm]| Section { places, variants: variants(harms) };
        let sections = vec![
            section(Places::ToController(clean.to_controller.len()), to_controller),
            section(Places::ToHost(clean.to_host.len()), &bytes),
            section(Places::Listed(stopped), &[Harm::Stop]),
            section(Places::Listed(commands), &[Harm::PowerOff]),
            section(Places::Listed(moves), &[Harm::LimitSwitch]),
            section(Places::Listed(motions), &moving),
            section(Places::Listed(answers), &[Harm::PowerOff]),
        ];
        Plan { sections, stop, emergency_stop }
    }

    /// How many points there are.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.sections.iter().map(Section::len).sum()
    }

    /// Whether there is nothing that could go wrong.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The point of this number.
    #[must_use]
    pub fn point(&self, number: u64) -> Option<Point> {
        let mut rest = number;
        for section in &self.sections {
            if rest >= section.len() {
                rest -= section.len();
                continue;
            }
            let variants = section.variants.len() as u64;
            let place = usize::try_from(rest / variants).ok()?;
            let (harm, mode) = *section.variants.get(usize::try_from(rest % variants).ok()?)?;
            let place = match &section.places {
                Places::ToController(_) => Place::ToController(place),
                Places::ToHost(_) => Place::ToHost(place),
                Places::Listed(places) => *places.get(place)?,
            };
            return Some(Point { number, place, harm, mode });
        }
        None
    }

    /// The faults of a point, for a device that begins where the session begins. They are begun in this
    /// order, before anything else.
    #[must_use]
    pub fn faults(&self, clean: &Account, point: &Point) -> Vec<Fault> {
        self.faults_from(clean, point, Base::default())
    }

    /// The same for a device that is further on, but not yet there.
    pub(crate) fn faults_from(&self, clean: &Account, point: &Point, base: Base) -> Vec<Fault> {
        let Point { place, harm, mode, .. } = *point;
        let mut faults = Vec::new();
        if mode == Mode::Compound {
            let next = heard_before(clean, place).saturating_sub(base.heard) + 1;
            let when = When { first: next, ..When::once() };
            faults.push(LineFault::new(Damage::Drop, Way::ToHost, when).into());
        }
        match place {
            Place::ToController(byte) => {
                let first = (byte as u64).saturating_sub(base.sent) + 1;
                faults.extend(of_byte(harm, mode, Way::ToController, first));
            }
            Place::ToHost(byte) if harm == Harm::Delayed => {
                let first = (byte as u64).saturating_sub(base.heard) + 1;
                faults.extend(late(clean, byte, first));
            }
            Place::ToHost(byte) => {
                let first = (byte as u64).saturating_sub(base.heard) + 1;
                faults.extend(of_byte(harm, mode, Way::ToHost, first));
            }
            Place::Command(command) => {
                let times = (command as u64 + 1).saturating_sub(base.begun);
                let after = vec![begun(times)];
                faults.extend(self.of_machine(harm, mode, None, after));
            }
            Place::Motion(motion, quarter) => {
                if let Some(motion) = clean.motions.get(motion) {
                    let times = motion.command.saturating_sub(base.begun);
                    let position = position(motion, quarter);
                    let condition = Condition::AxisAt { axis: motion.axis, position };
                    let after = vec![begun(times), Awaited { condition, times: 1 }];
                    faults.extend(self.of_machine(harm, mode, Some(motion), after));
                }
            }
            Place::Answer(answer) => {
                let times = (answer as u64 + 1).saturating_sub(base.answered);
                let condition = Condition::Answered { like: None };
                let after = vec![Awaited { condition, times: small(times) }];
                faults.extend(self.of_machine(harm, mode, None, after));
            }
        }
        faults
    }

    /// Whether a point is still to come where so much has been.
    pub(crate) fn is_after(&self, clean: &Account, point: &Point, base: Base) -> bool {
        match point.place {
            Place::ToController(byte) => base.sent <= byte as u64,
            Place::ToHost(byte) => base.heard <= byte as u64,
            Place::Command(command) => base.begun <= command as u64,
            Place::Motion(motion, _) => {
                clean.motions.get(motion).is_some_and(|motion| base.begun < motion.command)
            }
            Place::Answer(answer) => base.answered <= answer as u64,
        }
    }

    fn of_machine(
        &self,
        harm: Harm,
        mode: Mode,
        motion: Option<&MotionPlace>,
        after: Vec<Awaited>,
    ) -> Option<Fault> {
        let ahead = |motion: &MotionPlace| motion.to > motion.from;
        let mishap = match harm {
            Harm::Stop => Mishap::Hold { signal: self.stop?, value: 1 },
            Harm::EmergencyStop => Mishap::Hold { signal: self.emergency_stop?, value: 1 },
            Harm::LimitSwitch => {
                let motion = motion?;
                let (axis, positive) = (motion.axis, ahead(motion));
                Mishap::Switch { axis, positive, says: SwitchSays::Pressed }
            }
            Harm::LostSteps => {
                let motion = motion?;
                let steps = if ahead(motion) { -LOST } else { LOST };
                Mishap::Push { axis: motion.axis, steps }
            }
            _ => Mishap::Power,
        };
        let lasts = (mode != Mode::Persistent).then_some(PASSES);
        Some(MachineFault { mishap, when: When { after, lasts, ..When::ALWAYS } }.into())
    }

    /// What goes wrong at a point, for people: a sentence without an end.
    #[must_use]
    pub fn describe(&self, clean: &Account, point: &Point) -> String {
        let Point { place, harm, mode, .. } = *point;
        let said = |exchange: usize| match clean.exchanges.get(exchange) {
            Some(exchange) if !exchange.said.is_empty() => shown(&exchange.said),
            _ => "the first line".to_owned(),
        };
        let happens = match harm {
            Harm::Dropped => "was lost",
            Harm::Garbled => "was garbled",
            Harm::Misread => "was misread",
            Harm::Duplicated => "came twice",
            Harm::Delayed => "came late",
            Harm::Stop => "STOP was pressed",
            Harm::EmergencyStop => "the emergency stop was pressed",
            Harm::LimitSwitch => "a limit switch was hit",
            Harm::PowerOff => "the power failed",
            Harm::LostSteps => "the carriage lost 20 steps",
        };
        let mut words = match place {
            Place::ToController(byte) => {
                let exchange = clean.to_controller.get(byte).map_or(0, |(exchange, _)| *exchange);
                let same = |before: &&(usize, u64)| before.0 == exchange;
                let before = clean.to_controller[..byte.min(clean.to_controller.len())].iter();
                let nth = before.rev().take_while(same).count() + 1;
                let line = clean.exchanges.get(exchange);
                let byte = line.and_then(|line| line.said.get(nth - 1)).copied();
                let byte = byte.map_or_else(|| "the end".to_owned(), |byte| shown(&[byte]));
                format!(
                    "{byte} (byte {nth}) of {} {happens} on its way to the controller",
                    said(exchange)
                )
            }
            Place::ToHost(byte) => {
                let (value, exchange) = clean.to_host.get(byte).copied().unwrap_or_default();
                let same = |before: &&(u8, usize)| before.1 == exchange;
                let before = clean.to_host[..byte.min(clean.to_host.len())].iter();
                let nth = before.rev().take_while(same).count() + 1;
                let (value, said) = (shown(&[value]), said(exchange));
                match harm {
                    Harm::Delayed if nth == 1 => {
                        format!("the answer to {said} {happens}: with the next answer")
                    }
                    Harm::Delayed => format!(
                        "the answer to {said} {happens} from byte {nth} on: with the next answer"
                    ),
                    _ => format!(
                        "{value} (byte {nth}) of the answer to {said} {happens} on its way to the host"
                    ),
                }
            }
            Place::Command(command) => {
                format!("{happens} when {} began", command_shown(clean, command))
            }
            Place::Motion(motion, quarter) => match clean.motions.get(motion) {
                Some(motion) => {
                    let command = usize::try_from(motion.command).unwrap_or_default();
                    let place = Grouped(position(motion, quarter));
                    let command = command_shown(clean, command.saturating_sub(1));
                    format!("{happens} when {} was at {place}, during {command}", motion.name)
                }
                None => happens.to_owned(),
            },
            Place::Answer(answer) => {
                let exchange = clean.answers.get(answer).copied().unwrap_or_default();
                format!("{happens} when {} had been answered", said(exchange))
            }
        };
        words += match (mode, place, harm) {
            (Mode::Transient, _, Harm::PowerOff) => " and came back at once",
            (Mode::Transient, ..) => "",
            (Mode::Persistent, Place::ToController(_) | Place::ToHost(_), _) => {
                ", and so was every byte after it"
            }
            (Mode::Persistent, ..) => " and stayed so",
            (Mode::Compound, ..) => "; and then the next byte to the host was lost",
        };
        words
    }
}

impl Section {
    fn len(&self) -> u64 {
        let places = match &self.places {
            Places::ToController(count) | Places::ToHost(count) => *count,
            Places::Listed(places) => places.len(),
        };
        places as u64 * self.variants.len() as u64
    }
}

/// The places on the way of a motion.
fn quarters((place, motion): (usize, &MotionPlace)) -> Vec<Place> {
    let is_between = |quarter: &u8| position(motion, *quarter) != motion.from;
    (1..=3).filter(is_between).map(|quarter| Place::Motion(place, quarter)).collect()
}

/// Where the counter of the axis is so many quarters of the way on.
fn position(motion: &MotionPlace, quarter: u8) -> i64 {
    let way = i128::from(motion.to) - i128::from(motion.from);
    let at = i128::from(motion.from) + way * i128::from(quarter) / 4;
    i64::try_from(at).unwrap_or(motion.from)
}

fn small(times: u64) -> u32 {
    u32::try_from(times.max(1)).unwrap_or(u32::MAX)
}

fn begun(times: u64) -> Awaited {
    Awaited { condition: Condition::Command { like: None }, times: small(times) }
}

/// How many bytes have come to the host when it goes wrong, the byte itself included.
fn heard_before(clean: &Account, place: Place) -> u64 {
    match place {
        Place::ToController(byte) => clean.to_controller.get(byte).map_or(0, |(_, heard)| *heard),
        Place::ToHost(byte) => byte as u64 + 1,
        Place::Command(command) => clean.commands.get(command).map_or(0, |command| command.heard),
        Place::Motion(motion, _) => clean.motions.get(motion).map_or(0, |motion| motion.heard),
        Place::Answer(answer) => {
            let exchange = clean.answers.get(answer).copied().unwrap_or_default();
            clean.to_host.partition_point(|(_, heard)| *heard <= exchange) as u64
        }
    }
}

fn of_byte(harm: Harm, mode: Mode, way: Way, first: u64) -> Option<Fault> {
    let damage = match harm {
        Harm::Dropped => Damage::Drop,
        Harm::Garbled => Damage::Garble(Garbling::Flip(GARBLES)),
        Harm::Misread => Damage::Garble(Garbling::Flip(MISREADS)),
        Harm::Duplicated => Damage::Duplicate,
        _ => Damage::Delay(DELAY),
    };
    let times = (mode != Mode::Persistent).then_some(1);
    Some(LineFault::new(damage, way, When { first, times, ..When::ALWAYS }).into())
}

/// The rest of an answer from one of its bytes on comes before the next answer. What puts it there is
/// begun first, since it counts bytes that the other one takes away.
fn late(clean: &Account, byte: usize, first: u64) -> Vec<Fault> {
    let exchange = clean.to_host.get(byte).map_or(0, |(_, exchange)| *exchange);
    let end = clean.to_host.partition_point(|(_, heard)| *heard <= exchange);
    let rest: Vec<u8> = clean.to_host[byte.min(end)..end].iter().map(|(byte, _)| *byte).collect();
    let count = rest.len();
    let mut faults = Vec::new();
    if end < clean.to_host.len() {
        // Before which byte it comes is said with `every`, or it would come by itself.
        let when = When { first: first + count as u64, ..When::once() };
        faults.push(LineFault::new(Damage::Insert(Bytes::from(rest)), Way::ToHost, when).into());
    }
    let run = u32::try_from(count).unwrap_or(u32::MAX);
    let when = When { first, ..When::once() };
    faults.push(LineFault::new(Damage::Drop, Way::ToHost, when).bytes(run).into());
    faults
}

/// Bytes as people read them, in quotes, no longer than a line.
pub(crate) fn shown(bytes: &[u8]) -> String {
    let text = vimc4_device::escape(bytes);
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("`{}…`", &text[..end]),
        None => format!("`{text}`"),
    }
}

fn command_shown(clean: &Account, command: usize) -> String {
    match clean.commands.get(command) {
        Some(command) => format!("{} ({})", shown(&command.line), command.means),
        None => "a command".to_owned(),
    }
}

/// A part of all points that is done elsewhere than the others: those whose number, divided by `of`,
/// leaves `number - 1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Which, from 1.
    pub number: u64,
    /// Of how many.
    pub of: u64,
}

/// A text that names no shard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShardError(String);

impl fmt::Display for ShardError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` is no shard; write its number and how many there are, as in 3/16", self.0)
    }
}

impl std::error::Error for ShardError {}

impl Shard {
    /// All points.
    pub const WHOLE: Shard = Shard { number: 1, of: 1 };

    /// The numbers of its points, of so many.
    pub fn numbers(self, points: u64) -> impl Iterator<Item = u64> {
        let step = usize::try_from(self.of).unwrap_or(usize::MAX).max(1);
        (self.number.saturating_sub(1)..points).step_by(step)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Shard, ShardError> {
        let parsed = text.split_once('/').and_then(|(number, of)| {
            let (number, of) = (number.parse().ok()?, of.parse().ok()?);
            (1..=of).contains(&number).then_some(Shard { number, of })
        });
        parsed.ok_or_else(|| ShardError(text.to_owned()))
    }
}
