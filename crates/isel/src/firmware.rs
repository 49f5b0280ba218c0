//! What every part of the firmware works on: the state and the outputs.

use bytes::Bytes;
use vimc4_device::{
    Event, FaultNews, FaultNumber, FlashChange, Kinds, MachineStrike, Outbox, Stamp, Strike,
    Warning,
};

use crate::activity::Activity;
use crate::state::State;

/// The firmware of a controller. The other modules are its parts.
#[derive(Clone, Debug)]
pub(crate) struct Firmware {
    pub(crate) state: State,
    pub(crate) out: Outbox,
}

impl Firmware {
    pub(crate) fn wants(&self, kinds: Kinds) -> bool {
        self.out.wants(kinds)
    }

    /// Emits an event that belongs to the command that is being executed.
    pub(crate) fn emit(&mut self, event: Event) {
        let stamp = Stamp { at: self.state.now, command: self.state.command };
        self.out.emit(stamp, event);
    }

    /// Does something that belongs to no command, even during one: a button, a switch or the line
    /// has caused it.
    pub(crate) fn for_no_command(&mut self, act: impl FnOnce(&mut Firmware)) {
        let command = self.state.command.take();
        act(self);
        self.state.command = command;
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

    pub(crate) fn flash_changed(&mut self, what: &'static str) {
        if self.wants(Kinds::FLASH) {
            self.emit(Event::Flash { what: what.into() });
        }
    }

    pub(crate) fn warn_no_effect(&mut self, what: &'static str) {
        if self.wants(Kinds::WARNING) {
            self.emit(Event::Warning(Warning::NoEffect { what: what.into() }));
        }
    }

    /// Reports what a fault has done.
    pub(crate) fn strikes(&mut self, number: FaultNumber, strike: MachineStrike) {
        if self.wants(Kinds::FAULT) {
            let news = FaultNews::Strikes(Strike::Machine(strike));
            self.for_no_command(|firmware| firmware.emit(Event::Fault { number, news }));
        }
    }

    pub(crate) fn take_activity(&mut self) -> Activity {
        std::mem::replace(&mut self.state.activity, Activity::Idle)
    }
}
