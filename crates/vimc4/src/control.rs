//! The controls of a running emulator, for programs that must not block.

use std::sync::Arc;
use std::time::Duration;

use vimc4_catalogue::{Controller, Details, Machine, MemoryError, Model, State};
use vimc4_device::{
    Condition, Deed, Device, Event, Fault, FaultNumber, FaultView, Faulting, Line, LineState,
    ModemLine, Names, OwnedInput, RuleView, Scenario, ScenarioNumber, Signal, Stamp, Time,
};
use vimc4_host::{
    BreakpointId, BreakpointView, Clock, ControlError, Effect, Handle, HostLines, MemoryPort,
    Modem, Pause, Pending, Sink, SinkId, Source, Step, TimeAdvance, unix_lines,
};

use vimc4_coverage::Coverage;
use vimc4_journal::{Journal, Picture};
use vimc4_timeline::recording::LineSort;

use crate::coverage::Tally;
use crate::record::{HostCommand, Memory, Passing, Record};
use crate::recording::{Recorder, RecordingFile, recording_head};

/// Controls an emulator without waiting: every method is that of the same name of
/// [`Emulator`](crate::Emulator), but gives a [`Pending`] that can be awaited, or waited for later.
///
/// Requests take effect in the order of the calls, whether or not anybody waits. A control can be
/// copied and sent to other threads and tasks; once the emulator has ended, its replies say so.
///
/// ```
/// # #[tokio::main(flavor = "current_thread")]
/// # async fn main() -> Result<(), Box<dyn std::error::Error>> {
/// use tokio::io::{AsyncReadExt, AsyncWriteExt};
/// use vimc4::{Button, Clock, Condition, Emulator};
///
/// let emu = Emulator::builder().time(Clock::Manual).start()?;
/// let control = emu.control();
/// let mut port = control.connect().await?;
/// port.write_all(b"@01\r@0A5000,900\r").await?;
///
/// // While the test waits here, a driver in another task may run.
/// control.run_until(Condition::AxisAt { axis: 0, position: 2_500 }).await?;
/// assert_eq!(control.position().await?[0], 2_500);
/// control.press(Button::Stop).await?;
/// control.run_until_idle().await?;
/// let mut answers = [0; 2];
/// port.read_exact(&mut answers).await?;
/// assert_eq!(&answers, b"0F");
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Control {
    model: Model,
    machine: Arc<Machine>,
    pub(crate) handle: Handle<Line<Controller>>,
    pub(crate) record: Option<Record>,
    /// What is used instead of it where there is none.
    pub(crate) passing: Passing,
    tally: Option<Tally>,
}

/// A picture of a controller: [`Emulator::view`](crate::Emulator::view).
pub type View = vimc4_device::View<Details>;

/// Everything that decides what an emulator will do: the state of its controller, machine and
/// line at one instant. Taking one is cheap, and keeping many is too: programs and profiles
/// are shared.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    state: LineState<State>,
}

/// The buttons of the panel by name. Any method that takes a name takes these.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Button {
    /// Runs the stored program, or continues a stopped motion or program.
    Start,
    /// Brakes whatever moves.
    Stop,
    /// Switches the power stage on.
    On,
    /// The emergency stop, which latches.
    EmergencyStop,
}

impl AsRef<str> for Button {
    fn as_ref(&self) -> &str {
        match self {
            Button::Start => "start",
            Button::Stop => "stop",
            Button::On => "on",
            Button::EmergencyStop => "estop",
        }
    }
}

impl Control {
    pub(crate) fn new(
        model: Model,
        machine: Arc<Machine>,
        handle: Handle<Line<Controller>>,
        record: Option<Record>,
        tally: Option<Tally>,
    ) -> Control {
        Control { model, machine, handle, record, passing: Passing::default(), tally }
    }

