//! A running emulator.

use std::net::SocketAddr;
use std::path::Path;
#[cfg(all(unix, feature = "pty"))]
use std::path::PathBuf;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use vimc4_catalogue::Model;
use vimc4_device::{
    Condition, Event, FaultNumber, FaultView, Names, RuleView, Scenario, ScenarioNumber, Signal,
    Stamp, Time,
};
use vimc4_host::{
    BreakpointId, BreakpointView, ControlError, MemoryPort, Pause, RunError, Step, Worker, block_on,
};
#[cfg(all(unix, feature = "pty"))]
use vimc4_host::{LinkError, PtyLink};

use vimc4_coverage::Coverage;
use vimc4_journal::Journal;
use vimc4_journal::expect::Expect;
use vimc4_language::{Order, read_fault, read_rule};

use crate::control::{Control, Snapshot, View};
use crate::error::Error;
use crate::expect::Live;
use crate::fault::{AnyFault, FaultHandle};
use crate::profiles::scenario_file;
use crate::record::HostCommand;
use crate::recording::RecordingFile;
use crate::scenario::{AnyScenario, ScenarioHandle};

/// A virtual controller that runs until it is dropped, in a thread of its own or one that it
/// shares with [others](crate::Builder::on).
///
/// ```
/// use std::io::{Read, Write};
/// use vimc4::{Clock, Emulator};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let emu = Emulator::builder().model("imc-s8").time(Clock::Manual).start()?;
///
/// // A serial port within the process; `port()` and `tcp_addr()` are for other programs.
/// let mut port = emu.connect()?;
/// port.write_all(b"@07\r@0A5000,900,0,900,0,900,0,900\r")?;
///
/// // Time stands still until it is told to move: the move stops at exactly step 2,500.
/// emu.run_until(&vimc4::Condition::AxisAt { axis: 0, position: 2_500 })?;
/// assert_eq!(emu.position()?, [2_500, 0, 0, 0]);
///
/// let duration = emu.run_until_idle()?;
/// assert_eq!(emu.position()?, [5_000, 0, 0, 0]);
/// let mut answers = [0; 2];
/// port.read_exact(&mut answers)?;
/// assert_eq!(&answers, b"00");
///
/// let commands = emu.commands()?;
/// assert_eq!(commands[1].mnemonic, "@A");
/// println!("{} took until {duration}", commands[1].text);
/// # Ok(())
/// # }
/// ```
///
/// The methods block until the controller has done what they say, which takes microseconds unless
/// time is to pass. Whatever was written to the line before a call has arrived when the call takes
/// effect. A program that must not block uses the [`control`](Emulator::control), which has the
/// same methods to be awaited.
#[derive(Debug)]
pub struct Emulator {
    control: Control,
    places: Places,
    #[cfg(all(unix, feature = "pty"))]
    link: Option<PtyLink>,
    ended: watch::Receiver<End>,
    /// Whether dropping it waits for its end.
    waits_for_end: bool,
    /// Its thread, which ends with the last emulator that runs there.
    worker: Worker,
    recording: Option<Kept>,
}

/// The recording of an emulator.
#[derive(Debug)]
pub(crate) struct Kept {
    pub(crate) file: RecordingFile,
    /// Whether it stays only if the test fails.
    pub(crate) failed_only: bool,
}

impl Drop for Kept {
    fn drop(&mut self) {
        if self.failed_only && !std::thread::panicking() {
            self.file.discard();
        } else {
            self.file.finish();
        }
    }
}

/// How its task has ended, once it has.
type End = Option<Result<(), Arc<RunError>>>;

/// Where it can be reached.
#[derive(Clone, Debug, Default)]
pub(crate) struct Places {
    pub(crate) tcp: Option<SocketAddr>,
    pub(crate) rfc2217: Option<SocketAddr>,
    pub(crate) serial: Option<String>,
    #[cfg(all(unix, feature = "pty"))]
    pub(crate) pty: Option<PathBuf>,
}

impl Places {
    #[cfg(feature = "tracing")]
    pub(crate) fn trace(&self, traces: &vimc4_host::Traces) {
        #[cfg(all(unix, feature = "pty"))]
        self.pty.iter().for_each(|path| traces.transport("pty", &path.display()));
        self.serial.iter().for_each(|device| traces.transport("serial", device));
        self.tcp.iter().for_each(|address| traces.transport("tcp", address));
        self.rfc2217.iter().for_each(|address| traces.transport("rfc2217", address));
    }
}

