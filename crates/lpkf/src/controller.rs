//! The life of a command, from the line to its answer.
//!
//! [`State`] decides: each of its methods changes it and returns the consequences. Only this module
//! carries them out, and all output goes through here into the outbox:
//!
//! 1. [`receive`](Controller::receive): the reader turns bytes into commands, and each one that is
//!    taken gets a number. `admission` says whether it is carried out at once, waits or is refused.
//! 2. [`execute`](Controller::execute): `execute` does what takes no time and returns the stages
//!    that take some.
//! 3. [`advance`](Controller::advance): `job` begins a stage, and `moves` and `reference` turn it
//!    into a motion. When that ends, the command continues here.
//! 4. [`executed`](Controller::executed) answers, and what waits comes next.
//!
//! [`break_off`](Controller::break_off) ends it early: because of what a motion meets, or of a
//! [`signal`](Controller::signal). Everything that happens by itself is a [`Cause`];
//! [`perform_cause`](Controller::perform_cause) performs them one by one.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::sync::Arc;

use bytes::Bytes;
use vimc4_device::{
    CommandNumber, Course, Event, FaultNews, FaultNumber, Faulting, Kinds, Loss, MachineStrike,
    Mishap, Motion, Outbox, SignalId, Situation, Stamp, StopCause, Strike, Time, Warning,
};
use vimc4_plant::{Contact, End, Followed, Machine, Plant};

use crate::admission::Admission;
use crate::buffer::{Buffer, Entry};
use crate::cause::Cause;
use crate::execute::Effect;
use crate::halting::{Ending, Interruption, Pressed, Resumed};
use crate::job::Begun;
use crate::language::{Axis, Command, Item, Reader, Status, why_ignored};
use crate::mishaps::Limits;
use crate::model::{InitReply, Model, StatusDigits};
use crate::signals::Leads;
use crate::state::{Activity, Moving, Stage, State, Task};
use crate::why::{Stop, Why};

/// How many bytes of a lost half line are shown.
const HALF_SHOWN: usize = 100;

/// A virtual LPKF controller with its machine.
#[derive(Clone, Debug)]
pub struct Controller {
    pub(crate) state: State,
    pub(crate) out: Outbox,
}

impl Controller {
    /// A controller of a model on a machine, just switched on.
    #[must_use]
    pub fn new(model: Arc<Model>, machine: Arc<Machine>) -> Controller {
        let mut state = State::new(model, machine);
        state.home();
        Controller { state, out: Outbox::default() }
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.state.model
    }

    // --- causes ---

    /// Performs a single cause, the first that is due up to and including `at`. Returns whether there
    /// was one.
    pub(crate) fn perform_cause(&mut self, at: Time) -> bool {
        let (now, next) = (self.state.now, self.state.next_cause());
        let Some((due, cause)) = next.filter(|(due, _)| *due <= at.max(now)) else { return false };
        self.state.now = due.max(now);
        match cause {
            Cause::Activity => self.advance(),
            Cause::Ball => self.state.follow_ball(),
            Cause::Stop => self.state.stop_here(),
            Cause::Entry => self.take_turn(),
            Cause::SpindleSpeed => {
                let says = self.state.unit.speed_reached();
                self.send(says);
            }
            Cause::BallReport => {
                let says = self.state.report_ball();
                self.send(says);
            }
            Cause::Contact => self.contact(),
            Cause::Switch => {
                self.carriage_changes_switch();
                // What else is due at the same instant belongs to the same cause.
                self.perform_cause(self.state.now);
            }
        }
        true
    }

    /// Performs all that is due now.
    fn go_on(&mut self) {
        while self.perform_cause(self.state.now) {}
    }

    /// Begins the next waiting item.
    fn take_turn(&mut self) {
        match self.state.next_entry() {
            Some(Entry::Through(bytes)) => self.pass_through(&bytes),
            Some(Entry::Command { raw, command, number }) => {
                self.command_event(number, &command, &raw);
                self.carry_out(number, &raw, command);
            }
            None => {}
        }
    }

    // --- from the line ---

