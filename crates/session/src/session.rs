//! A device in its run loop.

use std::collections::VecDeque;
use std::time::Duration;

use vimc4_device::{Condition, Device, Foresight, Input, OwnedInput, Time};

use crate::advance::Advance;
use crate::clients::LineClients;
use crate::engine::{Engine, SessionOutput};
use crate::pace::Pace;
use crate::request::{AdvanceRequest, Completion, Destination, Progress, RequestId, Work};
use crate::{
    BreakpointId, BreakpointView, Clock, ControlError, EventFilter, Pause, ReportKind, Source, Step,
};

/// How many causes are looked ahead for a caller that waits while time runs by itself. A condition
/// that is not decided by then is waited for.
const FORESIGHT: u32 = 1_000;

/// A device, the clock it lives by, and all that waits for it and watches it. Its owner has the real
/// clock, the ports, and the files, and drives it from outside.
///
/// There are four kinds of methods:
///
/// - getters, such as [`device`](Session::device), [`paused`](Session::paused), and
///   [`next_timeout`](Session::next_timeout);
/// - `handle_*`: the passing of time, and what happens on the line;
/// - requests. A request that takes time returns a [`RequestId`]; all others return their result;
/// - `poll_*`: [outputs](Session::poll_output) with reports among them, and
///   [completions](Session::poll_completion). The owner calls them after each call of the other kinds,
///   until they return nothing.
///
/// Wall time is passed in, as the time since an origin that the owner chooses. A clock that does not
/// run by itself ignores it.
#[derive(Debug)]
pub struct Session<D: Device> {
    pub(crate) engine: Engine<D>,
    pub(crate) clients: LineClients,
    /// Whether the baud rate of a client counts.
    pub(crate) has_physics: bool,
    pace: Pace,
    advance: Option<Advance<D>>,
    /// The advances that begin when that has ended.
    queue: VecDeque<QueuedAdvance>,
    /// When a watcher wants to know that time has passed.
    watch_due: Option<Time>,
    last_request: u64,
}

#[derive(Debug)]
struct QueuedAdvance {
    id: RequestId,
    by: Source,
    destination: Destination,
    request: AdvanceRequest,
}

/// Getters and setup.
impl<D: Device> Session<D> {
    /// A device that lives by a clock. Time [starts](Session::start) later.
    pub fn new(device: D, clock: Clock) -> Session<D> {
        Session {
            engine: Engine::new(device),
            clients: LineClients::default(),
            has_physics: false,
            pace: Pace::new(clock),
            advance: None,
            queue: VecDeque::new(),
            watch_due: None,
            last_request: 0,
        }
    }

    /// Some inputs are carried out by the device itself, such as those of a debugger in its history.
    /// `take` returns the input that the last cause was, and its source.
    #[must_use]
    pub fn with_inputs_of_device(
        mut self,
        take: fn(&mut D) -> Option<(OwnedInput, Source)>,
    ) -> Session<D> {
        self.engine.take_input = Some(take);
        self
    }

    /// The reports that are wanted from now on; `None` if nobody watches.
    pub fn set_wants(&mut self, wants: Option<EventFilter>) {
        self.engine.set_wants(wants);
    }

    /// When a watcher wants to know that time has passed. Time stops there on its way, but does not
    /// move for a watcher alone.
    pub fn set_watch_due(&mut self, due: Option<Time>) {
        self.watch_due = due;
    }

    /// Whether the flash memory outlives the device, so that a restored state has to be stored.
    pub fn set_keeps_flash(&mut self, keeps: bool) {
        self.engine.keeps_flash = keeps;
    }

    /// Whether the device reads bytes at the baud rate of the client.
    pub fn set_physics(&mut self, has_physics: bool) {
        self.has_physics = has_physics;
    }

    /// Whether the device reads bytes at the baud rate of the client.
    pub fn has_physics(&self) -> bool {
        self.has_physics
    }

