//! What a machine is like.

use serde::{Deserialize, Serialize};
use vimc4_device::{AXES, LengthUnit, Loss, Scale, Warning};

use crate::job::JobSetup;
use crate::profile::ProfileError;
use crate::profiles;

/// An end of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum End {
    /// Where the carriage's position is smallest; limit switch 1.
    Negative,
    /// Where it is largest; limit switch 2.
    Positive,
}

impl End {
    /// The other end.
    #[must_use]
    pub fn other(self) -> End {
        match self {
            End::Negative => End::Positive,
            End::Positive => End::Negative,
        }
    }
}

/// Where an axis finds its reference point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Reference {
    /// At the limit switch of the negative end.
    Negative,
    /// At the limit switch of the positive end.
    Positive,
    /// At carriage position 0, from whichever side it comes. For a bench without ends.
    Home,
    /// Nowhere: no reference switch is connected, a reference run never ends by itself.
    None,
}

/// What a step of an axis is in the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// A carriage on a spindle.
    Linear,
    /// A turning table.
    Rotary,
}

/// What a step of an axis is for people.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    /// `mm`, or `°` of a turning table.
    pub name: &'static str,
    /// How much of it a step is.
    pub per_step: f64,
}

/// One axis of a machine. Positions are steps of the carriage, counted in the machine's own
/// direction; the profile defines position 0 by placing everything else relative to it.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// Linear or rotary.
    pub unit: Unit,
    /// Steps of the motor for one turn of the spindle or the table.
    pub steps_per_turn: u32,
    /// The spindle's lead in µm; absent on a rotary axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lead_um: Option<u32>,
    /// Whether a positive step moves the carriage towards its negative end.
    #[serde(default)]
    pub inverted: bool,
    /// Where the reference point is.
    pub reference: Reference,
    /// The negative limit switch is active here and below.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub negative_switch: Option<i64>,
    /// The positive limit switch is active here and above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub positive_switch: Option<i64>,
    /// The lowest position the mechanics allow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lowest: Option<i64>,
    /// The highest position the mechanics allow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub highest: Option<i64>,
    /// Where the carriage stands at first.
    #[serde(default)]
    pub start: i64,
    /// How many steps the motor makes after it has turned round before the carriage follows.
    #[serde(default, skip_serializing_if = "is_default")]
    pub backlash: u32,
    /// How many steps further back a limit switch releases than it was pressed.
    #[serde(default, skip_serializing_if = "is_default")]
    pub hysteresis: u32,
    /// The limits of its motor; absent if it follows any demand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motor: Option<Motor>,
}

/// The limits of a motor with the mass that it has to move. A motor that is asked for more stalls
/// until the motion is over.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Motor {
    /// The highest step frequency in Hz with which it starts without a ramp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<u32>,
    /// The greatest acceleration in Hz/ms that it follows at a step frequency in Hz, as pairs of
    /// these with ascending frequencies and descending accelerations. It is interpolated between
    /// two pairs, constant below the first, and none above the last.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pull: Vec<(u32, u32)>,
    /// Its extra load, such as a cut: the acceleration in Hz/ms that would load it as much.
    #[serde(skip_serializing_if = "is_default")]
    pub load: u32,
}

impl Machine {
    /// Says by how many steps carriage minus counter of an axis has changed, and how.
    #[must_use]
    pub fn steps_lost(&self, axis: usize, name: &'static str, steps: i64, how: Loss) -> Warning {
        let gear = self.axis(axis);
        let um = gear.lead_um.and_then(|lead| {
            let turn = u128::from(gear.steps_per_turn.max(1));
            let way = u128::from(steps.unsigned_abs()) * u128::from(lead);
            u64::try_from((way + turn / 2) / turn).ok()
        });
        Warning::StepsLost { axis: axis as u8, name: name.into(), steps, um, how }
    }
}

impl Axis {
    /// Where the limit switch of an end becomes active, if there is one.
    #[must_use]
    pub fn switch(&self, end: End) -> Option<i64> {
        match end {
            End::Negative => self.negative_switch,
            End::Positive => self.positive_switch,
        }
    }

    /// The range in which the carriage presses no switch and is within the mechanics, as a
    /// controller counts from the reference point. `None` where nothing limits it, or where it has
    /// no reference point.
    #[must_use]
    pub fn travel(&self) -> (Option<i64>, Option<i64>) {
        let lowest = self.negative_switch.map(|at| at + 1).max(self.lowest);
        let highest = match (self.positive_switch.map(|at| at - 1), self.highest) {
            (Some(switch), Some(end)) => Some(switch.min(end)),
            (one, other) => one.or(other),
        };
        let zero = match self.reference {
            Reference::Negative => lowest,
            Reference::Positive => highest,
            Reference::Home => Some(0),
            Reference::None => None,
        };
        let Some(zero) = zero else { return (None, None) };
        let (lowest, highest) = (lowest.map(|at| at - zero), highest.map(|at| at - zero));
        if self.inverted {
            (highest.map(|at| -at), lowest.map(|at| -at))
        } else {
            (lowest, highest)
        }
    }

