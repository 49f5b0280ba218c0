//! A controller without a thread, a clock or a port, driven in virtual time.

use std::sync::Arc;

use vimc4_device::{Device, Input, Output};
use vimc4_isel::{Controller, Model};
use vimc4_plant::Machine;

use super::failure::{Doing, Failure, Outcome};

/// An unwatched IMC4 on a machine.
pub(crate) fn controller(machine: Machine) -> Outcome<Controller> {
    let model = Model::builtin("imc4").doing("find the model imc4")?;
    Controller::new(model, Arc::new(machine), &[]).doing("make a controller")
}

/// An unwatched SMCU on a machine.
pub(crate) fn board(machine: Machine) -> Outcome<vimc4_lpkf::Controller> {
    let model = vimc4_lpkf::Model::builtin("smcu").doing("find the model smcu")?;
    Ok(vimc4_lpkf::Controller::new(model, Arc::new(machine)))
}

/// The machine without ends.
pub(crate) fn bench() -> Outcome<Machine> {
    let machine = Machine::builtin("bench").doing("find the machine bench")?;
    Ok(Machine::clone(&machine))
}

/// What a controller has answered in the meantime: how many bytes, and the first of the last
/// answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Answer {
    /// How many bytes.
    pub(crate) bytes: usize,
    /// How the last answer began.
    pub(crate) code: u8,
}

impl Answer {
    /// Takes what has come out.
    pub(crate) fn hear(&mut self, controller: &mut impl Device) {
        while let Some(output) = controller.poll_output() {
            if let Output::Bytes(_, bytes) = output {
                self.bytes += bytes.len();
                self.code = bytes.first().copied().unwrap_or(self.code);
            }
        }
    }
}

/// Sends bytes at the controller's present time and lets it run until it waits for more, with no
/// harness that would be measured with it.
pub(crate) fn play(controller: &mut impl Device, bytes: &[u8]) -> Answer {
    let mut answer = Answer::default();
    controller.handle(Input::Bytes(bytes), controller.now());
    answer.hear(controller);
    while let Some(due) = controller.wake() {
        controller.handle(Input::Wake, due);
        answer.hear(controller);
    }
    answer
}

/// Sends a line that has to be answered with this code.
pub(crate) fn expect(controller: &mut impl Device, line: &str, code: u8) -> Outcome<()> {
    let answer = play(controller, format!("{line}\r").as_bytes());
    if answer.code == code && answer.bytes > 0 {
        return Ok(());
    }
    let (expected, got) = (char::from(code), char::from(answer.code));
    Err(Failure::new(format!("`{line}` is answered {got:?}, not {expected:?}")))
}
