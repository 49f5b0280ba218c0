//! The controls of a running emulator, for programs that must not block.

use std::sync::Arc;
use std::time::Duration;

use vimc4_catalogue::{Controller, Details, Family, Machine, Model, State};
use vimc4_device::{
    Condition, Deed, Device, Event, Fault, FaultNumber, FaultView, Faulting, Line, LineState,
    Names, OwnedInput, Signal, Stamp, Time,
};
use vimc4_host::{
    BreakpointId, BreakpointView, ControlError, Effect, Handle, HostLines, Journey, MemoryPort,
    Modem, Pause, Pending, Sink, SinkId, Step,
};

use vimc4_journal::{Journal, Picture};

use crate::record::{HostCommand, Memory, Record};

/// Controls an emulator without waiting: every method is that of the same name of
/// [`Emulator`](crate::Emulator), but gives a [`Pending`] that can be awaited, or waited for later.
///
/// What is asked for takes effect in the order of the calls, whether or not anybody waits. A
/// control can be copied and sent to other threads and tasks; once the emulator has ended its
/// replies say so.
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
}

/// A picture of a controller: [`Emulator::view`](crate::Emulator::view).
pub type View = vimc4_device::View<Details>;

/// Everything that decides what an emulator will do: the state of its controller, machine and
/// line at one instant. Taking one is cheap, and keeping many is too: programs and profiles
/// are shared.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    family: Family,
    state: LineState<State>,
}

