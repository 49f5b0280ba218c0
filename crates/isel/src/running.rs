//! Running the stored program.
//!
//! Every line takes at least the model's line time, so that no program executes endlessly in no
//! time. A line that waits for an input sleeps until one changes, and then goes on at the time of
//! its next poll.

use bytes::Bytes;
use vimc4_device::{Event, Kinds, StopCause, Time, Warning};
use vimc4_isel_wire::{Command, Mode, Op, PortTest};

use crate::activity::{Activity, Ending, Plan, PortCondition, Purpose, Wait};
use crate::answers::Answer;
use crate::firmware::Firmware;
use crate::model::LoopCount;
use crate::outcome::Outcome;
use crate::program::Validity;
use crate::state::{OpenLoop, Run};
use crate::why::{Breaker, By, Opened, Why};

const NANOS_PER_TENTH: u64 = 100_000_000;

impl Firmware {
    // --- start, pause, end ---

    /// `S`: goes on with a stopped motion, or with the program.
    pub(crate) fn start_command(&mut self, job: Purpose) -> Outcome {
        let answers = matches!(job, Purpose::Command(_));
        if let Some(plan) = self.state.remainder.take() {
            self.take_up(job, plan)
        } else if self.state.run.is_some() {
            self.resume(answers)
        } else {
            self.begin_run(answers)
        }
    }

    /// Goes on with what is left of a stopped motion. It is a move like any other: on a limit
    /// switch that has become active meanwhile it does not begin, and is lost.
    pub(crate) fn take_up(&mut self, job: Purpose, plan: Plan) -> Outcome {
        let way = plan.way();
        match self.check_limits(|axis| way[axis], plan.turns()) {
            Ok(()) => self.begin_plan(job, plan),
            Err(why) => Outcome::Finished(job, Err(why)),
        }
    }

    /// Runs the program from its beginning, with the axes and reference speeds that were
    /// stored with it.
    pub(crate) fn begin_run(&mut self, by_command: bool) -> Outcome {
        let Some(program) = &self.state.flash.program else { return Outcome::Nothing };
        if program.validity != Validity::Valid {
            return Outcome::Nothing;
        }
        let (axes, speeds) = (program.axes, program.speeds);
        self.state.axes = axes;
        self.state.initialise();
        self.state.speeds = speeds;
        self.state.run = Some(Run {
            by_command,
            line: 0,
            began: self.state.now,
            loops: Vec::new(),
            until: None,
            remainder: None,
            stopping: None,
            paused: false,
        });
        self.signal_error(false);
        match self.watch_program_inputs() {
            Outcome::Nothing => self.next_line(),
            ended => ended,
        }
    }

    /// Goes on with a program that was stopped. If a host's command had begun or continued it, that
    /// command is taken up again, no matter what continues the program (12 5, code F): the host
    /// learns of its end, as it does with a stopped motion.
    pub(crate) fn resume(&mut self, by_command: bool) -> Outcome {
        let Some(run) = &mut self.state.run else { return Outcome::Nothing };
        run.paused = false;
        run.by_command |= by_command;
        let remainder = run.remainder.take();
        match (self.watch_program_inputs(), remainder) {
            (Outcome::Nothing, Some(plan)) if self.state.is_running() => {
                self.take_up(Purpose::Program, plan)
            }
            (Outcome::Nothing, _) => self.next_line(),
            (ended, _) => ended,
        }
    }

    /// The program halts and waits to be started again.
    pub(crate) fn pause(&mut self, by: By) {
        self.state.activity = Activity::Idle;
        let Some(run) = &mut self.state.run else { return };
        run.paused = true;
        run.stopping = None;
        if run.by_command {
            self.answer_stopped(Op::Start, by);
        } else {
            self.tell_cut_short(Purpose::Program, |c| c.pause_in_words(by), true);
        }
    }

    /// The program ends, with success or an error.
    pub(crate) fn end_run(&mut self, result: Result<(), Why>) {
        self.state.activity = Activity::Idle;
        let Some(run) = self.state.run.take() else { return };
        if let Err(why) = result {
            self.signal_error(true);
            if self.wants(Kinds::WARNING) {
                let code = char::from(why.reply().code());
                let (line, why) = (run.line + 1, self.in_words(why, None).into());
                self.emit(Event::Warning(Warning::ProgramError { code, line, why }));
            }
        }
        match result {
            _ if !run.by_command => {}
            Ok(()) => self.done(Mode::Direct, Op::Start),
            Err(why) => {
                let Answer(bytes) = why.reply().into();
                self.answer_why(bytes, |c| {
                    (c.mnemonic(Mode::Direct, Op::Start), c.in_words_of_program(why, run.line))
                });
            }
        }
    }

    /// `Ia`: the output shows its value on an error, and the opposite otherwise (12 4.2.12).
    fn signal_error(&mut self, error: bool) {
        let PortTest { port, mask, value } = self.state.settings.error_signal;
        if mask != 0 {
            self.write_port_bits(port, mask, if error { value } else { !value });
        }
    }

    // --- line by line ---