    /// Bytes have arrived.
    pub(crate) fn receive(&mut self, bytes: &[u8]) {
        if !self.state.powered {
            return;
        }
        let unread = Reader::new(self.state.model.grammar());
        let mut reader = std::mem::replace(&mut self.state.reader, unread);
        for &byte in bytes {
            let was_open = reader.channel_open();
            reader.read(byte, |item| {
                // Earlier commands are carried out first, as far as nothing prevents them.
                self.go_on();
                self.take(item);
            });
            let opened = !was_open && reader.channel_open();
            let ignored = reader.take_ignored();
            if opened || ignored.is_some() {
                self.go_on();
            }
            if let Some(ignored) = ignored.filter(|_| self.out.wants(Kinds::WARNING)) {
                let why = why_ignored(&ignored, self.state.model.grammar());
                self.warn_no_effect(None, why.into());
            }
            // A `!OC` that is refused opens nothing.
            if opened && self.state.refusal(None).is_some() {
                reader.close_channel();
            }
        }
        self.state.reader = reader;
    }

    fn take(&mut self, item: Item<&[u8]>) {
        match item {
            Item::Command { raw, command } => self.take_command(raw, command),
            Item::Through(byte) => {
                if self.make_room(1) {
                    self.state.buffer.put_through(byte);
                }
            }
            Item::TooLong => self.report(Why::TooLong),
        }
    }

    fn take_command(&mut self, raw: &[u8], command: Result<Command, Status>) {
        let admission = self.state.admit(&command);
        if matches!(admission, Admission::Waits) {
            if self.make_room(raw.len()) {
                let (raw, number) = (Bytes::copy_from_slice(raw), self.next_number());
                self.state.buffer.put(Entry::Command { raw, command, number });
            }
            return;
        }
        let number = self.next_number();
        self.command_event(number, &command, raw);
        match (admission, command) {
            (Admission::Refused(why), command) => {
                self.answer_failed(Some(number), letters(&command), why, raw);
            }
            (Admission::Directly, Ok(command)) => self.execute_directly(number, &command),
            (Admission::Aside, Ok(query)) => self.answer_query(number, &query),
            (Admission::Afresh, command) => {
                self.state.buffer = Buffer::default();
                self.carry_out(number, raw, command);
            }
            (Admission::AtOnce, command) => self.carry_out(number, raw, command),
            (_, Err(_)) | (Admission::Ignored | Admission::Waits, _) => {}
        }
    }

    /// The number of a command that is taken from the line now.
    fn next_number(&mut self) -> CommandNumber {
        let number = self.state.number.map_or(CommandNumber::FIRST, CommandNumber::next);
        self.state.number = Some(number);
        number
    }

    /// Whether this many more bytes fit into the buffer. What does not fit is lost; that is
    /// reported once for everything lost together.
    fn make_room(&mut self, bytes: usize) -> bool {
        let size = self.state.model.buffer.bytes;
        if self.state.buffer.has_room(bytes, size) {
            return true;
        }
        self.warn(None, Warning::ReceiveOverflow { lost: bytes as u64 });
        if !std::mem::replace(&mut self.state.buffer.overrun, true) {
            self.report(Why::BufferFull(bytes));
        }
        false
    }

    /// Bytes for the spindle unit.
    fn pass_through(&mut self, bytes: &[u8]) {
        let start_ms = self.state.model.spindle_unit.start_ms;
        for &byte in bytes {
            for says in self.state.unit.take_byte(byte, self.state.now, start_ms) {
                self.send(says);
            }
        }
    }

    // --- execution ---

    /// Begins a command, or says why it is not one.
    fn carry_out(&mut self, number: CommandNumber, raw: &[u8], command: Result<Command, Status>) {
        match command {
            Ok(command) => self.execute(number, command),
            Err(status) => self.answer_failed(Some(number), "?", Why::Text(status), raw),
        }
    }

    /// Begins a command whose turn has come.
    fn execute(&mut self, number: CommandNumber, command: Command) {
        if command.resumes() {
            return match self.state.resume(&command) {
                Resumed::Nothing => {
                    self.warn_no_effect(Some(number), "no command was broken off".into());
                    self.executed(number, command);
                }
                Resumed::Again(broken) => self.execute(number, broken),
                Resumed::Stages(command, start, stages) => {
                    self.state.job = Some(Task::new(command, Some(number), start, stages));
                }
            };
        }
        if let Some(stages) = self.apply(number, &command) {
            if stages.is_empty() {
                return self.executed(number, command);
            }
            let start = self.state.position;
            self.state.job = Some(Task::new(command, Some(number), start, stages));
        }
    }

