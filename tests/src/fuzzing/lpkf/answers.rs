//! What a controller may say, and when.

use std::borrow::Cow;
use std::collections::BTreeMap;

use vimc4_device::{CommandNumber, Event, Stamp};
use vimc4_lpkf::language::{Answer, Dialect, Form, Status, forms};
use vimc4_lpkf::{Controller, InitReply, StatusDigits};

use crate::fuzzing::motions::Motions;
use crate::fuzzing::twins;

/// What goes on with a command that was broken off: what it answers is that command's answer.
const GOING_ON: [&str; 2] = ["!CS", "!RC"];

/// Follows what a watched controller says and holds it against the tables.
#[derive(Clone, Debug)]
pub(in crate::fuzzing) struct Conversation {
    dialect: Dialect,
    decimal: bool,
    init_reply: InitReply,
    /// The command that was taken last, until it is answered.
    latest: Option<Open>,
    /// The one that executes, if others that bypass it have been taken since.
    running: Option<Open>,
    /// What has begun under each number: a command, and what `!RP` repeats has the number of that.
    begun: BTreeMap<CommandNumber, Vec<&'static str>>,
    /// An answer that was announced and must be the next bytes.
    announced: Option<Vec<u8>>,
    motions: Motions,
}

/// A command that may still be answered.
#[derive(Clone, Copy, Debug)]
struct Open {
    mnemonic: &'static str,
    /// It has sent its data.
    data: bool,
}

impl twins::Conversation<Controller> for Conversation {
    fn new(controller: &Controller) -> Conversation {
        let model = controller.model();
        Conversation {
            dialect: model.command_set,
            decimal: model.quirks.status_digits == StatusDigits::Decimal,
            init_reply: model.quirks.init_reply,
            latest: None,
            running: None,
            begun: BTreeMap::new(),
            announced: None,
            motions: Motions::default(),
        }
    }

    fn reset(&mut self) {
        assert!(self.announced.is_none(), "announced and not sent");
        (self.latest, self.running) = (None, None);
    }

    fn event(&mut self, stamp: Stamp, event: &Event) {
        assert!(self.announced.is_none(), "{event:?} before what was announced is sent");
        match event {
            Event::Command { mnemonic: Cow::Borrowed(mnemonic), .. } => {
                assert!(*mnemonic == "?" || self.form(mnemonic).is_some(), "no command {mnemonic}");
                let before = self.latest.replace(Open { mnemonic, data: false });
                if let Some(before) = before.filter(|open| self.takes_turns(open.mnemonic)) {
                    self.running = Some(before);
                }
                let number = stamp.command.unwrap_or_else(|| unreachable!("{mnemonic} has none"));
                let before = self.begun.entry(number).or_default();
                assert!(before.last().is_none_or(|last| *last == "!RP"), "{number} came twice");
                before.push(mnemonic);
            }
            Event::Answer { mnemonic: Cow::Borrowed(mnemonic), bytes, why } => {
                assert_eq!(why.is_some(), bytes.starts_with(b"E"), "an error says why");
                match stamp.command {
                    Some(number) => {
                        let by = self.begun.get(&number).map_or(&[][..], Vec::as_slice);
                        // What was broken off is answered by what goes on with it.
                        let answers = |by: &&str| by == mnemonic || GOING_ON.contains(by);
                        assert!(by.iter().any(answers), "{by:?} answers as {mnemonic}");
                    }
                    None => assert_eq!(*mnemonic, "", "nobody asked"),
                }
                self.check_answer(mnemonic, bytes);
                self.announced = Some(bytes.to_vec());
            }
            Event::Motion(motion) => self.motions.follow(stamp.command, motion),
            _ => {}
        }
    }

    /// Bytes on the line are the answer that was announced, or the trackball's or the spindle
    /// unit's, which nobody announces.
    fn sent(&mut self, bytes: &[u8]) {
        if let Some(announced) = self.announced.take() {
            return assert_eq!(bytes, announced, "sends something else than it announced");
        }
        let unannounced = match bytes {
            [digit, b'\r'] => b"01289".contains(digit),
            [b'A', place @ .., b'\r'] => count(place) == Some(1),
            [b'B', ways @ .., b'\r'] => count(ways) == Some(2),
            _ => false,
        };
        assert!(unannounced, "talks unasked: {}", bytes.escape_ascii());
    }
}