impl Emulator {
    pub(crate) fn new(
        control: Control,
        places: Places,
        ended: watch::Receiver<End>,
        worker: Worker,
        recording: Option<Kept>,
    ) -> Emulator {
        Emulator {
            control,
            places,
            #[cfg(all(unix, feature = "pty"))]
            link: None,
            ended,
            waits_for_end: true,
            worker,
            recording,
        }
    }

    /// Leads the link of this name to the pseudo-terminal, if there is one.
    #[cfg(all(unix, feature = "pty"))]
    pub(crate) fn link_to(&mut self, path: &Path, replace: bool) -> Result<(), LinkError> {
        if let Some(target) = &self.places.pty {
            self.link = Some(PtyLink::create(path, target, replace)?);
        }
        Ok(())
    }

    // --- where it is ---

    /// The model.
    pub fn model(&self) -> &Model {
        self.control.model()
    }

    /// The same controls, to be awaited instead of waited for.
    pub fn control(&self) -> &Control {
        &self.control
    }

    /// The path of the serial port that a program opens: the link, or the pseudo-terminal
    /// itself if there is no link. `None` if there is no pseudo-terminal.
    pub fn port(&self) -> Option<&Path> {
        #[cfg(all(unix, feature = "pty"))]
        return self.link.as_ref().map(PtyLink::path).or(self.places.pty.as_deref());
        #[cfg(not(all(unix, feature = "pty")))]
        None
    }

    /// Where it listens, with the port that was picked.
    pub fn tcp_addr(&self) -> Option<SocketAddr> {
        self.places.tcp
    }

    /// Where it listens for clients that speak RFC 2217, with the port that was picked.
    pub fn rfc2217_addr(&self) -> Option<SocketAddr> {
        self.places.rfc2217
    }

    /// The real serial port that it has open.
    pub fn serial(&self) -> Option<&str> {
        self.places.serial.as_deref()
    }

    /// Opens the line from within the process. All ports open at the same time share one wire: each
    /// sees everything the controller sends.
    pub fn connect(&self) -> Result<MemoryPort, Error> {
        Ok(self.control.connect().wait()?)
    }

    /// Its recording, if it is [recorded](crate::Builder::record) into a file.
    pub fn recording(&self) -> Option<&RecordingFile> {
        self.recording.as_ref().map(|kept| &kept.file)
    }

    // --- time ---

    /// The controller's time.
    pub fn now(&self) -> Result<Time, Error> {
        Ok(self.control.now().wait()?)
    }

    /// Moves time forward, with the clocks that do not run by themselves.
    pub fn advance(&self, span: Duration) -> Result<Time, Error> {
        Ok(self.control.advance(span).wait()?)
    }

    /// Cancels every journey through time that another caller is awaiting.
    pub fn cancel_all(&self) {
        self.control.cancel_all();
    }

    /// Lets time pass until the controller does nothing any more, and says when that was. With
    /// a clock that runs by itself it waits for it.
    pub fn run_until_idle(&self) -> Result<Time, Error> {
        self.run_until(&Condition::Idle)
    }

    /// Lets time pass up to the first instant at which the condition holds, and says when that
    /// was. With a clock that runs by itself it waits for it.
    ///
    /// # Errors
    ///
    /// If the condition never holds unless something else happens first. Time has not moved
    /// then.
    pub fn run_until(&self, condition: &Condition) -> Result<Time, Error> {
        Ok(self.control.run_until(condition.clone()).wait()?)
    }

    // --- what it sees ---

    /// The step counters of the axes that the controller has, X first.
    pub fn position(&self) -> Result<Vec<i64>, Error> {
        Ok(self.control.position().wait()?)
    }

    /// A picture of the controller: positions, speeds, program, ports and what it will do.
    pub fn view(&self) -> Result<View, Error> {
        Ok(self.control.view().wait()?)
    }

    /// What the host sent, decoded, oldest first.
    pub fn commands(&self) -> Result<Vec<HostCommand>, Error> {
        Ok(self.control.commands().wait()?)
    }

    /// Waits until the host sends a command of this mnemonic, such as `@A`, and returns it. It
    /// continues from the command that was waited for last, so that none is missed, however fast
    /// the host is.
    ///
    /// # Errors
    ///
    /// If none comes within ten seconds on the wall, or nothing is
    /// [recorded](crate::Builder::record).
    pub fn next_command(&self, mnemonic: &str) -> Result<HostCommand, Error> {
        Ok(self.control.next_command(mnemonic).wait_within(Duration::from_secs(10))?)
    }

