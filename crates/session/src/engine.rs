//! A device, and all that watches it while inputs go in.

use std::collections::VecDeque;

use bytes::Bytes;
use vimc4_device::{
    Condition, Deed, Device, Event, FlashChange, Input, Kinds, Output, OwnedInput, Stamp, Time,
};

use crate::request::{Completion, RequestId};
use crate::transmission::Transmission;
use crate::waiters::Waiters;
use crate::{
    BreakpointId, Breakpoints, ControlError, EventFilter, LineEvent, Pause, ReportKind, Source,
    Step,
};

/// An output of a [`Session`](crate::Session). The outputs come in the order in which things
/// happened.
#[derive(Clone, Debug, PartialEq)]
pub enum SessionOutput {
    /// A report that somebody wants. It has the meaning of a command that the device can no longer
    /// [explain](Device::explain).
    Report(Time, ReportKind, Option<String>),
    /// The device sends bytes: those of one time in one piece.
    Bytes(Time, Bytes),
    /// The device stores something, which must be safe before later bytes leave.
    Store(FlashChange),
    /// Everything that followed from an input, or from the passing of time, has been returned.
    Settled,
}

/// Takes the input that a device has just carried out by itself, and its source.
pub(crate) type TakeInput<D> = fn(&mut D) -> Option<(OwnedInput, Source)>;

/// An input that waits, and its source.
#[derive(Debug)]
struct PendingInput {
    input: OwnedInput,
    by: Option<Source>,
}

/// A device with its breakpoints and waiting callers: every input passes through here, and every
/// effect comes out of here.
#[derive(Debug)]
pub(crate) struct Engine<D: Device> {
    pub(crate) device: D,
    pub(crate) waiters: Waiters,
    pub(crate) breakpoints: Breakpoints,
    /// The reports that somebody wants; `None` if nobody watches.
    pub(crate) wants: Option<EventFilter>,
    /// Whether the flash memory outlives the device.
    pub(crate) keeps_flash: bool,
    /// How to take an input that the device has carried out by itself, if it can.
    pub(crate) take_input: Option<TakeInput<D>>,
    /// Time is paused.
    pause: Option<Pause>,
    /// The requests that complete when time is paused.
    pause_requests: Vec<RequestId>,
    /// Inputs that wait behind the causes that were due when time was paused.
    pending: VecDeque<PendingInput>,
    /// An instant, and how many causes have been performed at it since an input or a report of them.
    performed: (Time, u32),
    /// Outputs of the device that have been looked at and not passed on.
    seen: VecDeque<Output>,
    outputs: VecDeque<SessionOutput>,
    is_settled: bool,
    completions: VecDeque<(RequestId, Completion)>,
    /// The number of inputs, other than time.
    inputs: u64,
    /// The number of outputs that were sent or stored.
    pub(crate) said: u64,
    /// The number of bytes that have arrived since the power was switched off; `None` while it is on.
    unpowered: Option<u64>,
}

impl<D: Device> Engine<D> {
    pub(crate) fn new(device: D) -> Engine<D> {
        let mut engine = Engine {
            device,
            waiters: Waiters::default(),
            breakpoints: Breakpoints::default(),
            wants: None,
            keeps_flash: false,
            take_input: None,
            pause: None,
            pause_requests: Vec::new(),
            pending: VecDeque::new(),
            performed: (Time::ZERO, 0),
            seen: VecDeque::new(),
            outputs: VecDeque::new(),
            is_settled: false,
            completions: VecDeque::new(),
            inputs: 0,
            said: 0,
            unpowered: None,
        };
        engine.update_power();
        engine.update_kinds();
        engine
    }

    // --- outputs ---

    pub(crate) fn poll_output(&mut self) -> Option<SessionOutput> {
        let output = self.outputs.pop_front();
        output.or_else(|| std::mem::take(&mut self.is_settled).then_some(SessionOutput::Settled))
    }

    pub(crate) fn poll_completion(&mut self) -> Option<(RequestId, Completion)> {
        self.completions.pop_front()
    }

    pub(crate) fn complete(&mut self, id: RequestId, completion: Completion) {
        self.completions.push_back((id, completion));
    }

    /// Completes the requests of waiters that have been removed.
    fn complete_waiters(
        &mut self,
        ids: Vec<RequestId>,
        end: impl Fn() -> Result<Time, ControlError>,
    ) {
        if ids.is_empty() {
            return;
        }
        for id in ids {
            self.complete(id, Completion::Advanced(end()));
        }
        self.update_kinds();
    }