    /// The same controls under another name, which appears in the log and the news. Without one the
    /// name is `the library`.
    #[must_use]
    pub fn by(&self, who: &str) -> Control {
        Control { handle: self.handle.by(who), ..self.clone() }
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The machine.
    pub fn machine(&self) -> &Arc<Machine> {
        &self.machine
    }

    /// Opens the line from within the process. The port can be read and written in either way,
    /// blocking or awaiting.
    pub fn connect(&self) -> Pending<MemoryPort> {
        self.handle.with(|runner| {
            let (memory, port) = vimc4_host::Memory::pair();
            runner.attach(Box::new(memory));
            Ok(port)
        })
    }

    /// The same with modem lines, for a client that presents itself as a serial port: `lines` is
    /// called whenever a line of the controller changes, such as CTS when a host has to wait, and must
    /// not block; the [`HostLines`] are told what the host does to its own lines.
    pub fn connect_with_lines(
        &self,
        lines: impl FnMut(ModemLine, bool) + Send + 'static,
    ) -> Pending<(MemoryPort, HostLines)> {
        self.handle.with(|runner| {
            let (memory, port) = vimc4_host::Memory::pair();
            let (modem, host) = Modem::pair("memory", lines);
            runner.attach(Box::new(memory));
            runner.attach(Box::new(modem));
            Ok((port, host))
        })
    }

    /// Gives the pseudo-terminal the modem lines that it lacks, if the client's side has something that
    /// can provide them. `lines` is called whenever a line of the controller changes, such as CTS when
    /// a host has to wait; it must not block. The returned [`HostLines`] are to be told what the host
    /// does to its own lines, which appears among the news.
    pub fn handshake_lines(
        &self,
        lines: impl FnMut(ModemLine, bool) + Send + 'static,
    ) -> Pending<HostLines> {
        self.handle.with(|runner| {
            let (modem, host) = Modem::pair("pty", lines);
            runner.attach(Box::new(modem));
            Ok(host)
        })
    }

    /// Whether a host that heeds CTS may send now, with all that it has sent so far taken in.
    pub fn takes_more(&self) -> Pending<bool> {
        self.handle.with(|runner| Ok(runner.device().room(true) > 0))
    }

    // --- time ---

    /// The controller's time.
    pub fn now(&self) -> Pending<Time> {
        self.handle.now()
    }

    /// How its time passes.
    pub fn clock(&self) -> Pending<Clock> {
        self.handle.clock()
    }

    /// Lets time pass at another speed from now on, such as `8x` after `real`: from one clock that
    /// runs by itself to another.
    pub fn set_clock(&self, clock: Clock) -> Pending<()> {
        self.handle.set_clock(clock)
    }

    /// Moves time forward, with the clocks that do not run by themselves.
    pub fn advance(&self, span: Duration) -> TimeAdvance {
        self.handle.advance(span)
    }

    /// Lets time pass until the controller does nothing any more.
    pub fn run_until_idle(&self) -> TimeAdvance {
        self.run_until(Condition::Idle)
    }

    /// Lets time pass up to the first instant at which the condition holds.
    pub fn run_until(&self, condition: Condition) -> TimeAdvance {
        self.handle.run_until(condition)
    }

    /// Cancels every journey that has been requested so far.
    pub fn cancel_all(&self) {
        self.handle.cancel_all();
    }

    /// Cancels every journey requested so far that needs something from outside, a command or a
    /// button, to arrive.
    pub fn cancel_all_unless_by_itself(&self) {
        self.handle.cancel_all_unless_by_itself();
    }

    // --- what it sees ---

    /// The step counters of the axes that the controller has, X first.
    pub fn position(&self) -> Pending<Vec<i64>> {
        self.handle.with(|runner| {
            let device = runner.device();
            let axes = device.view(device.now()).axes;
            Ok(axes.iter().map(|axis| axis.position).collect())
        })
    }

    /// A picture of the controller: positions, speeds, program, ports and what it will do.
    pub fn view(&self) -> Pending<View> {
        self.handle.view()
    }

    /// What the host sent, decoded, oldest first.
    pub fn commands(&self) -> Pending<Vec<HostCommand>> {
        self.remembered(|memory, _| memory.commands())
    }

    /// What happened, oldest first.
    pub fn events(&self) -> Pending<Vec<(Stamp, Event)>> {
        self.remembered(|memory, _| memory.events())
    }

    /// Everything that happened, oldest first: commands, answers, motions, ports, what people did, each
    /// with its time and the number of its command.
    pub fn journal(&self) -> Pending<Journal> {
        self.remembered(|memory, device| {
            memory.pass(device.now());
            memory.journal.clone()
        })
    }

    /// How much of what the controller can do the host has met. It has to be wanted by
    /// [`Builder::coverage`].
    ///
    /// [`Builder::coverage`]: crate::Builder::coverage
    pub fn coverage(&self) -> Pending<Coverage> {
        let tally = self.tally.clone();
        self.handle.with(move |_| match tally {
            Some(tally) => Ok(tally.coverage()),
            None => Err(ControlError::Unsupported(
                "nothing is counted; build the emulator with Builder::coverage(true)",
            )),
        })
    }

    /// The same without asking the controller, which may have ended: what was met by all that it has
    /// answered. `None` if nothing is counted.
    pub fn coverage_so_far(&self) -> Option<Coverage> {
        self.tally.as_ref().map(Tally::coverage)
    }

    /// Forgets the commands and events so far.
    pub fn forget(&self) -> Pending<()> {
        self.remembered(|memory, device| memory.forget(Picture::of(device)))
    }

    /// The next command of this mnemonic (such as `@A`) that the host sends, counted from the one
    /// that was waited for last. It needs the record that [`Builder::record`] switches off. A mnemonic that no
    /// command of the model has, such as `@0A`, is refused.
    ///
    /// [`Builder::record`]: crate::Builder::record
    pub fn next_command(&self, mnemonic: &str) -> Pending<HostCommand> {
        if let Err(error) = self.has_command(mnemonic) {
            return self.handle.with(|_| Err(error));
        }
        let (answer, reply) = Pending::promised();
        match &self.record {
            Some(record) => record.lock().await_command(mnemonic.to_owned(), answer),
            None => drop(answer.send(Err(ControlError::Unsupported(
                "commands are not recorded; do without Builder::record(false)",
            )))),
        }
        reply
    }

    /// Whether a command of the model has this mnemonic, which is one word without numbers.
    fn has_command(&self, mnemonic: &str) -> Result<(), ControlError> {
        let names = self.model.names(Vec::new());
        let known = match names.mnemonic(mnemonic) {
            Ok(()) => return Ok(()),
            Err(known) => known,
        };
        let (model, mnemonic) = (self.model.name().to_owned(), mnemonic.to_owned());
        Err(ControlError::NoCommand { model, mnemonic, known })
    }

    /// Looks into the record once everything written to the line before has arrived.
    fn remembered<T: Default + Send + 'static>(
        &self,
        look: impl FnOnce(&mut Memory, &Line<Controller>) -> T + Send + 'static,
    ) -> Pending<T> {
        let record = self.record.clone();
        self.handle.with(move |runner| {
            let device = runner.device();
            Ok(record.map_or_else(T::default, |record| look(&mut record.lock(), device)))
        })
    }

