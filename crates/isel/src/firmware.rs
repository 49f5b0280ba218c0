//! What every part of the firmware works on: the state, and what leaves.

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

    /// Tells of something that belongs to the command that is executed or under way.
    pub(crate) fn emit(&mut self, event: Event) {
        let stamp = Stamp { at: self.state.now, command: self.state.command };
        self.out.emit(stamp, event);
    }

    /// Does what belongs to no command, whatever is under way: a button, a switch or the line has
    /// led to it.
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

    /// Says what a fault has done.
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
