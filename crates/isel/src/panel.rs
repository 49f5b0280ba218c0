//! Buttons, switches and the supply: what the outside world does to the controller
//! (99 appendix E).

use vimc4_device::{Event, Kinds, StopCause, Warning};
use vimc4_isel_wire::Op;
use vimc4_plant::PlantSignal;

use crate::activity::{Activity, Ending, Purpose, Wait};
use crate::firmware::Firmware;
use crate::outcome::Outcome;
use crate::why::{By, Off, Opened, Why};
use crate::wiring::Output;

impl Firmware {
    /// A signal of the plant is set. One that a fault holds takes no level.
    pub(crate) fn signal(&mut self, signal: PlantSignal, level: bool) {
        if !self.state.plant.withholds(signal.id(), level.into()) {
            self.set_signal(signal, level);
        }
    }

    /// A signal of the plant takes a level.
    pub(crate) fn set_signal(&mut self, signal: PlantSignal, level: bool) {
        let driven = self.state.driven();
        let limits = matches!(signal, PlantSignal::Limit(..)).then(|| self.limits());
        if !self.state.plant.set(signal, level) {
            return;
        }
        if self.wants(Kinds::SIGNAL) {
            let event = Event::Signal { signal: signal.id(), value: level.into() };
            self.for_no_command(|firmware| firmware.emit(event));
        }
        if let Some(limits) = limits {
            let after = self.limits();
            self.for_no_command(|firmware| firmware.tell_limits(&limits, &after));
            self.expect_switch();
        }
        if !self.state.powered {
            return;
        }
        // Bad supply or temperature switches the power stages off.
        self.for_no_command(|firmware| firmware.outputs_changed(driven));
        let outcome = match (signal, level) {
            (PlantSignal::Stop, true) => self.stop_button(),
            (PlantSignal::Start, true) => self.start_button(),
            (PlantSignal::On, true) => self.on_button(),
            (PlantSignal::EmergencyStop, true) => self.emergency_stop(),
            (PlantSignal::Limit(..), _) => self.limits_changed(),
            _ => Outcome::Nothing,
        };
        self.follow(outcome);
        if self.state.cover_forbids() {
            let by_key = matches!(signal, PlantSignal::Key);
            let outcome = self.cover_opened(if by_key { Opened::Key } else { Opened::Now });
            self.follow(outcome);
        }
        if !self.state.motors_on() && self.is_moving() {
            let outcome = self.halt(Why::Stages(self.state.why_off()));
            self.follow(outcome);
        }
        self.inputs_changed();
    }

    /// STOP halts the motion or the program, and the spindle.
    fn stop_button(&mut self) -> Outcome {
        self.for_no_command(|firmware| {
            if firmware.state.driven().get(Output::SPINDLE) && firmware.wants(Kinds::WARNING) {
                firmware.emit(Event::Warning(Warning::SpindleOff));
            }
            firmware.drive(|outputs| outputs.set(Output::SPINDLE, false));
        });
        self.stop(By::Button)
    }

    /// START runs a valid program, or goes on with one that was stopped. With a motion that was
    /// stopped in DNC mode the iMC-xx goes on as well (12 5, code F); on the older cards the host
    /// sees the button and sends `S` (99 2.2.12).
    fn start_button(&mut self) -> Outcome {
        let ready = self.state.is_at_rest() && !self.state.storing && !self.state.is_stop_held();
        if !ready || self.check_plant().is_err() {
            Outcome::Nothing
        } else if self.state.run.is_some() {
            self.resume(false)
        } else if self.state.remainder.is_none() {
            self.begin_run(false)
        } else if self.state.model.quirks.start_resumes_dnc {
            self.start_command(Purpose::Command(Op::Start))
        } else {
            Outcome::Nothing
        }
    }

    /// ON switches the power stage on. In the initial state, which an emergency stop leaves, it
    /// does more: with STOP held and the key on test it erases the program, with START held it
    /// begins the self-test (99 3.1, E1).
    fn on_button(&mut self) -> Outcome {
        let panel = *self.state.plant.panel();
        if panel.emergency_stop {
            return Outcome::Nothing;
        }
        let initial = !self.state.relay && self.state.is_at_rest();
        let erases = initial && panel.stop && !panel.automatic;
        if let Some(ms) = self.state.model.timing.panel_erase_ms.filter(|_| erases) {
            self.state.run = None;
            self.state.storing = false;
            let until = self.state.now.after_nanos(ms.saturating_mul(1_000_000));
            self.state.activity = Activity::Waiting { what: Wait::PanelErase, until: Some(until) };
            if self.wants(Kinds::FLASH) {
                let what = format!("erasing, which takes {} s", ms as f64 / 1_000.0).into();
                self.emit(Event::Flash { what });
            }
            return Outcome::Nothing;
        }
        if self.state.cover_forbids() {
            return Outcome::Nothing;
        }
        self.state.relay = true;
        self.for_no_command(|firmware| firmware.drive(|outputs| outputs.set(Output::STAGE, true)));
        if panel.start && initial && self.has_self_test() {
            return self.begin_self_test();
        }
        Outcome::Nothing
    }

    /// The emergency stop takes the power from the motors; a running command is answered with `9`,
    /// and the controller restarts without it.
    fn emergency_stop(&mut self) -> Outcome {
        let outcome = self.halt(Why::Stages(Off::EmergencyStop));
        self.follow(outcome);
        self.open_relay();
        self.reset();
        Outcome::Nothing
    }

    /// The cover was opened with the key on automatic, or the key turned with it open.
    fn cover_opened(&mut self, opened: Opened) -> Outcome {
        match &self.state.activity {
            Activity::Moving(_) => self.brake(Ending::Cover(opened)),
            Activity::Referencing(_) => self.halt(Why::Cover(opened)),
            _ => Outcome::Nothing,
        }
    }

    /// The mains switch is turned.
    pub(crate) fn power(&mut self, on: bool) {
        if !self.state.plant.withholds_power(on) {
            self.switch_power(on);
        }
    }

    /// The power goes, or comes back.
    pub(crate) fn switch_power(&mut self, on: bool) {
        if on == self.state.powered {
            return;
        }
        if !on {
            self.struck(StopCause::PowerLoss);
            self.tell_unanswered("the loss of power");
            self.halt_motors();
        }
        let outputs = self.state.driven();
        self.state.powered = on;
        // A test double is ready as soon as it has power: the power stage is switched on too.
        self.state.relay = on && !self.state.plant.panel().emergency_stop;
        self.reset();
        if !on {
            self.state.outputs = crate::wiring::Outputs::default();
            self.state.activity = Activity::Idle;
            self.outputs_changed(outputs);
        } else if let Activity::Waiting { what, .. } = &mut self.state.activity {
            *what = Wait::PowerUp;
        } else {
            let outcome = self.powered_up();
            self.follow(outcome);
        }
    }

    /// An input may have changed: activities that wait for one check again.
    pub(crate) fn inputs_changed(&mut self) {
        if let Activity::Moving(moving) = &self.state.activity
            && let Some(condition) = moving.plan.until
            && moving.ending == Ending::Complete
            && self.is_met(condition)
        {
            let outcome = self.brake(Ending::Event);
            self.follow(outcome);
        }
        let outcome = self.program_inputs_changed();
        self.follow(outcome);
    }

    fn is_moving(&self) -> bool {
        matches!(self.state.activity, Activity::Moving(_) | Activity::Referencing(_))
    }
}
