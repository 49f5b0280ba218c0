//! The controls of a running controller.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::sync::{mpsc, oneshot};
use vimc4_device::{
    Condition, Deed, Device, Fault, FaultNumber, OwnedInput, Scenario, ScenarioNumber, Signal,
    Time, View,
};

use crate::BreakpointView;
use crate::Clock;
use crate::ControlError;
use crate::advance::{AdvanceCounts, TimeAdvance};
use crate::pending::Pending;
use crate::runner::{Deferred, Ending, Runner};
use crate::transport::Transport;
use crate::{BreakpointId, Effect, Sink, SinkId, Source};
use crate::{Pause, Step};
use vimc4_session::Destination;

/// Controls a running controller from outside: its panel, its power, its time.
///
/// Every method makes its request at once and in order; the [`Pending`] can be awaited or waited
/// for. Bytes never take this path. The controller ends when it is [told to](Handle::stop) or when
/// the last handle is dropped.
#[derive(Debug)]
pub struct Handle<D: Device> {
    jobs: mpsc::UnboundedSender<Deferred<D>>,
    /// Has the controller look at the requests to its advances.
    nudge: mpsc::UnboundedSender<()>,
    /// The advances that have been requested.
    advances: Arc<AdvanceCounts>,
    stop: Arc<Mutex<Option<oneshot::Sender<Ending>>>>,
    /// Whether time moves by itself.
    by_itself: bool,
    /// Its name as a source.
    who: Arc<str>,
}

impl<D: Device> Clone for Handle<D> {
    fn clone(&self) -> Self {
        Handle {
            jobs: self.jobs.clone(),
            nudge: self.nudge.clone(),
            advances: Arc::clone(&self.advances),
            stop: Arc::clone(&self.stop),
            by_itself: self.by_itself,
            who: Arc::clone(&self.who),
        }
    }
}

