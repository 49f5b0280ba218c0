//! What can be wrong with what a line asks for.

use std::fmt;

use thiserror::Error;
use vimc4_isel_wire::AxisSet;

use super::target::Direction;
use crate::Severity;
use crate::geometry::Reason;
use crate::language::reference::WHOLE_MARK;
use crate::language::{Accessory, LETTERS, Value};

/// What can be wrong with what a line asks for. Axes are given by index, X the first.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum Problem {
    /// No command is before the file mark, but blank lines or comments are.
    #[error("the file mark IMF_PBL is not in the first line")]
    MarkNotFirst,
    /// A command is before the file mark.
    #[error("the file mark IMF_PBL comes after a command")]
    MarkLate,
    /// There is no PROGEND.
    #[error("PROGEND is missing: the end of the file may be missing too")]
    EndMissing,
    /// There is no PROGEND, and the last line has no end.
    #[error(
        "the file ends in the middle of this line and without PROGEND: numbers may be cut short, \
         and lines may be missing"
    )]
    CutOff,
    /// There is no file mark.
    #[error("the file mark IMF_PBL is missing")]
    MarkMissing,
    /// The machine is not referenced before it moves.
    #[error("the job moves before any REF; all axes are referenced first")]
    ReferenceFirst,
    /// An axis moves that was not referenced with the others.
    #[error("{} moves without a reference run; its present place counts as 0", LETTERS[*.0])]
    NotReferenced(usize),
    /// A reference run without a reference switch never ends by itself.
    #[error("{} has no reference switch on this machine: its reference run goes on until STOP", LETTERS[*.0])]
    NoReferenceSwitch(usize),
    /// The machine lacks the axis.
    #[error("the machine has no {} axis", LETTERS[*.0])]
    NoSuchAxis(usize),
    /// A word is not used.
    #[error("{word} is ignored: it is not in the plane of the arc")]
    OutsidePlane {
        /// The word.
        word: char,
        /// The command that would use it.
        helix: Option<&'static str>,
    },
    /// A target is beyond what LIMIT allows.
    #[error("{} would go to {at} in machine coordinates, beyond its LIMIT {lowest},{highest}", LETTERS[*axis])]
    BeyondLimit {
        /// The axis.
        axis: usize,
        /// Where it would go.
        at: Value,
        /// The lowest place.
        lowest: Value,
        /// The highest.
        highest: Value,
    },
    /// A target is beyond the machine's travel.
    #[error("{} would go to {at} in machine coordinates; its travel ends at {end}", LETTERS[*axis])]
    BeyondTravel {
        /// The axis.
        axis: usize,
        /// Where it would go.
        at: Value,
        /// The end that is in the way.
        end: Value,
    },
    /// A target is beyond the controller's counter.
    #[error("{} would go to step {at}, beyond the controller's counter", LETTERS[*axis])]
    BeyondCounter {
        /// The axis.
        axis: usize,
        /// The counter it would need.
        at: i64,
    },
    /// A word that would lead elsewhere is not used.
    #[error("{} does not go to {at}: it is not in the plane of the arc", LETTERS[*axis])]
    OffPlane {
        /// The axis.
        axis: usize,
        /// Where the word would lead, in machine coordinates.
        at: Value,
        /// The command that would lead there.
        helix: Option<&'static str>,
    },
    /// J and K are both given for the same axis.
    #[error("J and K both give the centre in Z")]
    TwoCentres,
    /// W is not the angle from the start to the end.
    #[error(
        "W says {said} degrees, but the helix goes {is} from its start to its end; W does not count"
    )]
    SweepDiffers {
        /// What W says.
        said: Value,
        /// How far it is, in degrees.
        is: Value,
    },
    /// An arc whose centre is where it starts.
    #[error("the arc has no radius: its centre is where it starts")]
    NoRadius,
    /// An arc whose end is hardly beside its start, on the side that it leaves last.
    #[error("the end is less than a step from the start: this makes a whole circle")]
    NearlyWhole,
    /// An arc that does not lead to its end.
    #[error("the end is not on the arc: the radius is {start} at the start and {end} at the end")]
    UnevenRadius {
        /// The radius at the start.
        start: Value,
        /// The radius at the end.
        end: Value,
    },
    /// The controller is not fast enough.
    #[error(
        "a speed of {wanted} needs {asked} Hz; the controller makes {given} Hz at most, a speed of {speed}"
    )]
    SpeedCapped {
        /// The speed that was asked for.
        wanted: Value,
        /// Hz.
        asked: u64,
        /// Hz.
        given: u32,
        /// The speed that it is.
        speed: Value,
        /// What has set it.
        set_by: SetBy,
    },
    /// The controller is not slow enough.
    #[error(
        "a speed of {wanted} needs {asked} Hz; the controller makes {given} Hz at least, a speed of {speed}"
    )]
    SpeedRaised {
        /// The speed that was asked for.
        wanted: Value,
        /// Hz, which may be less than one.
        asked: Value,
        /// Hz.
        given: u32,
        /// The speed that it is.
        speed: Value,
        /// What has set it.
        set_by: SetBy,
    },
    /// One movement of the file takes many motions, and longer.
    #[error(
        "this takes {percent} % longer than it could: it is made in {pieces} pieces, because {why}"
    )]
    SlowPieces {
        /// How much longer.
        percent: u32,
        /// How many motions.
        pieces: u64,
        /// Why.
        why: Why,
    },
    /// The controller has no command for its ramps.
    #[error("ACCEL has no effect: this controller cannot change its acceleration")]
    AccelerationFixed,
    /// Logical ports that the profile does not map.
    #[error(
        "the machine's profile maps {ports} to no port of the controller{}",
        match lines {
            1 => String::new(),
            _ => format!(" ({lines} lines)"),
        }
    )]
    PortsUnmapped {
        /// The ports.
        ports: PortNames,
        /// How many lines use them.
        lines: u32,
    },
    /// Bits of a logical port without a wire.
    #[error(
        "the controller has no wire at {}; its wires are at {}",
        Bits { port: *port, bits: *bits },
        Bits { port: *port, bits: *wired }
    )]
    NoWire {
        /// The port.
        port: PortName,
        /// The bits that the line needs, the first of them bit 0.
        bits: u8,
        /// The bits with a wire.
        wired: u8,
        /// Whether the controller refuses such a value.
        is_refused: bool,
    },
    /// The profile names bits of a port that have no wire.
    #[error("no effect: the controller has no wire at bit {bit} of its output port {port}")]
    NoWireBehind {
        /// The port of the controller.
        port: u16,
        /// The bit, from 0.
        bit: u8,
    },
    /// A wait for levels that only the panel could give.
    #[error(
        "this waits until {port} reads {value:08b}B; untouched it reads {rest:08b}B, and {}",
        match free {
            0 => "none of its bits is an input".to_owned(),
            _ => format!("only {} can change", Bits { port: *port, bits: *free }),
        }
    )]
    WaitUnreachable {
        /// The port.
        port: PortName,
        /// What is waited for.
        value: u8,
        /// What it reads while nobody touches the panel.
        rest: u8,
        /// The bits that can change.
        free: u8,
    },
    /// The profile maps a port that the controller does not have.
    #[error("the controller has no {} {port}", if *input { "input port" } else { "output port" })]
    NoSuchPort {
        /// Whether it is an input.
        input: bool,
        /// The port of the controller.
        port: u16,
    },
    /// The spindle is not switched by the controller.
    #[error("SPINDLE has no effect: the machine's profile connects no spindle")]
    NoSpindle,
    /// The direction is not switched by the controller.
    #[error("the spindle's direction has no effect: the machine's profile connects nothing for it")]
    NoSpindleDirection,
    /// The speed of the spindle is not set by the controller.
    #[error("the spindle's speed is set by hand: the machine's profile connects nothing for it")]
    NoSpindleSpeed,
    /// The spindle does not turn that fast.
    #[error("the spindle makes {0} turns a minute at most")]
    SpindleCapped(u32),
    /// Things that the controller does not switch.
    #[error("no effect: the machine's profile connects nothing for {0}")]
    NotConnected(Accessories),
    /// Something follows the end.
    #[error("everything after PROGEND is ignored, and there is more")]
    BehindEnd,
    /// A radius of a few µm.
    #[error("a radius of {0} µm is very little")]
    MillimetreRadius(Value),
    /// The drill moves across at the surface after a hole.
    #[error(
        "the tool goes across the work at its surface: S is the height after a hole, and it is not above the reference plane"
    )]
    AtSurface,
    /// The drill moves across below the surface after a hole.
    #[error(
        "the tool goes across inside the work, {0} µm below the reference plane: S is below the plane"
    )]
    InsideWork(Value),
    /// L is below the reference plane, or below the bottom of the hole.
    #[error(
        "L is {} µm {} the reference plane: the drill would go down to it through the work at the rapid speed",
        Value::thousandths(.0.in_thousandths().abs()),
        if *.0 < Value::ZERO { "below" } else { "above, and the bottom is higher above," }
    )]
    LiftBelowPlane(Value),
    /// A length of DRILLDEF below 0, and which.
    #[error(
        "{0} is {1}, below 0, and is a length; R below 0 would lead into the work at the rapid speed"
    )]
    NegativeLength(char, Value),
    /// WPZERO before the place of the tool is known.
    #[error(
        "the tool's place is not known before a reference run, and WPZERO would make it the zero"
    )]
    PlaceUnknown,
    /// The place that became the zero gets other coordinates.
    #[error(
        "the work-piece zero of {axes} was taken in line {line}, before this reference run, and is another place from here on"
    )]
    ZeroBeforeReference {
        /// The axes.
        axes: AxisSet,
        /// The line that took the place for the zero.
        line: u32,
    },
    /// PATH, PATHEND.
    #[error("path processing has no effect: the moves run as they are written")]
    PathIgnored,
    /// The tool is not changed, because the options say so.
    #[error("tool {0} is not put in: the one before goes on")]
    ToolLeftOut(u32),
    /// TOOLDEF, INITTOOL.
    #[error("this has no effect: the operator changes tools at GETTOOL")]
    ToolIgnored,
    /// A register that was never set.
    #[error("register {0} is empty: the work-piece zero stays where it is")]
    EmptyRegister(u8),
    /// A hole without depth.
    #[error("this drills nothing: the depth D is not more than 0")]
    NoDepth,
    /// Steps of a cycle without a depth.
    #[error("neither F nor O says how deep a step is: the hole is drilled at once")]
    NoDrillSteps,
    /// Steps of a cycle behind the first without a depth.
    #[error("O does not say how deep the steps after the first are: each is one step of the axis")]
    NoOtherSteps,
    /// A command for files is typed where the operator is asked.
    #[error("{0} is for files, and is not done here")]
    ForFiles(&'static str),
    /// A depth of a few µm.
    #[error("a depth of {0} µm is very little")]
    MillimetresMeant(Value),
    /// CYL whose first axis does not turn.
    #[error("{} is not a turning axis", LETTERS[*.0])]
    NotRotary(usize),
    /// CYL whose second axis turns too.
    #[error("{} turns too: CYL needs a linear axis there", LETTERS[*.0])]
    NotLinear(usize),
    /// An arc, a helix or a drilled hole along the circumference of a cylinder.
    #[error("{} is turned into an angle by CYL and can only move along straight lines", LETTERS[*.0])]
    OnCylinder(usize),
    /// A turning axis that follows another.
    #[error("{} replaces another axis (CYL) and cannot be moved by itself", LETTERS[*.0])]
    Follows(usize),
    /// A stored program has nobody to ask.
    #[error("a stored program cannot wait for the operator")]
    NoOperator,
    /// A stored program waits in tenths of a second.
    #[error("a stored program waits in tenths of a second: this becomes {0} ms")]
    WaitRounded(u64),
    /// The program does not fit.
    #[error(
        "the program needs {needed} bytes and the controller has {there}: this line is the first \
         that does not fit"
    )]
    TooLarge {
        /// The bytes of the whole program.
        needed: u32,
        /// The bytes of the controller.
        there: u32,
    },
}

