//! What the controller answers.

use bytes::Bytes;
use vimc4_device::{Event, Kinds};
use vimc4_isel_wire::{Mode, Op, Reply};

use crate::activity::Purpose;
use crate::firmware::Firmware;
use crate::model::{ControlReply, LowerCase, StopReply};
use crate::state::Receiver;
use crate::why::{By, Why};

/// The bytes of an answer.
pub(crate) struct Answer(pub(crate) Bytes);

impl From<Reply> for Answer {
    fn from(reply: Reply) -> Answer {
        const CODES: &[u8] = b"0123456789DFGHR";
        let place = CODES.iter().position(|&code| code == reply.code()).unwrap_or(0);
        Answer(Bytes::from_static(&CODES[place..=place]))
    }
}

impl From<Vec<u8>> for Answer {
    fn from(bytes: Vec<u8>) -> Answer {
        Answer(bytes.into())
    }
}

impl Firmware {
    /// A command has been taken from the line.
    pub(crate) fn announce(&mut self, mnemonic: &'static str, text: &[u8]) {
        self.note_command(mnemonic, text);
        self.finds(mnemonic);
    }

    /// The same for a line that is no command of the model.
    pub(crate) fn note_command(&mut self, mnemonic: &'static str, text: &[u8]) {
        self.state.number_command();
        if self.wants(Kinds::COMMAND) {
            self.emit(Event::Command {
                mnemonic: mnemonic.into(),
                bytes: Bytes::copy_from_slice(text),
            });
        }
    }

    /// `0`: a command has been executed.
    pub(crate) fn done(&mut self, mode: Mode, op: Op) {
        self.answer_bytes(mode, op, Answer::from(Reply::Done).0);
    }

    pub(crate) fn answer_bytes(&mut self, mode: Mode, op: Op, bytes: Bytes) {
        if self.wants(Kinds::ANSWER) {
            let mnemonic = self.mnemonic(mode, op);
            self.emit(Event::Answer { mnemonic: mnemonic.into(), bytes: bytes.clone(), why: None });
        }
        self.send(bytes);
    }

    /// A command is refused, or ends before its time.
    pub(crate) fn refuse(&mut self, mode: Mode, op: Op, why: Why) {
        let Answer(bytes) = why.reply().into();
        self.answer_why(bytes, |c| (c.mnemonic(mode, op), c.in_words(why, None)));
    }

    /// The same because of what a line says.
    pub(crate) fn refuse_line(
        &mut self,
        mnemonic: &'static str,
        why: Why,
        line: &[u8],
        mode: Mode,
    ) {
        let Answer(bytes) = why.reply().into();
        self.answer_why(bytes, |c| (mnemonic, c.in_words(why, Some((line, mode)))));
    }

    /// An answer with its mnemonic and its reason, which is put into words only if events are
    /// watched.
    pub(crate) fn answer_why(
        &mut self,
        bytes: Bytes,
        why: impl FnOnce(&Self) -> (&'static str, String),
    ) {
        if self.wants(Kinds::ANSWER) {
            let (mnemonic, why) = why(self);
            let why = Some(why.into());
            self.emit(Event::Answer { mnemonic: mnemonic.into(), bytes: bytes.clone(), why });
        }
        self.send(bytes);
    }

    /// The answer of this model to a control byte that ends no command.
    pub(crate) fn answer_control(&mut self, control: &'static str, reply: ControlReply) {
        if reply == ControlReply::Done {
            let Answer(bytes) = Reply::Done.into();
            if self.wants(Kinds::ANSWER) {
                self.emit(Event::Answer {
                    mnemonic: control.into(),
                    bytes: bytes.clone(),
                    why: None,
                });
            }
            self.send(bytes);
        }
    }

    pub(crate) fn answer_stopped(&mut self, op: Op, by: By) {
        let Answer(bytes) = match self.state.model.quirks.stop_reply {
            StopReply::F => Reply::Stopped.into(),
            StopReply::F0 => vec![Reply::Stopped.code(), Reply::Done.code()].into(),
        };
        let why = Why::Stopped(by);
        self.answer_why(bytes, |c| (c.mnemonic(Mode::Direct, op), c.in_words(why, None)));
    }

    /// An early end of a motion is reported although the motion has been answered.
    pub(crate) fn tells_late_errors(&self) -> bool {
        self.state.model.quirks.lower_case == LowerCase::BeforeAndError
    }

    pub(crate) fn mnemonic(&self, mode: Mode, op: Op) -> &'static str {
        self.state.model.mnemonic(mode, op)
    }

    // --- ends without an answer ---

    /// Something ends before its time, and no error says so.
    pub(crate) fn tell_cut_short(
        &mut self,
        job: Purpose,
        by: impl FnOnce(&Self) -> String,
        answered: bool,
    ) {
        if !self.wants(Kinds::ANSWER) {
            return;
        }
        let run = self.state.run.as_ref().filter(|_| job == Purpose::Program);
        let (op, place) = match job {
            Purpose::Command(op) | Purpose::Answered(op) => (op, String::new()),
            Purpose::SelfTest => (Op::SelfTest, String::new()),
            Purpose::Program => {
                let line = run.map_or(0, |run| run.line) + 1;
                (Op::Start, format!("in line {line} of the program, "))
            }
        };
        let awaited = matches!(job, Purpose::Command(_)) || run.is_some_and(|run| run.by_command);
        let silence = if awaited && !answered { ", without an answer" } else { "" };
        let Receiver { waiting, line } = &self.state.receiver;
        let lost = match line.begun().len() + waiting.len() {
            _ if answered => String::new(),
            0 => String::new(),
            1 => "; 1 character that waited is lost".to_owned(),
            many => format!("; {many} characters that waited are lost"),
        };
        let why = format!("{place}by {}{silence}{lost}", by(self)).into();
        let mnemonic = self.mnemonic(Mode::Direct, op).into();
        self.emit(Event::CutShort { mnemonic, why });
    }

    /// A new motion drops what is left of a motion or a program that was stopped.
    pub(crate) fn drop_stopped(&mut self) {
        if self.state.run.is_some() {
            let by = |_: &Firmware| "a motion of the host: the rest of it is dropped".to_owned();
            self.for_no_command(|c| c.tell_cut_short(Purpose::Program, by, true));
        }
        self.state.forget_stopped_motion();
    }

    /// Reports what a reset or the loss of power ends without an answer.
    pub(crate) fn tell_unanswered(&mut self, by: &'static str) {
        if let Some(job) = self.under_way() {
            return self.tell_cut_short(job, |_| by.to_owned(), false);
        }
        let half = self.state.receiver.line.begun();
        if !half.trim_ascii().is_empty() && self.wants(Kinds::ANSWER) {
            let why = format!("by {by}: the half line {} is lost", half.escape_ascii()).into();
            self.for_no_command(|c| c.emit(Event::CutShort { mnemonic: "?".into(), why }));
        }
    }
}
