//! Limit switches as the controller sees them, and where on its way a path meets one.

use vimc4_device::{Event, Kinds};
use vimc4_motion::Path;
use vimc4_plant::{End, Slide, Way};

use crate::axes::AXES;
use crate::firmware::Firmware;
use crate::model::LimitBits;
use crate::state::State;

/// Which limit switches are active, as the controller sees them: for each axis the negative and the
/// positive one.
pub(crate) type Limits = [[bool; 2]; AXES];

/// The ends in the order of [`Limits`].
pub(crate) const ENDS: [End; 2] = [End::Negative, End::Positive];

impl Firmware {
    /// Which limit switches are active now.
    pub(crate) fn limits(&self) -> Limits {
        self.limits_at(|axis| self.state.slide_at(axis, self.state.now))
    }

    /// Which limit switches are active where the carriages stand.
    pub(crate) fn limits_at_rest(&self) -> Limits {
        self.limits_at(|axis| self.state.plant.slide(axis))
    }

    /// Which limit switches are active where the carriages would be.
    pub(crate) fn limits_at(&self, slide: impl Fn(usize) -> Slide) -> Limits {
        std::array::from_fn(|axis| {
            let slide = slide(axis);
            ENDS.map(|end| self.limit_active_at(axis, end, &slide))
        })
    }

    /// Reports the limit switches that have changed. A change that no command has caused belongs to
    /// none.
    pub(crate) fn tell_limits(&mut self, before: &Limits, after: &Limits) {
        if before == after || !self.wants(Kinds::SWITCH) {
            return;
        }
        for (axis, (before, after)) in before.iter().zip(after).enumerate() {
            let ends = [false, true].into_iter().zip(before.iter().zip(after));
            for (positive, (_, active)) in ends.filter(|(_, (before, after))| before != after) {
                self.emit(Event::Switch { axis: axis as u8, positive, active: *active });
            }
        }
    }

    /// Looks for the step of the running motion, after the present one, with which a limit switch
    /// changes.
    pub(crate) fn expect_switch(&mut self) {
        let (state, signs) = (&self.state, self.state.carriage_signs());
        let step = state.running().and_then(|running| {
            let way = Way { path: &running.segment.path, signs: &signs };
            let active = |axis, end, slide: &Slide| self.limit_active_at(axis, end, slide);
            state.plant.switch_ahead(&way, running.steps_at(state.now), active)
        });
        self.state.plant.expect_switch(step);
    }

    /// Whether the limit switch of an end is active for an axis at an instant: the switch that stands
    /// for this end is enabled and has its active level (12 4.2.6, 4.2.7). A switch that the machine
    /// does not have has no level; only a hand can press it.
    pub(crate) fn limit_active_at(&self, axis: usize, end: End, slide: &Slide) -> bool {
        let State { settings, plant, model, .. } = &self.state;
        let switch = if settings.swapped.has(axis) { end.other() } else { end };
        let bits = match model.quirks.limit_bits {
            LimitBits::Switch => usize::from(switch == End::Positive),
            LimitBits::End => usize::from(end == End::Positive),
        };
        settings.is_enabled(axis, bits)
            && match plant.has_switch(axis, switch) {
                true => {
                    plant.switch_level(axis, switch, slide) != settings.is_low_active(axis, bits)
                }
                false => plant.pressed(axis, switch, slide),
            }
    }

    /// Whether a limit switch is active where the carriage stands.
    pub(crate) fn limit_active(&self, axis: usize, end: End) -> bool {
        self.limit_active_at(axis, end, &self.state.plant.slide(axis))
    }

    /// The limit switch on which an axis stands.
    pub(crate) fn active_limit(&self, axis: usize) -> Option<End> {
        self.active_limit_at(axis, &self.state.plant.slide(axis))
    }

    /// The limit switch on which an axis is at an instant.
    pub(crate) fn active_limit_at(&self, axis: usize, slide: &Slide) -> Option<End> {
        let ends = [End::Negative, End::Positive];
        ends.into_iter().find(|&end| self.limit_active_at(axis, end, slide))
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
        let (signs, plant) = (self.state.carriage_signs(), &self.state.plant);
        let way = Way { path, signs: &signs };
        (0..AXES)
            .filter_map(|axis| {
                let active = |slide: &Slide| self.active_limit_at(axis, slide).is_some();
                let left = plant.first(axis, &way, from, |slide| !active(slide))?;
                plant.first(axis, &way, left, active)
            })
            .min()
    }

    /// The limit switches onto which a path runs with this step.
    pub(crate) fn hit_with(&self, path: &Path, step: u64) -> [Option<End>; AXES] {
        let (signs, plant) = (self.state.carriage_signs(), &self.state.plant);
        let way = Way { path, signs: &signs };
        std::array::from_fn(|axis| {
            let limit = |step| self.active_limit_at(axis, &plant.slide_after(axis, &way, step));
            limit(step).filter(|_| limit(step.saturating_sub(1)).is_none())
        })
    }

    /// An axis after so many steps of a path that begins where the carriages stand.
    pub(crate) fn slide_after(&self, axis: usize, path: &Path, steps: u64) -> Slide {
        let signs = self.state.carriage_signs();
        self.state.plant.slide_after(axis, &Way { path, signs: &signs }, steps)
    }
}
