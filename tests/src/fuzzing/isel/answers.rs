//! What a controller may say, and when.

use std::borrow::Cow;
use std::collections::BTreeSet;

use vimc4_device::{Activity, CommandNumber, Device, Event, Stamp, Warning};
use vimc4_isel::{ControlReply, Controller, LoneEnd, LowerCase};
use vimc4_isel_wire::{CommandSpec, Dialect, Mode, Reply, table};

use crate::fuzzing::motions::Motions;
use crate::fuzzing::twins;

/// The byte that resets a controller.
const RESET: u8 = 254;

/// The longest text answer.
const TEXT_MAX: usize = 512;

/// Replies that the tables should list and do not: erasing that an emergency stop ends.
const UNLISTED: [(&str, Reply); 1] = [("@k", Reply::Plant)];

/// Follows what a watched controller says and holds it against the tables.
#[derive(Clone, Debug)]
pub(in crate::fuzzing) struct Conversation {
    dialect: Dialect,
    /// The command that is being executed.
    pending: Option<&'static str>,
    /// The number of the command that comes next, and those that were answered.
    next: CommandNumber,
    answered: BTreeSet<CommandNumber>,
    /// An answer that was announced and must be the next bytes.
    announced: Option<Vec<u8>>,
    /// A line of a program sends a character: it must be the next byte.
    character: bool,
    /// The flash memory has changed since the last command.
    flashed: bool,
    motions: Motions,
    /// What ends a motion early is told although it was answered before.
    late_errors: bool,
    /// 254 and 255 are answered at rest, too.
    controls_answer: bool,
    /// A `9` without a data field is answered `0`, too.
    ends_without_field: bool,
    /// Bytes that were no answer to anything.
    unasked: usize,
    /// The self-test was at work.
    tests_itself: bool,
}

impl twins::Conversation<Controller> for Conversation {
    fn new(controller: &Controller) -> Conversation {
        let model = controller.model();
        Conversation {
            dialect: model.command_set.dialect(),
            late_errors: model.quirks.lower_case == LowerCase::BeforeAndError,
            controls_answer: model.quirks.reset_reply == ControlReply::Done
                && model.quirks.break_reply == ControlReply::Done,
            ends_without_field: model.quirks.lone_end == LoneEnd::Done,
            pending: None,
            next: CommandNumber::FIRST,
            answered: BTreeSet::new(),
            announced: None,
            character: false,
            flashed: false,
            motions: Motions::default(),
            unasked: 0,
            tests_itself: false,
        }
    }

    fn received(&mut self, byte: u8) {
        if byte == RESET {
            twins::Conversation::reset(self);
        }
    }

    fn reset(&mut self) {
        assert!(self.announced.is_none() && !self.character, "announced and not sent");
        self.pending = None;
        self.tests_itself = false;
    }

    fn flash(&mut self) {
        self.flashed = true;
    }

    fn event(&mut self, stamp: Stamp, event: &Event) {
        let number = stamp.command;
        match event {
            Event::Command { mnemonic: Cow::Borrowed(mnemonic), .. } => {
                if let Some(pending) = self.pending {
                    unreachable!("{mnemonic} is executed, but {pending} is not answered");
                }
                assert!(*mnemonic == "?" || self.spec(mnemonic).is_some(), "no command {mnemonic}");
                assert_eq!(number, Some(self.next), "{mnemonic} has another's number");
                self.next = self.next.next();
                self.pending = Some(mnemonic);
                self.flashed = false;
            }
            Event::Line { mnemonic: Cow::Borrowed(mnemonic), .. } => {
                assert!(self.spec(mnemonic).is_some(), "no command {mnemonic}");
                self.character = *mnemonic == "1";
            }
            Event::Answer { mnemonic: Cow::Borrowed("254" | "255"), bytes, .. } => {
                assert!(self.controls_answer && bytes == &b"0"[..], "a control byte is answered");
                self.announced = Some(bytes.to_vec());
            }
            Event::Answer { mnemonic: Cow::Borrowed(mnemonic), bytes, why } => {
                let pending = self.pending.take();
                // What START goes on with belongs to no command and is answered like an `S`.
                let resumed = number.is_none() && *mnemonic == "@S";
                let late = pending.is_none() && bytes != &b"0"[..] && self.late_errors;
                assert!(resumed || late || pending == Some(*mnemonic), "{mnemonic} was not asked");
                if let Some(number) = number {
                    assert!(number < self.next, "{mnemonic} is answered before it came");
                    assert!(self.answered.insert(number) || late, "{mnemonic} is answered twice");
                }
                let is_error =
                    matches!(**bytes, [b'F', ..] | [b'1'..=b'9' | b'D' | b'G' | b'H' | b'R']);
                assert_eq!(why.is_some(), is_error, "an error says why");
                self.check_answer(mnemonic, bytes);
                self.announced = Some(bytes.to_vec());
            }
            Event::Motion(motion) => self.motions.follow(number, motion),
            Event::Ignored { .. } | Event::Warning(Warning::ReceiveOverflow { .. }) => {
                assert_eq!(number, None)
            }
            _ => {}
        }
    }