    /// What happened, oldest first.
    pub fn events(&self) -> Result<Vec<(Stamp, Event)>, Error> {
        Ok(self.control.events().wait()?)
    }

    /// Everything that happened, oldest first: commands, answers, motions, ports, what people did, each
    /// with its time and the number of its command.
    pub fn journal(&self) -> Result<Journal, Error> {
        Ok(self.control.journal().wait()?)
    }

    /// How much of what the controller can do the host has met so far: commands, their answers, the
    /// states that they found and what stopped them. [`add_coverage`](crate::add_coverage) adds it to a
    /// file.
    ///
    /// # Errors
    ///
    /// If it is not counted, which [`Builder::coverage`](crate::Builder::coverage) switches on.
    pub fn coverage(&self) -> Result<Coverage, Error> {
        Ok(self.control.coverage().wait()?)
    }

    /// Begins a sentence about what has to happen: from now on, if it ends with
    /// [`watch`](vimc4_journal::expect::Sentence::watch), or so far, if it ends with
    /// [`so_far`](vimc4_journal::expect::Sentence::so_far).
    ///
    /// ```
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// use std::io::Write;
    /// use vimc4::{Clock, Emulator};
    ///
    /// let emu = Emulator::builder().machine("mill").time(Clock::Manual).start()?;
    /// let moved = emu.expect().command("@A").answered("0").once().then().command("@P").once().watch()?;
    /// let inside = emu.expect().never("x > 20mm").watch()?;
    /// emu.connect()?.write_all(b"@07\r@0A800,900,0,900,0,900,0,900\r@0P\r")?;
    /// emu.run_until_idle()?;
    /// moved.check()?;
    /// inside.check()?;
    /// # Ok(())
    /// # }
    /// ```
    pub fn expect(&self) -> Expect<Live> {
        Live::expect(&self.control, self.recording())
    }

    /// Forgets the commands and events so far.
    pub fn forget(&self) -> Result<(), Error> {
        Ok(self.control.forget().wait()?)
    }

    // --- what happens to it ---

    /// The things of the outside world that can be set, with their names.
    pub fn signals(&self) -> Result<Vec<Signal>, Error> {
        Ok(self.control.signals().wait()?)
    }

    /// What people call its axes and signals, with which [orders](crate::Order) are read and
    /// completed.
    pub fn names(&self) -> Result<Names, Error> {
        Ok(self.control.names().wait()?)
    }

    /// Sets a signal to any value it takes: 1 and 0, or the number of a switch's position.
    pub fn set_signal(&self, name: impl AsRef<str>, value: i32) -> Result<(), Error> {
        self.control.set_signal(name, value).wait()?;
        Ok(())
    }

    /// Presses a button and releases it at the same instant; the emergency stop stays pressed
    /// until it is released.
    pub fn press(&self, button: impl AsRef<str>) -> Result<(), Error> {
        self.control.press(button).wait()?;
        Ok(())
    }

    /// Presses a button and keeps it pressed.
    pub fn hold(&self, button: impl AsRef<str>) -> Result<(), Error> {
        self.control.hold(button).wait()?;
        Ok(())
    }

    /// Releases a button.
    pub fn release(&self, button: impl AsRef<str>) -> Result<(), Error> {
        self.control.release(button).wait()?;
        Ok(())
    }

    /// Puts a switch into a position, as in `turn("cover", "open")`.
    pub fn turn(&self, switch: &str, position: &str) -> Result<(), Error> {
        self.control.turn(switch, position).wait()?;
        Ok(())
    }

    /// Sets a bit of an input port, as the controller reads it.
    pub fn input(&self, port: u16, bit: u8, level: bool) -> Result<(), Error> {
        self.control.input(port, bit, level).wait()?;
        Ok(())
    }

    /// Erases the stored program as a person does at the panel: the emergency stop pressed and
    /// released, key on test, STOP held, ON. It takes its time, and the key is turned back at
    /// once. The controller has then been reset, and its power stages are off until ON is pressed
    /// or it is switched off and on.
    pub fn erase(&self) -> Result<(), Error> {
        self.control.erase().wait()?;
        Ok(())
    }

    /// Carries out an order as people type it: [`Order::read`](crate::Order::read) reads it.
    /// Returns its output as text.
    pub fn give(&self, order: &Order) -> Result<String, Error> {
        block_on(self.control.give(order))
    }

