//! What the host can set, and what it is after power-on.

use serde::{Deserialize, Serialize};
use vimc4_device::AXES;
use vimc4_plant::{Machine, Unit};

use crate::language::Mode;
use crate::model::Model;

/// Everything that `IN` brings back to the values after power-on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Settings {
    /// Whether commands that are done are answered `C`.
    pub(crate) echo: bool,
    /// Whether the external stop works.
    pub(crate) external_stop: bool,
    /// The window of X and Y: lowest and highest corner, steps.
    pub(crate) window: Option<[[i64; 2]; 2]>,
    /// The range of each axis, lowest and highest, steps.
    pub(crate) ranges: [Option<(i64, i64)>; AXES],
    /// The way of a step: pm, or millionths of a second of arc.
    pub(crate) resolution: [u64; AXES],
    /// mm/s², or mrad/s².
    pub(crate) acceleration: [u32; AXES],
    /// The speed of each axis by itself, µm/s or tenths of a degree a second.
    pub(crate) axis_speed: [u32; AXES],
    /// The speed of X and Y with the head down, µm/s.
    pub(crate) speed_down: u32,
    /// Their speed with the head up, µm/s.
    pub(crate) speed_up: u32,
    /// The one of the two that was set last, µm/s.
    pub(crate) speed_set_last: u32,
    /// Which times `PD` and `PU` take.
    pub(crate) mode: Mode,
    /// Before and after lowering, before and after lifting, ms.
    pub(crate) drill_times: [u32; 4],
    /// The same for milling, ms.
    pub(crate) mill_times: [u32; 4],
    /// How long everything rests after a move, ms.
    pub(crate) settling: u32,
}

impl Settings {
    /// Those after power-on.
    pub(crate) fn new(model: &Model, machine: &Machine) -> Settings {
        let defaults = &model.defaults;
        let by_unit = |axis: usize, linear: u32, rotary: u32| match machine.axis(axis).unit {
            Unit::Linear => linear,
            Unit::Rotary => rotary,
        };
        let of_axes =
            |linear: u32, rotary: u32| std::array::from_fn(|axis| by_unit(axis, linear, rotary));
        Settings {
            echo: defaults.echo,
            external_stop: false,
            window: None,
            ranges: [None; AXES],
            resolution: std::array::from_fn(|axis| match machine.axis(axis).unit {
                Unit::Linear => defaults.resolution_pm,
                Unit::Rotary => defaults.turn_resolution * 1_000,
            }),
            acceleration: of_axes(defaults.acceleration, defaults.turn_acceleration),
            axis_speed: of_axes(defaults.axis_speed, defaults.axis_turn),
            speed_down: defaults.speed_down,
            speed_up: defaults.speed_up,
            speed_set_last: defaults.speed_up,
            mode: Mode::Drilling,
            drill_times: defaults.drill_times,
            mill_times: defaults.mill_times,
            settling: 0,
        }
    }

    /// The times of the present mode.
    pub(crate) fn head_times(&self) -> [u32; 4] {
        match self.mode {
            Mode::Drilling => self.drill_times,
            Mode::Milling => self.mill_times,
        }
    }

    /// The lowest and the highest place an axis may go to, steps. Counters have 32 bits.
    pub(crate) fn borders(&self, axis: usize) -> (i64, i64) {
        let (mut low, mut high) = (i64::from(i32::MIN), i64::from(i32::MAX));
        if let Some((least, most)) = self.ranges[axis] {
            (low, high) = (low.max(least), high.min(most));
        }
        if let Some([least, most]) = self.window.filter(|_| axis < 2) {
            (low, high) = (low.max(least[axis]), high.min(most[axis]));
        }
        (low, high)
    }
}
