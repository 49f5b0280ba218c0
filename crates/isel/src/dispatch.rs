//! The life of a command: what happens to a line, and all that follows from it.
//!
//! A line is read, admitted and executed. An activity that takes time (a motion, a reference run, a
//! wait, a program) ends or is ended, and has an [`Outcome`]. Only this module decides what
//! follows: an answer, the next line of the program, the end of the program.

use bytes::Bytes;
use vimc4_device::{Event, Kinds};
use vimc4_isel_wire::{Addressed, Command, Mode, Op, parse};

use crate::activity::{Activity, Plan, Purpose, Wait};
use crate::firmware::Firmware;
use crate::outcome::Outcome;
use crate::why::{By, Why};

impl Firmware {
    // --- a line ---

    /// Executes a line from the serial line.
    pub(crate) fn execute_line(&mut self, text: &[u8]) {
        if self.state.storing {
            self.store_line(text);
            return;
        }
        let dialect = self.state.model.command_set.dialect();
        if self.is_lone_end(text) {
            return self.lone_end(text);
        }
        let capital = self.capital(text);
        let line = self.small_d(capital.as_deref().unwrap_or(text));
        let line = line.as_ref();
        match parse(line, dialect, Mode::Direct, self.state.device) {
            Ok(Addressed::OtherDevice) => self.pass_over(text),
            Err(fault) => {
                self.announce("?", text);
                self.refuse_line("?", fault.into(), line, Mode::Direct);
            }
            Ok(Addressed::Frame(frame)) => {
                let op = frame.op();
                self.announce(frame.spec().mnemonic, text);
                match self.admit(&frame) {
                    Ok(command) if capital.is_some() => {
                        self.done(Mode::Direct, op);
                        self.execute(op, command, Purpose::Answered(op));
                    }
                    Ok(command) => self.execute(op, command, Purpose::Command(op)),
                    Err(why) => {
                        self.refuse_line(frame.spec().mnemonic, why, line, Mode::Direct);
                    }
                }
            }
        }
    }

    /// Answers a line that is longer than any command.
    pub(crate) fn refuse_long_line(&mut self, beginning: &[u8]) {
        self.announce("?", &[beginning, b"..."].concat());
        if self.state.storing {
            self.invalidate_program();
        }
        self.refuse_line("?", Why::TooLong, b"", Mode::Direct);
    }

    /// A line was for another controller.
    fn pass_over(&mut self, text: &[u8]) {
        if self.wants(Kinds::COMMAND) {
            let number = text.iter().skip(1).find(|byte| **byte != b' ');
            let number = char::from(number.copied().unwrap_or(b'?'));
            let why = format!("for controller {number}, this one is {}", self.state.device);
            let bytes = Bytes::copy_from_slice(text);
            self.emit(Event::Ignored { bytes, why: why.into() });
        }
    }

    /// Begins what a command says, or does it at once. A motion runs for `job`.
    fn execute(&mut self, op: Op, command: Command, job: Purpose) {
        let outcome = match command {
            Command::RelativeMove(_)
            | Command::AbsoluteMove(_)
            | Command::Circle(_)
            | Command::Helix(..)
            | Command::MoveUntil { .. } => {
                self.drop_stopped();
                self.warn_off_circle(&command);
                let plan = self.plan_of(&command);
                self.begin_plan(job, plan)
            }
            Command::Reference(axes) => {
                self.drop_stopped();
                self.begin_reference(job, axes)
            }
            Command::Free(axes) => {
                self.drop_stopped();
                self.begin_free(job, axes)
            }
            Command::SelfTest => {
                self.drop_stopped();
                self.begin_self_test()
            }
            Command::Start => self.start_command(job),
            at_once => {
                self.perform(op, at_once);
                Outcome::Nothing
            }
        };
        self.follow(outcome);
    }

    // --- the end of an activity ---

    /// The time of the running activity is over.
    pub(crate) fn activity_ended(&mut self) {
        let outcome = match self.state.activity {
            Activity::Moving(_) => self.segment_ended(),
            Activity::Referencing(_) => self.reference_phase_ended(),
            Activity::Waiting { what, .. } => self.wait_ended(what),
            Activity::Idle | Activity::Echo => Outcome::Nothing,
        };
        self.follow(outcome);
    }

    fn wait_ended(&mut self, what: Wait) -> Outcome {
        self.state.activity = Activity::Idle;
        match what {
            Wait::Boot => {}
            Wait::PowerUp => return self.powered_up(),
            Wait::Erase => {
                self.erase_program();
                self.done(Mode::Direct, Op::Erase);
            }
            Wait::PanelErase => self.erase_program(),
            Wait::Delay => return self.line_ended(),
            Wait::Line | Wait::Port | Wait::Character | Wait::Forever => return self.next_line(),
        }
        Outcome::Nothing
    }

    /// Does what follows, until something takes time again or everything is done.
    pub(crate) fn follow(&mut self, mut outcome: Outcome) {
        loop {
            outcome = match outcome {
                Outcome::Nothing => return self.state.command_ended(),
                Outcome::Finished(job, result) => self.finished(job, result),
                Outcome::Stopped(job, plan, by) => self.stopped(job, plan, by),
                Outcome::ProgramHalts(by) => {
                    self.pause(by);
                    Outcome::Nothing
                }
                Outcome::ProgramEnds(result) => {
                    self.end_run(result);
                    Outcome::Nothing
                }
            }
        }
    }

    /// A job has ended, with success or an error.
    fn finished(&mut self, job: Purpose, result: Result<(), Why>) -> Outcome {
        self.state.activity = Activity::Idle;
        match (job, result) {
            (Purpose::Command(op), Ok(())) => self.done(Mode::Direct, op),
            (Purpose::Command(op), Err(why)) => self.refuse(Mode::Direct, op, why),
            (Purpose::Answered(op), Err(why)) if self.tells_late_errors() => {
                self.refuse(Mode::Direct, op, why);
            }
            (Purpose::Answered(_), _) => {}
            (Purpose::Program, Ok(())) => return self.line_ended(),
            (Purpose::Program, Err(why)) => return Outcome::ProgramEnds(Err(why)),
            (Purpose::SelfTest, _) => self.self_test_ended(),
        }
        Outcome::Nothing
    }

    /// The motion stopped with something left of it.
    fn stopped(&mut self, job: Purpose, plan: Plan, by: By) -> Outcome {
        match job {
            Purpose::Command(op) => {
                self.state.remainder = Some(plan);
                self.answer_stopped(op, by);
            }
            Purpose::Answered(op) => {
                self.state.remainder = Some(plan);
                if self.tells_late_errors() {
                    self.answer_stopped(op, by);
                }
            }
            Purpose::Program => {
                if let Some(run) = &mut self.state.run {
                    run.remainder = Some(plan);
                }
                return Outcome::ProgramHalts(by);
            }
            Purpose::SelfTest => self.self_test_ended(),
        }
        Outcome::Nothing
    }
}