    // --- reports ---

    /// Reports are wanted of this from now on.
    pub(crate) fn set_wants(&mut self, wants: Option<EventFilter>) {
        self.wants = wants;
        self.update_kinds();
    }

    /// Has the device emit the events that somebody needs now.
    pub(crate) fn update_kinds(&mut self) {
        let wanted = self.wants.unwrap_or_default().kinds.and(self.waiters.kinds());
        self.device.watch(wanted.and(self.breakpoints.kinds()));
    }

    /// Whether events of these kinds are wanted.
    pub(crate) fn is_wanted(&self, kinds: Kinds) -> bool {
        self.wants.is_some_and(|wants| wants.kinds.contain(kinds))
    }

    /// Whether inputs are wanted.
    pub(crate) fn are_inputs_wanted(&self) -> bool {
        self.wants.is_some_and(|wants| wants.inputs)
    }

    fn report(&mut self, at: Time, what: ReportKind) {
        self.outputs.push_back(SessionOutput::Report(at, what, None));
    }

    /// Keeps what reported commands mean, because an input may change that.
    fn keep_meanings(&mut self) {
        for output in &mut self.outputs {
            if let SessionOutput::Report(_, ReportKind::Event { event, .. }, meaning @ None) =
                output
                && let Event::Command { bytes, .. } = event
            {
                *meaning = Some(self.device.explain(bytes));
            }
        }
    }

    /// Reports an operator action that is about to be performed.
    pub(crate) fn report_action(&mut self, at: Time, by: &Source, deed: Deed) {
        let meaning = match deed {
            Deed::Byte(byte) => Some(self.device.explain(&[byte])),
            _ => None,
        };
        let what = ReportKind::News(LineEvent::Deed { by: by.clone(), deed });
        self.outputs.push_back(SessionOutput::Report(at, what, meaning));
    }

    /// Reports an event of the line, if anybody watches.
    pub(crate) fn report_news(&mut self, at: Time, news: LineEvent) {
        if self.wants.is_some() {
            self.report(at, ReportKind::News(news));
        }
    }

    fn report_input(&mut self, at: Time, what: impl FnOnce() -> ReportKind) {
        if self.are_inputs_wanted() {
            let what = what();
            self.report(at, what);
        }
    }

    /// The reports with which a recording of the inputs begins.
    pub(crate) fn beginning(&self) -> Vec<ReportKind> {
        let state = ReportKind::State { by: None, state: self.written_state() };
        let left = self.is_anything_due();
        let stands = ReportKind::Stands { causes: left.then_some(0) };
        std::iter::once(state).chain(self.is_single_stepped().then_some(stands)).collect()
    }

    /// Everything that followed from an input has been reported.
    pub(crate) fn settle(&mut self) {
        if self.is_single_stepped() {
            let (now, left) = (self.device.now(), self.is_anything_due());
            let (at, causes) = std::mem::replace(&mut self.performed, (now, 0));
            let causes = left.then_some(if at == now { causes } else { 0 });
            self.report_input(now, || ReportKind::Stands { causes });
        }
        self.is_settled = true;
    }

    // --- inputs ---

    /// Gives the device an input. Its source has to be known if inputs are wanted.
    ///
    /// If a cause that is due before pauses time, the input waits behind that. If time is paused
    /// already, the causes due at this instant come first, and the consequences at this instant
    /// follow.
    pub(crate) fn input(&mut self, input: Input<'_>, at: Time, by: Option<&Source>) {
        if self.is_watched_closely() {
            self.input_by_moments(input, at, by);
        } else {
            self.note_input(input, at, by);
            self.device.handle(input, at);
        }
        self.drain();
        self.waiters.look_ahead(&self.device);
    }

    /// Reports an input, and keeps track of the power.
    fn note_input(&mut self, input: Input<'_>, at: Time, by: Option<&Source>) {
        if input != Input::Wake {
            self.keep_meanings();
        }
        if let Some(by) = by {
            self.report_input(at, || ReportKind::Input { by: by.clone(), input: input.into() });
        }
        self.inputs += u64::from(input != Input::Wake);
        match (input, &mut self.unpowered) {
            (Input::Bytes(bytes), Some(dropped)) => {
                *dropped += u64::try_from(bytes.len()).unwrap_or(u64::MAX);
            }
            (Input::Power(true), _) => {
                self.report_dropped_bytes(at);
                self.unpowered = None;
            }
            (Input::Power(false), None) => self.unpowered = Some(0),
            _ => {}
        }
    }

