//! Faults of the machine: changing it at the present positions, and finding what has changed.

use vimc4_device::{AXES, Running};
use vimc4_plant::{Contact, End, Followed, Jams, Plant, Slide, Way};

use crate::language::Axis;
use crate::state::State;

/// Which limit switches are pressed: for each axis the negative and the positive one.
pub(crate) type Limits = [[bool; 2]; AXES];

/// The ends in the order of [`Limits`].
pub(crate) const ENDS: [End; 2] = [End::Negative, End::Positive];

impl State {
    /// Changes the machine, with the axes where they are now. Returns how they have followed up to now, if
    /// they move, and the jams that have come.
    pub(crate) fn change_machine(
        &mut self,
        change: impl FnOnce(&mut Plant),
    ) -> Option<(Followed, Jams)> {
        let signs = self.carriage_signs();
        let Some(Running { segment, began }) = self.running() else {
            change(&mut self.plant);
            return None;
        };
        let steps = segment.profile.steps_at(self.now.nanos_since(began));
        let segment = segment.clone();
        let way = Way { path: &segment.path, signs: &signs };
        Some(self.plant.changes(&way, &segment, steps, change))
    }

    /// What a bouncing contact does now.
    pub(crate) fn contact_now(&mut self) -> Option<Contact> {
        let slides: [_; AXES] = std::array::from_fn(|axis| self.slide_at(axis, self.now));
        self.plant.contact(self.now, |plant, axis| {
            slides.get(axis).copied().unwrap_or_else(|| plant.slide(axis))
        })
    }

    /// Which limit switches are pressed now.
    pub(crate) fn pressed_now(&self) -> Limits {
        self.pressed(|axis| self.slide_at(axis, self.now))
    }

    fn pressed(&self, slide: impl Fn(usize) -> Slide) -> Limits {
        std::array::from_fn(|index| {
            let Some(axis) = Axis::from_index(index).filter(|axis| self.is_fitted(*axis)) else {
                return [false; 2];
            };
            let slide = slide(axis.index());
            ENDS.map(|end| self.plant.pressed(index, end, &slide))
        })
    }

    /// Looks for the step of the running motion, after the present one, with which a limit switch
    /// changes.
    pub(crate) fn expect_switch(&mut self) {
        let signs = self.carriage_signs();
        let step = self.running().and_then(|running| {
            let way = Way { path: &running.segment.path, signs: &signs };
            let pressed = |axis, end, slide: &Slide| self.plant.pressed(axis, end, slide);
            self.plant.switch_ahead(&way, running.steps_at(self.now), pressed)
        });
        self.plant.expect_switch(step);
    }

    /// The limit switches that the running motion changes with the step that it makes now.
    pub(crate) fn switches_passed(&self) -> Vec<(Axis, End, bool)> {
        let (Some(step), Some(running)) = (self.plant.next_switch(), self.running()) else {
            return Vec::new();
        };
        let signs = self.carriage_signs();
        let way = Way { path: &running.segment.path, signs: &signs };
        let after = |steps| self.pressed(|axis| self.plant.slide_after(axis, &way, steps));
        self.changes(&after(step.saturating_sub(1)), &after(step))
    }

    /// The limit switches that have changed: axis and end, and whether it is pressed.
    pub(crate) fn switches_changed(&self, before: &Limits) -> Vec<(Axis, End, bool)> {
        self.changes(before, &self.pressed_now())
    }

    fn changes(&self, before: &Limits, after: &Limits) -> Vec<(Axis, End, bool)> {
        let changed = self.fitted().flat_map(|axis| {
            let (before, after) = (before[axis.index()], after[axis.index()]);
            let ends = ENDS.into_iter().zip(before.into_iter().zip(after));
            ends.filter(|(_, (before, after))| before != after)
                .map(move |(end, (_, after))| (axis, end, after))
        });
        changed.collect()
    }
}