    /// Whether a carriage at `position` presses the limit switch of an end.
    #[must_use]
    pub fn presses(&self, end: End, position: i64) -> bool {
        match end {
            End::Negative => self.negative_switch.is_some_and(|at| position <= at),
            End::Positive => self.positive_switch.is_some_and(|at| position >= at),
        }
    }
}

/// A machine: its axes and how its switches are wired.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Machine {
    /// Its name.
    pub name: String,
    /// What it is, in one line.
    pub title: String,
    /// Whether a pressed limit switch reads 0 on the raw port instead of 1.
    #[serde(default)]
    pub switches_low_active: bool,
    /// Whether it finds its reference points by itself: an LPKF controller then makes a reference
    /// run of all axes when it is switched on, and on `IN`. isel's wait for the command.
    #[serde(default)]
    pub homes: bool,
    /// How job files are run on it.
    #[serde(default, skip_serializing_if = "is_default")]
    pub job: JobSetup,
    /// The axes that are fitted.
    pub axes: Axes,
}

pub(crate) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// The axes by name, in the order in which controllers count them. What isel calls Z and A is
/// Z0 and Z1 to LPKF, which go on with Z2 and Z3; a profile may use either name.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axes {
    /// The X axis.
    pub x: Axis,
    /// The Y axis.
    pub y: Axis,
    /// The Z axis, or Z0.
    #[serde(default, alias = "z0", skip_serializing_if = "Option::is_none")]
    pub z: Option<Axis>,
    /// The A axis, or Z1.
    #[serde(default, alias = "z1", skip_serializing_if = "Option::is_none")]
    pub a: Option<Axis>,
    /// The Z2 axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z2: Option<Axis>,
    /// The Z3 axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub z3: Option<Axis>,
}

/// A motor that drives nothing.
static UNFITTED: Axis = Axis {
    unit: Unit::Linear,
    steps_per_turn: 400,
    lead_um: Some(5_000),
    inverted: false,
    reference: Reference::None,
    negative_switch: None,
    positive_switch: None,
    lowest: None,
    highest: None,
    start: 0,
    backlash: 0,
    hysteresis: 0,
    motor: None,
};

profiles! { Machine, Machine::check, [
    "bench" = include_str!("../machines/bench.toml"),
    "mill" = include_str!("../machines/mill.toml"),
    "mill-4axis" = include_str!("../machines/mill-4axis.toml"),
    "traverse" = include_str!("../machines/traverse.toml"),
    "stage" = include_str!("../machines/stage.toml"),
    "board-plotter" = include_str!("../machines/board-plotter.toml"),
    "positioner" = include_str!("../machines/positioner.toml"),
] }

impl Machine {
    /// What a step of each axis is for people.
    ///
    /// ```
    /// let mill = vimc4_plant::Machine::builtin("mill").expect("a built-in machine");
    /// let x = mill.measures()[0];
    /// assert_eq!((x.name, 800.0 * x.per_step), ("mm", 10.0));
    /// ```
    #[must_use]
    pub fn measures(&self) -> [Measure; AXES] {
        std::array::from_fn(|axis| {
            let axis = self.axis(axis);
            let turn = f64::from(axis.steps_per_turn);
            match axis.lead_um {
                Some(lead) => Measure { name: "mm", per_step: f64::from(lead) / 1_000.0 / turn },
                None => Measure { name: "°", per_step: 360.0 / turn },
            }
        })
    }

    /// The same for conditions, where positions may be in mm or degrees.
    #[must_use]
    pub fn scales(&self) -> [Option<Scale>; AXES] {
        std::array::from_fn(|axis| {
            let Axis { steps_per_turn: steps, lead_um, .. } = *self.fitted(axis)?;
            let (units, unit) = match lead_um {
                Some(lead) => (lead, LengthUnit::Micrometre),
                None => (360, LengthUnit::Degree),
            };
            Some(Scale { steps, units, unit })
        })
    }

    /// Checks that switches are in the right order, that the carriage starts inside its travel and
    /// the like.
    fn check(&self, text: &str) -> Result<(), ProfileError> {
        let names = [&["x"][..], &["y"], &["z", "z0"], &["a", "z1"], &["z2"], &["z3"]];
        for (index, names) in names.iter().enumerate().filter(|(axis, _)| self.fits(*axis)) {
            let mut tables = names.iter().map(|name| format!("axes.{name}"));
            let table = tables.find(|table| text.contains(&format!("[{table}]")));
            check_axis(text, &table.unwrap_or_default(), self.axis(index))?;
        }
        check_job(text, &self.job)?;
        check_zeros(text, self)
    }

