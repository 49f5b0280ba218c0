//! Reference runs and the search for the hard clip limits: axes drive to their switches.

use std::collections::VecDeque;

use vimc4_plant::{End, Reference};

use crate::language::{Axis, Side};
use crate::moves::along;
use crate::state::{Moving, Sought, Stage, State};
use crate::why::Why;

/// This many steps stand for "without end": they are more than the counters have.
const ON_AND_ON: i64 = 1 << 40;

impl State {
    /// What a machine that homes by itself does at power-on and on `IN`: the reference run of all
    /// axes.
    pub(crate) fn homing_stages(&self) -> VecDeque<Stage> {
        match self.plant.machine().homes {
            true => self.reference_stages(None).unwrap_or_default(),
            false => VecDeque::new(),
        }
    }

    /// `!IS`: all axes one after the other, or one.
    pub(crate) fn reference_stages(&self, only: Option<Axis>) -> Result<VecDeque<Stage>, Why> {
        let machine = self.plant.machine();
        let kind = |axis: Axis| machine.axis(axis.index()).reference;
        let mut stages = VecDeque::new();
        if let Some(axis) = only.filter(|axis| kind(*axis) == Reference::None) {
            return Err(Why::NoReference(axis));
        }
        let axes: Vec<Axis> = match only {
            Some(axis) => vec![axis],
            None => self.fitted().filter(|axis| kind(*axis) != Reference::None).collect(),
        };
        let profile = &self.model.reference;
        for axis in axes {
            let speed = self.reference_speed(axis, profile.speed);
            let leave = self.reference_speed(axis, profile.leave_speed);
            let end = match kind(axis) {
                Reference::Home => {
                    let home = self.plant.way_to(axis.index(), 0);
                    let way = home * self.carriage_sign(axis.index());
                    stages.extend([Stage::Free(axis, way, speed), Stage::Zero(axis)]);
                    continue;
                }
                Reference::Positive => End::Positive,
                _ => End::Negative,
            };
            let inwards = if end == End::Negative { 1 } else { -1 };
            let free = inwards * self.carriage_sign(axis.index()) * i64::from(profile.free_steps);
            stages.extend([
                Stage::Onto(axis, end, speed),
                Stage::Off(axis, end, leave),
                Stage::Free(axis, free, leave),
                Stage::Zero(axis),
            ]);
        }
        Ok(stages)
    }

    /// A reference speed in steps a second, from µm/s or hundredths of a degree a second.
    fn reference_speed(&self, axis: Axis, speed: u32) -> u32 {
        let unit = if self.is_rotary(axis) { 36_000 } else { 1_000 };
        self.steps_per_second(axis, u64::from(speed) * unit)
    }

    /// `OH`: each axis to its positive switch and back to 0 at the speed set last. An axis
    /// without a switch is not moved: its limit is what the machine's profile says.
    pub(crate) fn hard_clip_stages(&self, only: Option<Axis>) -> VecDeque<Stage> {
        let mut stages = VecDeque::new();
        let axes: Vec<Axis> = match only {
            Some(axis) => vec![axis],
            None => self.fitted().collect(),
        };
        for axis in axes {
            let index = axis.index();
            let end = self.outer_end(axis);
            if self.plant.machine().axis(index).switch(end).is_some() {
                let speed = self.steps_per_second(axis, self.speed_set_last(axis));
                stages.push_back(Stage::Onto(axis, end, speed));
                stages.push_back(Stage::Found(axis));
                stages.push_back(Stage::Return(axis));
            } else {
                stages.push_back(Stage::Found(axis));
            }
        }
        stages.push_back(Stage::HardClipLimits(only));
        stages
    }

    /// The speed that was set last for an axis: of X and Y of an SMCU `VS` or `!VU`.
    fn speed_set_last(&self, axis: Axis) -> u64 {
        match self.is_smcu() && axis.index() < 2 {
            true => u64::from(self.settings.speed_set_last) * 1_000,
            false => self.axis_speed(axis),
        }
    }

    /// `OH`: back to 0.
    pub(crate) fn back_to_zero(&mut self, axis: Axis) -> Option<Moving> {
        let link = self.straight(along(axis, -self.position[axis.index()]));
        self.along_links(vec![link], self.speed_set_last(axis), self.axis_acceleration(axis))
    }

    /// The end of the carriage's travel where the counters are largest.
    fn outer_end(&self, axis: Axis) -> End {
        match self.carriage_sign(axis.index()) {
            1 => End::Positive,
            _ => End::Negative,
        }
    }

    /// Drives onto a limit switch, or off it; does nothing if it is already there.
    pub(crate) fn drive(&mut self, axis: Axis, end: End, speed: u32, onto: bool) -> Option<Moving> {
        let index = axis.index();
        let plant = &self.plant;
        if plant.pressed(index, end, &plant.slide(index)) == onto {
            return None;
        }
        let sign = self.carriage_sign(index);
        let towards = if (end == End::Positive) == onto { 1 } else { -1 };
        let way = self.within_counter(axis, sign * towards * ON_AND_ON);
        let sought = Sought { axis, end, onto };
        Some(self.creep(axis, way, speed, Some(sought)))
    }

    /// Goes by some steps.
    pub(crate) fn free(&mut self, axis: Axis, way: i64, speed: u32) -> Option<Moving> {
        if way == 0 {
            return None;
        }
        let way = self.within_counter(axis, way);
        Some(self.creep(axis, way, speed, None))
    }

    /// As much of a way as the 32-bit counter of an axis allows, and the end at which the axis
    /// stops if that is not all. Its configured range does not matter before its reference point is
    /// found.
    fn within_counter(&self, axis: Axis, way: i64) -> (i64, Option<(Axis, Side)>) {
        let here = self.position[axis.index()];
        let to = (here + way).clamp(i64::from(i32::MIN), i64::from(i32::MAX));
        let side = if way < 0 { Side::Negative } else { Side::Positive };
        (to - here, (to != here + way).then_some((axis, side)))
    }

    /// Sets the reference point here.
    pub(crate) fn set_zero(&mut self, axis: Axis) {
        let index = axis.index();
        self.position[index] = 0;
        self.origin[index] = self.plant.carriage()[index];
        self.referenced[index] = true;
    }

    /// `OH`: the last place before the switch, or the one that the profile gives.
    pub(crate) fn last_place(&self, axis: Axis) -> i64 {
        let index = axis.index();
        let end = self.outer_end(axis);
        let profile = self.plant.machine().axis(index);
        let last = match end {
            End::Positive => profile.highest,
            End::Negative => profile.lowest,
        };
        match (profile.switch(end), last) {
            (Some(_), _) => self.position[index] - 1,
            (None, Some(last)) => self.carriage_sign(index) * (last - self.origin[index]),
            (None, None) => 0,
        }
    }
}