    /// The number of inputs so far, other than time.
    pub(crate) fn inputs(&self) -> u64 {
        self.inputs
    }

    /// Lets time pass.
    pub(crate) fn pass_time(&mut self, at: Time) {
        self.input(Input::Wake, at, None);
    }

    /// Lets time pass up to the next deadline.
    pub(crate) fn step(&mut self, at: Time) {
        self.pass_time(at);
        self.complete_due_waiters();
        self.fail_unreachable_waiters();
    }

    /// The next time at which the device does something, or for which a caller or a breakpoint waits.
    pub(crate) fn next_deadline(&self) -> Option<Time> {
        let watched = self.waiters.due().into_iter().chain(self.breakpoints.due());
        let due = self.device.wake().into_iter().chain(watched).min();
        due.filter(|at| *at != Time::NEVER)
    }

    fn complete_due_waiters(&mut self) {
        let now = self.device.now();
        let due = self.waiters.take_due(now);
        self.complete_waiters(due, || Ok(now));
    }

    /// Fails the waiters whose condition is unreachable, if the device rests.
    pub(crate) fn fail_unreachable_waiters(&mut self) {
        if self.waiters.is_empty() || self.device.wake().is_some_and(|at| at != Time::NEVER) {
            return;
        }
        let unreachable = self.waiters.take_unreachable();
        self.complete_waiters(unreachable, || Err(ControlError::Never));
    }

    /// Ends the waiters that want to wait no longer.
    pub(crate) fn end_cancelled_waiters(&mut self)
    where
        D: Clone,
    {
        let cancelled = self.waiters.take_cancelled(&self.device);
        let at = self.device.now();
        self.complete_waiters(cancelled, || Err(ControlError::Cancelled { at }));
    }

    // --- moment by moment ---

    /// Whether the states between two causes of one instant matter.
    fn is_watched_closely(&self) -> bool {
        self.is_single_stepped() || self.waiters.have_happenings() || self.take_input.is_some()
    }