    /// Switches the power off or on.
    pub fn power(&self, on: bool) -> Result<(), Error> {
        self.control.power(on).wait()?;
        Ok(())
    }

    /// Something goes wrong from now on, and until the handle is dropped.
    ///
    /// ```
    /// use std::io::{Read, Write};
    /// use vimc4::{Clock, Emulator};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let emu = Emulator::builder().time(Clock::Instant).start()?;
    /// let mut port = emu.connect()?;
    /// let fault = emu.fault("garble into ? to-host after command @0P")?;
    /// port.write_all(b"@07\r@0P\r")?;
    /// let mut answers = [0; 2];
    /// port.read_exact(&mut answers)?;
    /// assert_eq!(&answers, b"0?");
    /// assert_eq!(fault.struck()?, 1);
    /// drop(fault);
    /// assert!(emu.faults()?.is_empty());
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// If the words describe no fault, or the emulator has ended.
    pub fn fault(&self, fault: impl Into<AnyFault>) -> Result<FaultHandle, Error> {
        let fault = match fault.into() {
            AnyFault::Fault(fault) => fault,
            AnyFault::Words(words) => read_fault(&words, &self.names()?).map_err(Error::Fault)?,
        };
        let number = self.control.fault(fault).wait()?;
        Ok(FaultHandle::new(self.control.clone(), number))
    }

    /// The present faults, and how often each has struck.
    ///
    /// # Errors
    ///
    /// If the emulator has ended.
    pub fn faults(&self) -> Result<Vec<FaultView>, Error> {
        Ok(self.control.faults().wait()?)
    }

    /// Ends the fault of this number, if there is one.
    ///
    /// # Errors
    ///
    /// If the emulator has ended.
    pub fn end_fault(&self, number: FaultNumber) -> Result<(), Error> {
        self.control.end_fault(number).wait()?;
        Ok(())
    }

    /// Ends all faults, no matter how they were started.
    ///
    /// # Errors
    ///
    /// If the emulator has ended.
    pub fn end_faults(&self) -> Result<(), Error> {
        self.control.end_faults().wait()?;
        Ok(())
    }

    /// Things happen from now on as rules say, and until the handle is dropped: then what they have
    /// changed is set back.
    ///
    /// ```
    /// use std::io::{Read, Write};
    /// use vimc4::{Clock, Emulator};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let emu = Emulator::builder().machine("bench").time(Clock::Instant).start()?;
    /// let mut port = emu.connect()?;
    /// let stops = emu.scenario("rule once when x > 100: press stop")?;
    /// port.write_all(b"@01\r@0A1000,900\r")?;
    /// let mut answers = [0; 2];
    /// port.read_exact(&mut answers)?;
    /// assert_eq!(&answers, b"0F");
    /// assert_eq!(stops.acted()?, 1);
    /// drop(stops);
    /// assert!(emu.rules()?.is_empty());
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// If the words describe no rules, a rule waits for one that is not there, or the emulator has ended.
    pub fn scenario(&self, scenario: impl Into<AnyScenario>) -> Result<ScenarioHandle, Error> {
        let scenario = match scenario.into() {
            AnyScenario::Scenario(scenario) => scenario,
            AnyScenario::Words(words) => {
                let names = self.names()?;
                let lines = words.lines().map(str::trim).filter(|line| !line.is_empty());
                let rules = lines.map(|line| read_rule(line, &names).map_err(Error::Rule));
                let rules = rules.collect::<Result<_, _>>()?;
                Scenario { rules }
            }
        };
        let present = self.rules()?;
        scenario.check(present.iter().filter_map(|view| view.id.name.as_deref()))?;
        let number = self.control.scenario(scenario).wait()?;
        Ok(ScenarioHandle::new(self.control.clone(), number))
    }

    /// The same with the rules of a [file](crate::scenario_file).
    ///
    /// # Errors
    ///
    /// If the file cannot be read, something in it is no rule, or the emulator has ended.
    pub fn scenario_file(&self, path: impl AsRef<Path>) -> Result<ScenarioHandle, Error> {
        self.scenario(scenario_file(path, &self.names()?)?)
    }

    /// The rules of the present scenarios, and how often each has acted.
    ///
    /// # Errors
    ///
    /// If the emulator has ended.
    pub fn rules(&self) -> Result<Vec<RuleView>, Error> {
        Ok(self.control.rules().wait()?)
    }