    /// A query that is answered during the executing command.
    fn answer_query(&mut self, number: CommandNumber, query: &Command) {
        if self.apply(number, query).is_some() {
            self.answer_done(number, query);
        }
    }

    /// A command that bypasses the buffer.
    fn execute_directly(&mut self, number: CommandNumber, command: &Command) {
        if *command == Command::GoOn {
            self.tell_dropped(number);
        }
        let Some(command) = self.state.execute_directly(command) else {
            return self.answer_done(number, command);
        };
        // `!RP` is done when the repetition is, which comes before waiting commands. The repetition
        // takes the room that it would take if it had been sent.
        let mut raw = Vec::new();
        command.print(&mut raw);
        // The end belongs to no command.
        raw.pop();
        if self.make_room(raw.len()) {
            let (raw, command) = (raw.into(), Ok(command));
            self.state.buffer.put_first(Entry::Command { raw, command, number });
        }
    }

    /// `!GO` drops what is left of a command that was broken off.
    fn tell_dropped(&mut self, number: CommandNumber) {
        let broken = self.state.broken.as_ref().filter(|broken| !broken.stages.is_empty());
        let Some(command) = broken.map(|broken| &broken.command) else { return };
        let head = match (command, self.state.outputs.head_down) {
            (Command::PenDown, false) => "; the head is still up",
            (Command::PenUp, true) => "; the head is still down",
            _ => "",
        };
        let mnemonic = command.form().mnemonic;
        let why = format!("!GO drops what was left of {mnemonic}{head}");
        self.emit(Some(number), Kinds::ANSWER, || Event::CutShort {
            mnemonic: mnemonic.into(),
            why: why.into(),
        });
    }

    /// Does the part of a command that takes no time. Returns its stages, unless it has failed.
    fn apply(&mut self, number: CommandNumber, command: &Command) -> Option<VecDeque<Stage>> {
        let letters = command.form().mnemonic;
        match self.switching(Some(number), |state| state.execute(command)) {
            Ok(Effect { warning, line, stages }) => {
                if let Some(warning) = warning {
                    self.warn_no_effect(Some(number), warning);
                }
                if let Some(line) = line {
                    self.answer(Some(number), letters, line.finish());
                }
                Some(stages)
            }
            Err(why) => {
                self.answer_failed(Some(number), letters, why, b"");
                None
            }
        }
    }

    /// The present step of the command is over: the next one begins, or the command is done.
    fn advance(&mut self) {
        if let Some(moving) = self.state.take_moving() {
            return self.motion_ended(&moving);
        }
        let number = self.job_number();
        let letters = self.state.job.as_ref().map_or("", |job| job.command.form().mnemonic);
        match self.switching(number, State::next_stage) {
            Some(Ok(Begun::Over)) => {}
            Some(Ok(Begun::Motion(moving))) => {
                let origin = self.state.position;
                self.emit(number, Kinds::MOTION, || {
                    let segment = Box::new(moving.segment.clone());
                    Event::Motion(Motion::Begins { origin, segment })
                });
                let jams = self.state.plant.jams(&moving.segment, 0);
                self.state.set_activity(Activity::Moving(moving));
                self.state.expect_switch();
                jams.into_iter().for_each(|(axis, fault)| self.stands(axis, fault));
            }
            Some(Ok(Begun::Pause(pause, until))) => {
                self.state.set_activity(Activity::Waiting(pause, until));
            }
            Some(Ok(Begun::Says(line))) => self.answer(number, letters, line.finish()),
            Some(Err(why)) => {
                self.state.job = None;
                self.answer_failed(number, letters, why, b"");
            }
            None => {
                if let Some(Task { command, number: Some(number), .. }) = self.state.job.take() {
                    self.executed(number, command);
                }
            }
        }
    }

    /// A motion has come to its end, to a border or to a switch.
    fn motion_ended(&mut self, moving: &Moving) {
        let (steps, ending) = moving.ending();
        self.commit(moving, steps);
        match ending {
            Ending::Arrived => {}
            Ending::OnLimit(axis, end) => {
                let stop = Stop::Limit(axis, self.state.side(axis, end));
                let why = self.state.on_limit(axis, end, false);
                self.break_off(Some((moving, steps)), stop, why);
            }
            Ending::Halted(stop, why) => self.break_off(Some((moving, steps)), stop, why),
        }
    }