/// What sets a speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetBy {
    /// VEL.
    Velocity,
    /// FASTVEL.
    RapidVelocity,
    /// V of DRILLDEF.
    Drill {
        /// The lengths of DRILLDEF are mm, but V is not one of them.
        in_mm: bool,
        /// It is in thousandths of an inch a second.
        inch: bool,
    },
}

impl fmt::Display for SetBy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            SetBy::Velocity => "VEL",
            SetBy::RapidVelocity => "FASTVEL",
            SetBy::Drill { .. } => "V of DRILLDEF",
        })
    }
}

/// What would be right where V of DRILLDEF is too slow.
fn more_of_v(wanted: Value, in_mm: bool) -> String {
    let though = if in_mm { " under --drilldef-unit mm too" } else { "" };
    match wanted.times(1_000).filter(|_| wanted < Value::whole(1_000)) {
        Some(meant) => {
            format!("V of DRILLDEF is in µm/s{though}: for {wanted} mm/s write V{meant}")
        }
        None => format!("ask for more with V of DRILLDEF, which is in µm/s{though}"),
    }
}

/// Why a movement is made in pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// A and others move, and the controller moves A by itself.
    AWithOthers,
    /// An arc or a helix is not one motion.
    Curve(Reason),
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Why::AWithOthers => "the controller does not move A together with other axes",
            Why::Curve(Reason::UnequalSteps) => "the axes of the plane have unequal steps",
            Why::Curve(Reason::NoHelix) => "the controller has no helices",
            Why::Curve(Reason::Steep) => "it is steeper than the controller makes evenly",
            Why::Curve(Reason::OffTheCircle) => "no circle of the controller is near enough",
        })
    }
}