    /// The same as [`Device::handle`], cause by cause, as far as no breakpoint is met.
    fn input_by_moments(&mut self, input: Input<'_>, at: Time, by: Option<&Source>) {
        let was_paused = self.is_paused();
        let stopped = |engine: &Engine<D>| engine.is_paused() && !was_paused;
        self.perform_until(at, stopped);
        while !stopped(self)
            && let Some(PendingInput { input, by }) = self.pending.pop_front()
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

    /// Performs the causes due up to `at`, and stops where breakpoints have to be checked.
    fn perform_until(&mut self, at: Time, stopped: impl Fn(&Engine<D>) -> bool) {
        while !stopped(self)
            && let Some(due) = self.next_moment().filter(|due| *due <= at)
        {
            self.perform_at(due);
        }
    }

    /// The next instant with a cause, or at which breakpoints have to be checked.
    pub(crate) fn next_moment(&self) -> Option<Time> {
        let now = self.device.now();
        let look = self.breakpoints.due().filter(|at| *at > now);
        self.device.wake().into_iter().chain(look).min().filter(|at| *at != Time::NEVER)
    }

    /// Performs the cause that is due at `due`, or lets time pass up to then. Nothing is due before.
    pub(crate) fn perform_at(&mut self, due: Time) -> Step {
        if self.take_input.is_some() {
            self.pass_on();
        }
        let is_cause = self.device.perform(due);
        let step =
            if let Some((input, by)) = self.take_input.and_then(|take| take(&mut self.device)) {
                let now = self.device.now();
                self.note_input(input.as_input(), now, Some(&by));
                self.performed = (now, 0);
                Step::Input
            } else if is_cause {
                self.count_cause();
                Step::Cause
            } else {
                self.device.accept(Input::Wake, due);
                Step::Time
            };
        self.look();
        step
    }

    /// Gives the device an input. The causes that are due have been performed.
    pub(crate) fn accept(&mut self, input: Input<'_>, at: Time, by: Option<&Source>) {
        // Earlier outputs are reported before.
        self.pass_on();
        self.note_input(input, at, by);
        self.device.accept(input, at);
        if input != Input::Wake {
            self.performed = (self.device.now(), 0);
        }
        self.look();
    }

    /// Checks the waiters and breakpoints after a cause or an input.
    fn look(&mut self) {
        let before = self.seen.len();
        while let Some(output) = self.device.poll_output() {
            self.seen.push_back(output);
        }
        let Engine { seen, device, waiters, breakpoints, .. } = self;
        let events = seen.range(before..).filter_map(Output::event);
        let happened = waiters.take_happened(device, events.clone());
        let met = breakpoints.look(device, events);
        let now = device.now();
        self.complete_waiters(happened, || Ok(now));
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

    // --- pauses ---

    /// Pauses time whenever a condition becomes true.
    pub(crate) fn add_breakpoint(&mut self, condition: Condition) -> BreakpointId {
        let id = self.breakpoints.add(&self.device, condition);
        self.update_kinds();
        self.settle();
        id
    }

    /// Pauses time in the name of `by`, by a breakpoint that is not listed.
    pub(crate) fn add_stop(&mut self, condition: Condition, by: Source) -> BreakpointId {
        let id = self.breakpoints.add_stop(&self.device, condition, by);
        self.update_kinds();
        self.settle();
        id
    }

    /// Removes a breakpoint. Returns whether it was there.
    pub(crate) fn remove_breakpoint(&mut self, id: BreakpointId) -> bool {
        let was_there = self.breakpoints.remove(id);
        self.update_kinds();
        if was_there {
            self.report_if_running();
        }
        was_there
    }

    pub(crate) fn is_paused(&self) -> bool {
        self.pause.is_some()
    }

    pub(crate) fn paused(&self) -> Option<&Pause> {
        self.pause.as_ref()
    }

    /// Whether a cause is due at this instant.
    fn is_anything_due(&self) -> bool {
        self.device.wake().is_some_and(|due| due <= self.device.now())
    }

    /// Pauses time here on request.
    pub(crate) fn pause(&mut self, by: Source) {
        self.begin_pause(Some(by), Vec::new());
        self.drain();
    }

    /// Pauses time here, on request or at breakpoints.
    fn begin_pause(&mut self, by: Option<Source>, breakpoints: Vec<BreakpointId>) {
        let at = self.device.now();
        self.report_news(
            at,
            LineEvent::Paused { by: by.clone(), breakpoints: breakpoints.clone() },
        );
        let pause = Pause { at, by, breakpoints };
        for id in std::mem::take(&mut self.pause_requests) {
            self.complete(id, Completion::Paused(pause.clone()));
        }
        self.pause = Some(pause);
    }

    /// Completes the request when time is paused: at once if it is.
    pub(crate) fn await_pause(&mut self, id: RequestId) {
        match self.pause.clone() {
            Some(pause) => self.complete(id, Completion::Paused(pause)),
            None => self.pause_requests.push(id),
        }
    }

    /// Reports that the device is no longer stepped cause by cause, if so.
    fn report_if_running(&mut self) {
        if !self.is_single_stepped() {
            self.pass_on();
            self.report_input(self.device.now(), || ReportKind::Goes);
        }
    }

    /// Whether the device is stepped cause by cause.
    fn is_single_stepped(&self) -> bool {
        self.pause.is_some() || !self.breakpoints.is_empty()
    }

    /// Lets time go on, beginning with the causes left at this instant. They may pause it again.
    pub(crate) fn resume(&mut self, by: &Source) {
        let now = self.device.now();
        self.report_news(now, LineEvent::Resumed { by: by.clone() });
        self.pause = None;
        self.input_by_moments(Input::Wake, now, None);
        self.report_if_running();
        self.drain();
        self.waiters.look_ahead(&self.device);
        self.fail_unreachable_waiters();
    }

    /// Lets time go on for good, without breakpoints.
    pub(crate) fn release(&mut self) {
        self.breakpoints.clear();
        self.pending.clear();
        self.pause = None;
    }

    /// Does one thing while time is paused: a cause that is due now, or else a pending input, or else
    /// the next cause. Time passes at most up to the next breakpoint that is met.
    pub(crate) fn perform_one(&mut self) -> Step {
        let step = if self.is_anything_due() {
            self.perform_at(self.device.now())
        } else if let Some(PendingInput { input, by }) = self.pending.pop_front() {
            self.accept(input.as_input(), self.device.now(), by.as_ref());
            Step::Input
        } else if let Some(due) = self.next_moment() {
            self.perform_at(due)
        } else {
            return Step::Rest;
        };
        self.after_step();
        step
    }

    /// Lets time pass while it is paused, up to `at`, unless something is due before. Breakpoints are
    /// met on the way.
    pub(crate) fn wait_until(&mut self, at: Time) {
        while self.device.now() < at && self.device.wake().is_none_or(|due| due >= at) {
            let look = self.breakpoints.due().filter(|look| *look > self.device.now());
            let to = look.map_or(at, |look| look.min(at));
            self.device.accept(Input::Wake, to);
            self.look();
        }
        self.after_step();
    }

    /// Gives an input while time is paused. It comes after the causes due at this instant, and its
    /// consequences are left to steps.
    pub(crate) fn give(&mut self, input: Input<'_>, by: Option<&Source>) {
        self.hold_back(input, by);
        while !self.is_anything_due()
            && let Some(PendingInput { input, by }) = self.pending.pop_front()
        {
            self.accept(input.as_input(), self.device.now(), by.as_ref());
        }
        self.after_step();
    }

    /// Keeps an input, behind the causes that are due, until time goes on or is stepped.
    pub(crate) fn hold_back(&mut self, input: Input<'_>, by: Option<&Source>) {
        if !matches!(input, Input::Wake | Input::Bytes([])) {
            self.pending.push_back(PendingInput { input: input.into(), by: by.cloned() });
        }
    }

    /// The inputs that wait behind the causes that are due.
    pub(crate) fn pending(&self) -> impl Iterator<Item = &OwnedInput> {
        self.pending.iter().map(|pending| &pending.input)
    }

    pub(crate) fn discard_pending(&mut self) {
        self.pending.clear();
    }

    fn after_step(&mut self) {
        self.drain();
        self.waiters.look_ahead(&self.device);
        self.complete_due_waiters();
    }

    // --- the power ---

    pub(crate) fn is_off(&self) -> bool {
        self.unpowered.is_some()
    }

    /// Reports how many bytes were dropped since the power was switched off.
    pub(crate) fn report_dropped_bytes(&mut self, at: Time) {
        if let Some(dropped) = &mut self.unpowered
            && *dropped > 0
        {
            let bytes = std::mem::take(dropped);
            self.report_news(at, LineEvent::PowerWasOff { bytes });
        }
    }

    fn update_power(&mut self) {
        let powered = self.device.view(self.device.now()).powered;
        self.unpowered = (!powered).then_some(0);
    }

    // --- another state ---

    /// Continues from another state, whose time becomes the present.
    pub(crate) fn restore(&mut self, by: &Source, state: D::State) {
        let at = self.device.now();
        let before = self.keeps_flash.then(|| self.device.flash_image());
        self.device.restore(state);
        self.state_changed(by, at);
        if let Some(before) = before {
            let after = self.device.flash_image();
            if before != after {
                self.store(FlashChange::Replace(Bytes::from(after)));
            }
        }
        if self.is_paused() {
            self.after_step();
        }
    }

    /// The device continues from another state, which it was put into at `at`.
    pub(crate) fn state_changed(&mut self, by: &Source, at: Time) {
        self.performed = (self.device.now(), 0);
        self.breakpoints.begin(&self.device);
        self.update_kinds();
        self.update_power();
        if self.are_inputs_wanted() {
            let what = ReportKind::State { by: Some(by.clone()), state: self.written_state() };
            self.report(at, what);
        }
    }

    /// The state of the device as JSON. Every state can be written.
    pub(crate) fn written_state(&self) -> serde_json::Value {
        serde_json::to_value(self.device.state()).unwrap_or_default()
    }

    // --- what comes out ---

    /// Passes on the outputs of the device, when everything due now has been done.
    pub(crate) fn drain(&mut self) {
        self.pass_on();
        self.settle();
    }

    /// Passes on the outputs of the device in order. The bytes of one time leave in one piece.
    fn pass_on(&mut self) {
        let mut bytes_now = Transmission::default();
        while let Some(output) = self.seen.pop_front().or_else(|| self.device.poll_output()) {
            match output {
                Output::Bytes(at, bytes) => {
                    if !bytes_now.has_space_at(at) {
                        self.send(&mut bytes_now);
                    }
                    bytes_now.add(at, bytes);
                }
                Output::Flash(_, change) => {
                    self.send(&mut bytes_now);
                    self.store(change);
                }
                Output::Event(Stamp { at, command }, event) => {
                    self.send(&mut bytes_now);
                    if self.is_wanted(event.kind()) {
                        self.report(at, ReportKind::Event { command, event });
                    }
                }
            }
        }
        self.send(&mut bytes_now);
    }

    fn send(&mut self, transmission: &mut Transmission) {
        if let Some((at, bytes)) = transmission.take() {
            self.said += 1;
            self.outputs.push_back(SessionOutput::Bytes(at, bytes));
        }
    }

    fn store(&mut self, change: FlashChange) {
        self.said += 1;
        self.outputs.push_back(SessionOutput::Store(change));
    }
}