    /// The motion of the executing command ends after this many steps.
    fn commit(&mut self, moving: &Moving, steps: u64) {
        let number = self.job_number();
        let followed = self.state.commit(&moving.segment, steps);
        self.warn_of_losses(&followed);
        self.emit(number, Kinds::MOTION, || Event::Motion(Motion::Ends { steps }));
    }

    /// Reports which carriages no longer agree with their counters.
    fn warn_of_losses(&mut self, followed: &Followed) {
        let number = self.job_number();
        let lost = followed.lost.iter().zip(followed.stood).enumerate();
        for (axis, (&steps, stood)) in lost.filter(|(_, (steps, _))| **steps != 0) {
            let name = Axis::from_index(axis).map_or("?", |axis| self.state.axis_name(axis));
            let how = if stood { Loss::Stalled } else { Loss::AtEnd };
            if stood && let Some(fault) = followed.because[axis] {
                self.stands(axis, fault);
            }
            let warning = self.state.plant.machine().steps_lost(axis, name, -steps, how);
            self.warn(number, warning);
        }
    }

    /// A command has been executed.
    fn executed(&mut self, number: CommandNumber, command: Command) {
        self.answer_done(number, &command);
        // `!RP` does not repeat commands that continue others, and after `IN` there is none to
        // repeat.
        if !command.resumes() && command != Command::Initialize {
            self.state.last = Some(command);
        }
    }

    // --- interruptions ---

    /// Aborts what is executing, maybe within a motion after this many steps, and answers why;
    /// without a command the status is sent by itself.
    fn break_off(&mut self, motion: Option<(&Moving, u64)>, stop: Stop, why: Why) {
        self.struck(why.cause());
        match self.state.break_off(motion, stop) {
            Some((number, letters)) => self.answer_failed(Some(number), letters, why, b""),
            None => self.report(why),
        }
    }

    /// Something stops the command that executes, for coverage.
    fn struck(&mut self, cause: StopCause) {
        let Some(Task { command, number: Some(number), .. }) = &self.state.job else { return };
        let (mnemonic, doing) = (command.form().mnemonic.into(), self.state.doing());
        self.emit(Some(*number), Kinds::COURSE, || {
            let situation = Situation::Doing(doing);
            Event::Course(Course::Stops { mnemonic, cause, situation })
        });
    }

    /// A signal is set. One that a fault holds takes no value.
    pub(crate) fn signal(&mut self, id: SignalId, value: i32) {
        if !self.state.plant.withholds(id, value) {
            self.set_signal(id, value);
        }
    }

    /// A signal takes a value.
    fn set_signal(&mut self, id: SignalId, value: i32) {
        if self.out.wants(Kinds::SIGNAL)
            && let Some(value) = self.state.taken(id, value)
        {
            self.emit(None, Kinds::SIGNAL, || Event::Signal { signal: id, value });
        }
        let before = self.state.pressed_now();
        let leads = self.state.signal(id, value);
        self.tell_switches(&before);
        match leads {
            Leads::Nowhere => {}
            Leads::Interruption(stop, why) => self.interrupt(stop, why),
            Leads::Halt(fault) => self.halt(fault),
            Leads::Report(why) => self.report(why),
            Leads::Switch(axis, end, active) => self.switch_changed(axis, end, active),
            Leads::Says(bytes) => self.send(bytes),
        }
    }

    /// Something from outside stops what is executing, along the ramp if it moves.
    fn interrupt(&mut self, stop: Stop, why: Why) {
        match self.state.interrupt(stop, why) {
            Interruption::Nothing => {}
            Interruption::Now => self.break_off(None, stop, why),
            Interruption::Brakes(segment) => self.emit(self.job_number(), Kinds::MOTION, || {
                Event::Motion(Motion::Changes { segment })
            }),
        }
    }

