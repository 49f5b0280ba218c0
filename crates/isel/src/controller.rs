//! The controller as a device.

use std::sync::Arc;

use vimc4_device::{
    Device, Fact, Input, Kinds, ModemLine, Outbox, Output as Out, Point, Running, Signal, SignalId,
    Time, View,
};
use vimc4_isel_wire::{Addressed, Fault, Mode, Reply, control, parse};
use vimc4_plant::{Machine, PlantSignal};

use crate::axes::wrap;
use crate::firmware::Firmware;
use crate::flash::{Flash, FlashError};
use crate::model::Model;
use crate::state::State;
use crate::view::{Details, signals_of};

/// A virtual isel controller with its machine.
#[derive(Clone, Debug)]
pub struct Controller(Firmware);

impl Controller {
    /// A controller of a model on a machine, just switched on, with a flash memory read from
    /// an image as [`Device::flash_image`] gave it (empty for an erased one).
    ///
    /// # Errors
    ///
    /// If the image is not one of this model's.
    pub fn new(
        model: Arc<Model>,
        machine: Arc<Machine>,
        flash_image: &[u8],
    ) -> Result<Controller, FlashError> {
        let flash = Flash::read(flash_image, &model, &machine)?;
        let state = State::new(model, machine, flash);
        Ok(Controller(Firmware { state, out: Outbox::default() }))
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.0.state.model
    }
}

impl Device for Controller {
    type State = State;
    type Details = Details;

    fn perform(&mut self, at: Time) -> bool {
        if self.0.state.has_waiting() {
            self.0.take_waiting();
            return true;
        }
        let switch = self.0.state.switch_due_by(at);
        if let Some(due) = switch {
            self.0.state.now = due;
            self.0.carriage_changes_switch();
        }
        // What else is due at the same instant belongs to the same cause.
        let at = switch.unwrap_or(at);
        if let Some(due) = self.0.state.contact_due_by(at) {
            self.0.state.now = due;
            self.0.contact();
        } else if let Some(due) = self.0.state.due_by(at) {
            self.0.state.now = due;
            self.0.activity_ended();
        } else {
            return switch.is_some();
        }
        true
    }

    fn accept(&mut self, input: Input<'_>, at: Time) {
        self.0.state.now = self.0.state.now.max(at);
        match input {
            Input::Bytes(bytes) => self.0.receive(bytes),
            Input::Signal(id, value) => {
                if let Some(signal) = PlantSignal::from_id(id) {
                    self.0.signal(signal, value != 0);
                }
            }
            Input::Power(on) => self.0.power(on),
            Input::Fault(faulting) => self.0.fault(faulting),
            Input::Rule(_) | Input::Wake => {}
        }
    }

    fn poll_output(&mut self) -> Option<Out> {
        self.0.out.poll()
    }

    fn watch(&mut self, kinds: Kinds) -> Kinds {
        self.0.out.watch(kinds)
    }

    fn state(&self) -> State {
        self.0.state.clone()
    }

    fn restore(&mut self, state: State) {
        self.0.state = state;
        self.0.out.clear();
        if self.0.state.plant.is_without_next_switch() {
            self.0.expect_switch();
        }
    }

    fn now(&self) -> Time {
        self.0.state.now
    }

    fn wake(&self) -> Option<Time> {
        self.0.state.wake()
    }

    fn view(&self, at: Time) -> View<Details> {
        self.0.picture(at)
    }

    fn activity(&self) -> vimc4_device::Activity {
        self.0.state.shown_activity()
    }

    fn details(&self) -> Details {
        self.0.own_details()
    }

    fn position(&self, at: Time) -> Point {
        let state = &self.0.state;
        let running = state.running();
        let offset = |axis| running.map_or(0, |running| running.offset(axis, at.max(state.now)));
        std::array::from_fn(|axis| wrap(state.position[axis] + offset(axis)))
    }

    fn reach(&self) -> (Point, Point) {
        let here = self.0.state.position;
        let Some(Running { segment, .. }) = self.0.state.running() else { return (here, here) };
        let (low, high) = segment.path.extent(segment.profile.steps());
        let limits = |axis: usize| {
            let (low, high) = (here[axis] + low[axis], here[axis] + high[axis]);
            // A counter that overflows wraps around.
            if (wrap(low), wrap(high)) == (low, high) { (low, high) } else { (i64::MIN, i64::MAX) }
        };
        (std::array::from_fn(|axis| limits(axis).0), std::array::from_fn(|axis| limits(axis).1))
    }

    fn running(&self) -> Option<Running<'_>> {
        self.0.state.running()
    }

    fn signals(&self) -> Vec<Signal> {
        signals_of(&self.0.state.model)
    }

    fn baud(&self) -> u32 {
        self.0.state.baud
    }

    fn modem_line(&self) -> Option<(ModemLine, bool)> {
        let line = self.0.state.model.line.start_line?;
        Some((line, self.0.state.plant.panel().start))
    }

    fn flash_image(&self) -> Vec<u8> {
        self.0.state.flash.image()
    }

    fn explain(&self, command: &[u8]) -> String {
        let state = &self.0.state;
        if let [byte] = command
            && let Some(control) = control(*byte)
        {
            return self.0.control_in_words(control);
        }
        if self.0.is_lone_end(command) {
            return "the end of a data field, although none is being stored".to_owned();
        }
        let capital = self.0.capital(command);
        let command = self.0.small_d(capital.as_deref().unwrap_or(command));
        let command = command.as_ref();
        let mode = if command.first() == Some(&b'@') { Mode::Direct } else { Mode::Stored };
        match parse(command, state.model.command_set.dialect(), mode, state.device) {
            Ok(Addressed::Frame(frame)) => match frame.decode(&state.context(None)) {
                Ok(command) => command.describe(state.axes),
                Err(_) => frame.spec().title.to_owned(),
            },
            Ok(Addressed::OtherDevice) => "for another device".to_owned(),
            // Whether a line can be stored matters only while a program is being stored.
            Err(Fault::NotStorable) if !state.storing => Reply::Syntax.meaning().to_owned(),
            Err(fault) => fault.reply().meaning().to_owned(),
        }
    }

    fn is_urgent(&self, byte: u8) -> bool {
        control(byte).is_some()
    }

    fn why_without_effect(&self, signal: SignalId, value: i32) -> Option<&'static str> {
        self.0.why_ignored(PlantSignal::from_id(signal)?, value != 0)
    }

    fn why_in_vain(&self, fault: &vimc4_device::Fault) -> Option<&'static str> {
        self.0.state.plant.why_in_vain(fault)
    }

    fn is_idle(&self) -> bool {
        self.0.state.is_idle()
    }

    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time> {
        self.0.forecast(fact, from)
    }

    fn comes_round(&self, from: Time) -> Option<Time> {
        self.0.comes_round(from)
    }
}