    /// Sets the bytes that end a line, to report a partial line that a client leaves behind. With
    /// `fresh` it is discarded instead: the device gets complete lines only.
    pub fn set_lines(&mut self, ends: &'static [u8], fresh: bool) {
        self.clients.set_lines(ends, fresh);
    }

    /// Sets the bytes that end a line, also in words, where LF does not end one.
    pub fn set_line_feeds(&mut self, ends: &'static [u8], right: &'static str) {
        self.clients.set_line_feeds(ends, right);
    }

    /// Time starts.
    pub fn start(&mut self, wall: Duration) {
        self.pace.begin(wall, self.engine.device.now());
        // The device may have something to say before the first input.
        self.engine.drain();
    }

    /// Pauses time where it is. Time is not paused.
    pub fn pause_here(&mut self, by: Source) {
        self.engine.pause(by);
    }

    /// The device.
    pub fn device(&self) -> &D {
        &self.engine.device
    }

    /// The device, for changes that are no inputs.
    pub fn device_mut(&mut self) -> &mut D {
        &mut self.engine.device
    }

    /// The time up to which the device has run.
    pub fn now(&self) -> Time {
        self.engine.device.now()
    }

    /// Its clock.
    pub fn clock(&self) -> Clock {
        self.pace.clock()
    }

    /// Whether time runs by itself.
    pub fn runs_by_itself(&self) -> bool {
        self.pace.runs()
    }

    /// Since when time is paused, and why.
    pub fn paused(&self) -> Option<&Pause> {
        self.engine.paused()
    }

    /// Whether time is paused.
    pub fn is_paused(&self) -> bool {
        self.engine.is_paused()
    }

    /// The breakpoints, and how often each was met.
    pub fn breakpoints(&self) -> Vec<BreakpointView> {
        self.engine.breakpoints.views()
    }

    /// The inputs that wait behind the causes that are due, while time is paused.
    pub fn pending(&self) -> impl Iterator<Item = &OwnedInput> {
        self.engine.pending()
    }

    /// The reports with which a recording of the inputs begins.
    pub fn beginning(&self) -> Vec<ReportKind> {
        self.engine.beginning()
    }

    /// The state of the device as JSON.
    pub fn written_state(&self) -> serde_json::Value {
        self.engine.written_state()
    }

    /// The model time at a wall time.
    pub fn present(&self, wall: Duration) -> Time {
        let now = self.now();
        // While the device is behind or paused, its own time is the present.
        if self.pace.is_behind() || self.is_paused() {
            return now;
        }
        self.pace.time_at(wall).map_or(now, |at| at.max(now))
    }

    /// The wall time of the next deadline.
    pub fn next_timeout(&self) -> Option<Duration> {
        if !self.pace.runs() || self.is_paused() {
            return None;
        }
        self.pace.wall_of(self.next_stop()?)
    }

    /// Whether anything will be due.
    pub fn has_deadline(&self) -> bool {
        self.pace.is_behind() || self.next_stop().is_some()
    }

    /// Whether inputs have to wait: time is advancing, or the device is behind its clock. They arrive
    /// at the end, in a pause, or after a long advance.
    pub fn holds_up_inputs(&self) -> bool {
        self.pace.is_behind() || self.advance.as_ref().is_some_and(Advance::is_undisturbed)
    }

    /// Whether time can [jump](Session::jump) when the line is quiet.
    pub fn can_jump(&self) -> bool {
        self.pace.jumps()
            && self.advance.is_none()
            && !self.is_paused()
            && self.engine.next_deadline().is_some()
    }

    /// The progress of the present advance.
    pub fn progress(&self) -> Option<(RequestId, Progress)> {
        self.advance.as_ref().map(|advance| (advance.id, advance.progress(self.now())))
    }

    /// The next output.
    pub fn poll_output(&mut self) -> Option<SessionOutput> {
        self.engine.poll_output()
    }

    /// The next request that has ended.
    pub fn poll_completion(&mut self) -> Option<(RequestId, Completion)> {
        self.engine.poll_completion()
    }

    /// Everything that was reported by now counts as settled.
    pub fn settle(&mut self) {
        self.engine.drain();
    }