    /// Something from outside takes the motors' ability to move: they halt where they are.
    fn halt(&mut self, fault: Status) {
        let (stop, why) = (Stop::Fault(fault), Why::Fault(fault));
        if self.state.job.is_none() {
            return self.report(why);
        }
        match self.abandon_motion() {
            Some((moving, steps)) => self.break_off(Some((&moving, steps)), stop, why),
            None => self.break_off(None, stop, why),
        }
    }

    /// Motors stop where they are.
    fn abandon_motion(&mut self) -> Option<(Box<Moving>, u64)> {
        let moving = self.state.take_moving()?;
        let steps = moving.steps_at(self.state.now);
        self.commit(&moving, steps);
        Some((moving, steps))
    }

    /// The running motion makes the step with which a limit switch changes.
    fn carriage_changes_switch(&mut self) {
        if self.out.wants(Kinds::SWITCH) {
            for (axis, end, active) in self.state.switches_passed() {
                self.switch_event(self.job_number(), axis, end, active);
            }
        }
        self.state.expect_switch();
    }

    /// Reports the limit switches that have changed without a command.
    fn tell_switches(&mut self, before: &Limits) {
        if self.out.wants(Kinds::SWITCH) {
            for (axis, end, active) in self.state.switches_changed(before) {
                self.switch_event(None, axis, end, active);
            }
        }
    }

    /// A limit switch was pressed or released by hand, or by a fault.
    fn switch_changed(&mut self, axis: Axis, end: End, active: bool) {
        match self.state.switch_pressed(axis, end, active) {
            Pressed::Nothing => {}
            Pressed::Found(moving, steps) => self.commit(&moving, steps),
            Pressed::Blocked(moving, steps) => {
                self.commit(&moving, steps);
                let stop = Stop::Limit(axis, self.state.side(axis, end));
                let why = self.state.on_limit(axis, end, true);
                self.break_off(Some((&moving, steps)), stop, why);
            }
        }
    }

    // --- faults of the machine ---

    /// A fault begins or ends.
    pub(crate) fn fault(&mut self, faulting: &Faulting) {
        let (ended, begun) = self.state.plant.faulting(faulting);
        ended.into_iter().for_each(|number| self.end_fault(number));
        if let Some((number, mishap)) = begun {
            self.begin_fault(number, mishap);
        }
    }

    fn begin_fault(&mut self, number: FaultNumber, mishap: &Mishap) {
        let instead = match mishap {
            // A signal that acts the moment it is set cannot be held.
            Mishap::Hold { signal, .. } => match self.state.signal_value(*signal) {
                Some(value) => value,
                None => return,
            },
            Mishap::Power => self.state.powered.into(),
            _ => 0,
        };
        let (begun, mut pushed) = (mishap.clone(), 0);
        self.change_machine(|plant| pushed = plant.begin_fault(number, begun, instead));
        if mishap.strikes_at_once() {
            self.strikes(number, MachineStrike::Changed);
        }
        match mishap {
            Mishap::Push { axis, .. } => {
                let axis = usize::from(*axis);
                let name = Axis::from_index(axis).map_or("?", |axis| self.state.axis_name(axis));
                if pushed != 0 {
                    let machine = self.state.plant.machine();
                    let warning = machine.steps_lost(axis, name, pushed, Loss::Pushed);
                    self.warn(None, warning);
                }
            }
            Mishap::Hold { signal, value } => self.set_signal(*signal, *value),
            Mishap::Power => self.switch_power(false),
            _ => {}
        }
    }

    fn end_fault(&mut self, number: FaultNumber) {
        let mut ended = None;
        self.change_machine(|plant| ended = plant.end_fault(number));
        match ended {
            Some((Mishap::Hold { signal, .. }, back)) => self.set_signal(signal, back),
            Some((Mishap::Power, back)) => self.switch_power(back != 0),
            _ => {}
        }
    }

    /// A fault lets the motor of an axis stand.
    fn stands(&mut self, axis: usize, fault: FaultNumber) {
        let name = Axis::from_index(axis).map_or("?", |axis| self.state.axis_name(axis)).to_owned();
        self.strikes(fault, MachineStrike::Stands(axis as u8, name));
    }

    fn strikes(&mut self, number: FaultNumber, strike: MachineStrike) {
        self.emit(None, Kinds::FAULT, || {
            let news = FaultNews::Strikes(Strike::Machine(strike));
            Event::Fault { number, news }
        });
    }