    /// Executes the line that comes next, now.
    pub(crate) fn next_line(&mut self) -> Outcome {
        let now = self.state.now;
        let Some(run) = &mut self.state.run else { return Outcome::Nothing };
        if let Some(by) = run.stopping {
            return Outcome::ProgramHalts(by);
        }
        run.began = now;
        let line = run.line;
        let command = self.state.flash.program.as_ref().and_then(|p| p.command(line)).cloned();
        let Some(command) = command else { return Outcome::ProgramEnds(Ok(())) };
        if self.wants(Kinds::COMMAND) {
            let mnemonic = self.mnemonic(Mode::Stored, command.op(Mode::Stored));
            self.emit(Event::Line { line: line + 1, mnemonic: mnemonic.into() });
        }
        self.line_finds(command.op(Mode::Stored));
        if let Err(why) = self.check_line(&command) {
            return Outcome::ProgramEnds(Err(why));
        }
        self.execute_program_line(line, command)
    }

    /// The reasons for which a direct command would have been refused.
    fn check_line(&self, command: &Command) -> Result<(), Why> {
        let moves = matches!(
            command,
            Command::RelativeMove(_)
                | Command::AbsoluteMove(_)
                | Command::Circle(_)
                | Command::Helix(..)
                | Command::Reference(_)
        );
        if moves {
            self.check_plant()?;
        } else if let Command::SetPort(write) = command {
            self.check_switching(*write)?;
        }
        self.check_command(command)
    }

    fn execute_program_line(&mut self, line: u32, command: Command) -> Outcome {
        match command {
            Command::RelativeMove(_)
            | Command::AbsoluteMove(_)
            | Command::Circle(_)
            | Command::Helix(..) => {
                self.warn_off_circle(&command);
                let mut plan = self.plan_of(&command);
                let until = self.state.run.as_mut().and_then(|run| run.until.take());
                plan.until = until.map(PortCondition::Bit);
                self.begin_plan(Purpose::Program, plan)
            }
            Command::Reference(axes) => self.begin_reference(Purpose::Program, axes),
            Command::Delay { tenths } => {
                let until = self.state.now.after_nanos(u64::from(tenths) * NANOS_PER_TENTH);
                self.wait(Wait::Delay, Some(until))
            }
            Command::Loop { count, offset } => self.repeat(line, count, offset),
            Command::Branch { offset: 0 } => self.wait(Wait::Forever, None),
            Command::Branch { offset } => self.jump(line, i64::from(offset)),
            Command::BranchIf { test, offset } => {
                let way = self.branch_way(offset);
                match self.is_met(PortCondition::Bit(test)) {
                    true if way == 0 => self.wait(Wait::Port, None),
                    true => self.jump(line, way),
                    false => self.line_ended(),
                }
            }
            Command::AwaitSync { .. } => {
                let _ = self.wait(Wait::Character, None);
                self.character_arrived()
            }
            Command::SendSync(character) => {
                self.send(Bytes::copy_from_slice(&[character]));
                self.line_ended()
            }
            Command::Until(test) => {
                if let Some(run) = &mut self.state.run {
                    run.until = Some(test);
                }
                self.line_ended()
            }
            other => {
                self.apply(&other);
                self.line_ended()
            }
        }
    }

    /// The present line is done; the one after it comes next.
    pub(crate) fn line_ended(&mut self) -> Outcome {
        let line = self.state.run.as_ref().map_or(0, |run| run.line);
        self.go_to(line + 1)
    }

    /// Jumps by an offset from `line`. A target outside the data field ends the program with
    /// `G`; the end mark itself is inside.
    fn jump(&mut self, line: u32, offset: i64) -> Outcome {
        let end = self.state.flash.program.as_ref().map_or(0, |program| program.len());
        match u32::try_from(i64::from(line) + offset).ok().filter(|target| *target <= end) {
            Some(target) => self.go_to(target),
            None => {
                let to = i64::from(line) + offset;
                let why = Why::Jump { to, other_base: self.other_base_leads_to(line, to, end) };
                Outcome::ProgramEnds(Err(why))
            }
        }
    }

    /// Whether a conditional branch at a line, whose target does not exist, would lead into the
    /// program if counted from the other line.
    fn other_base_leads_to(&self, line: u32, to: i64, end: u32) -> bool {
        let program = self.state.flash.program.as_ref();
        let command = program.and_then(|program| program.command(line));
        let step = if self.state.model.quirks.branches_from_next() { -1 } else { 1 };
        matches!(command, Some(Command::BranchIf { .. } | Command::AwaitSync { .. }))
            && (0..=i64::from(end)).contains(&(to + step))
    }

    /// The line `target` comes next, as soon as the time of the present one is over.
    fn go_to(&mut self, target: u32) -> Outcome {
        let line_nanos = self.state.model.timing.line_us.saturating_mul(1_000);
        let Some(run) = &mut self.state.run else { return Outcome::Nothing };
        run.line = target;
        let due = run.began.after_nanos(line_nanos);
        if due <= self.state.now { self.next_line() } else { self.wait(Wait::Line, Some(due)) }
    }