/// A logical port: A1 to A4, E1 to E4.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PortName {
    /// Which way it leads.
    pub direction: Direction,
    /// Its number, from 1.
    pub number: u8,
}

/// `A1`
impl fmt::Display for PortName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let letter = match self.direction {
            Direction::Input => 'E',
            Direction::Output => 'A',
        };
        write!(f, "{letter}{}", self.number)
    }
}

/// A set of logical ports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PortNames(u8);

impl PortNames {
    /// All that there can be, in the order of their bits.
    fn all() -> impl Iterator<Item = PortName> {
        let numbered = |direction| (1..=4).map(move |number| PortName { direction, number });
        numbered(Direction::Output).chain(numbered(Direction::Input))
    }

    /// The set of one port.
    pub(super) fn of(port: PortName) -> PortNames {
        let place = PortNames::all().position(|known| known == port);
        PortNames(place.map_or(0, |place| 1 << place))
    }

    /// Adds ports.
    pub(super) fn insert_all(&mut self, others: PortNames) {
        self.0 |= others.0;
    }

    fn iter(self) -> impl Iterator<Item = PortName> {
        (0..8).zip(PortNames::all()).filter(move |(bit, _)| self.0 >> bit & 1 == 1).map(|(_, p)| p)
    }

    /// What would map them, as a profile has it.
    fn profile_lines(self) -> String {
        let lines: Vec<String> = self.iter().map(|port| format!("{port} = 0")).collect();
        lines.join(", ")
    }
}