    /// Bytes on the line are the answer that was announced, or the character that a line of a
    /// program sends; who else sends something is counted.
    fn sent(&mut self, bytes: &[u8]) {
        if let Some(announced) = self.announced.take() {
            assert_eq!(bytes, announced, "sends something else than it announced");
        } else if self.character {
            assert!(matches!(bytes, [33..=126]), "{bytes:?} is not a character");
            self.character = false;
        } else {
            // The self-test is the one command that talks instead of answering.
            self.unasked += bytes.len();
            self.pending = self.pending.filter(|pending| *pending != "@?");
        }
    }

    fn drained(&mut self, controller: &Controller) {
        if std::mem::take(&mut self.unasked) > 0 {
            // The characters of a self-test come also when it ends in a reset.
            let activity = controller.activity();
            let tests_itself = matches!(activity, Activity::SelfTest | Activity::Echo);
            assert!(tests_itself || self.tests_itself, "{activity}: talks unasked");
            self.tests_itself = tests_itself;
        }
    }
}

impl Conversation {
    fn check_answer(&self, mnemonic: &'static str, bytes: &[u8]) {
        let reply = bytes.first().copied().and_then(Reply::from_code);
        let hex = |digits: &[u8]| digits.iter().all(|d| matches!(d, b'0'..=b'9' | b'A'..=b'F'));
        let well_formed = match (mnemonic, bytes) {
            (_, [_]) => {
                let reply = reply.unwrap_or_else(|| unreachable!("{mnemonic} answers {bytes:?}"));
                match self.spec(mnemonic) {
                    Some(spec) => {
                        spec.replies.contains(&reply) || UNLISTED.contains(&(mnemonic, reply))
                    }
                    None => matches!(reply, Reply::Syntax | Reply::NotStorable),
                }
            }
            ("@P", [b'0', digits @ ..]) => matches!(digits.len(), 6 | 12 | 18 | 24) && hex(digits),
            ("@b" | "@D", [b'0', digits @ ..]) => digits.len() == 2 && hex(digits),
            ("@V" | "@U" | "@H" | "@h", text) => {
                text.len() <= TEXT_MAX && (text.starts_with(b"0") || text.ends_with(b"0"))
            }
            (_, b"F0") => self.spec(mnemonic).is_some_and(|s| s.replies.contains(&Reply::Stopped)),
            _ => false,
        };
        assert!(well_formed, "{mnemonic} answers {}", bytes.escape_ascii());
        // What is answered `0` is in the flash memory.
        let keeps = match mnemonic {
            "9" => !self.ends_without_field,
            "@i" | "@k" | "@IW" => true,
            _ => !mnemonic.starts_with('@'),
        };
        assert!(self.flashed || !keeps || bytes != b"0", "{mnemonic} confirms what is not kept");
    }

    fn spec(&self, mnemonic: &str) -> Option<&'static CommandSpec> {
        let mode = if mnemonic.starts_with('@') { Mode::Direct } else { Mode::Stored };
        table(self.dialect, mode).iter().find(|spec| spec.mnemonic == mnemonic)
    }
}