    fn next_request(&mut self) -> RequestId {
        self.last_request += 1;
        RequestId(self.last_request)
    }
}

/// Time.
impl<D: Device> Session<D> {
    /// When something is due, or a watcher wants to know that time has passed.
    fn next_stop(&self) -> Option<Time> {
        self.engine.next_deadline().into_iter().chain(self.watch_due).min()
    }

    /// Whether something is due by a wall time, or the device is behind its clock.
    pub fn is_due(&self, wall: Duration) -> bool {
        if self.pace.is_behind() {
            return true;
        }
        let Some(due) = self.next_stop() else { return false };
        self.pace.time_at(wall).is_some_and(|present| due <= present)
    }

    /// Does one thing on the way to the model time at a wall time, if time runs by itself.
    pub fn catch_up(&mut self, wall: Duration) -> Work {
        if self.is_paused() {
            self.pace.caught_up();
            return Work::Idle;
        }
        let Some(present) = self.pace.time_at(wall) else { return Work::Idle };
        if self.advance_towards(present) || self.is_paused() {
            self.pace.caught_up();
            return Work::Idle;
        }
        Work::More
    }

    /// The owner has let time pass for some units of work, and more is due by this wall time. If that
    /// lasts, the clock gives way.
    pub fn fall_behind(&mut self, wall: Duration) {
        if self.is_paused() {
            self.pace.caught_up();
        } else {
            self.pace.fell_behind(wall, self.now());
        }
    }

    /// The clock shows the present time of the device from now on.
    pub fn restart_clock(&mut self, wall: Duration) {
        self.pace.restart(wall, self.now());
    }

    /// Does one thing on the way to a time. Returns whether that time has come.
    pub fn advance_towards(&mut self, to: Time) -> bool {
        let next = |session: &Session<D>| session.next_stop().filter(|due| *due <= to);
        if let Some(due) = next(self) {
            self.engine.step(due);
            if self.is_paused() || next(self).is_some() {
                return false;
            }
        }
        if self.now() < to {
            self.engine.step(to);
        }
        true
    }

    /// The line is quiet: with the instant clock, time jumps to the next thing.
    pub fn jump(&mut self) -> Work {
        match self.next_stop() {
            Some(due) if self.can_jump() => {
                self.engine.step(due);
                Work::More
            }
            _ => Work::Idle,
        }
    }

    // --- pauses ---

    /// Pauses time, unless it is paused. Returns the time.
    pub fn pause(&mut self, wall: Duration, by: Source) -> Time {
        if !self.is_paused() {
            let at = self.present(wall);
            self.engine.pass_time(at);
        }
        if !self.is_paused() {
            self.engine.pause(by);
        }
        self.pace.caught_up();
        self.now()
    }

    /// Lets time go on. Wall time that has passed meanwhile is not made up for.
    pub fn resume(&mut self, wall: Duration, by: &Source) -> Result<Time, ControlError> {
        self.needs_pause()?;
        self.engine.resume(by);
        self.restart_clock(wall);
        Ok(self.now())
    }

    /// Does one thing while time is paused.
    pub fn step(&mut self) -> Result<Step, ControlError> {
        self.needs_pause()?;
        Ok(self.engine.perform_one())
    }

    /// Lets time pass while it is paused, up to `at` unless something is due before.
    pub fn wait_until(&mut self, at: Time) -> Result<Time, ControlError> {
        self.needs_pause()?;
        self.engine.wait_until(at);
        Ok(self.now())
    }

    fn needs_pause(&self) -> Result<(), ControlError> {
        if self.is_paused() { Ok(()) } else { Err(ControlError::NotPaused) }
    }

    /// Completes when time is paused: at once if it is.
    pub fn await_pause(&mut self) -> RequestId {
        let id = self.next_request();
        self.engine.await_pause(id);
        id
    }

    /// Pauses time whenever a condition becomes true.
    pub fn add_breakpoint(&mut self, condition: Condition) -> BreakpointId {
        self.engine.add_breakpoint(condition)
    }