/// `A2 and E4`
impl fmt::Display for PortNames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        listed(f, self.iter())
    }
}

/// Bits of a logical port, as a file names them.
struct Bits {
    port: PortName,
    /// The first is bit 0.
    bits: u8,
}

/// `A1.4, A1.5 and A1.6`
impl fmt::Display for Bits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Bits { port, bits } = self;
        let set = (0..8).filter(|bit| bits >> bit & 1 == 1);
        listed(f, set.map(|bit| format!("{port}.{}", bit + 1)))
    }
}

/// `one, two and three`
fn listed(
    f: &mut fmt::Formatter<'_>,
    items: impl Iterator<Item = impl fmt::Display>,
) -> fmt::Result {
    let mut items = items.peekable();
    let mut is_first = true;
    while let Some(item) = items.next() {
        match (is_first, items.peek()) {
            (true, _) => write!(f, "{item}")?,
            (false, Some(_)) => write!(f, ", {item}")?,
            (false, None) => write!(f, " and {item}")?,
        }
        is_first = false;
    }
    Ok(())
}

/// Things that a job switches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Accessories(u16);

impl Accessories {
    /// Adds one.
    pub(super) fn insert(&mut self, accessory: Accessory) {
        self.0 |= 1 << accessory as u16;
    }
}