    /// Ends the scenario of this number, if there is one.
    ///
    /// # Errors
    ///
    /// If the emulator has ended.
    pub fn end_scenario(&self, number: ScenarioNumber) -> Result<(), Error> {
        self.control.end_scenario(number).wait()?;
        Ok(())
    }

    /// Ends all scenarios and all faults, no matter how they were started.
    ///
    /// # Errors
    ///
    /// If the emulator has ended.
    pub fn reset(&self) -> Result<(), Error> {
        self.control.reset().wait()?;
        Ok(())
    }

    /// The present state. [`restore`](Emulator::restore) goes back to it, as often as wanted.
    pub fn snapshot(&self) -> Result<Snapshot, Error> {
        Ok(self.control.snapshot().wait()?)
    }

    /// Goes back to a state taken earlier, of this or another emulator of the same model. Its
    /// time goes back with it; clients stay connected.
    pub fn restore(&self, snapshot: &Snapshot) -> Result<(), Error> {
        Ok(self.control.restore(snapshot).wait()?)
    }

    // --- time stands still ---

    /// Pauses time, whatever the clock, and says when that was. Clients stay connected: what they
    /// send waits on the line, and they notice nothing but the delay.
    pub fn pause(&self) -> Result<Time, Error> {
        Ok(self.control.pause().wait()?)
    }

    /// Lets time go on from where it is. The wall-clock time that has passed meanwhile is not made
    /// up for.
    pub fn resume(&self) -> Result<Time, Error> {
        Ok(self.control.resume().wait()?)
    }

    /// Waits until time is paused, whatever the cause, and returns the cause.
    pub fn until_paused(&self) -> Result<Pause, Error> {
        Ok(self.control.until_paused().wait()?)
    }

    /// Does one thing while time is paused, and returns what it was.
    pub fn step(&self) -> Result<Step, Error> {
        Ok(self.control.step().wait()?)
    }

    /// Pauses time at the very moment a condition becomes true: before anything else happens, even
    /// at the same instant.
    pub fn break_when(&self, condition: &Condition) -> Result<BreakpointId, Error> {
        Ok(self.control.break_when(condition.clone()).wait()?)
    }

    /// Removes a breakpoint. Returns whether it was there.
    pub fn remove_breakpoint(&self, breakpoint: BreakpointId) -> Result<bool, Error> {
        Ok(self.control.remove_breakpoint(breakpoint).wait()?)
    }

    /// The breakpoints, and how often each was met.
    pub fn breakpoints(&self) -> Result<Vec<BreakpointView>, Error> {
        Ok(self.control.breakpoints().wait()?)
    }

    // --- its end ---

    /// Tells it to end, without waiting for that.
    pub fn stop(&self) {
        self.control.stop();
    }

    /// Resolves when it has ended, with the error if it ended by itself.
    pub async fn ended(&self) -> Result<(), Error> {
        self.end().await
    }

    /// The same for a caller that may outlive the emulator.
    pub fn end(&self) -> impl Future<Output = Result<(), Error>> + Send + use<> {
        let mut ended = self.ended.clone();
        async move {
            match ended.wait_for(Option::is_some).await.as_deref() {
                Ok(Some(Err(error))) => Err(Error::Run(Arc::clone(error))),
                // Told to end; or it is gone, which only a panic in it can do.
                Ok(_) => Ok(()),
                Err(_) => Err(Error::Control(ControlError::Ended)),
            }
        }
    }

    /// Removes the link to its pseudo-terminal. Clients that have it open stay.
    pub fn unlink(&mut self) {
        #[cfg(all(unix, feature = "pty"))]
        drop(self.link.take());
    }

    /// Removes its link and lets go of it without waiting for its end, nor for that of its thread.
    /// For a program that is about to end and has no time to lose: the system frees what is left of
    /// a thousand controllers faster.
    pub fn abandon(mut self) {
        self.control.stop();
        self.waits_for_end = false;
        // The thread ends with the last that has it; so nobody is the last.
        std::mem::forget(self.worker.clone());
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        #[cfg(all(unix, feature = "pty"))]
        drop(self.link.take());
        self.control.stop();
        // Its own thread would wait for itself.
        if self.waits_for_end && !self.worker.is_here() {
            // Its ports are free afterwards. A panic in it has been printed already.
            let _ = block_on(pin!(self.ended.wait_for(Option::is_some)));
        }
    }
}