impl Conversation {
    fn form(&self, mnemonic: &str) -> Option<&'static Form> {
        let mut known = forms().iter().filter(|form| form.known_to(self.dialect));
        known.find(|form| form.mnemonic == mnemonic)
    }

    /// Whether a command executes only when the one before it is done, and so is not answered
    /// any more once the next of its kind has been taken. The others are answered at once, if
    /// they are.
    fn takes_turns(&self, mnemonic: &str) -> bool {
        self.form(mnemonic).is_some_and(|form| {
            !form.direct && matches!(form.answer, Answer::Done | Answer::HardClip)
        })
    }

    fn check_answer(&mut self, mnemonic: &'static str, bytes: &[u8]) {
        let text = bytes.escape_ascii();
        let status = Status::ALL.iter().find(|status| {
            let written = status.written(self.dialect, self.decimal);
            written.is_some_and(|written| bytes.strip_suffix(b"\r") == Some(written.as_bytes()))
        });
        if mnemonic.is_empty() {
            return assert!(status.is_some(), "says {text} unasked");
        }
        let asked = |open: &mut Option<Open>| {
            open.is_some_and(|open| open.mnemonic == mnemonic || GOING_ON.contains(&open.mnemonic))
        };
        let slot = [&mut self.latest, &mut self.running]
            .into_iter()
            .find_map(|slot| if asked(slot) { Some(slot) } else { None });
        let Some(slot) = slot else { unreachable!("{mnemonic} was not asked: {text}") };
        let Some(open) = slot else { return };
        let (answer, sent_data) = (answer_of(mnemonic), open.data);
        if let Some(letter) = answer.letter().filter(|letter| bytes[0] == *letter as u8) {
            assert!(!sent_data, "{mnemonic} answers twice");
            open.data = true;
            assert!(is_data(letter, bytes, self.dialect), "{mnemonic} answers {text}");
            return;
        }
        *slot = None;
        match bytes {
            b"C\r" => {
                assert!(answer != Answer::Silence && mnemonic != "?", "{mnemonic} answers C");
                assert_eq!(answer.letter().is_some(), sent_data, "{mnemonic} answers C");
                let zed = mnemonic == "IN" && self.init_reply == InitReply::Z;
                assert!(!zed, "IN answers C");
            }
            b"Z" => {
                assert!(mnemonic == "IN" && self.init_reply == InitReply::Z, "{mnemonic}: Z");
            }
            _ => {
                assert!(status.is_some(), "{mnemonic} answers {text}");
                assert!(!sent_data, "{mnemonic} fails after its data");
            }
        }
    }
}

/// What a command sends when it has succeeded.
fn answer_of(mnemonic: &str) -> Answer {
    let form = forms().iter().find(|form| form.mnemonic == mnemonic);
    form.map_or(Answer::Done, |form| form.answer)
}

/// Whether a line has the form of the data with this letter.
fn is_data(letter: char, line: &[u8], dialect: Dialect) -> bool {
    let Some(fields) = line.get(1..).and_then(|rest| rest.strip_suffix(b"\r")) else {
        return false;
    };
    let axes = if dialect == Dialect::Smcu { 3 } else { 6 };
    match letter {
        // A quirk puts a blank behind the letter, another answers as many as the other model.
        'W' => {
            let values = count(fields.strip_prefix(b" ").unwrap_or(fields));
            values.is_some_and(|n| matches!(n, 1 | 3 | 6))
        }
        // A quirk writes them in hexadecimal digits.
        'S' => {
            let hexadecimal = fields.split(|&byte| byte == b',').all(|number| {
                (1..=8).contains(&number.len()) && number.iter().all(u8::is_ascii_hexdigit)
            });
            hexadecimal && fields.iter().filter(|&&byte| byte == b',').count() == 2
        }
        'R' => fields.len() == 4 && count(fields) == Some(1),
        _ => count(fields).is_some_and(|n| n == 1 || n == axes),
    }
}

/// How many numbers of 32 bits these are, with commas between them.
fn count(fields: &[u8]) -> Option<usize> {
    let fields = std::str::from_utf8(fields).ok()?;
    let numbers: Result<Vec<i32>, _> = fields.split(',').map(str::parse).collect();
    numbers.ok().map(|numbers| numbers.len())
}
