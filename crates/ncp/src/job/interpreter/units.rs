//! Lengths and speeds in thousandths of an inch.

use vimc4_isel_wire::AxisSet;

use crate::language::{DrillWords, Instruction, Placed, Units, Value, Word, Words};

impl Units {
    /// The command with its lengths and speeds in µm. Angles, times and everything else stay as
    /// they are, and so do the lengths of DRILLDEF that are in mm.
    pub(super) fn metric(
        self,
        command: Instruction,
        rotary: AxisSet,
        drill_in_mm: bool,
    ) -> Instruction {
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
            Instruction::Limit(limits) => Instruction::Limit(std::array::from_fn(|axis| {
                limits[axis].map(|(low, high)| (of(axis, low), of(axis, high)))
            })),
            Instruction::Velocity(word) => Instruction::Velocity(length(word)),
            Instruction::RapidVelocity(word) => Instruction::RapidVelocity(length(word)),
            Instruction::Move(frame, rate, to) => Instruction::Move(frame, rate, words(to)),
            Instruction::Arc { frame, turn, helix, centre, sweep, to } => {
                let centre = centre.map(|word| word.map(length));
                Instruction::Arc { frame, turn, helix, centre, sweep, to: words(to) }
            }
            Instruction::ZeroAt(zero) => Instruction::ZeroAt(words(zero)),
            Instruction::Store(register, zero) => Instruction::Store(register, words(zero)),
            Instruction::Drill(at) => Instruction::Drill(words(at)),
            Instruction::Cylinder(turning, radius, linear) => {
                Instruction::Cylinder(turning, length(radius), linear)
            }
            Instruction::DrillDefinition(drill) => Instruction::DrillDefinition(DrillWords {
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

    /// The rounding of written places: programs give whole numbers, which in µm is less than a
    /// step.
    pub(super) fn resolution(self) -> Value {
        match self {
            Units::Metric => Value::ZERO,
            Units::Inch => self.in_um(Value::whole(1)),
        }
    }

    /// A speed as in the file, which is that of rotary axes.
    pub(super) fn back(self, speed: Value) -> Value {
        match self {
            Units::Metric => speed,
            Units::Inch => Value::thousandths((speed.in_thousandths() * 10 + 127) / 254),
        }
    }
}
