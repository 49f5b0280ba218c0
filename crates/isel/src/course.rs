//! What commands find and what stops them, for coverage. The firmware does not depend on it.

use vimc4_device::{Activity as Doing, Course, Event, Kinds, Situation, StopCause};
use vimc4_isel_wire::{Mode, Op};

use crate::activity::{Activity, Ending, Purpose, Wait};
use crate::firmware::Firmware;
use crate::why::{Breaker, By, Off, Opened, Why};

impl Firmware {
    /// A command is taken from the line.
    pub(crate) fn finds(&mut self, mnemonic: &'static str) {
        if self.wants(Kinds::COURSE) {
            let situation = match self.state.doing() {
                Doing::Idle if self.state.remainder.is_some() => Situation::StoppedMotion,
                doing => Situation::Doing(doing),
            };
            self.emit(Event::Course(Course::Finds { mnemonic: mnemonic.into(), situation }));
        }
    }

    /// A line of a program is executed.
    pub(crate) fn line_finds(&mut self, op: Op) {
        if self.wants(Kinds::COURSE) {
            let mnemonic = self.state.model.mnemonic(Mode::Stored, op);
            let situation = self.in_program(Doing::ProgramLine);
            self.emit(Event::Course(Course::Finds { mnemonic: mnemonic.into(), situation }));
        }
    }

    /// Something strikes what is under way, which it still is.
    pub(crate) fn struck(&mut self, cause: StopCause) {
        if self.wants(Kinds::COURSE)
            && let Some(job) = self.under_way()
        {
            self.job_struck(job, cause, self.state.doing());
        }
    }

    /// The same by a way in which a motion can end.
    pub(crate) fn struck_by(&mut self, ending: Ending) {
        if let Some(cause) = ending.cause() {
            self.struck(cause);
        }
    }

    /// Something strikes a job that was doing this.
    pub(crate) fn job_struck(&mut self, job: Purpose, cause: StopCause, doing: Doing) {
        if self.wants(Kinds::COURSE) {
            let (op, situation) = match job {
                Purpose::Command(op) | Purpose::Answered(op) => (op, Situation::Doing(doing)),
                Purpose::SelfTest => (Op::SelfTest, Situation::Doing(doing)),
                Purpose::Program => (Op::Start, self.in_program(doing)),
            };
            let mnemonic = self.state.model.mnemonic(Mode::Direct, op).into();
            self.emit(Event::Course(Course::Stops { mnemonic, cause, situation }));
        }
    }

    /// What is under way, for which a command of the host is answered, or a program.
    pub(crate) fn under_way(&self) -> Option<Purpose> {
        match &self.state.activity {
            Activity::Moving(moving) => Some(moving.job),
            Activity::Referencing(run) => Some(run.job),
            Activity::Waiting { what: Wait::Erase, .. } => Some(Purpose::Command(Op::Erase)),
            _ => self.state.is_running().then_some(Purpose::Program),
        }
    }

    fn in_program(&self, doing: Doing) -> Situation {
        match &self.state.run {
            Some(run) if !run.loops.is_empty() => Situation::Looping(doing),
            _ => Situation::Doing(doing),
        }
    }
}

impl By {
    pub(crate) fn cause(self) -> StopCause {
        match self {
            By::Line => StopCause::StopByte,
            By::Button | By::ButtonHeld => StopCause::StopButton,
        }
    }
}

impl Breaker {
    fn cause(self) -> StopCause {
        match self {
            Breaker::Line => StopCause::BreakByte,
            Breaker::Input => StopCause::AbortInput,
            Breaker::Stop(by) => by.cause(),
        }
    }
}

impl Opened {
    fn cause(self) -> StopCause {
        match self {
            Opened::Input => StopCause::CoverInput,
            Opened::Already | Opened::Now | Opened::Key => StopCause::Cover,
        }
    }
}

impl Ending {
    /// What brings it about, unless a motion ends so in any case.
    pub(crate) fn cause(self) -> Option<StopCause> {
        match self {
            Ending::Complete | Ending::Event => None,
            Ending::Stop(by) => Some(by.cause()),
            Ending::Break(breaker) => Some(breaker.cause()),
            Ending::Cover(opened) => Some(opened.cause()),
        }
    }
}

impl Why {
    /// What halts something under way, if this is why it halts.
    pub(crate) fn cause(self) -> Option<StopCause> {
        Some(match self {
            Why::Stages(Off::EmergencyStop) => StopCause::EmergencyStop,
            Why::Stages(Off::Supply) => StopCause::Supply,
            Why::Stages(Off::Heat) => StopCause::Overtemperature,
            Why::Stages(Off::Relay | Off::Switched) => StopCause::StagesOff,
            Why::Cover(opened) => opened.cause(),
            Why::ReferenceBroken(breaker) => breaker.cause(),
            _ => return None,
        })
    }
}