/// `WPCLAMP, PUMP and LAMP`
impl fmt::Display for Accessories {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        listed(f, Accessory::ALL.into_iter().filter(|one| self.0 >> *one as u16 & 1 == 1))
    }
}

impl Problem {
    /// Its severity.
    #[must_use]
    pub fn severity(self) -> Severity {
        use Problem::*;
        match self {
            MarkNotFirst | ReferenceFirst | OutsidePlane { .. } | ToolIgnored | NoSpindleSpeed => {
                Severity::Note
            }
            MarkLate
            | MarkMissing
            | EndMissing
            | NearlyWhole
            | NoWire { is_refused: false, .. }
            | NoWireBehind { .. }
            | WaitUnreachable { .. }
            | NotReferenced(_)
            | NoReferenceSwitch(_)
            | SpeedCapped { .. }
            | SpeedRaised { .. }
            | AccelerationFixed
            | NoSpindle
            | NoSpindleDirection
            | SpindleCapped(_)
            | SlowPieces { .. }
            | ToolLeftOut(_)
            | NotConnected(_)
            | BehindEnd
            | MillimetreRadius(_)
            | AtSurface
            | InsideWork(_)
            | ZeroBeforeReference { .. }
            | OffPlane { .. }
            | SweepDiffers { .. }
            | PathIgnored
            | EmptyRegister(_)
            | NoDepth
            | NoDrillSteps
            | NoOtherSteps
            | MillimetresMeant(_)
            | WaitRounded(_) => Severity::Warning,
            NoSuchAxis(_)
            | BeyondLimit { .. }
            | BeyondTravel { .. }
            | BeyondCounter { .. }
            | NoRadius
            | LiftBelowPlane(_)
            | NegativeLength(..)
            | PlaceUnknown
            | TwoCentres
            | UnevenRadius { .. }
            | CutOff
            | PortsUnmapped { .. }
            | NoWire { is_refused: true, .. }
            | NoSuchPort { .. }
            | NotRotary(_)
            | NotLinear(_)
            | OnCylinder(_)
            | Follows(_)
            | NoOperator
            | ForFiles(_)
            | TooLarge { .. } => Severity::Error,
        }
    }

