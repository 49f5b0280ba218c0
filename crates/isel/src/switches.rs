//! Limit switches as the controller sees them, and where on its way a path meets one.

use vimc4_motion::Path;
use vimc4_plant::{End, Slide, Way};

use crate::axes::AXES;
use crate::firmware::Firmware;
use crate::model::LimitBits;
use crate::state::State;

impl Firmware {
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
