//! Steps of an owner that follows a debugger or a recording.

use vimc4_device::{Deed, Device, Input, Time};

use crate::session::Session;
use crate::{LineEvent, Source, Step};

/// What has been done elsewhere is done again, one thing at a time.
impl<D: Device> Session<D> {
    /// Performs the next cause, or lets time pass up to it, but not beyond `to`.
    pub fn perform_by(&mut self, to: Time) -> Step {
        let due = self.engine.next_moment().map_or(to, |due| due.min(to));
        let step = self.engine.perform_at(due);
        self.engine.drain();
        step
    }

    /// Lets time pass up to `at`. Nothing is due before.
    pub fn arrive(&mut self, at: Time) {
        if at > self.now() {
            self.engine.accept(Input::Wake, at, None);
        }
        self.engine.drain();
    }

    /// Gives the device an input, and leaves its consequences to further steps.
    pub fn accept(&mut self, at: Time, by: &Source, input: Input<'_>) {
        self.engine.accept(input, at, Some(by));
        self.engine.drain();
    }

    /// The device has been put into another state, at `at`. Inputs that wait are discarded.
    pub fn state_changed(&mut self, by: &Source, at: Time) {
        self.engine.report_news(at, LineEvent::Deed { by: by.clone(), deed: Deed::Restore });
        self.engine.discard_pending();
        self.engine.state_changed(by, at);
        self.engine.drain();
    }
}
