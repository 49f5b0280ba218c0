//! Lengths and speeds in thousandths of an inch.

use vimc4_isel_wire::AxisSet;

use crate::language::{Command, DrillWords, Placed, Units, Value, Word, Words};

impl Units {
    /// The command with its lengths and speeds in µm. Angles, times and everything else stay as
    /// they are, and so do the lengths of DRILLDEF that are in mm.
    pub(super) fn metric(self, command: Command, rotary: AxisSet, drill_in_mm: bool) -> Command {
        if self == Units::Metric {
            return command;
        }
        let length = |word: Word| Placed { value: self.in_um(word.value), ..word };
        let bore = |word: Word| if drill_in_mm { word } else { length(word) };
        let of = |axis: usize, word: Word| if rotary.has(axis) { word } else { length(word) };
        let words = |words: Words| -> Words {
            std::array::from_fn(|axis| words[axis].map(|word| of(axis, word)))
        };
        match command {
            Command::Limit(limits) => Command::Limit(std::array::from_fn(|axis| {
                limits[axis].map(|(low, high)| (of(axis, low), of(axis, high)))
            })),
            Command::Velocity(word) => Command::Velocity(length(word)),
            Command::RapidVelocity(word) => Command::RapidVelocity(length(word)),
            Command::Move(frame, rate, to) => Command::Move(frame, rate, words(to)),
            Command::Arc { frame, turn, helix, centre, sweep, to } => {
                let centre = centre.map(|word| word.map(length));
                Command::Arc { frame, turn, helix, centre, sweep, to: words(to) }
            }
            Command::ZeroAt(zero) => Command::ZeroAt(words(zero)),
            Command::Store(register, zero) => Command::Store(register, words(zero)),
            Command::Drill(at) => Command::Drill(words(at)),
            Command::Cylinder(turning, radius, linear) => {
                Command::Cylinder(turning, length(radius), linear)
            }
            Command::DrillDefinition(drill) => Command::DrillDefinition(DrillWords {
                cycle: drill.cycle,
                plane: drill.plane.map(length),
                depth: drill.depth.map(bore),
                dwell: drill.dwell,
                speed: drill.speed.map(length),
                first: drill.first.map(bore),
                other: drill.other.map(bore),
                decrease: drill.decrease.map(bore),
                retreat: drill.retreat.map(bore),
                lift: drill.lift.map(bore),
                safety: drill.safety.map(bore),
            }),
            other => other,
        }
    }

    /// To what places are written: programs give whole numbers, which in µm is less than a step.
    pub(super) fn resolution(self) -> Value {
        match self {
            Units::Metric => Value::ZERO,
            Units::Inch => self.in_um(Value::whole(1)),
        }
    }

    /// A speed as the file has it, which is that of turning axes.
    pub(super) fn back(self, speed: Value) -> Value {
        match self {
            Units::Metric => speed,
            Units::Inch => Value::thousandths((speed.in_thousandths() * 10 + 127) / 254),
        }
    }
}
