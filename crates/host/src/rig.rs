//! A device and everything that it is plugged into.

use std::collections::VecDeque;

use bytes::Bytes;
use vimc4_device::{Device, Event, FlashChange, Input, Kinds, Output, Stamp, Time, Warning};

use crate::leaving::Leaving;
use crate::report::{News, Sink, SinkId, Source, Wants, What};
use crate::sinks::Sinks;
use crate::storage::Storage;
use crate::waiting::Waiters;
use crate::wire::Wire;

/// A device with its line, its flash memory and those who watch it: whatever goes in goes in here,
/// and all that comes of it goes where it belongs.
pub(crate) struct Rig<D: Device> {
    pub(crate) device: D,
    pub(crate) wire: Wire,
    pub(crate) storage: Storage,
    pub(crate) sinks: Sinks,
    pub(crate) waiters: Waiters,
    /// What has come out of the device while it was looked at moment by moment.
    seen: VecDeque<Output>,
    /// How often something but time has gone in.
    pub(crate) inputs: u64,
    /// How often something was sent or stored.
    pub(crate) said: u64,
    /// How many bytes have come since the power was taken away; `None` while it is on.
    unpowered: Option<u64>,
}

impl<D: Device> Rig<D> {
    pub(crate) fn new(device: D) -> Rig<D> {
        let wire = Wire::new(device.baud());
        let mut rig = Rig {
            device,
            wire,
            storage: Storage::default(),
            sinks: Sinks::default(),
            waiters: Waiters::default(),
            seen: VecDeque::new(),
            inputs: 0,
            said: 0,
            unpowered: None,
        };
        rig.look_for_power();
        rig.watch_kinds();
        rig
    }

    // --- who watches ---

    /// Lets a sink watch from now on.
    pub(crate) fn watch(&mut self, sink: Box<dyn Sink>) -> SinkId {
        let Rig { sinks, device, .. } = self;
        let id = sinks.add(sink, device, || written_state(device));
        self.watch_kinds();
        id
    }

    /// Lets go of a sink. Returns whether it was still there.
    pub(crate) fn detach(&mut self, id: SinkId) -> bool {
        let was_there = self.sinks.remove(id);
        self.watch_kinds();
        was_there
    }

    /// Lets go of those who want to see what goes in.
    pub(crate) fn end_recordings(&mut self) {
        self.settle();
        self.sinks.end_recordings();
        self.watch_kinds();
    }

    /// Says to recordings that everything that came of what went in has been told.
    fn settle(&mut self) {
        let Rig { sinks, device, .. } = self;
        sinks.settle(device, &|| written_state(device));
    }

    /// Has the device tell what is wanted of it now.
    pub(crate) fn watch_kinds(&mut self) {
        self.device.watch(self.sinks.wants().kinds.and(self.waiters.kinds()));
    }

    /// Whether somebody wants to see events of these kinds.
    pub(crate) fn is_wanted(&self, kinds: Kinds) -> bool {
        self.sinks.wants().kinds.contain(kinds)
    }

    /// Tells the sinks that want it.
    pub(crate) fn tell(
        &mut self,
        at: Time,
        wanted: impl Fn(&Wants) -> bool,
        what: impl FnOnce() -> What,
    ) {
        if self.sinks.tell(&self.device, at, wanted, what) {
            self.watch_kinds();
        }
    }

    /// Tells all sinks.
    pub(crate) fn tell_news(&mut self, at: Time, news: News) {
        self.tell(at, |_| true, || What::News(news));
    }

    // --- what goes in ---

    /// Something happens to the device. Who has done it has to be known if anybody wants to see
    /// what goes in.
    pub(crate) fn input(&mut self, input: Input<'_>, at: Time, by: Option<&Source>) {
        if self.sinks.wants().inputs
            && let Some(by) = by
        {
            let what = || What::Input { by: by.clone(), input: input.into() };
            self.tell(at, |wants| wants.inputs, what);
        }
        self.inputs += u64::from(input != Input::Wake);
        match (input, &mut self.unpowered) {
            (Input::Bytes(bytes), Some(unheard)) => {
                *unheard += u64::try_from(bytes.len()).unwrap_or(u64::MAX);
            }
            (Input::Power(true), _) => {
                self.tell_unheard(at);
                self.unpowered = None;
            }
            (Input::Power(false), None) => self.unpowered = Some(0),
            _ => {}
        }
        if self.waiters.have_happenings() {
            self.handle_by_moments(input, at);
        } else {
            self.device.handle(input, at);
        }
        self.drain();
        self.waiters.look_ahead(&self.device);
    }

    /// Nothing but time passes.
    pub(crate) fn pass_time(&mut self, at: Time) {
        self.input(Input::Wake, at, None);
    }

    /// Lets time pass up to the next thing that is to be done.
    pub(crate) fn step(&mut self, at: Time) {
        self.pass_time(at);
        if self.waiters.answer_due(self.device.now()) {
            self.watch_kinds();
        }
        self.disappoint();
    }

    /// The next time at which the device does something, or somebody waits for it.
    pub(crate) fn next_deadline(&self) -> Option<Time> {
        let due = self.device.wake().into_iter().chain(self.waiters.due()).min();
        due.filter(|at| *at != Time::NEVER)
    }