impl<D: Device + Clone + 'static> Handle<D> {
    /// A device in the time of a clock, ready to be [run](Runner::run), and its first handle.
    pub fn pair(device: D, clock: Clock) -> (Runner<D>, Handle<D>) {
        let (jobs, job_queue) = mpsc::unbounded_channel();
        let (stop, stop_signal) = oneshot::channel();
        let (nudge, nudges) = mpsc::unbounded_channel();
        let by_itself = clock.rate().is_some();
        let runner = Runner::new(device, clock, job_queue, nudges, stop_signal);
        let (stop, who) = (Arc::new(Mutex::new(Some(stop))), Arc::from("the library"));
        (runner, Handle { jobs, nudge, advances: Arc::default(), stop, by_itself, who })
    }

    /// The same handle under another name, which appears in the [news](crate::LineEvent::Deed).
    #[must_use]
    pub fn by(&self, who: &str) -> Handle<D> {
        Handle { who: Arc::from(who), ..self.clone() }
    }

    /// Ends the controller. Its transports are closed when its task has ended.
    pub fn stop(&self) {
        self.end(Ending::Closes);
    }

    /// The same for a program that is about to end: its transports and its memory are left to the
    /// system, which frees them faster where there are many.
    pub fn stop_and_leave(&self) {
        self.end(Ending::Leaves);
    }

    fn end(&self, ending: Ending) {
        let stop = self.stop.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(stop) = stop {
            // If nobody hears it, it has ended already.
            let _ = stop.send(ending);
        }
    }

    /// The things of the outside world that can be set.
    pub fn signals(&self) -> Pending<Vec<Signal>> {
        self.with(|runner| Ok(runner.device().signals()))
    }

    /// Sets a signal by name to any value it takes.
    pub fn set(&self, name: &str, value: i32) -> Pending<Effect> {
        self.act(Deed::Set(name.to_owned(), value))
    }

    /// Puts a switch into a position by name, as in `turn("key", "auto")`.
    pub fn turn(&self, name: &str, position: &str) -> Pending<Effect> {
        self.act(Deed::Turn(name.to_owned(), position.to_owned()))
    }

    /// Presses a button and releases it at the same instant, unless it latches.
    pub fn press(&self, name: &str) -> Pending<Effect> {
        self.act(Deed::Press(name.to_owned()))
    }

    /// Presses a button and keeps it pressed.
    pub fn hold(&self, name: &str) -> Pending<Effect> {
        self.act(Deed::Hold(name.to_owned()))
    }

    /// Releases a button.
    pub fn release(&self, name: &str) -> Pending<Effect> {
        self.act(Deed::Release(name.to_owned()))
    }

    /// Sets a bit of an input port.
    pub fn set_input(&self, port: u16, bit: u8, level: bool) -> Pending<Effect> {
        self.act(Deed::Input { port, bit, level })
    }

    /// Switches the power off or on.
    pub fn power(&self, on: bool) -> Pending<Effect> {
        self.act(Deed::Power(on))
    }

    /// Something goes wrong from now on, with the number that comes back.
    pub fn fault(&self, fault: Fault) -> Pending<FaultNumber> {
        let by = self.source();
        self.with(move |runner| {
            runner.request(|session, wall| session.inject_fault(wall, &by, fault))
        })
    }

    /// A scenario begins now, with the number that comes back.
    pub fn scenario(&self, scenario: Scenario) -> Pending<ScenarioNumber> {
        let by = self.source();
        self.with(move |runner| {
            runner.request(|session, wall| session.begin_scenario(wall, &by, scenario))
        })
    }

    /// The scenario of this number ends, or all do.
    pub fn end_scenarios(&self, number: Option<ScenarioNumber>) -> Pending<Effect> {
        let by = self.source();
        self.with(move |runner| {
            Ok(runner.request(|session, wall| session.end_scenarios(wall, &by, number)))
        })
    }

    /// All scenarios and all faults end.
    pub fn reset(&self) -> Pending<Effect> {
        let by = self.source();
        self.with(move |runner| Ok(runner.request(|session, wall| session.reset(wall, &by))))
    }

    /// Performs a deed on the device, in the name of this handle.
    pub fn act(&self, deed: Deed) -> Pending<Effect> {
        self.act_on(|_| Ok(deed))
    }

    /// Performs a deed that depends on the state the device is in by then.
    pub fn act_on(
        &self,
        what: impl FnOnce(&D) -> Result<Deed, ControlError> + Send + 'static,
    ) -> Pending<Effect> {
        let by = self.source();
        self.with(move |runner| {
            let deed = what(runner.device())?;
            runner.request(|session, wall| session.act(wall, &by, deed))
        })
    }

    /// Moves time forward. Only clocks that do not run by themselves can be moved.
    pub fn advance(&self, span: Duration) -> TimeAdvance {
        self.advance_to(Destination::After(span))
    }

    /// Moves time forward to the first instant at which the condition holds, or waits for that
    /// instant if the clock runs by itself.
    pub fn run_until(&self, condition: Condition) -> TimeAdvance {
        self.advance_to(Destination::Until(condition))
    }

    /// Cancels every [`TimeAdvance`] that has been requested so far, through any handle.
    pub fn cancel_all(&self) {
        self.advances.cancel_all();
        // If the controller has ended, there is no advance any more.
        let _ = self.nudge.send(());
    }

    /// Cancels every [`TimeAdvance`] requested so far that needs something from outside to arrive, a
    /// command or a button, at once or as soon as it needs it: where time passes by itself, the
    /// advance would otherwise wait for that. The controller's own actions are foreseen for 10,000
    /// causes; a advance that has not arrived by then is cancelled too.
    pub fn cancel_all_unless_by_itself(&self) {
        self.advances.cancel_all_that_need_inputs();
        let _ = self.nudge.send(());
    }

    /// The controller's time.
    pub fn now(&self) -> Pending<Time> {
        self.with(|runner| Ok(runner.device().now()))
    }

    /// A picture of the controller at its present time.
    pub fn view(&self) -> Pending<View<D::Details>> {
        self.with(|runner| Ok(runner.device().view(runner.device().now())))
    }

    /// Everything that decides what the controller will do.
    pub fn state(&self) -> Pending<D::State>
    where
        D::State: Send,
    {
        self.with(|runner| Ok(runner.device().state()))
    }

    /// Continues from a state taken earlier, its time included.
    pub fn restore(&self, state: D::State) -> Pending<()>
    where
        D::State: Send,
    {
        let by = self.source();
        self.with(move |runner| {
            runner.request(|session, wall| session.restore(wall, &by, state));
            Ok(())
        })
    }

    /// Continues from another state, which is made of the present one.
    ///
    /// # Errors
    ///
    /// If none can be made: then nothing has changed.
    pub fn change(
        &self,
        make: impl FnOnce(&D) -> Result<D::State, ControlError> + Send + 'static,
    ) -> Pending<()> {
        let by = self.source();
        self.with(move |runner| {
            let state = make(runner.device())?;
            runner.request(|session, wall| session.restore(wall, &by, state));
            Ok(())
        })
    }

    /// The device itself, as it is now: a copy that the caller can drive.
    pub fn device(&self) -> Pending<D>
    where
        D: Send,
    {
        self.with(|runner| Ok(runner.device().clone()))
    }

    /// Whose time it lives in.
    pub fn clock(&self) -> Pending<Clock> {
        self.with(|runner| Ok(runner.clock()))
    }

    /// Lets time pass at another speed from now on.
    ///
    /// # Errors
    ///
    /// If time does not run by itself, or would not any more.
    pub fn set_clock(&self, clock: Clock) -> Pending<()> {
        self.with(move |runner| runner.request(|session, wall| session.set_clock(wall, clock)))
    }

    // --- time stands still ---

    /// Pauses the controller's time, whatever its clock, and says when that was. Clients stay
    /// connected: what they send waits on the line, and they notice nothing but the delay. If time
    /// is paused already, it stays paused.
    pub fn pause(&self) -> Pending<Time> {
        let by = self.source();
        self.with(|runner| Ok(runner.pause(by)))
    }

    /// Lets time go on from where it is. The wall-clock time that has passed meanwhile is not made
    /// up for.
    pub fn resume(&self) -> Pending<Time> {
        let by = self.source();
        self.with(move |runner| runner.request(|session, wall| session.resume(wall, &by)))
    }

    /// Since when time has been paused, and why; `None` if it is running.
    pub fn paused(&self) -> Pending<Option<Pause>> {
        self.with(|runner| Ok(runner.session().paused().cloned()))
    }

    /// Resolves when time is paused, whatever the cause: at once if it is paused already.
    pub fn until_paused(&self) -> Pending<Pause> {
        let (answer, reply) = Pending::promised();
        let _ = self.jobs.send(Box::new(move |runner| runner.await_pause(answer)));
        reply
    }

    /// Does one thing while time is paused: the next cause of what the device does by itself, or an input
    /// that has waited behind what was due. Time passes as far as that needs.
    pub fn step(&self) -> Pending<Step> {
        self.with(|runner| runner.request(|session, _| session.step()))
    }

    /// While time is paused, lets it pass up to then, if nothing is due before, and says when it is then.
    /// What is due then is left to [steps](Handle::step).
    pub fn wait_until(&self, at: Time) -> Pending<Time> {
        self.with(move |runner| runner.request(|session, _| session.wait_until(at)))
    }

    /// Gives the device an input. While time is paused it comes after what is due at this instant, and
    /// what it leads to is left to [steps](Handle::step); what is done by the other methods, such as
    /// [`press`](Handle::press), happens at once with everything that is due at this instant.
    pub fn inject(&self, input: OwnedInput) -> Pending<()> {
        let by = self.source();
        self.with(move |runner| {
            runner.request(|session, wall| session.give(wall, &by, input.as_input()));
            Ok(())
        })
    }

    /// Takes in at most so many of the bytes that wait on the line, although time is paused, and
    /// returns how many it took; what they lead to is left to [steps](Handle::step). With 0,
    /// clients come and go.
    pub fn hear(&self, bytes: usize) -> Pending<usize> {
        let (answer, reply) = Pending::promised();
        let _ = self.jobs.send(Box::new(move |runner| runner.hear(bytes, answer)));
        reply
    }

    /// Pauses time at the very moment a condition becomes true: before anything else happens, even
    /// at the same instant. [`Breakpoint`](vimc4_device::Breakpoint) says when that is.
    pub fn break_when(&self, condition: Condition) -> Pending<BreakpointId> {
        self.with(|runner| Ok(runner.request(|session, _| session.add_breakpoint(condition))))
    }

    /// The same for somebody who has breakpoints of their own, such as a debugger: time is paused in the
    /// name of `by`, and the breakpoint is not among those that are listed and numbered.
    pub fn stop_when(&self, condition: Condition, by: Source) -> Pending<BreakpointId> {
        self.with(|runner| Ok(runner.request(|session, _| session.add_stop(condition, by))))
    }

    /// Removes a breakpoint. Returns whether it was still there.
    pub fn remove_breakpoint(&self, breakpoint: BreakpointId) -> Pending<bool> {
        self.with(move |runner| {
            Ok(runner.request(|session, _| session.remove_breakpoint(breakpoint)))
        })
    }

    /// The breakpoints, and how often each was met.
    pub fn breakpoints(&self) -> Pending<Vec<BreakpointView>> {
        self.with(|runner| Ok(runner.session().breakpoints()))
    }

    // --- who is there ---

    /// Opens another way to the line.
    pub fn attach(&self, transport: impl Transport + 'static) -> Pending<()> {
        self.with(move |runner| {
            runner.attach(Box::new(transport));
            Ok(())
        })
    }

    /// Lets a sink watch from now on.
    pub fn watch(&self, sink: impl Sink + 'static) -> Pending<SinkId> {
        self.with(move |runner| Ok(runner.watch(Box::new(sink))))
    }

    /// Detaches a sink. Returns whether it was still attached.
    pub fn detach(&self, sink: SinkId) -> Pending<bool> {
        self.with(move |runner| Ok(runner.detach(sink)))
    }

    /// Does anything with the controller, between two inputs and after everything that was sent
    /// before.
    pub fn with<T: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Runner<D>) -> Result<T, ControlError> + Send + 'static,
    ) -> Pending<T> {
        let (sender, reply) = Pending::promised();
        // If it cannot be sent, the sender is dropped with it, and the reply says so.
        let _ = self.jobs.send(Box::new(move |runner| {
            let _ = sender.send(work(runner));
        }));
        reply
    }

    fn source(&self) -> Source {
        Source::Controls(self.who.as_ref().into())
    }

    fn advance_to(&self, destination: Destination) -> TimeAdvance {
        let (completion, advance) =
            TimeAdvance::begin(self.by_itself, self.nudge.clone(), &self.advances);
        let by = self.source();
        let _ = self.jobs.send(Box::new(move |runner| runner.advance(by, destination, completion)));
        advance
    }
}