    /// Whether an axis finds its reference point by itself, at a switch or where it began.
    #[must_use]
    pub fn has_reference(&self, axis: usize) -> bool {
        self.axis(axis).reference != Reference::None
    }

    /// Whether it has the axis with an index, 0 for X.
    #[must_use]
    pub fn fits(&self, index: usize) -> bool {
        self.fitted(index).is_some()
    }

    /// The axis with an index, 0 for X. A motor where none is fitted turns freely.
    #[must_use]
    pub fn axis(&self, index: usize) -> &Axis {
        self.fitted(index).unwrap_or(&UNFITTED)
    }

    fn fitted(&self, index: usize) -> Option<&Axis> {
        match index {
            0 => Some(&self.axes.x),
            1 => Some(&self.axes.y),
            2 => self.axes.z.as_ref(),
            3 => self.axes.a.as_ref(),
            4 => self.axes.z2.as_ref(),
            5 => self.axes.z3.as_ref(),
            _ => None,
        }
    }
}

fn check_job(text: &str, job: &JobSetup) -> Result<(), ProfileError> {
    let error = |table: &str, key: &str, message: &str, help: &str| {
        Err(ProfileError::about_key(text, table, key, message, help))
    };
    let values = [
        ("velocity", job.velocity),
        ("rapid_velocity", job.rapid_velocity),
        ("acceleration", job.acceleration),
        ("apart", job.apart),
    ];
    if let Some((key, _)) = values.iter().find(|(_, value)| *value == 0) {
        return error(
            "job",
            key,
            "0 would never come to an end",
            "velocities are in µm/s, accelerations in Hz/ms, and A may be a step apart at least",
        );
    }
    let spindle = job.spindle.iter();
    let outputs = [
        ("job.spindle.on", spindle.clone().map(|spindle| spindle.on).next()),
        (
            "job.spindle.counterclockwise",
            spindle.clone().find_map(|spindle| spindle.counterclockwise),
        ),
        ("job.coolant", job.coolant),
    ];
    let accessories = job.accessories.values().map(|output| ("job.accessories", Some(*output)));
    for (table, output) in outputs.into_iter().chain(accessories) {
        if output.and_then(|output| output.bit).is_some_and(|bit| bit > 7) {
            return error(table, "bit", "a port has eight bits", "give it a number from 0 to 7");
        }
    }
    if spindle.filter_map(|spindle| spindle.analogue).any(|analogue| analogue.full_rpm == 0) {
        return error(
            "job.spindle.analogue",
            "full_rpm",
            "a spindle that never turns",
            "give its turns a minute at 255",
        );
    }
    Ok(())
}

/// A work-piece zero must name existing axes.
fn check_zeros(text: &str, machine: &Machine) -> Result<(), ProfileError> {
    let registers = machine.job.registers.each().into_iter().enumerate();
    let registers = registers.map(|(index, zero)| (format!("job.registers.{}", index + 1), zero));
    for (table, zero) in registers.chain([("job.zero".to_owned(), &machine.job.zero)]) {
        let axes = [("x", zero.x), ("y", zero.y), ("z", zero.z), ("a", zero.a)];
        for (index, (key, named)) in axes.into_iter().enumerate() {
            if named.is_some() && !machine.fits(index) {
                let message = format!("the machine has no axis {key} for a work-piece zero");
                let help = "leave it out, or describe the axis";
                return Err(ProfileError::about_key(text, &table, key, message, help));
            }
        }
    }
    Ok(())
}