    fn repeat(&mut self, line: u32, count: u16, offset: i32) -> Outcome {
        let depth = self.state.model.limits.loop_depth;
        let extra = match self.state.model.quirks.loop_count {
            LoopCount::Total => u32::from(count) - 1,
            LoopCount::Extra => u32::from(count),
        };
        let Some(run) = &mut self.state.run else { return Outcome::Nothing };
        // Loops inside this one that a branch has left are over.
        let first = i64::from(line) + i64::from(offset);
        run.loops.retain(|open| !(first..i64::from(line)).contains(&i64::from(open.line)));
        let open = run.loops.iter().rposition(|open| open.line == line);
        if let Some(place) = open {
            run.loops.truncate(place + 1);
        }
        let left = match open {
            Some(place) => run.loops[place].left,
            None => extra,
        };
        if left == 0 {
            if open.is_some() {
                run.loops.pop();
            }
            return self.line_ended();
        }
        match open {
            Some(place) => run.loops[place].left = left - 1,
            None if run.loops.len() == depth => {
                return Outcome::ProgramEnds(Err(Why::LoopDepth));
            }
            None => run.loops.push(OpenLoop { line, left: left - 1 }),
        }
        self.jump(line, i64::from(offset))
    }

    /// The way of a conditional branch, counted from its own line.
    fn branch_way(&self, offset: i32) -> i64 {
        i64::from(offset) + i64::from(self.state.model.quirks.branches_from_next())
    }

    // --- waiting ---

    fn wait(&mut self, what: Wait, until: Option<Time>) -> Outcome {
        self.state.activity = Activity::Waiting { what, until };
        Outcome::Nothing
    }

    /// A character arrived for the line that waits for one: the oldest from 33 to 126 counts,
    /// others are dropped.
    pub(crate) fn character_arrived(&mut self) -> Outcome {
        let Some(line) = self.state.run.as_ref().map(|run| run.line) else {
            return Outcome::Nothing;
        };
        let program = self.state.flash.program.as_ref();
        let Some(&Command::AwaitSync { character, offset }) = program.and_then(|p| p.command(line))
        else {
            return Outcome::Nothing;
        };
        while let Some(byte) = self.state.receiver.waiting.pop_front() {
            if (33..=126).contains(&byte) {
                return match byte == character {
                    true => self.jump(line, self.branch_way(offset)),
                    false => self.line_ended(),
                };
            }
        }
        Outcome::Nothing
    }

    /// Inputs of a running program changed.
    pub(crate) fn program_inputs_changed(&mut self) -> Outcome {
        let ended = self.watch_program_inputs();
        self.poll_waiting_branch();
        ended
    }

    /// `IA`, `IH`, `IN`: inputs that end a running program when they differ from what they
    /// should be (12 4.2.11 to 4.2.14).
    fn watch_program_inputs(&mut self) -> Outcome {
        if !self.state.is_running() {
            return Outcome::Nothing;
        }
        let settings = &self.state.settings;
        let differs = |test: PortTest| {
            test.mask != 0 && self.read_port(test.port) & test.mask != test.value & test.mask
        };
        let (emergency, cover, abort) =
            (differs(settings.emergency), differs(settings.cover), differs(settings.abort));
        if emergency {
            self.struck(StopCause::EmergencyInput);
            self.halt_motors();
            self.end_run(Err(Why::EmergencyInput));
            self.for_no_command(Firmware::open_relay);
        } else if cover {
            let opened = Opened::Input;
            return self.end_program_motion(Ending::Cover(opened), Err(Why::Cover(opened)));
        } else if abort {
            return self.end_program_motion(Ending::Break(Breaker::Input), Ok(()));
        }
        Outcome::Nothing
    }

    /// Ends the program, along the ramp if it moves.
    fn end_program_motion(&mut self, ending: Ending, result: Result<(), Why>) -> Outcome {
        match &self.state.activity {
            Activity::Moving(_) => self.brake(ending),
            Activity::Referencing(_) => {
                self.halt(result.err().unwrap_or(Why::ReferenceBroken(Breaker::Input)))
            }
            _ => {
                self.struck_by(ending);
                if let Ending::Break(by) = ending {
                    self.tell_cut_short(Purpose::Program, |c| c.breaker_in_words(by), true);
                }
                Outcome::ProgramEnds(result)
            }
        }
    }

    /// A branch to itself checks its port once per line time. It sleeps while the port keeps it
    /// waiting, and wakes for its next check when the port has changed.
    fn poll_waiting_branch(&mut self) {
        let Activity::Waiting { what: Wait::Port, .. } = self.state.activity else { return };
        let Some(run) = &self.state.run else { return };
        let program = self.state.flash.program.as_ref();
        let Some(&Command::BranchIf { test, .. }) = program.and_then(|p| p.command(run.line))
        else {
            return;
        };
        let line_nanos = self.state.model.timing.line_us.saturating_mul(1_000);
        let looks = self.state.now.nanos_since(run.began) / line_nanos + 1;
        let until = match self.is_met(PortCondition::Bit(test)) {
            true => None,
            false => Some(run.began.after_nanos(looks.saturating_mul(line_nanos))),
        };
        self.state.activity = Activity::Waiting { what: Wait::Port, until };
    }
}