    /// Pauses time in the name of `by` whenever a condition becomes true. The breakpoint is not listed.
    pub fn add_stop(&mut self, condition: Condition, by: Source) -> BreakpointId {
        self.engine.add_stop(condition, by)
    }

    /// Removes a breakpoint. Returns whether it was there.
    pub fn remove_breakpoint(&mut self, id: BreakpointId) -> bool {
        self.engine.remove_breakpoint(id)
    }

    /// Changes the speed of a clock that runs by itself. Other clocks cannot be replaced, because
    /// waiting callers rely on them.
    pub fn set_clock(&mut self, wall: Duration, clock: Clock) -> Result<(), ControlError> {
        if clock.rate().is_none() || !self.pace.runs() {
            return Err(ControlError::Unsupported(
                "only a clock that runs by itself can change its speed, as from real to 8x; \
                 any other is chosen when the controller is started",
            ));
        }
        self.replace_clock(wall, clock);
        Ok(())
    }

    /// Replaces the clock. Nobody may wait for a time or a condition.
    pub fn replace_clock(&mut self, wall: Duration, clock: Clock) {
        if !self.is_paused() {
            let at = self.present(wall);
            self.engine.pass_time(at);
        }
        self.pace.replace(clock, wall, self.now());
    }

    /// Continues from another state, whose time becomes the present. A pause remains. An advance is
    /// cancelled, because its destination belongs to another time.
    pub(crate) fn continue_from(&mut self, wall: Duration, by: &Source, at: Time, state: D::State) {
        if let Some(Advance { id, .. }) = self.advance.take() {
            let end = Err(ControlError::Cancelled { at });
            self.engine.complete(id, Completion::Advanced(end));
        }
        self.engine.restore(by, state);
        if !self.is_paused() {
            self.restart_clock(wall);
            self.engine.pass_time(self.now());
            self.engine.fail_unreachable_waiters();
        }
    }
}

/// Time that is sent to a destination.
impl<D: Device + Clone> Session<D> {
    /// Does one thing that is due: for an advance, or because time runs by itself.
    pub fn handle_timeout(&mut self, wall: Duration) -> Work {
        if self.is_paused() {
            self.hold_up_advance();
            return Work::Idle;
        }
        if self.advance.is_none()
            && let Some(next) = self.queue.pop_front()
        {
            let QueuedAdvance { id, by, destination, request } = next;
            let mut advance = Advance::begin(id, by, self.now(), destination);
            advance.request = request;
            self.advance = Some(advance);
        }
        match self.advance.take() {
            Some(advance) => self.continue_advance(advance),
            // A device that has nothing to do yet need not know that time passes.
            None if self.is_due(wall) => self.catch_up(wall),
            None => Work::Idle,
        }
    }

    /// Sends time to a destination. If time runs by itself, only a condition can be awaited.
    pub fn advance(&mut self, by: Source, destination: Destination) -> RequestId {
        let id = self.next_request();
        match self.begin_advance(id, by, destination) {
            Ok(()) => {}
            Err(error) => self.engine.complete(id, Completion::Advanced(Err(error))),
        }
        id
    }

    fn begin_advance(
        &mut self,
        id: RequestId,
        by: Source,
        destination: Destination,
    ) -> Result<(), ControlError> {
        match &self.advance {
            Some(advance) if advance.is_paused => {
                return Err(ControlError::Unsupported(
                    "time is on its way already, and paused; resume or cancel that journey first",
                ));
            }
            Some(_) => {
                let request = AdvanceRequest::Go;
                self.queue.push_back(QueuedAdvance { id, by, destination, request });
                return Ok(());
            }
            None => {}
        }
        if self.is_paused() && !self.pace.runs() {
            return Err(ControlError::Paused);
        }
        match destination {
            destination if !self.pace.runs() => {
                self.advance = Some(Advance::begin(id, by, self.now(), destination));
                Ok(())
            }
            Destination::Until(condition) => self.wait_for(id, condition),
            Destination::After(_) => Err(ControlError::RunsByItself),
        }
    }