    /// What a bouncing contact does now.
    fn contact(&mut self) {
        let before = self.state.pressed_now();
        match self.state.contact_now() {
            Some(Contact::Begins(numbers)) => {
                for number in numbers {
                    self.strikes(number, MachineStrike::Bounces);
                }
            }
            Some(Contact::Limit(..)) => self.machine_changed(&before),
            Some(Contact::Signal(signal, level)) => {
                self.state.plant.is_bouncing(signal, level);
                self.set_signal(signal.id(), level.into());
            }
            None => {}
        }
    }

    /// Changes the machine, with the axes where they are now.
    fn change_machine(&mut self, change: impl FnOnce(&mut Plant)) {
        let before = self.state.pressed_now();
        if let Some((followed, jams)) = self.state.change_machine(change) {
            self.warn_of_losses(&followed);
            jams.into_iter().for_each(|(axis, fault)| self.stands(axis, fault));
        }
        self.machine_changed(&before);
    }

    /// The limit switches may have changed.
    fn machine_changed(&mut self, before: &Limits) {
        self.state.look_ahead_again();
        self.tell_switches(before);
        if self.state.powered {
            for (axis, end, active) in self.state.switches_changed(before) {
                self.switch_changed(axis, end, active);
            }
        }
    }

    /// The mains switch is turned.
    pub(crate) fn power(&mut self, on: bool) {
        if !self.state.plant.withholds_power(on) {
            self.switch_power(on);
        }
    }

    /// The power goes, or comes back. Motors stop where they are and nothing is answered; the
    /// carriages keep what the counters lose.
    fn switch_power(&mut self, on: bool) {
        if on == self.state.powered {
            return;
        }
        if !on {
            self.struck(StopCause::PowerLoss);
            self.tell_lost();
        }
        self.abandon_motion();
        self.switching(None, |state| {
            state.powered = on;
            state.job = None;
            state.switched_on();
        });
        if on {
            self.state.home();
        }
    }

    /// Reports what is lost with the power without an answer: the executing command, an aborted
    /// one, and the waiting ones.
    fn tell_lost(&mut self) {
        if !self.out.wants(Kinds::ANSWER) {
            return;
        }
        let written = |command: &Command| {
            let mut raw = Vec::new();
            command.print(&mut raw);
            // The end belongs to no command.
            raw.pop();
            raw.escape_ascii().to_string()
        };
        let mut lost = Vec::new();
        let mut mnemonic = None;
        if let Some(job) = self.state.job.as_ref().filter(|job| job.number.is_some()) {
            lost.push(written(&job.command));
            mnemonic = Some(job.command.form().mnemonic);
        }
        if let Some(broken) = self.state.broken.as_ref().filter(|b| !b.stages.is_empty()) {
            lost.push(format!("what is left of {}", written(&broken.command)));
            mnemonic = mnemonic.or(Some(broken.command.form().mnemonic));
        }
        if let Some((first, command)) = self.state.buffer.first_command() {
            let first = first.escape_ascii();
            lost.push(match self.state.buffer.commands() {
                1 => format!("{first}, which waited"),
                many => format!("{many} commands that waited, {first} the first of them"),
            });
            mnemonic = mnemonic.or(Some(letters(command)));
        }
        let half = self.state.reader.pending();
        if let Some(beginning) = half.get(..HALF_SHOWN) {
            lost.push(format!("the half line {}…", beginning.escape_ascii()));
        } else if !half.is_empty() {
            lost.push(format!("the half line {}", half.escape_ascii()));
        }
        if !lost.is_empty() {
            let mnemonic = mnemonic.unwrap_or("?").into();
            let why =
                format!("by the loss of power, without an answer: {}", lost.join("; ")).into();
            let number = self.job_number();
            self.emit(number, Kinds::ANSWER, || Event::CutShort { mnemonic, why });
        }
    }

    // --- output ---

    /// The number of the command that executes.
    fn job_number(&self) -> Option<CommandNumber> {
        self.state.job.as_ref()?.number
    }

    /// A command has been completed.
    fn answer_done(&mut self, number: CommandNumber, command: &Command) {
        let done: &[u8] = match (command, self.state.model.quirks.init_reply) {
            (Command::Initialize, InitReply::Z) => b"Z",
            (Command::Initialize, InitReply::C) => b"C\r",
            (Command::OpenChannel(_), _) => return,
            _ if self.state.settings.echo => b"C\r",
            _ => return,
        };
        self.answer(Some(number), command.form().mnemonic, Bytes::from_static(done));
    }

