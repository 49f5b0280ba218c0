//! What goes wrong with the machine, and what that leads to.

use vimc4_device::{
    AXES, Event, Fault, FaultNews, FaultNumber, Faulting, Kinds, MachineStrike, Mishap, Running,
    Strike,
};
use vimc4_plant::{Contact, End, Plant, Way};

use crate::controller::Controller;
use crate::language::Axis;
use crate::state::State;

/// Which limit switches are pressed: for each axis the negative and the positive one.
type Limits = [[bool; 2]; AXES];

/// The ends in the order of [`Limits`].
const ENDS: [End; 2] = [End::Negative, End::Positive];

impl Controller {
    /// A fault begins or ends.
    pub(crate) fn fault(&mut self, faulting: &Faulting) {
        match faulting {
            Faulting::Begin(number, Fault::Machine(fault)) => {
                self.end_fault(*number);
                self.begin_fault(*number, &fault.mishap);
            }
            Faulting::Begin(..) => {}
            Faulting::End(number) => self.end_fault(*number),
            Faulting::EndAll => {
                for number in self.state.plant.faults() {
                    self.end_fault(number);
                }
            }
        }
    }

    fn begin_fault(&mut self, number: FaultNumber, mishap: &Mishap) {
        let instead = match mishap {
            // What acts in the moment it is set cannot be held.
            Mishap::Hold { signal, .. } => match self.state.signal_value(*signal) {
                Some(value) => value,
                None => return,
            },
            Mishap::Power => self.state.powered.into(),
            _ => 0,
        };
        let begun = mishap.clone();
        self.change_machine(|plant| plant.begin_fault(number, begun, instead));
        self.strikes(number, MachineStrike::Changed);
        match mishap {
            Mishap::Hold { signal, value } => self.set_signal(*signal, *value),
            Mishap::Power => self.switch_power(false),
            _ => {}
        }
    }

    fn end_fault(&mut self, number: FaultNumber) {
        let mut ended = None;
        self.change_machine(|plant| ended = plant.end_fault(number));
        match ended {
            Some((Mishap::Hold { signal, .. }, back)) => self.set_signal(signal, back),
            Some((Mishap::Power, back)) => self.switch_power(back != 0),
            _ => {}
        }
    }

    pub(crate) fn strikes(&mut self, number: FaultNumber, strike: MachineStrike) {
        self.emit(None, Kinds::FAULT, || {
            let news = FaultNews::Strikes(Strike::Machine(strike));
            Event::Fault { number, news }
        });
    }

    /// What a contact does that bounces, now.
    pub(crate) fn contact(&mut self) {
        let before = self.state.pressed_now();
        let slides: [_; AXES] =
            std::array::from_fn(|axis| self.state.slide_at(axis, self.state.now));
        let slide = |plant: &Plant, axis: usize| {
            slides.get(axis).copied().unwrap_or_else(|| plant.slide(axis))
        };
        match self.state.plant.contact(self.state.now, slide) {
            Some(Contact::Begins(numbers)) => {
                for number in numbers {
                    self.strikes(number, MachineStrike::Bounces);
                }
            }
            Some(Contact::Limit(..)) => self.machine_changed(before),
            Some(Contact::Signal(signal, level)) => {
                self.state.plant.is_bouncing(signal, level);
                self.set_signal(signal.id(), level.into());
            }
            None => {}
        }
    }

    /// Changes the machine, with the axes where they are now.
    fn change_machine(&mut self, change: impl FnOnce(&mut Plant)) {
        let before = self.state.pressed_now();
        let signs = self.state.carriage_signs();
        if let Some(Running { segment, began }) = self.state.running() {
            let steps = segment.profile.steps_at(self.state.now.nanos_since(began));
            let segment = segment.clone();
            let way = Way { path: &segment.path, signs: &signs };
            let followed = self.state.plant.advance(&way, steps);
            change(&mut self.state.plant);
            self.state.plant.goes_on(&segment, steps);
            self.warn_of_losses(&followed);
        } else {
            change(&mut self.state.plant);
        }
        self.machine_changed(before);
    }

    /// The limit switches may be others than before.
    fn machine_changed(&mut self, before: Limits) {
        self.state.look_ahead_again();
        let after = self.state.pressed_now();
        for axis in self.state.fitted().collect::<Vec<_>>() {
            for (place, end) in ENDS.into_iter().enumerate() {
                let active = after[axis.index()][place];
                if before[axis.index()][place] != active && self.state.powered {
                    self.switch_changed(axis, end, active);
                }
            }
        }
    }
}

impl State {
    fn pressed_now(&self) -> Limits {
        std::array::from_fn(|index| {
            let Some(axis) = Axis::from_index(index).filter(|axis| self.is_fitted(*axis)) else {
                return [false; 2];
            };
            let slide = self.slide_at(axis.index(), self.now);
            ENDS.map(|end| self.plant.pressed(index, end, &slide))
        })
    }
}