    /// Lets a sink watch from now on. For consumers that take their time there are
    /// [`Reports`](crate::Reports).
    pub fn watch(&self, sink: impl Sink + 'static) -> Pending<SinkId> {
        self.handle.watch(sink)
    }

    /// The same, and how things stand at the moment from which it watches.
    pub fn watch_from_here(&self, sink: impl Sink + 'static) -> Pending<Picture> {
        self.handle.with(|runner| {
            runner.watch(Box::new(sink));
            Ok(Picture::of(runner.device()))
        })
    }

    /// Detaches a sink. Returns whether it was still attached.
    pub fn detach(&self, sink: SinkId) -> Pending<bool> {
        self.handle.detach(sink)
    }

    // --- what happens to it ---

    /// The things of the outside world that can be set, with their names.
    pub fn signals(&self) -> Pending<Vec<Signal>> {
        self.handle.signals()
    }

    /// What people call its axes and signals, with which [orders](crate::Order) are read and
    /// completed.
    pub fn names(&self) -> Pending<Names> {
        let (model, scales) = (self.model.clone(), self.machine.scales());
        self.handle
            .with(move |runner| Ok(model.names(runner.device().signals()).with_scales(scales)))
    }

    /// Sets a signal to any value it takes: 1 and 0, or the number of a switch's position.
    pub fn set_signal(&self, name: impl AsRef<str>, value: i32) -> Pending<Effect> {
        self.handle.set(name.as_ref(), value)
    }

    /// Presses a button and releases it at the same instant; the emergency stop stays pressed
    /// until it is released.
    pub fn press(&self, button: impl AsRef<str>) -> Pending<Effect> {
        self.handle.press(button.as_ref())
    }

    /// Presses a button and keeps it pressed.
    pub fn hold(&self, button: impl AsRef<str>) -> Pending<Effect> {
        self.handle.hold(button.as_ref())
    }

    /// Releases a button.
    pub fn release(&self, button: impl AsRef<str>) -> Pending<Effect> {
        self.handle.release(button.as_ref())
    }

