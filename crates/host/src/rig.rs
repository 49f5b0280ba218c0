//! A device and everything that it is plugged into.

use std::collections::VecDeque;
use std::iter;

use bytes::Bytes;
use tokio::sync::oneshot;
use vimc4_device::{
    Condition, Device, Event, FlashChange, Input, Kinds, ModemLine, Output, OwnedInput, Stamp,
    Time, Warning,
};

use crate::ControlError;
use crate::storage::Storage;
use crate::waiting::Waiters;
use crate::wire::Wire;
use crate::{BreakpointId, News, Pause, Sink, SinkId, Source, Step, Wants, What};
use vimc4_session::{Breakpoints, Sinks, Transmission};

/// An input that waits, and its source.
struct Pending {
    input: OwnedInput,
    by: Option<Source>,
}

/// A device with its line, its flash memory and its sinks: every input passes through here, and all
/// its effects are passed on from here.
pub(crate) struct Rig<D: Device> {
    pub(crate) device: D,
    pub(crate) wire: Wire,
    /// Whether the speed of a client counts.
    pub(crate) has_physics: bool,
    pub(crate) storage: Storage,
    pub(crate) sinks: Sinks,
    pub(crate) waiters: Waiters,
    pub(crate) breakpoints: Breakpoints,
    /// Time is paused: since when, and why.
    pause: Option<Pause>,
    /// Inputs behind what was due when time was paused.
    pending: VecDeque<Pending>,
    /// How many causes have been performed at an instant, since an input or since that was told.
    performed: (Time, u32),
    /// The callers that wait for time to be paused.
    waits_for_pause: Vec<oneshot::Sender<Result<Pause, ControlError>>>,
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
            has_physics: false,
            storage: Storage::default(),
            sinks: Sinks::default(),
            waiters: Waiters::default(),
            breakpoints: Breakpoints::default(),
            pause: None,
            pending: VecDeque::new(),
            performed: (Time::ZERO, 0),
            waits_for_pause: Vec::new(),
            seen: VecDeque::new(),
            inputs: 0,
            said: 0,
            unpowered: None,
        };
        rig.look_for_power();
        rig.watch_kinds();
        rig
    }

    // --- sinks ---

    /// Lets a sink watch from now on.
    pub(crate) fn watch(&mut self, sink: Box<dyn Sink>) -> SinkId {
        let led = self.is_led();
        let Rig { sinks, device, .. } = self;
        let id = sinks.add(sink, device, || {
            let state = What::State { by: None, state: written_state(device) };
            let left = device.wake().is_some_and(|due| due <= device.now());
            let stands = What::Stands { causes: left.then_some(0) };
            iter::once(state).chain(led.then_some(stands)).collect()
        });
        self.watch_kinds();
        id
    }

    /// Detaches a sink. Returns whether it was still attached.
    pub(crate) fn detach(&mut self, id: SinkId) -> bool {
        let was_there = self.sinks.remove(id);
        self.watch_kinds();
        was_there
    }

    /// Detaches the sinks that want inputs.
    pub(crate) fn end_recordings(&mut self) {
        self.settle();
        self.sinks.end_recordings();
        self.watch_kinds();
    }

    /// Tells recordings that everything that followed from an input has been reported.
    fn settle(&mut self) {
        if self.is_led() {
            self.tell_place();
        }
        let Rig { sinks, device, .. } = self;
        sinks.settle(device, &|| written_state(device));
    }

    /// Makes the device tell what is wanted of it now.
    pub(crate) fn watch_kinds(&mut self) {
        let wanted = self.sinks.wants().kinds.and(self.waiters.kinds());
        self.device.watch(wanted.and(self.breakpoints.kinds()));
    }

    /// Whether any sink wants events of these kinds.
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

    /// Something happens to the device. Its source has to be known if any sink wants inputs.
    ///
    /// If time is paused by what is due before, it waits behind that. If it is paused already, what is
    /// due at this instant is done first, and then what comes of it at this instant.
    pub(crate) fn input(&mut self, input: Input<'_>, at: Time, by: Option<&Source>) {
        if self.is_watched_closely() {
            self.input_by_moments(input, at, by);
        } else {
            self.tell_input(input, at, by);
            self.device.handle(input, at);
        }
        self.drain();
        self.waiters.look_ahead(&self.device);
    }

    /// Tells what goes in, and minds the power.
    fn tell_input(&mut self, input: Input<'_>, at: Time, by: Option<&Source>) {
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
    }

    /// Nothing but time passes.
    pub(crate) fn pass_time(&mut self, at: Time) {
        self.input(Input::Wake, at, None);
    }

    /// Lets time pass up to the next thing that is to be done.
    pub(crate) fn step(&mut self, at: Time) {
        self.pass_time(at);
        self.tell_time();
        if self.waiters.answer_due(self.device.now()) {
            self.watch_kinds();
        }
        self.disappoint();
    }

    /// The next time at which the device does something, or that a caller waits for.
    pub(crate) fn next_deadline(&self) -> Option<Time> {
        let watched = self.waiters.due().into_iter().chain(self.breakpoints.due());
        let due = self.device.wake().into_iter().chain(watched).min();
        due.filter(|at| *at != Time::NEVER)
    }

    /// Tells the sinks that wanted to know it that time has passed.
    fn tell_time(&mut self) {
        if self.sinks.pass(self.device.now()) {
            self.settle();
        }
    }

    /// Tells the callers whose condition can no longer come true: the device rests.
    pub(crate) fn disappoint(&mut self) {
        if self.waiters.is_empty() || self.device.wake().is_some_and(|at| at != Time::NEVER) {
            return;
        }
        if self.waiters.disappoint() {
            self.watch_kinds();
        }
    }

    /// Answers the callers that do not want to wait any longer.
    pub(crate) fn give_up_waiting(&mut self)
    where
        D: Clone,
    {
        if self.waiters.give_up(&self.device) {
            self.watch_kinds();
        }
    }

    /// Whether nothing more may happen now: time is paused, or what is stored would be lost.
    pub(crate) fn has_to_stop(&self) -> bool {
        self.is_paused() || self.storage.has_failed()
    }

    // --- moment by moment ---

    /// Whether any sink wants to see the states between two causes of one instant.
    fn is_watched_closely(&self) -> bool {
        self.is_led() || self.waiters.have_happenings()
    }

    /// The same as [`Device::handle`], cause by cause, as far as no breakpoint is met.
    fn input_by_moments(&mut self, input: Input<'_>, at: Time, by: Option<&Source>) {
        let was_paused = self.is_paused();
        let stopped = |rig: &Rig<D>| rig.is_paused() && !was_paused;
        self.perform_until(at, stopped);
        while !stopped(self)
            && let Some(Pending { input, by }) = self.pending.pop_front()
        {
            self.accept(input.as_input(), self.device.now().max(at), by.as_ref());
            self.perform_until(at, stopped);
        }
        if stopped(self) {
            return self.hold_back(input, by);
        }
        self.accept(input, at, by);
        self.perform_until(at, stopped);
    }

    /// Performs what is due up to `at`, and stops at the instants at which breakpoints have to be
    /// looked at.
    fn perform_until(&mut self, at: Time, stopped: impl Fn(&Rig<D>) -> bool) {
        while !stopped(self)
            && let Some(due) = self.next_moment().filter(|due| *due <= at)
        {
            self.moment_at(due);
        }
    }

    /// The next instant at which the device does something, or has to be looked at.
    fn next_moment(&self) -> Option<Time> {
        let now = self.device.now();
        let look = self.breakpoints.due().filter(|at| *at > now);
        self.device.wake().into_iter().chain(look).min().filter(|at| *at != Time::NEVER)
    }

    /// Performs the cause that is due then, or lets time pass up to it. Nothing is due before.
    /// Returns whether there was a cause.
    fn moment_at(&mut self, due: Time) -> bool {
        let is_cause = self.device.perform(due);
        if is_cause {
            self.count_cause();
        } else {
            self.device.accept(Input::Wake, due);
        }
        self.look();
        is_cause
    }

    /// Gives the device an input. What is due has been performed.
    fn accept(&mut self, input: Input<'_>, at: Time, by: Option<&Source>) {
        // What came out before is told before.
        self.pass_on();
        self.tell_input(input, at, by);
        self.device.accept(input, at);
        if input != Input::Wake {
            self.performed = (self.device.now(), 0);
        }
        self.look();
    }

    /// Looks at the device after a cause or an input: answers the callers whose condition it has
    /// met, and pauses time where a breakpoint is met.
    fn look(&mut self) {
        let before = self.seen.len();
        while let Some(output) = self.device.poll_output() {
            self.seen.push_back(output);
        }
        let Rig { seen, device, waiters, breakpoints, .. } = self;
        let events = seen.range(before..).filter_map(Output::event);
        let answered = waiters.answer_happened(device, events.clone());
        let met = breakpoints.look(device, events);
        if answered {
            self.watch_kinds();
        }
        if !met.is_empty() {
            self.pass_on();
            let (by, breakpoints) = met.pause();
            self.begin_pause(by, breakpoints);
        }
    }

    fn count_cause(&mut self) {
        let now = self.device.now();
        let (at, causes) = self.performed;
        self.performed = (now, if at == now { causes + 1 } else { 1 });
    }

    // --- a pause ---

    /// Pauses time from now on whenever a condition becomes true.
    pub(crate) fn break_when(&mut self, condition: Condition) -> BreakpointId {
        let id = self.breakpoints.add(&self.device, condition);
        self.watch_kinds();
        self.settle();
        id
    }

    /// The same in the name of somebody, without a breakpoint that is listed.
    pub(crate) fn stop_when(&mut self, condition: Condition, by: Source) -> BreakpointId {
        let id = self.breakpoints.add_stop(&self.device, condition, by);
        self.watch_kinds();
        self.settle();
        id
    }

    /// Removes a breakpoint. Returns whether it was there.
    pub(crate) fn remove_breakpoint(&mut self, id: BreakpointId) -> bool {
        let was_there = self.breakpoints.remove(id);
        self.watch_kinds();
        if was_there {
            self.tell_if_it_goes();
        }
        was_there
    }

    /// Whether time is paused.
    pub(crate) fn is_paused(&self) -> bool {
        self.pause.is_some()
    }

    /// Since when time is paused, and why.
    pub(crate) fn paused(&self) -> Option<&Pause> {
        self.pause.as_ref()
    }

    /// Whether something is left that happens at this very instant.
    fn is_anything_due(&self) -> bool {
        self.device.wake().is_some_and(|due| due <= self.device.now())
    }

    /// Pauses time here on request.
    pub(crate) fn pause(&mut self, by: Source) {
        self.begin_pause(Some(by), Vec::new());
        self.drain();
    }

    /// Pauses time here, on request or because breakpoints are met.
    fn begin_pause(&mut self, by: Option<Source>, breakpoints: Vec<BreakpointId>) {
        let at = self.device.now();
        self.tell_news(at, News::Paused { by: by.clone(), breakpoints: breakpoints.clone() });
        let pause = Pause { at, by, breakpoints };
        for waits in self.waits_for_pause.drain(..) {
            // The caller may have stopped waiting for it.
            let _ = waits.send(Ok(pause.clone()));
        }
        self.pause = Some(pause);
    }

    /// Answers when time is paused: at once if it is.
    pub(crate) fn tell_of_pause(&mut self, answer: oneshot::Sender<Result<Pause, ControlError>>) {
        match &self.pause {
            Some(pause) => _ = answer.send(Ok(pause.clone())),
            None => self.waits_for_pause.push(answer),
        }
    }

    /// Reports that the device is no longer led, if it was until now.
    fn tell_if_it_goes(&mut self) {
        if !self.is_led() {
            self.pass_on();
            let now = self.device.now();
            self.tell(now, |wants| wants.inputs, || What::Goes);
        }
    }

    /// Whether the device is led cause by cause.
    fn is_led(&self) -> bool {
        self.pause.is_some() || !self.breakpoints.is_empty()
    }

    /// Tells how far a device has come that is led.
    fn tell_place(&mut self) {
        let (now, left) = (self.device.now(), self.is_anything_due());
        let (at, causes) = std::mem::replace(&mut self.performed, (now, 0));
        let causes = left.then_some(if at == now { causes } else { 0 });
        self.tell(now, |wants| wants.inputs, || What::Stands { causes });
    }

    /// Time goes on, beginning with what is left at this instant. That may pause it again.
    pub(crate) fn resume(&mut self, by: &Source) {
        let now = self.device.now();
        self.tell_news(now, News::Resumed { by: by.clone() });
        self.pause = None;
        self.input_by_moments(Input::Wake, now, None);
        self.tell_if_it_goes();
        self.drain();
        self.waiters.look_ahead(&self.device);
        self.disappoint();
    }

    /// Time goes on for good: the device is no longer led.
    pub(crate) fn release(&mut self) {
        self.breakpoints.clear();
        self.pending.clear();
        self.pause = None;
    }

    /// Does one thing while time is paused: a cause that is due now, or else an input that has waited
    /// behind it, or else the next cause. Time passes no further than to where a breakpoint is met.
    pub(crate) fn perform_one(&mut self) -> Step {
        let step = if self.is_anything_due() {
            self.moment_at(self.device.now());
            Step::Cause
        } else if let Some(Pending { input, by }) = self.pending.pop_front() {
            self.accept(input.as_input(), self.device.now(), by.as_ref());
            Step::Input
        } else if let Some(due) = self.next_moment() {
            if self.moment_at(due) { Step::Cause } else { Step::Time }
        } else {
            return Step::Rest;
        };
        self.after_step();
        step
    }

    /// Lets time pass while it is paused, up to then, unless something is due before. Breakpoints are met
    /// on the way.
    pub(crate) fn wait_until(&mut self, at: Time) {
        while self.device.now() < at && self.device.wake().is_none_or(|due| due >= at) {
            let look = self.breakpoints.due().filter(|look| *look > self.device.now());
            let to = look.map_or(at, |look| look.min(at));
            self.device.accept(Input::Wake, to);
            self.look();
        }
        self.after_step();
    }

    /// Gives an input while time is paused. It comes after what is due at this instant, and what it
    /// leads to is left to steps.
    pub(crate) fn give(&mut self, input: Input<'_>, by: Option<&Source>) {
        self.hold_back(input, by);
        while !self.is_anything_due()
            && let Some(Pending { input, by }) = self.pending.pop_front()
        {
            self.accept(input.as_input(), self.device.now(), by.as_ref());
        }
        self.after_step();
    }

    /// Keeps an input for when time goes on, or for steps: it comes behind what is due.
    pub(crate) fn hold_back(&mut self, input: Input<'_>, by: Option<&Source>) {
        if !matches!(input, Input::Wake | Input::Bytes([])) {
            self.pending.push_back(Pending { input: input.into(), by: by.cloned() });
        }
    }

    fn after_step(&mut self) {
        self.drain();
        self.waiters.look_ahead(&self.device);
        if self.waiters.answer_due(self.device.now()) {
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
        self.performed = (self.device.now(), 0);
        self.breakpoints.begin(&self.device);
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
        if self.is_paused() {
            self.after_step();
        }
    }

    // --- what comes out ---

    /// Lets go of clients that have closed their side of the line, once they have every answer.
    pub(crate) fn dismiss_listeners(&mut self) {
        let Rig { wire, device, pause, .. } = self;
        if pause.is_none() {
            wire.dismiss_listeners(|| device.is_idle());
        }
    }

    /// Passes on what the device has to say, when all has been done that is to be done now.
    pub(crate) fn drain(&mut self) {
        self.pass_on();
        self.settle();
        self.wire.set_baud(self.device.baud());
        self.mind_ready();
    }

    /// Passes on what the device has to say, in order: what is stored is on disk before the
    /// answer that confirms it is sent. What is said at one and the same time leaves in one
    /// piece.
    fn pass_on(&mut self) {
        let mut transmission = Transmission::default();
        while let Some(output) = self.seen.pop_front().or_else(|| self.device.poll_output()) {
            match output {
                Output::Bytes(at, bytes) => {
                    if !transmission.has_space_at(at) {
                        self.send_all(&mut transmission);
                    }
                    transmission.add(at, bytes);
                }
                Output::Flash(_, change) => {
                    self.send_all(&mut transmission);
                    self.store(&change);
                }
                Output::Event(Stamp { at, command }, event) => {
                    self.send_all(&mut transmission);
                    let kind = event.kind();
                    let what = || What::Event { command, event };
                    self.tell(at, |wants| wants.kinds.contain(kind), what);
                }
            }
        }
        self.send_all(&mut transmission);
        self.storage.secure();
    }

    /// Asks clients to wait, by the lines that there are for it, while the device takes nothing.
    fn mind_ready(&mut self) {
        let line = self.device.modem_line();
        let shows_ready = !matches!(line, Some((ModemLine::Cts, _)));
        let ready = self.pause.is_none() && self.device.room(true) > 0;
        self.wire.set_ready(ready || !shows_ready);
        self.wire.set_line(line);
    }

    fn send_all(&mut self, transmission: &mut Transmission) {
        if let Some((at, bytes)) = transmission.take() {
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
        // Reported before it leaves: whatever a client has seen is in the recording already.
        self.tell(at, |wants| wants.sent, || What::Sent { bytes: bytes.clone() });
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
