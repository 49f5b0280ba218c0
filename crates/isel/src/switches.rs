//! Limit switches as the controller sees them, and where on its way a path meets one.

use vimc4_device::Point;
use vimc4_motion::Path;
use vimc4_plant::End;

use crate::axes::AXES;
use crate::firmware::Firmware;
use crate::model::LimitBits;
use crate::state::State;

impl Firmware {
    /// Whether the limit switch of an end is active with the carriage at a place: the switch
    /// that stands for this end is enabled and has its active level (12 4.2.6, 4.2.7). A switch
    /// that the machine does not have has no level; only a hand can press it.
    pub(crate) fn limit_active_at(&self, axis: usize, end: End, carriage: i64) -> bool {
        let State { settings, plant, model, .. } = &self.state;
        let switch = if settings.swapped.has(axis) { end.other() } else { end };
        let bits = match model.quirks.limit_bits {
            LimitBits::Switch => usize::from(switch == End::Positive),
            LimitBits::End => usize::from(end == End::Positive),
        };
        settings.is_enabled(axis, bits)
            && match plant.machine().axis(axis).switch(switch) {
                Some(_) => {
                    plant.switch_level_at(axis, switch, carriage)
                        != settings.is_low_active(axis, bits)
                }
                None => plant.is_held(axis, switch),
            }
    }

    /// Whether a limit switch is active where the carriage stands.
    pub(crate) fn limit_active(&self, axis: usize, end: End) -> bool {
        self.limit_active_at(axis, end, self.state.plant.carriage()[axis])
    }

    /// The limit switch on which an axis stands.
    pub(crate) fn active_limit(&self, axis: usize) -> Option<End> {
        self.active_limit_at(axis, self.state.plant.carriage()[axis])
    }

    /// The limit switch on which an axis would stand with the carriage at a place.
    pub(crate) fn active_limit_at(&self, axis: usize, carriage: i64) -> Option<End> {
        let ends = [End::Negative, End::Positive];
        ends.into_iter().find(|&end| self.limit_active_at(axis, end, carriage))
    }

    /// Whether a way leads away from a limit switch.
    pub(crate) fn leads_away(end: End, way: i64) -> bool {
        match end {
            End::Negative => way > 0,
            End::Positive => way < 0,
        }
    }

    /// The first step after step `from` at which a path, which begins where the carriages
    /// stand, runs onto a limit switch. A switch that is already active counts only after it has
    /// been left.
    pub(crate) fn first_hit(&self, path: &Path, from: u64) -> Option<u64> {
        let rest = path.after(from);
        let done = path.at(from);
        (0..AXES)
            .filter_map(|axis| {
                let active = |carriage: i64| self.active_limit_at(axis, carriage).is_some();
                let start = self.carriage_after(axis, &done);
                let left = match active(start) {
                    true => self.first_change(&rest, axis, start, &active, false)?,
                    false => 0,
                };
                let outside = self.carriage_after_from(axis, start, &rest.at(left));
                let step = self.first_change(&rest.after(left), axis, outside, &active, true)?;
                Some(from + left + step)
            })
            .min()
    }

    /// The limit switches onto which a path runs with this step.
    pub(crate) fn hit_with(&self, path: &Path, step: u64) -> [Option<End>; AXES] {
        let (before, after) = (path.at(step.saturating_sub(1)), path.at(step));
        std::array::from_fn(|axis| {
            let limit = |offset| self.active_limit_at(axis, self.carriage_after(axis, offset));
            limit(&after).filter(|_| limit(&before).is_none())
        })
    }

    /// The first step at which a predicate of the carriage's place, which is now `!wanted`,
    /// becomes `wanted`. It can only change at the edges of the switches, and a carriage moves
    /// by single steps, so the first place where it holds is beside an edge.
    pub(crate) fn first_change(
        &self,
        path: &Path,
        axis: usize,
        carriage: i64,
        predicate: &impl Fn(i64) -> bool,
        wanted: bool,
    ) -> Option<u64> {
        let sign = self.state.carriage_sign(axis);
        self.state
            .plant
            .edges(axis)
            .filter(|&place| predicate(place) == wanted)
            .filter_map(|place| path.first_at(axis, sign * (place - carriage)))
            .min()
    }

    /// Where the carriage is after an offset of the counters from standstill.
    pub(crate) fn carriage_after(&self, axis: usize, offset: &Point) -> i64 {
        self.carriage_after_from(axis, self.state.plant.carriage()[axis], offset)
    }

    fn carriage_after_from(&self, axis: usize, carriage: i64, offset: &Point) -> i64 {
        carriage + self.state.carriage_sign(axis) * offset[axis]
    }
}
