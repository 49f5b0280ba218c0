//! Plays a session against a device, in the model's own time.

use std::borrow::Cow;
use std::collections::{BTreeSet, VecDeque};
use std::fmt::{self, Write as _};

use vimc4_catalogue::Family;
use vimc4_device::{
    Course, Deed, Device, Event, Faulting, FlashChange, Harness, Input, Kinds, MAX_CAUSES, Motion,
    Names, Output, OwnedInput, Ruling, Time, View, show_nanos,
};
use vimc4_language::{read_faulting, read_ruling};

use crate::format::Session;
use crate::script::{Action, Expected, Step, escape};
use crate::travel::Travel;

/// How long a session may take, in the model's time: a week.
const LONGEST: u64 = 7 * 24 * 3600 * 1_000_000_000;

/// How a device is driven. The contract of [`Device`] allows both, so both must give the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// Every line in one piece, every wake-up when it is due, everything watched.
    Smooth,
    /// Byte by byte, with needless wake-ups, the state saved and restored between the actions,
    /// watching warnings only.
    Rough,
}

/// What was seen while a session ran.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Record {
    /// Commands that were executed.
    pub commands: BTreeSet<Cow<'static, str>>,
    /// Commands that were answered: mnemonic and kind of the answer, as
    /// [`Family::kind_of`](vimc4_catalogue::Family::kind_of) names it.
    pub answers: BTreeSet<(Cow<'static, str>, String)>,
    /// Errors that were answered: mnemonic, kind as above, and why, as the controller says.
    pub errors: BTreeSet<(Cow<'static, str>, String, String)>,
    /// Everything that was said for people: reasons, warnings, news.
    pub messages: BTreeSet<String>,
    /// Lines of stored programs that were executed.
    pub lines: BTreeSet<Cow<'static, str>>,
    /// Signals that were set, by name.
    pub signals: BTreeSet<String>,
    /// What commands found, and what stopped them, in order.
    pub courses: Vec<Course>,
    /// Something moved.
    pub moved: bool,
    /// The flash memory was written.
    pub wrote_flash: bool,
    /// An output was switched.
    pub switched: bool,
}

/// What an event says for people.
fn message_of(event: &Event) -> Option<String> {
    match event {
        Event::Ignored { why, .. } | Event::CutShort { why, .. } => Some(why.to_string()),
        Event::Answer { why, .. } => why.as_ref().map(ToString::to_string),
        Event::Warning(warning) => Some(warning.to_string()),
        Event::Flash { what } => Some(what.to_string()),
        Event::Fault { news, .. } => Some(news.to_string()),
        Event::Rule { news, .. } => Some(news.to_string()),
        _ => None,
    }
}

/// A look at a session after one of its steps.
#[derive(Debug)]
pub struct Glance<'a, D> {
    /// The number of the step.
    pub step: usize,
    /// When it began.
    pub began: Time,
    /// When it was done.
    pub ended: Time,
    /// The device after it.
    pub device: &'a D,
    /// What the device has sent meanwhile, byte by byte.
    pub heard: &'a [(Time, u8)],
    /// Why an error was answered meanwhile, in the words of the log.
    pub why: Option<&'a str>,
    /// How far the axes have gone since the controller was new.
    pub travel: &'a Travel,
    /// The flash memory has been written since the controller was new.
    pub wrote_flash: bool,
}

/// A session that did not go as it is written.
#[derive(Clone, Debug, thiserror::Error)]
pub struct Failure {
    id: String,
    path: String,
    title: String,
    /// The script around the place, with a mark on it.
    excerpt: String,
    expected: String,
    got: String,
    now: Time,
    since: u64,
}

impl Failure {
    /// What should have come or been.
    #[must_use]
    pub fn expected(&self) -> &str {
        &self.expected
    }

    /// What came or was instead.
    #[must_use]
    pub fn got(&self) -> &str {
        &self.got
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} in {}", self.id, self.path)?;
        writeln!(f, "  {}\n\n{}", self.title, self.excerpt)?;
        writeln!(f, "  expected  {}", self.expected)?;
        writeln!(f, "  got       {}", self.got)?;
        write!(
            f,
            "  at        {} on the stopwatch, model time {}",
            show_nanos(self.since),
            self.now
        )
    }
}

/// Plays a session on devices that `build` makes from a flash image, and says what was seen and
/// in which state the device ended.
///
/// # Errors
///
/// The first deviation from the session.
pub fn play<D: Device>(
    session: &Session,
    drive: Drive,
    build: impl Fn(&[u8]) -> Result<D, String>,
) -> Result<(Record, D::State), Box<Failure>> {
    play_watched(session, drive, build, |_| {})
}

