//! A controller of any family as a device.

use std::sync::Arc;

use vimc4_device::{
    Activity, Device, Fact, Fault, Input, Kinds, MemoryError, ModemLine, OtherController, Output,
    Point, Running, Signal, SignalId, Time, View,
};
use vimc4_plant::Machine;

use crate::list::{Details, Inner, Model, State, both, of};

/// A virtual controller with its machine.
#[derive(Clone, Debug)]
pub struct Controller(Inner);

impl Details {
    /// The stored program, if there is one.
    #[must_use]
    pub fn program(&self) -> Option<&vimc4_isel::ProgramView> {
        self.isel()?.program.as_ref()
    }

    /// Whether the head is down, if there is one.
    #[must_use]
    pub fn is_head_down(&self) -> Option<bool> {
        match self {
            #[cfg(feature = "lpkf")]
            Details::Lpkf(details) => Some(details.head == vimc4_lpkf::Head::Down),
            _ => None,
        }
    }

    /// Whether the controller says when a command is done.
    #[must_use]
    pub fn says_when_done(&self) -> bool {
        match self {
            #[cfg(feature = "lpkf")]
            Details::Lpkf(details) => details.echo,
            _ => true,
        }
    }
}

impl State {
    /// Whether a controller in the state `own` can continue from this one: it has the same model and machine.
    ///
    /// # Errors
    ///
    /// If it has not, with the names of both.
    pub fn fits(&self, own: &State) -> Result<(), OtherController> {
        if self.with_profiles_of(own).as_ref() == Some(self) {
            return Ok(());
        }
        let [found, own] = [self, own].map(|state| {
            let (model, machine) = state.profile_names();
            format!("{model} on {machine}")
        });
        // Profiles of one name may differ in their values.
        let found = if found == own { format!("another {found}") } else { found };
        Err(OtherController { found, own })
    }
}

impl Controller {
    /// A controller that has just been switched on, with this image in its memory.
    ///
    /// # Errors
    ///
    /// If the image is not one of this model.
    pub fn new(
        model: &Model,
        machine: Arc<Machine>,
        image: &[u8],
    ) -> Result<Controller, MemoryError> {
        let inner = of!(Model, model, model => Inner::from(model.switched_on(machine, image)?));
        Ok(Controller(inner))
    }
}

impl Device for Controller {
    type State = State;
    type Details = Details;

    fn perform(&mut self, at: Time) -> bool {
        of!(Inner, &mut self.0, device => device.perform(at))
    }

    fn accept(&mut self, input: Input<'_>, at: Time) {
        of!(Inner, &mut self.0, device => device.accept(input, at));
    }

    fn poll_output(&mut self) -> Option<Output> {
        of!(Inner, &mut self.0, device => device.poll_output())
    }

    fn watch(&mut self, kinds: Kinds) -> Kinds {
        of!(Inner, &mut self.0, device => device.watch(kinds))
    }

    fn state(&self) -> State {
        of!(Inner, &self.0, device => State::from(device.state()))
    }

    /// The state of another family does not fit this device and changes nothing.
    fn restore(&mut self, state: State) {
        both!(Inner, &mut self.0, State, state, device, state => device.restore(*state));
    }

    fn now(&self) -> Time {
        of!(Inner, &self.0, device => device.now())
    }

    fn wake(&self) -> Option<Time> {
        of!(Inner, &self.0, device => device.wake())
    }

    fn view(&self, at: Time) -> View<Details> {
        of!(Inner, &self.0, device => device.view(at).with(Details::from))
    }

    fn activity(&self) -> Activity {
        of!(Inner, &self.0, device => device.activity())
    }

    fn details(&self) -> Details {
        of!(Inner, &self.0, device => Details::from(device.details()))
    }

    fn position(&self, at: Time) -> Point {
        of!(Inner, &self.0, device => device.position(at))
    }

    fn reach(&self) -> (Point, Point) {
        of!(Inner, &self.0, device => device.reach())
    }

    fn running(&self) -> Option<Running<'_>> {
        of!(Inner, &self.0, device => device.running())
    }

    fn signals(&self) -> Vec<Signal> {
        of!(Inner, &self.0, device => device.signals())
    }

    fn baud(&self) -> u32 {
        of!(Inner, &self.0, device => device.baud())
    }

    fn room(&self, handshake: bool) -> usize {
        of!(Inner, &self.0, device => device.room(handshake))
    }

    fn modem_line(&self) -> Option<(ModemLine, bool)> {
        of!(Inner, &self.0, device => device.modem_line())
    }

    fn flash_image(&self) -> Vec<u8> {
        of!(Inner, &self.0, device => device.flash_image())
    }

    fn explain(&self, command: &[u8]) -> String {
        of!(Inner, &self.0, device => device.explain(command))
    }

    fn is_urgent(&self, byte: u8) -> bool {
        of!(Inner, &self.0, device => device.is_urgent(byte))
    }

    fn why_without_effect(&self, signal: SignalId, value: i32) -> Option<&'static str> {
        of!(Inner, &self.0, device => device.why_without_effect(signal, value))
    }

    fn why_in_vain(&self, fault: &Fault) -> Option<&'static str> {
        of!(Inner, &self.0, device => device.why_in_vain(fault))
    }

    fn is_idle(&self) -> bool {
        of!(Inner, &self.0, device => device.is_idle())
    }

    fn first_time(&self, fact: &Fact, from: Time) -> Option<Time> {
        of!(Inner, &self.0, device => device.first_time(fact, from))
    }

    fn comes_round(&self, from: Time) -> Option<Time> {
        of!(Inner, &self.0, device => device.comes_round(from))
    }
}
