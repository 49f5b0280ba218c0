//! The controller as a device.

use std::sync::Arc;

use bytes::Bytes;
use vimc4_device::{
    Condition, Device, Event, FlashChange, Input, Kinds, Outbox, Output as Out, Signal, SignalId,
    Time, View,
};
use vimc4_isel_wire::{Addressed, Fault, Mode, Reply, control, parse};
use vimc4_plant::{End, Machine, PlantSignal};

use crate::AXIS_NAMES;
use crate::flash::{Flash, FlashError};
use crate::model::Model;
use crate::ports::Wire;
use crate::state::{Activity, State};
use crate::view::Details;

/// A virtual isel controller with its machine.
#[derive(Clone, Debug)]
pub struct Controller {
    pub(crate) state: State,
    pub(crate) out: Outbox,
}

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
        Ok(Controller { state, out: Outbox::default() })
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.state.model
    }

    /// The time of the soonest cause. Only one thing is ever under way, so there is one at
    /// most.
    pub(crate) fn deadline(&self) -> Option<Time> {
        let due = match &self.state.activity {
            Activity::Idle | Activity::Echo => return None,
            Activity::Moving(moving) => moving.due(),
            Activity::Referencing(run) => run.due(),
            Activity::Waiting { until, .. } => (*until)?,
        };
        (due != Time::NEVER).then_some(due)
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

    pub(crate) fn append_to_flash_image(&mut self, record: String) {
        let change = FlashChange::Append(record.into());
        self.out.store(self.state.now, change);
    }

    pub(crate) fn replace_flash_image(&mut self) {
        let change = FlashChange::Replace(self.state.flash.image().into());
        self.out.store(self.state.now, change);
    }
}

impl Device for Controller {
    type State = State;
    type Details = Details;

    fn perform(&mut self, at: Time) -> bool {
        if self.has_waiting() {
            self.take_waiting();
            return true;
        }
        let Some(due) = self.deadline().filter(|due| *due <= at) else { return false };
        self.state.now = due;
        match self.state.activity {
            Activity::Moving(_) => self.segment_ended(),
            Activity::Referencing(_) => self.reference_phase_ended(),
            Activity::Waiting { what, .. } => self.wait_ended(what),
            Activity::Idle | Activity::Echo => {}
        }
        true
    }

    fn accept(&mut self, input: Input<'_>, at: Time) {
        self.state.now = self.state.now.max(at);
        match input {
            Input::Bytes(bytes) => self.receive(bytes),
            Input::Signal(id, value) => {
                if let Some(signal) = PlantSignal::from_id(id) {
                    self.signal(signal, value != 0);
                }
            }
            Input::Power(on) => self.power(on),
            Input::Wake => {}
        }
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
        if self.has_waiting() { Some(self.state.now) } else { self.deadline() }
    }

    fn view(&self, at: Time) -> View<Details> {
        self.picture(at)
    }

    fn activity(&self) -> vimc4_device::Activity {
        self.doing()
    }

    fn details(&self) -> Details {
        self.own_details()
    }

    fn signals(&self) -> Vec<Signal> {
        signals_of(&self.state.model)
    }

    fn input_signal(&self, port: u16, bit: u8) -> Option<SignalId> {
        let wire = self.state.model.ports.readable(port)?.get(usize::from(bit))?;
        wire.signal().map(PlantSignal::id)
    }

    fn baud(&self) -> u32 {
        self.state.baud
    }

    fn flash_image(&self) -> Vec<u8> {
        self.state.flash.image()
    }

    fn explain(&self, command: &[u8]) -> String {
        let state = &self.state;
        if let [byte] = command
            && let Some(control) = control(*byte)
        {
            return control.meaning().to_owned();
        }
        let capital = self.capital(command);
        let command = capital.as_deref().unwrap_or(command);
        let mode = if command.first() == Some(&b'@') { Mode::Direct } else { Mode::Stored };
        match parse(command, state.model.command_set.dialect(), mode, state.device) {
            Ok(Addressed::Frame(frame)) => match frame.decode(&self.context(None)) {
                Ok(command) => command.describe(state.axes),
                Err(_) => frame.spec().title.to_owned(),
            },
            Ok(Addressed::OtherDevice) => "for another device".to_owned(),
            // What can be stored is a question only while a program is stored.
            Err(Fault::NotStorable) if !state.storing => Reply::Syntax.meaning().to_owned(),
            Err(fault) => fault.reply().meaning().to_owned(),
        }
    }

    fn is_urgent(&self, byte: u8) -> bool {
        control(byte).is_some()
    }

    fn why_without_effect(&self, signal: SignalId, value: i32) -> Option<&'static str> {
        self.why_ignored(PlantSignal::from_id(signal)?, value != 0)
    }

    fn is_idle(&self) -> bool {
        !self.state.is_running()
            && matches!(self.state.activity, Activity::Idle | Activity::Echo)
            && !self.has_waiting()
    }

    fn crossing(&self, condition: &Condition) -> Option<Time> {
        self.forecast(condition)
    }
}

/// The plant's signals as a model shows them: its user inputs are called by the first port bit
/// that shows them.
fn signals_of(model: &Model) -> Vec<Signal> {
    let mut signals: Vec<Signal> =
        PlantSignal::PANEL.into_iter().map(|signal| signal.describe("")).collect();
    for (axis, name) in AXIS_NAMES.iter().enumerate() {
        let ends = [End::Negative, End::Positive].map(|end| PlantSignal::Limit(axis, end));
        signals.extend(ends.map(|limit| limit.describe(&name.to_lowercase())));
    }
    for number in 0..16 {
        let shown = model.ports.read.iter().find_map(|(port, wires)| {
            let bit = wires.iter().position(|wire| *wire == Wire::Input(number))?;
            Some(format!("{port}.{bit}"))
        });
        if let Some(name) = shown {
            signals.push(PlantSignal::Input(number).describe(&name));
        }
    }
    signals
}