/// Like [`play`], and shows the device after every step.
///
/// # Errors
///
/// The first deviation from the session.
pub(crate) fn play_watched<D: Device>(
    session: &Session,
    drive: Drive,
    build: impl Fn(&[u8]) -> Result<D, String>,
    mut watch: impl FnMut(Glance<'_, D>),
) -> Result<(Record, D::State), Box<Failure>> {
    let device = build(&[]).map_err(|error| {
        Box::new(Failure {
            id: session.id.clone(),
            path: session.path.display().to_string(),
            title: session.title.clone(),
            excerpt: String::new(),
            expected: "a controller with this profile and machine".to_owned(),
            got: error,
            now: Time::ZERO,
            since: 0,
        })
    })?;
    let mut player = Player {
        family: session.family,
        harness: drive.harness(device),
        drive,
        stopwatch: Time::ZERO,
        received: VecDeque::new(),
        heard: Vec::new(),
        has_told_why: false,
        warnings: Vec::new(),
        why: String::new(),
        flash: Vec::new(),
        record: Record::default(),
        travel: Travel::default(),
        wrote_flash: false,
    };
    player.run_to(Time::ZERO);
    for (index, step) in session.steps.iter().enumerate() {
        let began = player.harness.now();
        player.heard.clear();
        player.has_told_why = false;
        let result = match step.action {
            Action::Restart => player.restart(&build),
            Action::New => player.replace(session, &build),
            _ => player.perform(&step.action),
        };
        result.map_err(|Mismatch(expected, got)| player.failure(session, index, expected, got))?;
        watch(Glance {
            step: index,
            began,
            ended: player.harness.now(),
            device: player.harness.device(),
            heard: &player.heard,
            why: player.has_told_why.then_some(player.why.as_str()),
            travel: &player.travel,
            wrote_flash: player.wrote_flash,
        });
    }
    let last = session.steps.len().saturating_sub(1);
    player
        .check_end(session, &build)
        .map_err(|Mismatch(e, g)| player.failure(session, last, e, g))?;
    Ok((player.record, player.harness.device().state()))
}

/// What was expected, and what came instead.
struct Mismatch(String, String);

fn mismatch<T>(expected: impl Into<String>, got: impl Into<String>) -> Result<T, Mismatch> {
    Err(Mismatch(expected.into(), got.into()))
}

struct Player<D> {
    family: Family,
    harness: Harness<D>,
    drive: Drive,
    stopwatch: Time,
    received: VecDeque<(Time, u8)>,
    /// What has come during the step.
    heard: Vec<(Time, u8)>,
    warnings: Vec<String>,
    /// Why the last error was answered.
    why: String,
    /// Whether that was during the step.
    has_told_why: bool,
    flash: Vec<u8>,
    record: Record,
    travel: Travel,
    wrote_flash: bool,
}

impl Drive {
    fn harness<D: Device>(self, device: D) -> Harness<D> {
        Harness::new(device).watching(match self {
            Drive::Smooth => Kinds::ALL.and(Kinds::COURSE),
            Drive::Rough => Kinds::WARNING,
        })
    }
}

impl<D: Device> Player<D> {
    fn perform(&mut self, action: &Action) -> Result<(), Mismatch> {
        if self.drive == Drive::Rough {
            self.save_and_restore()?;
        }
        match action {
            Action::Send(bytes) => {
                self.stopwatch = self.harness.now();
                self.send(bytes);
            }
            Action::Control(byte) => self.send(&[*byte]),
            Action::Expect(expected) => return self.expect(expected),
            Action::Rest => {
                self.run(|_| false)?;
                return self.nothing_more();
            }
            Action::Silent(nanos) => {
                self.advance(*nanos)?;
                return self.nothing_more();
            }
            Action::Wait(nanos) => return self.advance(*nanos),
            Action::Mark => self.stopwatch = self.harness.now(),
            Action::Do(deed) => return self.act(deed),
            Action::Rule(ruling) => return self.rule(ruling),
            Action::Reset => {
                self.input(Input::Rule(&Ruling::EndAll));
                self.input(Input::Fault(&Faulting::EndAll));
            }
            Action::Restart | Action::New | Action::Store(_) => {}
            Action::Position(wanted) => {
                let view = self.view();
                return compare(wanted, view.axes.iter().map(|axis| axis.position));
            }
            Action::Carriage(wanted) => {
                let view = self.view();
                return compare(wanted, view.axes.iter().map(|axis| axis.carriage));
            }
            Action::Port { input, port, value } => {
                let view = self.view();
                let found = view.ports.iter().find(|p| p.port == *port && p.input == *input);
                let got = found.map_or("no such port".to_owned(), |p| format!("{:02X}", p.value));
                if got != format!("{value:02X}") {
                    return mismatch(format!("{value:02X}"), got);
                }
            }
            Action::Baud(wanted) => {
                let baud = self.harness.device().baud();
                if baud != *wanted {
                    return mismatch(format!("{wanted} baud"), format!("{baud} baud"));
                }
            }
            Action::Warning(kind) => match self.warnings.iter().position(|seen| seen == kind) {
                Some(at) => drop(self.warnings.drain(..=at)),
                None => return mismatch(format!("a warning {kind}"), self.warnings.join(", ")),
            },
            // In the rough mode the reason is not watched.
            Action::Why(why) if *why != self.why && self.drive == Drive::Smooth => {
                return mismatch(why, &self.why);
            }
            Action::Why(_) => {}
        }
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) {
        match self.drive {
            Drive::Smooth => self.input(Input::Bytes(bytes)),
            Drive::Rough => {
                for byte in bytes {
                    self.input(Input::Bytes(std::slice::from_ref(byte)));
                }
            }
        }
    }

    fn input(&mut self, input: Input<'_>) {
        self.harness.input(input);
        self.take_outputs();
    }

    fn run_to(&mut self, at: Time) {
        self.harness.run_to(at);
        self.take_outputs();
    }

    fn take_outputs(&mut self) {
        while let Some(output) = self.harness.take_output() {
            match output {
                Output::Bytes(at, bytes) => {
                    self.received.extend(bytes.iter().map(|byte| (at, *byte)));
                    self.heard.extend(bytes.iter().map(|byte| (at, *byte)));
                }
                Output::Flash(_, change) => {
                    self.record.wrote_flash = true;
                    self.wrote_flash = true;
                    match change {
                        FlashChange::Append(bytes) => self.flash.extend_from_slice(&bytes),
                        FlashChange::Replace(bytes) => self.flash = bytes.to_vec(),
                    }
                }
                Output::Event(stamp, event) => self.watch(stamp.at, event),
            }
        }
    }

    fn watch(&mut self, at: Time, event: Event) {
        self.record.messages.extend(message_of(&event));
        match event {
            Event::Command { mnemonic, .. } => {
                self.record.commands.insert(mnemonic);
            }
            Event::Answer { mnemonic, bytes, why } => {
                let kind = self.family.kind_of(&bytes);
                if self.family.refusal(&bytes).is_some() || why.is_some() {
                    let why = why.unwrap_or_default().into_string();
                    self.why.clone_from(&why);
                    self.has_told_why = !why.is_empty();
                    let error = kind.clone().map(|kind| (mnemonic.clone(), kind, why));
                    self.record.errors.extend(error);
                }
                self.record.answers.extend(kind.map(|kind| (mnemonic, kind)));
            }
            Event::Line { mnemonic, .. } => {
                self.record.lines.insert(mnemonic);
            }
            Event::Motion(motion) => {
                self.record.moved |= matches!(motion, Motion::Begins { .. });
                self.travel.watch(at, &motion);
            }
            Event::Course(course) => self.record.courses.push(course),
            Event::Port { .. } => self.record.switched = true,
            Event::Warning(warning) => {
                let value = serde_json::to_value(&warning).unwrap_or_default();
                self.warnings.push(value["warning"].as_str().unwrap_or("?").to_owned());
            }
            _ => {}
        }
    }

    fn view(&self) -> View<D::Details> {
        self.harness.device().view(self.harness.now())
    }

    /// Lets this much time pass.
    fn advance(&mut self, nanos: u64) -> Result<(), Mismatch> {
        let until = self.harness.now().after_nanos(nanos);
        let mut causes = 0;
        while self.harness.due().is_some_and(|due| due <= until) {
            self.step(&mut causes)?;
        }
        self.run_to(until);
        Ok(())
    }

    /// Lets the device run until `done` or until it waits for an input.
    fn run(&mut self, done: impl Fn(&Self) -> bool) -> Result<(), Mismatch> {
        let mut causes = 0;
        while !done(self) && self.harness.due().is_some() {
            self.step(&mut causes)?;
        }
        Ok(())
    }

    fn step(&mut self, causes: &mut u32) -> Result<(), Mismatch> {
        let (now, Some(due)) = (self.harness.now(), self.harness.due()) else { return Ok(()) };
        *causes += 1;
        if *causes > MAX_CAUSES || due.as_nanos() > LONGEST {
            return mismatch("an end", "the controller never comes to an end");
        }
        if due < now {
            let got = format!("{due}, which is over");
            return mismatch("a wake-up time that is still to come", got);
        }
        if self.drive == Drive::Rough {
            self.run_to(now.after_nanos(due.nanos_since(now) / 2));
        }
        self.run_to(due);
        Ok(())
    }

    fn expect(&mut self, expected: &Expected) -> Result<(), Mismatch> {
        let literal = match expected.parts.as_slice() {
            [literal] => Some(literal),
            _ => None,
        };
        self.run(|player| {
            let received = player.received.iter().map(|(_, byte)| byte);
            literal.is_some_and(|bytes| {
                player.received.len() >= bytes.len() || !received.zip(bytes).all(|(a, b)| a == b)
            })
        })?;
        let received: Vec<u8> = self.received.iter().map(|(_, byte)| *byte).collect();
        let length = literal.map_or(received.len(), |bytes| bytes.len().min(received.len()));
        let at = length.checked_sub(1).and_then(|last| self.received.get(last));
        let at = at.map_or(0, |(time, _)| time.nanos_since(self.stopwatch));
        let in_time = expected.at.is_none_or(|(wanted, off)| at.abs_diff(wanted) <= off);
        let short_enough = expected.max.is_none_or(|max| length <= max);
        if !matches(&expected.parts, &received[..length]) || !in_time || !short_enough {
            return mismatch(show_expected(expected), show_received(&received, at));
        }
        self.received.drain(..length);
        Ok(())
    }

    fn nothing_more(&self) -> Result<(), Mismatch> {
        let received: Vec<u8> = self.received.iter().map(|(_, byte)| *byte).collect();
        match self.received.back() {
            None => Ok(()),
            Some((at, _)) => {
                mismatch("nothing more", show_received(&received, at.nanos_since(self.stopwatch)))
            }
        }
    }

    fn act(&mut self, deed: &Deed) -> Result<(), Mismatch> {
        let signals = self.harness.device().signals();
        let deed = &match deed {
            // The script was read with the names of all controllers; now the names of this one
            // apply.
            Deed::Fault(faulting) => {
                let words = vimc4_catalogue::all_names().write_faulting(faulting);
                match read_faulting(&words, &Names::of(self.harness.device())) {
                    Ok(faulting) => Deed::Fault(faulting.into()),
                    Err(error) => return mismatch(deed.to_string(), error.to_string()),
                }
            }
            deed => deed.clone(),
        };
        let inputs = match deed.inputs(&signals) {
            Ok(inputs) => inputs,
            Err(error) => return mismatch(deed.to_string(), error.to_string()),
        };
        for input in inputs {
            if let OwnedInput::Signal(id, _) = input {
                let touched = signals.iter().filter(|signal| signal.id == id);
                self.record.signals.extend(touched.map(|signal| signal.name.clone()));
            }
            self.input(input.as_input());
        }
        Ok(())
    }

    /// Begins or ends rules. What the script has read with the names of all controllers is read with
    /// those of this one.
    fn rule(&mut self, ruling: &Ruling) -> Result<(), Mismatch> {
        let words = vimc4_catalogue::all_names().write_ruling(ruling);
        match read_ruling(&words, &Names::of(self.harness.device())) {
            Ok(ruling) => self.input(Input::Rule(&ruling)),
            Err(error) => return mismatch(words, error.to_string()),
        }
        Ok(())
    }

    fn restart(&mut self, build: impl Fn(&[u8]) -> Result<D, String>) -> Result<(), Mismatch> {
        match build(&self.flash) {
            Ok(device) => {
                let now = self.harness.now();
                self.harness = self.drive.harness(device);
                self.run_to(now);
                Ok(())
            }
            Err(error) => mismatch("a controller that takes the flash image it left", error),
        }
    }

    fn replace(
        &mut self,
        session: &Session,
        build: impl Fn(&[u8]) -> Result<D, String>,
    ) -> Result<(), Mismatch> {
        self.check_end(session, &build)?;
        self.flash.clear();
        self.warnings.clear();
        self.travel = Travel::default();
        self.wrote_flash = false;
        self.restart(build)
    }

    fn save_and_restore(&mut self) -> Result<(), Mismatch> {
        let before = self.harness.device().state();
        let after = serde_json::to_string(&before).map(|text| serde_json::from_str(&text));
        match after {
            Ok(Ok(after)) if after == before => {
                self.harness.restore(after);
                Ok(())
            }
            Ok(Err(error)) | Err(error) => mismatch("a state that can be saved", error.to_string()),
            Ok(Ok(after)) => mismatch(format!("{before:?}"), format!("{after:?} after saving it")),
        }
    }

    fn check_end(
        &self,
        session: &Session,
        build: impl Fn(&[u8]) -> Result<D, String>,
    ) -> Result<(), Mismatch> {
        self.nothing_more()?;
        let needs = session.needs();
        let may = needs.effects;
        if self.record.moved && !may.moves {
            return mismatch("a script that shows that it moves", "a motion");
        }
        if self.record.wrote_flash && !may.writes_flash {
            return mismatch("a script that shows that it writes the flash", "a write");
        }
        if self.record.switched && !may.outputs && !needs.operator {
            return mismatch("a script that shows that it switches outputs", "an output switched");
        }
        // The host's image grew change by change, and the device's own may be shorter; their
        // contents must be the same.
        let copied = build(&self.flash).map(|device| device.flash_image());
        if copied != Ok(self.harness.device().flash_image()) {
            return mismatch("changes that make the device's flash image", "another image");
        }
        Ok(())
    }

    fn failure(&self, session: &Session, at: usize, expected: String, got: String) -> Box<Failure> {
        let (now, excerpt) = (self.harness.now(), excerpt(session, at));
        Box::new(Failure {
            id: session.id.clone(),
            path: format!(
                "{}:{}",
                session.path.display(),
                session.steps.get(at).map_or(1, |s| s.line)
            ),
            title: session.title.clone(),
            excerpt,
            expected,
            got,
            now,
            since: now.nanos_since(self.stopwatch),
        })
    }
}

/// The script around a step, with a mark on it.
#[must_use]
pub fn excerpt(session: &Session, at: usize) -> String {
    let mut excerpt = String::new();
    let from = at.saturating_sub(6);
    let mut shown = None;
    for (index, Step { line, text, .. }) in session.steps.iter().enumerate().skip(from).take(9) {
        let mark = if index == at { "->" } else { "  " };
        let again = shown.replace((line, text)) == Some((line, text));
        if !again || index == at {
            let _ = writeln!(excerpt, "  {mark} {line:4}  {text}");
        }
    }
    excerpt
}

fn compare(wanted: &[i64], got: impl Iterator<Item = i64>) -> Result<(), Mismatch> {
    let got: Vec<i64> = got.take(wanted.len()).collect();
    if got == wanted { Ok(()) } else { mismatch(show_point(wanted), show_point(&got)) }
}

fn show_point(point: &[i64]) -> String {
    point.iter().map(i64::to_string).collect::<Vec<_>>().join(" ")
}

pub(crate) fn show_expected(expected: &Expected) -> String {
    let parts: Vec<String> = expected.parts.iter().map(|part| escape(part)).collect();
    let mut text = parts.join("...");
    if let Some((at, tolerance)) = expected.at {
        text += &format!(" at {}", show_nanos(at));
        if tolerance > 0 {
            text += &format!(" ± {}", show_nanos(tolerance));
        }
    }
    if let Some(max) = expected.max {
        text += &format!(", at most {max} bytes");
    }
    text
}

fn show_received(received: &[u8], at: u64) -> String {
    if received.is_empty() {
        return "nothing, and the controller waits for an input".to_owned();
    }
    format!("{} at {}", escape(received), show_nanos(at))
}

/// Whether `bytes` are the literal parts in this order, the first at the start, the last at the
/// end, with anything between two of them.
pub(crate) fn matches(parts: &[Vec<u8>], bytes: &[u8]) -> bool {
    let [first, middle @ .., last] = parts else {
        return parts.first().is_some_and(|only| only == bytes);
    };
    let Some(mut rest) = bytes.strip_prefix(first.as_slice()) else { return false };
    for part in middle {
        let found = rest.windows(part.len().max(1)).position(|w| w == part);
        match found {
            _ if part.is_empty() => {}
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dots_stand_for_anything() {
        let parts =
            |text: &str| text.split("...").map(|p| p.as_bytes().to_vec()).collect::<Vec<_>>();
        assert!(matches(&parts("0"), b"0"));
        assert!(!matches(&parts("0"), b"00"));
        assert!(matches(&parts("...\r\n0"), b"one\r\ntwo\r\n0"));
        assert!(matches(&parts("0...UserInfo..."), b"0the UserInfo is x\r\n"));
        assert!(!matches(&parts("0...UserInfo..."), b"0nothing"));
        assert!(!matches(&parts("00...0"), b"00"));
    }
}