    /// Puts a switch into a position, as in `turn("cover", "open")`.
    pub fn turn(&self, switch: &str, position: &str) -> Pending<Effect> {
        self.handle.turn(switch, position)
    }

    /// Sets a bit of an input port, as the controller reads it.
    pub fn input(&self, port: u16, bit: u8, level: bool) -> Pending<Effect> {
        self.handle.set_input(port, bit, level)
    }

    /// Erases the stored program as a person does at the panel: the emergency stop pressed and
    /// released, key on test, STOP held, ON. The controller has then been reset, and its power
    /// stages are off until ON is pressed or it is switched off and on.
    pub fn erase(&self) -> Pending<Effect> {
        let model = self.model.clone();
        self.handle.act_on(move |device| model.erasing(device).map_err(ControlError::Unsupported))
    }

    /// Performs a deed: all the methods above come down to this one.
    pub fn act(&self, deed: Deed) -> Pending<Effect> {
        self.handle.act(deed)
    }

    /// Switches the power off or on.
    pub fn power(&self, on: bool) -> Pending<Effect> {
        self.handle.power(on)
    }

    /// Something goes wrong from now on, with the number that comes back.
    pub fn fault(&self, fault: impl Into<Fault>) -> Pending<FaultNumber> {
        self.handle.fault(fault.into())
    }

    /// The fault of this number ends, if there is one.
    pub fn end_fault(&self, number: FaultNumber) -> Pending<Effect> {
        self.act(Deed::Fault(Box::new(Faulting::End(number))))
    }

    /// All faults end.
    pub fn end_faults(&self) -> Pending<Effect> {
        self.act(Deed::Fault(Box::new(Faulting::EndAll)))
    }

    /// The present faults, and how often each has struck.
    pub fn faults(&self) -> Pending<Vec<FaultView>> {
        self.handle.with(|runner| Ok(runner.device().faults()))
    }

    /// Things happen from now on as rules say, with the number that comes back.
    pub fn scenario(&self, scenario: impl Into<Scenario>) -> Pending<ScenarioNumber> {
        self.handle.scenario(scenario.into())
    }

    /// The scenario of this number ends, if there is one: what its rules hold is set back.
    pub fn end_scenario(&self, number: ScenarioNumber) -> Pending<Effect> {
        self.handle.end_scenarios(Some(number))
    }

    /// All scenarios end.
    pub fn end_scenarios(&self) -> Pending<Effect> {
        self.handle.end_scenarios(None)
    }

    /// All scenarios and all faults end, no matter how they were started.
    pub fn reset(&self) -> Pending<Effect> {
        self.handle.reset()
    }

    /// The rules of the present scenarios, and how often each has acted.
    pub fn rules(&self) -> Pending<Vec<RuleView>> {
        self.handle.with(|runner| Ok(runner.device().rules()))
    }

    /// The present state.
    pub fn snapshot(&self) -> Pending<Snapshot> {
        self.handle.with(|runner| Ok(Snapshot { state: runner.device().state() }))
    }

    /// Goes back to a state taken earlier, of this emulator or of another one with the same model and machine.
    /// A snapshot of another model or machine is refused.
    pub fn restore(&self, snapshot: &Snapshot) -> Pending<()> {
        self.put(snapshot.state.clone())
    }

    /// What is in its memory that outlives the power, in the form of its [file](crate::Builder::flash).
    pub fn flash(&self) -> Pending<Vec<u8>> {
        self.handle.with(|runner| Ok(runner.device().flash_image()))
    }

    /// Puts another image into that memory, as if the chip had been changed: a stored program is there
    /// at once, and settings count when it is switched on the next time. It has to be at rest.
    ///
    /// # Errors
    ///
    /// If the image is not one of this model.
    pub fn set_flash(&self, image: &[u8]) -> Result<Pending<()>, MemoryError> {
        let filled = Controller::new(&self.model, Arc::clone(&self.machine), &unix_lines(image))?;
        let filled = Device::state(&filled);
        Ok(self.handle.change(move |device| {
            if !device.is_idle() {
                return Err(ControlError::Unsupported(
                    "something is going on, and may come from the memory; wait until it is idle, or press \
                     stop",
                ));
            }
            let mut state = Device::state(device);
            state.device = state.device.with_memory_of(&filled).ok_or(ControlError::Ended)?;
            Ok(state)
        }))
    }

    // --- into a file ---

