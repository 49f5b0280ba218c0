//! Faults of the machine, and their consequences.

use vimc4_device::{Event, FaultNumber, Faulting, Kinds, Loss, MachineStrike, Mishap};
use vimc4_motion::Running;
use vimc4_plant::{Contact, Plant, PlantSignal, Way};

use crate::activity::Activity;
use crate::axes::{AXES, AXIS_NAMES};
use crate::firmware::Firmware;
use crate::switches::Limits;

impl Firmware {
    /// A fault begins or ends.
    pub(crate) fn fault(&mut self, faulting: &Faulting) {
        let (ended, begun) = self.state.plant.faulting(faulting);
        ended.into_iter().for_each(|number| self.end_fault(number));
        if let Some((number, mishap)) = begun {
            self.begin_fault(number, mishap);
        }
    }

    fn begin_fault(&mut self, number: FaultNumber, mishap: &Mishap) {
        let instead = match mishap {
            Mishap::Hold { signal, .. } => match PlantSignal::from_id(*signal) {
                Some(signal) => self.state.plant.level(signal).into(),
                None => return,
            },
            Mishap::Power => self.state.powered.into(),
            _ => 0,
        };
        let (begun, mut pushed) = (mishap.clone(), 0);
        self.change_machine(|plant| pushed = plant.begin_fault(number, begun, instead));
        if mishap.strikes_at_once() {
            self.strikes(number, MachineStrike::Changed);
        }
        match mishap {
            Mishap::Push { axis, .. } => {
                let axis = usize::from(*axis);
                let name = AXIS_NAMES.get(axis).copied().unwrap_or("?");
                if pushed != 0 && self.wants(Kinds::WARNING) {
                    let machine = self.state.plant.machine();
                    let warning = machine.steps_lost(axis, name, pushed, Loss::Pushed);
                    self.for_no_command(|firmware| firmware.emit(Event::Warning(warning)));
                }
            }
            Mishap::Hold { signal, value } => {
                if let Some(signal) = PlantSignal::from_id(*signal) {
                    self.set_signal(signal, *value != 0);
                }
            }
            Mishap::Power => self.switch_power(false),
            _ => {}
        }
    }

    fn end_fault(&mut self, number: FaultNumber) {
        let mut ended = None;
        self.change_machine(|plant| ended = plant.end_fault(number));
        match ended {
            Some((Mishap::Hold { signal, .. }, back)) => {
                if let Some(signal) = PlantSignal::from_id(signal) {
                    self.set_signal(signal, back != 0);
                }
            }
            Some((Mishap::Power, back)) => self.switch_power(back != 0),
            _ => {}
        }
    }

    /// What a bouncing contact does now.
    pub(crate) fn contact(&mut self) {
        let now = self.state.now;
        let before = self.limits();
        let slides: [_; AXES] = std::array::from_fn(|axis| self.state.slide_at(axis, now));
        let slide = |plant: &Plant, axis: usize| {
            slides.get(axis).copied().unwrap_or_else(|| plant.slide(axis))
        };
        match self.state.plant.contact(now, slide) {
            Some(Contact::Begins(numbers)) => {
                for number in numbers {
                    self.strikes(number, MachineStrike::Bounces);
                }
            }
            Some(Contact::Limit(..)) => self.machine_changed(before),
            Some(Contact::Signal(signal, level)) => {
                self.state.plant.is_bouncing(signal, level);
                self.set_signal(signal, level);
            }
            None => {}
        }
    }

    /// Changes the machine, with the axes where they are now.
    fn change_machine(&mut self, change: impl FnOnce(&mut Plant)) {
        let (now, before) = (self.state.now, self.limits());
        let signs = self.state.carriage_signs();
        if let Some(Running { segment, began }) = self.state.running() {
            let steps = segment.profile.steps_at(now.nanos_since(began));
            let segment = segment.clone();
            let way = Way { path: &segment.path, signs: &signs };
            let (followed, jams) = self.state.plant.changes(&way, &segment, steps, change);
            self.warn_of_losses(&followed, [false; AXES]);
            jams.into_iter().for_each(|(axis, number)| self.stands(axis, number));
        } else {
            change(&mut self.state.plant);
        }
        self.machine_changed(before);
    }

    /// The running motion makes the step with which a limit switch changes.
    pub(crate) fn carriage_changes_switch(&mut self) {
        if let Some(step) = self.state.plant.next_switch()
            && let Some(running) = self.state.running().filter(|_| self.wants(Kinds::SWITCH))
        {
            let path = &running.segment.path;
            let after = |steps| self.limits_at(|axis| self.slide_after(axis, path, steps));
            let (before, after) = (after(step.saturating_sub(1)), after(step));
            self.tell_limits(&before, &after);
        }
        self.expect_switch();
        self.inputs_changed();
    }

    /// The limit switches may have changed.
    fn machine_changed(&mut self, before: Limits) {
        let after = self.limits();
        let each = before.as_flattened().iter().zip(after.as_flattened());
        let pressed = each.into_iter().any(|(before, after)| after > before);
        self.for_no_command(|firmware| firmware.tell_limits(&before, &after));
        self.expect_switch();
        if !self.state.powered {
            return;
        }
        match &self.state.activity {
            Activity::Moving(_) if !pressed => self.look_ahead_again(),
            _ => {
                let outcome = self.limits_changed();
                self.follow(outcome);
            }
        }
        if before != after {
            self.inputs_changed();
        }
    }
}