fn check_axis(text: &str, table: &str, axis: &Axis) -> Result<(), ProfileError> {
    let error = |key: &str, message: String, help: &str| {
        Err(ProfileError::about_key(text, table, key, message, help))
    };
    if axis.steps_per_turn == 0 {
        return error("steps_per_turn", "an axis needs steps to turn".into(), "400 is common");
    }
    match (axis.unit, axis.lead_um) {
        (Unit::Linear, None | Some(0)) => {
            return error(
                if axis.lead_um.is_some() { "lead_um" } else { "unit" },
                format!("the linear axis [{table}] has no spindle lead"),
                "add lead_um, the way of one turn in µm: 2500, 4000, 5000 and 10000 are common",
            );
        }
        (Unit::Rotary, Some(_)) => {
            return error("lead_um", "a rotary axis has no lead".into(), "remove lead_um");
        }
        _ => {}
    }
    let pull = axis.motor.iter().flat_map(|motor| motor.pull.windows(2));
    for pair in pull {
        if let [(slow, much), (fast, less)] = pair
            && (slow >= fast || much < less)
        {
            let help = "the faster a motor turns the less it pulls: [[1000, 400], [10000, 50]]";
            let message =
                format!("[{slow}, {much}] and [{fast}, {less}] do not ascend and descend");
            let table = format!("{table}.motor");
            return Err(ProfileError::about_key(text, &table, "pull", message, help));
        }
    }
    if let (Some(low), Some(high)) = (axis.negative_switch, axis.positive_switch)
        && low >= high
    {
        return error(
            "positive_switch",
            format!("the positive switch at {high} is not beyond the negative one at {low}"),
            "give it a larger position than negative_switch",
        );
    }
    for (end, key) in
        [(Reference::Negative, "negative_switch"), (Reference::Positive, "positive_switch")]
    {
        let missing = match end {
            Reference::Negative => axis.negative_switch.is_none(),
            _ => axis.positive_switch.is_none(),
        };
        if axis.reference == end && missing {
            return error(
                "reference",
                format!("the reference switch is at an end without a switch: {key} is missing"),
                "add the switch, or say reference = \"none\" if none is connected",
            );
        }
    }
    if let Some(lowest) = axis.lowest
        && (axis.start < lowest || axis.negative_switch.is_some_and(|at| at < lowest))
    {
        return error(
            "lowest",
            format!("{lowest} is above the start or the negative switch"),
            "the carriage starts inside its travel, and reaches its switches",
        );
    }
    if let Some(highest) = axis.highest
        && (axis.start > highest || axis.positive_switch.is_some_and(|at| at > highest))
    {
        return error(
            "highest",
            format!("{highest} is below the start or the positive switch"),
            "the carriage starts inside its travel, and reaches its switches",
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_machine_is_sound_and_carries_its_name() {
        for name in Machine::names() {
            let text = Machine::builtin_toml(name).unwrap();
            let machine = Machine::from_toml(text).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(machine.name, name);
            assert!(Machine::builtin(name).is_some());
        }
    }

    #[test]
    fn travel_counts_from_the_reference_point() {
        let mut axis = Machine::builtin("mill").unwrap().axes.x.clone();
        assert_eq!(axis.travel(), (Some(0), Some(24_000)));
        axis.reference = Reference::Positive;
        assert_eq!(axis.travel(), (Some(-24_000), Some(0)));
        axis.inverted = true;
        assert_eq!(axis.travel(), (Some(0), Some(24_000)));
        axis.reference = Reference::Home;
        assert_eq!(axis.travel(), (Some(-24_000), Some(0)));
        axis.highest = Some(20_000);
        axis.negative_switch = None;
        assert_eq!(axis.travel(), (Some(-20_000), Some(161)));
        axis.reference = Reference::None;
        assert_eq!(axis.travel(), (None, None));
        assert_eq!(Machine::builtin("bench").unwrap().axes.x.travel(), (None, None));
    }

    #[test]
    fn an_error_points_at_the_key() {
        let text = Machine::builtin_toml("mill")
            .unwrap()
            .replace("positive_switch = 24001", "positive_switch = -5");
        let error = Machine::from_toml(&text).unwrap_err();
        let span = error.span.unwrap();
        assert_eq!(&text[span], "positive_switch = -5");

        let text = format!("{text}\n[job]\nvelocity = 0\n").replace("= -5", "= 24001");
        let error = Machine::from_toml(&text).unwrap_err();
        assert_eq!(&text[error.span.unwrap()], "velocity = 0");

        let motor = "\n[axes.y.motor]\npull = [[500, 100], [400, 50]]\n";
        let text = Machine::builtin_toml("mill").unwrap().to_owned() + motor;
        let error = Machine::from_toml(&text).unwrap_err();
        assert_eq!(&text[error.span.unwrap()], "pull = [[500, 100], [400, 50]]");

        let error = Machine::from_toml("name = \"x\"\ntilt = 3\n").unwrap_err();
        assert!(error.span.is_some(), "{error:?}");
    }

    #[test]
    fn all_missing_fields_are_told_at_once() {
        let mill = Machine::builtin_toml("mill").unwrap();
        let complete: toml::Table = mill.parse().unwrap();
        let mut fields = Vec::new();
        for field in complete.keys() {
            let mut table = complete.clone();
            table.remove(field);
            let error = Machine::from_toml(&table.to_string()).err();
            let is_missing = error.is_some_and(|error| error.message.starts_with("missing field"));
            fields.extend(is_missing.then_some(format!("`{field}`")));
        }
        assert!(fields.len() > 1, "{fields:?}");
        let error = Machine::from_toml("").unwrap_err();
        assert!(error.message.starts_with("missing fields "), "{}", error.message);
        for field in fields {
            assert!(error.message.contains(&field), "{field}: {}", error.message);
        }
    }
}