    /// Tells those who wait for what cannot come any more: the device rests.
    pub(crate) fn disappoint(&mut self) {
        if self.waiters.is_empty() || self.device.wake().is_some_and(|at| at != Time::NEVER) {
            return;
        }
        if self.waiters.disappoint() {
            self.watch_kinds();
        }
    }

    /// Lets go of those who do not want to wait any more.
    pub(crate) fn give_up_waiting(&mut self)
    where
        D: Clone,
    {
        if self.waiters.give_up(&self.device) {
            self.watch_kinds();
        }
    }

    /// The same as [`Device::handle`], and after each cause those are answered who have waited for
    /// what happened in it.
    fn handle_by_moments(&mut self, input: Input<'_>, at: Time) {
        while self.device.perform(at) {
            self.answer_waiters();
        }
        self.device.accept(input, at);
        self.answer_waiters();
        while self.device.perform(at) {
            self.answer_waiters();
        }
    }

    fn answer_waiters(&mut self) {
        let before = self.seen.len();
        while let Some(output) = self.device.poll_output() {
            self.seen.push_back(output);
        }
        let Rig { seen, device, waiters, .. } = self;
        let events = seen.range(before..).filter_map(Output::event);
        if waiters.answer_happened(device, events) {
            self.watch_kinds();
        }
    }

    // --- the power ---

    /// Whether the power is off.
    pub(crate) fn is_off(&self) -> bool {
        self.unpowered.is_some()
    }

    /// Says how much has come in vain since the power was taken away.
    pub(crate) fn tell_unheard(&mut self, at: Time) {
        if let Some(unheard) = &mut self.unpowered
            && *unheard > 0
        {
            let bytes = std::mem::take(unheard);
            self.tell_news(at, News::PowerWasOff { bytes });
        }
    }

    fn look_for_power(&mut self) {
        let powered = self.device.view(self.device.now()).powered;
        self.unpowered = (!powered).then_some(0);
    }

    // --- another state ---

    /// Continues from another state, whose time becomes the present.
    pub(crate) fn restore(&mut self, by: &Source, state: D::State) {
        let at = self.device.now();
        let before = self.storage.is_kept().then(|| self.device.flash_image());
        self.device.restore(state);
        self.watch_kinds();
        self.look_for_power();
        if self.sinks.wants().inputs {
            let what = What::State { by: Some(by.clone()), state: written_state(&self.device) };
            self.tell(at, |wants| wants.inputs, || what);
        }
        let after = self.device.flash_image();
        if before.is_some_and(|before| before != after) {
            self.store(&FlashChange::Replace(Bytes::from(after)));
            self.storage.secure();
        }
    }

    // --- what comes out ---

    /// Passes on what the device has to say, in order: what is stored is on disk before the
    /// answer that confirms it is sent. What is said at one and the same time leaves in one
    /// piece.
    pub(crate) fn drain(&mut self) {
        let mut leaving = Leaving::default();
        while let Some(output) = self.seen.pop_front().or_else(|| self.device.poll_output()) {
            match output {
                Output::Bytes(at, bytes) => {
                    if !leaving.is_at(at) {
                        self.send_all(&mut leaving);
                    }
                    leaving.add(at, bytes);
                }
                Output::Flash(_, change) => {
                    self.send_all(&mut leaving);
                    self.store(&change);
                }
                Output::Event(Stamp { at, command }, event) => {
                    self.send_all(&mut leaving);
                    let kind = event.kind();
                    let what = || What::Event { command, event };
                    self.tell(at, |wants| wants.kinds.contain(kind), what);
                }
            }
        }
        self.send_all(&mut leaving);
        self.storage.secure();
        self.settle();
        self.wire.set_baud(self.device.baud());
        self.wire.set_ready(self.device.room(true) > 0);
    }

    fn send_all(&mut self, leaving: &mut Leaving) {
        if let Some((at, bytes)) = leaving.take() {
            self.storage.secure();
            self.send(at, bytes);
        }
    }

    fn store(&mut self, change: &FlashChange) {
        self.said += 1;
        self.storage.store(change);
    }

    fn send(&mut self, at: Time, bytes: Bytes) {
        // An answer would confirm what is not stored.
        if self.storage.has_failed() {
            return;
        }
        self.said += 1;
        // Told before it leaves: who records has written down whatever a client has seen.
        let sent = bytes.clone();
        self.tell(at, |wants| wants.sent, || What::Sent { bytes: sent });
        let delivery = self.wire.send(&bytes);
        let lost = u64::try_from(bytes.len()).unwrap_or(u64::MAX);
        for news in delivery.losses {
            self.tell_news(at, news);
        }
        if !delivery.heard {
            let event = Event::Warning(Warning::NobodyListens { lost });
            let what = || What::Event { command: None, event };
            self.tell(at, |wants| wants.kinds.contain(Kinds::WARNING), what);
        }
    }
}

/// The state of a device as it is written down. Every state can be; if one should not, there is
/// nothing to be told of it.
fn written_state<D: Device>(device: &D) -> serde_json::Value {
    serde_json::to_value(device.state()).unwrap_or_default()
}
