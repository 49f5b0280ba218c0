//! The controller as a device.

use std::sync::Arc;

use bytes::Bytes;
use vimc4_device::{
    Activity, Condition, Device, Event, Input, Kinds, Outbox, Output as Out, Signal, SignalId,
    Time, View,
};
use vimc4_plant::{Machine, PlantSignal};

use crate::language::why_refused;
use crate::model::Model;
use crate::state::State;
use crate::view::Details;

/// A virtual LPKF controller with its machine.
#[derive(Clone, Debug)]
pub struct Controller {
    pub(crate) state: State,
    pub(crate) out: Outbox,
}

impl Controller {
    /// A controller of a model on a machine, just switched on.
    #[must_use]
    pub fn new(model: Arc<Model>, machine: Arc<Machine>) -> Controller {
        Controller { state: State::new(model, machine), out: Outbox::default() }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.state.model
    }

    /// The time of the soonest cause: what the command does, the spindle unit, the trackball.
    fn deadline(&self) -> Option<Time> {
        let causes = [self.job_due(), self.state.unit.due, self.state.ball.due];
        causes.into_iter().flatten().min().filter(|due| *due != Time::NEVER)
    }

    /// The mains switch. The carriages know what the counters forget.
    fn power(&mut self, on: bool) {
        if on == self.state.powered {
            return;
        }
        if !on {
            self.abandon_motion();
        }
        let outputs = self.outputs();
        self.state.powered = on;
        self.state.switched_on();
        self.outputs_changed(&outputs);
    }

    // --- outputs ---

    pub(crate) fn wants(&self, kinds: Kinds) -> bool {
        self.out.wants(kinds)
    }

    pub(crate) fn emit(&mut self, event: Event) {
        self.out.emit(self.state.now.into(), event);
    }

    pub(crate) fn send(&mut self, bytes: Bytes) {
        self.out.send(self.state.now, bytes);
    }
}

impl Device for Controller {
    type State = State;
    type Details = Details;

    fn perform(&mut self, at: Time) -> bool {
        let Some(due) = self.deadline().filter(|due| *due <= at) else { return false };
        self.state.now = due.max(self.state.now);
        if self.job_due() == Some(due) {
            self.activity_ended();
        } else if self.state.unit.due == Some(due) {
            self.speed_reached();
        } else {
            self.ball_report_due();
        }
        self.go_on();
        true
    }

    fn accept(&mut self, input: Input<'_>, at: Time) {
        self.state.now = self.state.now.max(at);
        match input {
            Input::Bytes(bytes) => self.receive(bytes),
            Input::Signal(id, value) => self.signal(id, value),
            Input::Power(on) => self.power(on),
            Input::Wake => {}
        }
        self.go_on();
    }

    fn poll_output(&mut self) -> Option<Out> {
        self.out.poll()
    }

    fn watch(&mut self, kinds: Kinds) {
        self.out.watch(kinds);
    }

    fn state(&self) -> &State {
        &self.state
    }

    fn restore(&mut self, state: State) {
        self.state = state;
        self.out.clear();
    }

    fn now(&self) -> Time {
        self.state.now
    }

    fn wake(&self) -> Option<Time> {
        self.deadline()
    }

    fn view(&self, at: Time) -> View<Details> {
        self.picture(at)
    }

    fn activity(&self) -> Activity {
        self.doing()
    }

    fn details(&self) -> Details {
        self.own_details()
    }

    fn signals(&self) -> Vec<Signal> {
        self.list_signals()
    }

    fn input_signal(&self, port: u16, bit: u8) -> Option<SignalId> {
        self.input_number(port, bit).map(|number| PlantSignal::Input(number).id())
    }

    fn baud(&self) -> u32 {
        self.state.model.line.baud
    }

    fn room(&self, handshake: bool) -> usize {
        if handshake { self.room_before_high_water() } else { usize::MAX }
    }

    /// It stores nothing.
    fn flash_image(&self) -> Vec<u8> {
        Vec::new()
    }

    fn explain(&self, command: &[u8]) -> String {
        match self.state.reader.understand(command) {
            Ok(command) => command.describe(),
            Err(status) => why_refused(command, self.state.model.grammar(), status),
        }
    }

    fn why_without_effect(&self, signal: SignalId, value: i32) -> Option<&'static str> {
        match PlantSignal::from_id(signal) {
            _ if value == 0 => None,
            _ if !self.state.powered => Some("the power is off"),
            Some(PlantSignal::Stop) if !self.state.settings.external_stop => {
                Some("the external stop is blocked; !ES1 lets it through")
            }
            // Of its own signals those that do nothing now are no switches.
            None => Some("nothing heeds it now"),
            Some(_) => None,
        }
    }

    fn is_idle(&self) -> bool {
        self.state.job.is_none() && self.state.unit.due.is_none()
    }

    fn crossing(&self, condition: &Condition) -> Option<Time> {
        self.forecast(condition)
    }
}