/// The buttons of the panel by name. Any method that takes a name takes these.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Button {
    /// Runs the stored program, or goes on with what was stopped.
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
    ) -> Control {
        Control { model, machine, handle, record }
    }

    /// The same controls for somebody of this name, who appears in the log and the news; without
    /// it that is `the library`.
    #[must_use]
    pub fn by(&self, who: &str) -> Control {
        Control { handle: self.handle.by(who), ..self.clone() }
    }

    /// The model.
    pub fn model(&self) -> &Model {
        &self.model
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

    /// The same with handshake lines, for a client that is a serial port to somebody: `cts` is told
    /// whenever a host has to wait and when it may go on, and must not block; what the host does to
    /// its own lines is told to the [`HostLines`].
    pub fn connect_with_lines(
        &self,
        cts: impl FnMut(bool) + Send + 'static,
    ) -> Pending<(MemoryPort, HostLines)> {
        self.handle.with(|runner| {
            let (memory, port) = vimc4_host::Memory::pair();
            let (modem, host) = Modem::pair("memory", cts);
            runner.attach(Box::new(memory));
            runner.attach(Box::new(modem));
            Ok((port, host))
        })
    }

    /// Gives the pseudo-terminal the handshake lines that it lacks, if somebody stands by its
    /// client who can answer for them. `cts` is told whenever a host has to wait and when it may
    /// go on; it must not block. What the host does to its own lines is told to the
    /// [`HostLines`] that come back, and appears among the news.
    pub fn handshake_lines(&self, cts: impl FnMut(bool) + Send + 'static) -> Pending<HostLines> {
        self.handle.with(|runner| {
            let (modem, host) = Modem::pair("pty", cts);
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

    /// Moves time forward, with the clocks that do not run by themselves.
    pub fn advance(&self, span: Duration) -> Journey {
        self.handle.advance(span)
    }

    /// Lets time pass until the controller does nothing any more.
    pub fn run_until_idle(&self) -> Journey {
        self.run_until(Condition::Idle)
    }

    /// Lets time pass up to the first instant at which the condition holds.
    pub fn run_until(&self, condition: Condition) -> Journey {
        self.handle.run_until(condition)
    }

    /// Gives up every journey that has been asked for so far.
    pub fn cancel_all(&self) {
        self.handle.cancel_all();
    }

    /// Gives up every journey asked for so far that needs something from outside, a command or a
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

    /// Forgets the commands and events so far.
    pub fn forget(&self) -> Pending<()> {
        self.remembered(|memory, device| memory.forget(Picture::of(device)))
    }

    /// The next command of this mnemonic (such as `@A`) that the host sends, counted from the one
    /// that was waited for last. It needs the record that [`Builder::record`] switches off.
    ///
    /// [`Builder::record`]: crate::Builder::record
    pub fn next_command(&self, mnemonic: &str) -> Pending<HostCommand> {
        let (answer, reply) = Pending::promised();
        match &self.record {
            Some(record) => record.lock().await_command(mnemonic.to_owned(), answer),
            None => drop(answer.send(Err(ControlError::Unsupported(
                "commands are not recorded; do without Builder::record(false)",
            )))),
        }
        reply
    }

    /// Looks into the record when what was written to the line before has arrived.
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

    /// Lets a sink watch from now on. [`Reports`](crate::Reports) are for those who want to take
    /// their time.
    pub fn watch(&self, sink: impl Sink + 'static) -> Pending<SinkId> {
        self.handle.watch(sink)
    }

    /// Lets go of a sink. Says whether it was still there.
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

    /// Does something to it: what all the methods above come to.
    pub fn act(&self, deed: Deed) -> Pending<Effect> {
        self.handle.act(deed)
    }

    /// Takes the power away or gives it back.
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

    /// The faults that there are, and how often each has struck.
    pub fn faults(&self) -> Pending<Vec<FaultView>> {
        self.handle.with(|runner| Ok(runner.device().faults()))
    }

    /// The present state.
    pub fn snapshot(&self) -> Pending<Snapshot> {
        let family = self.model.family();
        self.handle.with(move |runner| Ok(Snapshot { family, state: runner.device().state() }))
    }

    /// Goes back to a state taken earlier, of this or another emulator of the same model.
    pub fn restore(&self, snapshot: &Snapshot) -> Pending<()> {
        if snapshot.family != self.model.family() {
            return self.handle.with(|_| {
                Err(ControlError::Unsupported(
                    "this is a state of another family of controllers; restore it in one of its own",
                ))
            });
        }
        self.handle.restore(snapshot.state.clone())
    }

    // --- time stands still ---

    /// Pauses time, whatever the clock, and says when that was. Clients stay connected: what they send
    /// waits on the line, and they notice nothing but that it takes its time.
    pub fn pause(&self) -> Pending<Time> {
        self.handle.pause()
    }

    /// Time goes on from where it is. What has passed meanwhile on the wall is not made up for.
    pub fn resume(&self) -> Pending<Time> {
        self.handle.resume()
    }

    /// Since when time is paused, and why; `None` if it goes on.
    pub fn paused(&self) -> Pending<Option<Pause>> {
        self.handle.paused()
    }

    /// Is answered when time is paused, by whomever or whatever: at once if it is.
    pub fn until_paused(&self) -> Pending<Pause> {
        self.handle.until_paused()
    }

    /// Does one thing while time is paused: the next cause of what the controller does by itself, or an
    /// input that has waited behind what was due.
    pub fn step(&self) -> Pending<Step> {
        self.handle.step()
    }

    /// Gives an input, now. While time is paused it comes after what is due at this instant, and what it
    /// leads to is left to [steps](Control::step). What the other methods do, such as
    /// [`press`](Control::press), happens at once with everything that is due at this instant.
    pub fn inject(&self, input: OwnedInput) -> Pending<()> {
        self.handle.inject(input)
    }

    /// Takes in no more than so many bytes that wait on the line, although time is paused, and says how
    /// many that were; what they lead to is left to [steps](Control::step).
    pub fn hear(&self, bytes: usize) -> Pending<usize> {
        self.handle.hear(bytes)
    }

    /// Pauses time whenever a condition becomes true, exactly then: before anything else happens, even
    /// at the same instant.
    pub fn break_when(&self, condition: Condition) -> Pending<BreakpointId> {
        self.handle.break_when(condition)
    }

    /// Takes a breakpoint away, and says whether it was there.
    pub fn remove_breakpoint(&self, breakpoint: BreakpointId) -> Pending<bool> {
        self.handle.remove_breakpoint(breakpoint)
    }

    /// The breakpoints, and how often each was met.
    pub fn breakpoints(&self) -> Pending<Vec<BreakpointView>> {
        self.handle.breakpoints()
    }

    /// The controller itself at the end of its line, as it is now: a copy, to be driven by whoever has
    /// it, backwards and forwards. A state of it is put in by [`put`](Control::put).
    pub fn controller(&self) -> Pending<Line<Controller>> {
        self.handle.device()
    }

    /// Goes on from a state of a copy of the [controller](Control::controller), of an earlier or a later
    /// time. Paused time stays so.
    pub fn put(&self, state: LineState<State>) -> Pending<()> {
        self.handle.restore(state)
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