    /// A caller waits for a condition while time runs by itself.
    fn wait_for(&mut self, id: RequestId, condition: Condition) -> Result<(), ControlError> {
        let Engine { device, waiters, .. } = &mut self.engine;
        // An event from outside can happen at any time.
        let by_itself = !condition.has_happenings();
        if by_itself && device.foresee(&condition, FORESIGHT) == Foresight::Never {
            return Err(ControlError::Never);
        }
        waiters.add(device, condition, id);
        self.engine.update_kinds();
        Ok(())
    }

    /// The caller of an advance wants it to go on in another way.
    pub fn change_advance(&mut self, id: RequestId, request: AdvanceRequest) {
        if let Some(advance) = self.advance.as_mut().filter(|advance| advance.id == id) {
            advance.request = request;
        }
        for queued in self.queue.iter_mut().filter(|queued| queued.id == id) {
            queued.request = request;
        }
        self.engine.waiters.change(id, request);
        self.end_cancelled();
    }

    /// Ends the requests that have been cancelled and are not under way.
    fn end_cancelled(&mut self) {
        let at = self.now();
        let engine = &mut self.engine;
        self.queue.retain(|queued| {
            let is_cancelled = queued.request == AdvanceRequest::Cancel;
            if is_cancelled {
                let end = Err(ControlError::Cancelled { at });
                engine.complete(queued.id, Completion::Advanced(end));
            }
            !is_cancelled
        });
        self.engine.end_cancelled_waiters();
    }

    /// Goes on with an advance, unless it has ended.
    fn continue_advance(&mut self, mut advance: Advance<D>) -> Work {
        let was_undisturbed = advance.is_undisturbed();
        if let Some(end) = self.advance_once(&mut advance) {
            return self.end_advance(advance, end);
        }
        let work = match () {
            () if advance.is_paused => Work::Idle,
            () if was_undisturbed && !advance.is_undisturbed() => Work::Yield,
            () => Work::More,
        };
        self.advance = Some(advance);
        work
    }

    /// Does one unit of work for an advance. Returns how it ends, if it does.
    fn advance_once(&mut self, advance: &mut Advance<D>) -> Option<Result<Time, ControlError>> {
        advance.is_paused = false;
        match advance.request {
            AdvanceRequest::Cancel => Some(Err(ControlError::Cancelled { at: self.now() })),
            AdvanceRequest::Pause => {
                advance.is_paused = true;
                None
            }
            AdvanceRequest::Go | AdvanceRequest::Unaided => {
                match advance.look_ahead(&self.engine.device, self.engine.inputs()) {
                    Foresight::Never => Some(Err(ControlError::Never)),
                    Foresight::Open => {
                        let until = advance.searched_to()?;
                        Some(Err(ControlError::Unforeseen { until }))
                    }
                    Foresight::At(to) => {
                        if self.advance_towards(to) {
                            return Some(Ok(to));
                        }
                        advance.count_cause();
                        None
                    }
                }
            }
        }
    }

    fn end_advance(&mut self, advance: Advance<D>, end: Result<Time, ControlError>) -> Work {
        let Advance { id, by, began, .. } = advance;
        let now = self.now();
        if end.is_ok() || now > began {
            self.engine.input(Input::Wake, now, Some(&by));
        }
        self.engine.complete(id, Completion::Advanced(end));
        if self.is_paused() || self.queue.is_empty() { Work::Idle } else { Work::Yield }
    }

    /// An advance goes no further while time is paused, but can be cancelled.
    fn hold_up_advance(&mut self) {
        self.pace.caught_up();
        let at = self.now();
        match &mut self.advance {
            Some(Advance { id, request: AdvanceRequest::Cancel, .. }) => {
                let end = Err(ControlError::Cancelled { at });
                self.engine.complete(*id, Completion::Advanced(end));
                self.advance = None;
            }
            Some(advance) => advance.is_paused = true,
            None => {}
        }
    }
}
