//! A controller of any family as a device.

use std::cell::OnceCell;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use thiserror::Error;
use vimc4_device::{
    Activity, Condition, Device, Input, Kinds, Output, Signal, SignalId, Time, View,
};
use vimc4_isel::FlashError;
use vimc4_plant::Machine;

use crate::{Family, Model};

/// A virtual controller with its machine.
#[derive(Clone, Debug)]
pub struct Controller {
    inner: Inner,
    /// The state, from when it is asked for to the next input.
    state: OnceCell<State>,
}

#[derive(Clone, Debug)]
enum Inner {
    Isel(Box<vimc4_isel::Controller>),
    Lpkf(Box<vimc4_lpkf::Controller>),
}

/// Everything that decides what a controller will do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum State {
    /// One of isel's.
    Isel(Box<vimc4_isel::State>),
    /// One of LPKF's.
    Lpkf(Box<vimc4_lpkf::State>),
}

/// What can be seen of a controller that only its family has.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "family", rename_all = "lowercase")]
#[non_exhaustive]
pub enum Details {
    /// Of one of isel's.
    Isel(vimc4_isel::Details),
    /// Of one of LPKF's.
    Lpkf(vimc4_lpkf::Details),
}

impl Details {
    /// Those of an isel controller, if it is one.
    #[must_use]
    pub fn isel(&self) -> Option<&vimc4_isel::Details> {
        match self {
            Details::Isel(details) => Some(details),
            Details::Lpkf(_) => None,
        }
    }

    /// Those of an LPKF controller, if it is one.
    #[must_use]
    pub fn lpkf(&self) -> Option<&vimc4_lpkf::Details> {
        match self {
            Details::Lpkf(details) => Some(details),
            Details::Isel(_) => None,
        }
    }

    /// The stored program, if there is one.
    #[must_use]
    pub fn program(&self) -> Option<&vimc4_isel::ProgramView> {
        self.isel()?.program.as_ref()
    }

    /// Whether the head is down, if there is one.
    #[must_use]
    pub fn is_head_down(&self) -> Option<bool> {
        self.lpkf().map(|details| details.head == vimc4_lpkf::Head::Down)
    }

    /// Whether the controller says when a command is done.
    #[must_use]
    pub fn says_when_done(&self) -> bool {
        self.lpkf().is_none_or(|details| details.echo)
    }
}

impl State {
    /// The family of the controller that it is a state of.
    #[must_use]
    pub fn family(&self) -> Family {
        match self {
            State::Isel(_) => Family::Isel,
            State::Lpkf(_) => Family::Lpkf,
        }
    }
}

/// Why an image is none of a model's memory.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MemoryError {
    /// This is wrong, in this line.
    #[error(transparent)]
    Line(#[from] FlashError),
    /// The model forgets everything when it is switched off.
    #[error("it holds something, and this model has no memory that lasts")]
    None,
}

/// The same of whichever controller it is.
macro_rules! of {
    ($controller:expr, $inner:ident => $value:expr) => {
        match $controller {
            Inner::Isel($inner) => $value,
            Inner::Lpkf($inner) => $value,
        }
    };
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
        let inner = match model {
            Model::Isel(model) => {
                let model = Arc::clone(model);
                Inner::Isel(Box::new(vimc4_isel::Controller::new(model, machine, image)?))
            }
            Model::Lpkf(_) if !image.is_empty() => return Err(MemoryError::None),
            Model::Lpkf(model) => {
                Inner::Lpkf(Box::new(vimc4_lpkf::Controller::new(Arc::clone(model), machine)))
            }
        };
        Ok(Controller { inner, state: OnceCell::new() })
    }
}

impl Device for Controller {
    type State = State;
    type Details = Details;

    fn perform(&mut self, at: Time) -> bool {
        self.state.take();
        of!(&mut self.inner, device => device.perform(at))
    }

    fn accept(&mut self, input: Input<'_>, at: Time) {
        self.state.take();
        of!(&mut self.inner, device => device.accept(input, at));
    }

    fn handle(&mut self, input: Input<'_>, at: Time) {
        self.state.take();
        of!(&mut self.inner, device => device.handle(input, at));
    }

    fn poll_output(&mut self) -> Option<Output> {
        of!(&mut self.inner, device => device.poll_output())
    }

    fn watch(&mut self, kinds: Kinds) {
        of!(&mut self.inner, device => device.watch(kinds));
    }

    fn state(&self) -> &State {
        self.state.get_or_init(|| match &self.inner {
            Inner::Isel(device) => State::Isel(Box::new(device.state().clone())),
            Inner::Lpkf(device) => State::Lpkf(Box::new(device.state().clone())),
        })
    }

    /// The state of another family is none of this device's, and changes nothing.
    fn restore(&mut self, state: State) {
        self.state.take();
        match (&mut self.inner, state) {
            (Inner::Isel(device), State::Isel(state)) => device.restore(*state),
            (Inner::Lpkf(device), State::Lpkf(state)) => device.restore(*state),
            (Inner::Isel(_), State::Lpkf(_)) | (Inner::Lpkf(_), State::Isel(_)) => {}
        }
    }

    fn now(&self) -> Time {
        of!(&self.inner, device => device.now())
    }

    fn wake(&self) -> Option<Time> {
        of!(&self.inner, device => device.wake())
    }

    fn view(&self, at: Time) -> View<Details> {
        match &self.inner {
            Inner::Isel(device) => device.view(at).with(Details::Isel),
            Inner::Lpkf(device) => device.view(at).with(Details::Lpkf),
        }
    }

    fn activity(&self) -> Activity {
        of!(&self.inner, device => device.activity())
    }

    fn details(&self) -> Details {
        match &self.inner {
            Inner::Isel(device) => Details::Isel(device.details()),
            Inner::Lpkf(device) => Details::Lpkf(device.details()),
        }
    }

    fn signals(&self) -> Vec<Signal> {
        of!(&self.inner, device => device.signals())
    }

    fn input_signal(&self, port: u16, bit: u8) -> Option<SignalId> {
        of!(&self.inner, device => device.input_signal(port, bit))
    }

    fn baud(&self) -> u32 {
        of!(&self.inner, device => device.baud())
    }

    fn room(&self, handshake: bool) -> usize {
        of!(&self.inner, device => device.room(handshake))
    }

    fn flash_image(&self) -> Vec<u8> {
        of!(&self.inner, device => device.flash_image())
    }

    fn explain(&self, command: &[u8]) -> String {
        of!(&self.inner, device => device.explain(command))
    }

    fn is_urgent(&self, byte: u8) -> bool {
        of!(&self.inner, device => device.is_urgent(byte))
    }

    fn why_without_effect(&self, signal: SignalId, value: i32) -> Option<&'static str> {
        of!(&self.inner, device => device.why_without_effect(signal, value))
    }

    fn is_idle(&self) -> bool {
        of!(&self.inner, device => device.is_idle())
    }

    fn crossing(&self, condition: &Condition) -> Option<Time> {
        of!(&self.inner, device => device.crossing(condition))
    }
}