    /// Its name.
    #[must_use]
    pub fn code(self) -> &'static str {
        use Problem::*;
        match self {
            MarkNotFirst => "mark-not-first",
            MarkLate => "mark-late",
            MarkMissing => "mark-missing",
            EndMissing => "end-missing",
            CutOff => "cut-off",
            ReferenceFirst => "reference-first",
            NotReferenced(_) => "not-referenced",
            NoReferenceSwitch(_) => "no-reference-switch",
            NoSuchAxis(_) => "no-such-axis",
            OutsidePlane { .. } => "outside-plane",
            BeyondLimit { .. } => "beyond-limit",
            BeyondTravel { .. } => "beyond-travel",
            BeyondCounter { .. } => "beyond-counter",
            NoRadius => "no-radius",
            UnevenRadius { .. } => "uneven-radius",
            NearlyWhole => "nearly-whole",
            SpeedCapped { .. } => "speed-capped",
            SpeedRaised { .. } => "speed-raised",
            AccelerationFixed => "acceleration-fixed",
            PortsUnmapped { .. } => "port-unmapped",
            NoWire { .. } => "no-wire",
            NoWireBehind { .. } => "no-wire-behind",
            WaitUnreachable { .. } => "wait-unreachable",
            NoSuchPort { .. } => "no-such-port",
            NoSpindle => "no-spindle",
            NoSpindleDirection => "no-spindle-direction",
            NoSpindleSpeed => "no-spindle-speed",
            SpindleCapped(_) => "spindle-capped",
            SlowPieces { .. } => "slow-pieces",
            NotConnected(_) => "not-connected",
            BehindEnd => "behind-end",
            MillimetreRadius(_) => "millimetre-radius",
            AtSurface => "at-surface",
            InsideWork(_) => "inside-work",
            LiftBelowPlane(_) => "lift-below-plane",
            NegativeLength(..) => "negative-length",
            PlaceUnknown => "place-unknown",
            ZeroBeforeReference { .. } => "zero-before-reference",
            OffPlane { .. } => "off-plane",
            TwoCentres => "two-centres",
            SweepDiffers { .. } => "sweep-differs",
            PathIgnored => "path-ignored",
            ToolIgnored => "tool-ignored",
            ToolLeftOut(_) => "tool-left-out",
            EmptyRegister(_) => "empty-register",
            NoDepth => "no-depth",
            NoDrillSteps => "no-drill-steps",
            NoOtherSteps => "no-other-steps",
            ForFiles(_) => "for-files",
            MillimetresMeant(_) => "millimetres-meant",
            NotRotary(_) => "not-rotary",
            NotLinear(_) => "turns-too",
            OnCylinder(_) => "on-cylinder",
            Follows(_) => "follows",
            NoOperator => "no-operator",
            WaitRounded(_) => "wait-rounded",
            TooLarge { .. } => "program-too-large",
        }
    }

    /// What would be right.
    #[must_use]
    pub fn help(self) -> Option<String> {
        use Problem::*;
        let help = match self {
            MarkNotFirst | MarkLate | MarkMissing => {
                return Some(format!(
                    "begin the file with {WHOLE_MARK}; other programs insist on it"
                ));
            }
            ReferenceFirst => {
                "begin the job with REF XYZ, or say with --no-ref that the machine is at its zero"
            }
            NotReferenced(_) => "name the axis in a REF before",
            NoReferenceSwitch(_) => "leave it out of the REF",
            NoSuchAxis(_) => "leave the word out, or choose a machine that has the axis",
            OutsidePlane { helix: Some(helix), .. } | OffPlane { helix: Some(helix), .. } => {
                return Some(format!(
                    "leave the word out, choose another PLANE, or make it a helix: {helix}"
                ));
            }
            OutsidePlane { .. } | OffPlane { .. } => "leave the word out, or choose another PLANE",
            EndMissing => "end the job with PROGEND, if all of it is there",
            CutOff => "if all of it is there, end the line, and write PROGEND in the next one",
            BeyondLimit { .. } => {
                "say with --zero X,Y,Z where the work-piece lies, or set another LIMIT"
            }
            BeyondTravel { .. } => {
                "say where the work-piece lies, with --zero X,Y,Z or in the machine's profile, [job.zero], or choose a larger machine"
            }
            BeyondCounter { .. } => "a counter has 24 bits: -8388608 to 8388607 steps",
            NoRadius | UnevenRadius { .. } | NearlyWhole | TwoCentres | SweepDiffers { .. } => {
                self.arc_help()?
            }
            SpeedCapped { .. } | SpeedRaised { .. } | SlowPieces { .. } => {
                return self.speed_help();
            }
            AccelerationFixed => "imc-m, imc-mp and imc-s8 can",
            PortsUnmapped { .. } | NoWire { .. } | WaitUnreachable { .. } => {
                return self.port_help();
            }
            NoWireBehind { .. } | NoSuchPort { .. } => self.wire_help()?,
            NoSpindle | NoSpindleDirection | NoSpindleSpeed | NotConnected(_) => {
                self.wire_help()?
            }
            BehindEnd => "move PROGEND to the end, or leave the rest out",
            MillimetreRadius(_) => "radii are in µm: CYL A25000 Y for 25 mm",
            AtSurface | InsideWork(_) => "set S above the work, as in DRILLDEF S5000",
            NegativeLength(..) => "F, O and R are lengths and not below 0, as in DRILLDEF R200",
            LiftBelowPlane(_) => {
                "L counts from the reference plane, positive above it, as in DRILLDEF L1000"
            }
            PlaceUnknown => {
                "begin the job with REF XYZ and go to the work-piece, leave WPZERO out and say with --zero X,Y,Z where it lies, or say with --no-ref that the machine is at its zero"
            }
            ZeroBeforeReference { .. } => {
                "reference all axes first, as in REF XYZ, and take the zero after it"
            }
            PathIgnored | ToolIgnored | ToolLeftOut(_) | SpindleCapped(_) | WaitRounded(_) => {
                return None;
            }
            EmptyRegister(number) => {
                return Some(format!("fill it first, as in WPREG{number} X0 Y0"));
            }
            NoDepth => "define it first, as in DRILLDEF D2000",
            NoOtherSteps => "define them too, as in DRILLDEF F1000 O500",
            ForFiles(command) => at_the_terminal(command),
            NoDrillSteps => "define them first, as in DRILLDEF F1000 O500",
            MillimetresMeant(_) => "if the file gives millimetres, add --drilldef-unit mm",
            NotRotary(_) => "name the turning axis first, as in CYL A5000 Y",
            NotLinear(_) => "name a linear axis second, as in CYL A5000 Y",
            OnCylinder(_) => "end the cylinder first, as in CYL A0",
            Follows(_) => "move the axis it replaces, or end the cylinder with radius 0",
            NoOperator => {
                "run the job with `vimc4 send`, or leave the line out, changes of the tool with \
                 --leave-out-tool-changes"
            }
            TooLarge { needed, there } => return Some(smaller(needed, there)),
        };
        Some(help.to_owned())
    }

    fn arc_help(self) -> Option<&'static str> {
        Some(match self {
            Problem::NearlyWhole => {
                "leave the end out if a whole circle is meant; otherwise turn the other way, or leave the arc out"
            }
            Problem::NoRadius => {
                "I and J give the centre: in ABS from the work-piece zero, in REL from the start"
            }
            Problem::UnevenRadius { .. } => {
                "centre and end must fit; in ABS both count from the work-piece zero, in REL from the start"
            }
            Problem::TwoCentres => "leave one of them",
            Problem::SweepDiffers { .. } => "leave W out, or correct the end",
            _ => return None,
        })
    }

    fn wire_help(self) -> Option<&'static str> {
        Some(match self {
            Problem::NoWireBehind { .. } => {
                "`vimc4 models show` lists the wires; the machine's profile names the bit under [job]"
            }
            Problem::NoSuchPort { .. } => {
                "`vimc4 models show` lists its ports; the machine's profile maps them under [job]"
            }
            Problem::NoSpindle => {
                "name its port in the machine's profile: [job.spindle.on] port = 2"
            }
            Problem::NoSpindleDirection => {
                "name its output in the machine's profile, [job.spindle.counterclockwise]"
            }
            Problem::NoSpindleSpeed => {
                "name its analogue output in the machine's profile, [job.spindle.analogue]"
            }
            Problem::NotConnected(_) => {
                "name the outputs in the machine's profile, [job.coolant] and [job.accessories]"
            }
            _ => return None,
        })
    }

    fn speed_help(self) -> Option<String> {
        Some(match self {
            Problem::SpeedCapped { set_by, .. } => format!("ask for less with {set_by}"),
            Problem::SpeedRaised {
                set_by: SetBy::Drill { in_mm, inch: false }, wanted, ..
            } => more_of_v(wanted, in_mm),
            Problem::SpeedRaised { set_by, .. } => format!("ask for more with {set_by}"),
            Problem::SlowPieces { why, .. } => match why {
                Why::AWithOthers => {
                    "move A by itself, or allow it more steps in the machine's profile: [job] apart = 4"
                }
                Why::Curve(Reason::NoHelix) => {
                    "choose a model that has helices, imc-m, imc-mp or imc-s8, or a lower VEL"
                }
                _ => "a lower VEL loses less",
            }
            .to_owned(),
            _ => return None,
        })
    }

    fn port_help(self) -> Option<String> {
        let connect = |port: PortName| {
            format!(
                "connect {port} to another port of the controller in the machine's profile, [job.ports]"
            )
        };
        Some(match self {
            Problem::PortsUnmapped { ports, .. } => format!(
                "add to the machine's profile, each with the number of its port: [job.ports] {}",
                ports.profile_lines()
            ),
            Problem::NoWire { port, .. } => {
                format!("use a bit with a wire, or {}", connect(port))
            }
            Problem::WaitUnreachable { port, free: 0, .. } => connect(port),
            Problem::WaitUnreachable { port, free, .. } => format!(
                "wait for single bits, as in WAITBIT {port}.{}=1, or {}",
                free.trailing_zeros() + 1,
                connect(port)
            ),
            _ => return None,
        })
    }
}