    /// A command has failed, or one with these bytes is refused. A status that this model has no
    /// number for is not sent.
    fn answer_failed(
        &mut self,
        number: Option<CommandNumber>,
        letters: &'static str,
        why: Why,
        raw: &[u8],
    ) {
        let Model { quirks, command_set, .. } = &*self.state.model;
        let decimal = quirks.status_digits == StatusDigits::Decimal;
        let Some(text) = why.status(*command_set).written(*command_set, decimal) else {
            if self.out.wants(Kinds::WARNING) {
                self.warn_no_effect(number, self.state.in_words(why, raw).into());
            }
            return;
        };
        let words = self.out.wants(Kinds::ANSWER).then(|| self.state.in_words(why, raw).into());
        self.answer_why(number, letters, (text + "\r").into(), words);
    }

    /// Something has happened that no command asked for.
    fn report(&mut self, why: Why) {
        self.answer_failed(None, "", why, b"");
    }

    fn answer(&mut self, number: Option<CommandNumber>, letters: &'static str, bytes: Bytes) {
        self.answer_why(number, letters, bytes, None);
    }

    fn answer_why(
        &mut self,
        number: Option<CommandNumber>,
        letters: &'static str,
        bytes: Bytes,
        why: Option<Box<str>>,
    ) {
        let mnemonic = letters.into();
        let answer = || Event::Answer { mnemonic, bytes: bytes.clone(), why };
        self.emit(number, Kinds::ANSWER, answer);
        self.send(bytes);
    }

    fn command_event(
        &mut self,
        number: CommandNumber,
        command: &Result<Command, Status>,
        raw: &[u8],
    ) {
        let doing = self.state.doing();
        self.emit(Some(number), Kinds::COMMAND, || Event::Command {
            mnemonic: letters(command).into(),
            bytes: Bytes::copy_from_slice(raw),
        });
        self.emit(Some(number), Kinds::COURSE, || {
            let (mnemonic, situation) = (letters(command).into(), Situation::Doing(doing));
            Event::Course(Course::Finds { mnemonic, situation })
        });
    }

    fn switch_event(&mut self, number: Option<CommandNumber>, axis: Axis, end: End, active: bool) {
        let (axis, positive) = (axis.index() as u8, end == End::Positive);
        self.emit(number, Kinds::SWITCH, || Event::Switch { axis, positive, active });
    }

    /// Changes the state, and reports which outputs have changed.
    fn switching<R>(
        &mut self,
        number: Option<CommandNumber>,
        change: impl FnOnce(&mut State) -> R,
    ) -> R {
        if !self.out.wants(Kinds::PORT) {
            return change(&mut self.state);
        }
        let before = self.state.outputs.clone();
        let result = change(&mut self.state);
        if before != self.state.outputs {
            let io = &self.state.model.io;
            let (before, after) = (before.values(io), self.state.outputs.values(io));
            for (port, value) in after {
                if before.get(&port) != Some(&value) {
                    self.emit(number, Kinds::PORT, || Event::Port { port, value });
                }
            }
        }
        result
    }

    fn warn_no_effect(&mut self, number: Option<CommandNumber>, what: Cow<'static, str>) {
        self.warn(number, Warning::NoEffect { what });
    }

    fn warn(&mut self, number: Option<CommandNumber>, warning: Warning) {
        self.emit(number, Kinds::WARNING, || Event::Warning(warning));
    }

    /// An event of a kind, which is made only if it is watched.
    fn emit(
        &mut self,
        command: Option<CommandNumber>,
        kinds: Kinds,
        event: impl FnOnce() -> Event,
    ) {
        if self.out.wants(kinds) {
            self.out.emit(Stamp { at: self.state.now, command }, event());
        }
    }

    fn send(&mut self, bytes: Bytes) {
        self.out.send(self.state.now, bytes);
    }
}

/// What a command is called in events.
fn letters(command: &Result<Command, Status>) -> &'static str {
    command.as_ref().map_or("?", |command| command.form().mnemonic)
}