    /// Records everything from now on, beginning with the present state, into the memory of this
    /// program: at most so many bytes, then it ends. [`RecordingFile::so_far`] reads it, and
    /// [`RecordingFile::end_here`] ends it. `from` says who records.
    pub fn record_in_memory(&self, from: &str, most: u64) -> Pending<RecordingFile> {
        let (model, machine) = (self.model.clone(), Arc::clone(&self.machine));
        let from = from.to_owned();
        self.handle.with(move |runner| {
            let mut head = recording_head(&model, &machine, &runner.clock().to_string(), &from);
            if runner.device().is_paced() {
                head.line = LineSort::Paced;
            }
            let file = RecordingFile::in_memory(head, most, Names::of(runner.device()));
            runner.watch(Box::new(Recorder(file.clone())));
            Ok(file)
        })
    }

    // --- time stands still ---

    /// Pauses time, whatever the clock, and says when that was. Clients stay connected: what they
    /// send waits on the line, and they notice nothing but the delay.
    pub fn pause(&self) -> Pending<Time> {
        self.handle.pause()
    }

    /// Lets time go on from where it is. The wall-clock time that has passed meanwhile is not made
    /// up for.
    pub fn resume(&self) -> Pending<Time> {
        self.handle.resume()
    }

    /// Since when time has been paused, and why; `None` if it is running.
    pub fn paused(&self) -> Pending<Option<Pause>> {
        self.handle.paused()
    }

    /// Resolves when time is paused, whatever the cause: at once if it is paused already.
    pub fn until_paused(&self) -> Pending<Pause> {
        self.handle.until_paused()
    }

    /// Does one thing while time is paused: the next cause of what the controller does by itself, or an
    /// input that has waited behind what was due.
    pub fn step(&self) -> Pending<Step> {
        self.handle.step()
    }

    /// While time is paused, lets it pass up to then, if nothing is due before, and says when it is then.
    /// What is due then is left to [steps](Control::step).
    pub fn wait_until(&self, at: Time) -> Pending<Time> {
        self.handle.wait_until(at)
    }

    /// Gives an input, now. While time is paused it comes after what is due at this instant, and what it
    /// leads to is left to [steps](Control::step). What the other methods do, such as
    /// [`press`](Control::press), happens at once with everything that is due at this instant.
    pub fn inject(&self, input: OwnedInput) -> Pending<()> {
        self.handle.inject(input)
    }

    /// Takes in at most so many of the bytes that wait on the line, although time is paused, and
    /// returns how many it took; what they lead to is left to [steps](Control::step).
    pub fn hear(&self, bytes: usize) -> Pending<usize> {
        self.handle.hear(bytes)
    }

    /// Pauses time at the very moment a condition becomes true: before anything else happens, even
    /// at the same instant.
    pub fn break_when(&self, condition: Condition) -> Pending<BreakpointId> {
        self.handle.break_when(condition)
    }

    /// The same for somebody who has breakpoints of their own, such as a debugger: time is paused in the
    /// name of `by`, and the breakpoint is not among those that are listed and numbered.
    pub fn stop_when(&self, condition: Condition, by: Source) -> Pending<BreakpointId> {
        self.handle.stop_when(condition, by)
    }

    /// Removes a breakpoint. Returns whether it was there.
    pub fn remove_breakpoint(&self, breakpoint: BreakpointId) -> Pending<bool> {
        self.handle.remove_breakpoint(breakpoint)
    }

    /// The breakpoints, and how often each was met.
    pub fn breakpoints(&self) -> Pending<Vec<BreakpointView>> {
        self.handle.breakpoints()
    }

    /// A copy of the controller at the end of its line, as it is now, which the caller can drive
    /// backwards and forwards. [`put`](Control::put) puts a state of it in.
    pub fn controller(&self) -> Pending<Line<Controller>> {
        self.handle.device()
    }

    /// Continues from a state of a copy of the [controller](Control::controller), earlier or later.
    /// If time is paused, it stays paused. A state of another model or machine is refused.
    pub fn put(&self, state: LineState<State>) -> Pending<()> {
        self.handle.change(move |line| {
            state.device.fits(&line.state().device)?;
            Ok(state)
        })
    }

    // --- its end ---

    /// Tells the emulator to end.
    pub fn stop(&self) {
        self.handle.stop();
    }

    /// The same for a program that is about to end itself: ports and memory are left to the system.
    pub fn stop_and_leave(&self) {
        self.handle.stop_and_leave();
    }
}