/// What a command of files is at the terminal.
fn at_the_terminal(command: &str) -> &'static str {
    match command {
        "HALT" => "the job waits already",
        "GETTOOL" => "put the tool in, and go on",
        "WPTEACH" => "move to where the zero is, and type WPZERO",
        _ => "q ends the job",
    }
}

/// How a job is split that is too large for the memory.
fn smaller(needed: u32, there: u32) -> String {
    format!(
        "split the job into {} or more: the first ends before this line with PROGEND, and the next \
         begins at this line, after the settings that hold there; or send it with `vimc4 send`, \
         which stores nothing",
        needed.div_ceil(there.max(1))
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_speed_is_mended_where_it_is_set() {
        let help = |wanted, set_by| {
            let wanted = Value::whole(wanted);
            let speed = Value::whole(250);
            Problem::SpeedRaised { wanted, asked: Value::whole(1), given: 20, speed, set_by }.help()
        };
        let drill = |in_mm, inch| SetBy::Drill { in_mm, inch };
        for (wanted, set_by, expected) in [
            (2, SetBy::Velocity, "ask for more with VEL"),
            (2, SetBy::RapidVelocity, "ask for more with FASTVEL"),
            (2, drill(false, false), "V of DRILLDEF is in µm/s: for 2 mm/s write V2000"),
            (
                2,
                drill(true, false),
                "V of DRILLDEF is in µm/s under --drilldef-unit mm too: for 2 mm/s write V2000",
            ),
            (1_500, drill(false, false), "ask for more with V of DRILLDEF, which is in µm/s"),
            (2, drill(true, true), "ask for more with V of DRILLDEF"),
        ] {
            assert_eq!(help(wanted, set_by).as_deref(), Some(expected));
        }
    }
}
