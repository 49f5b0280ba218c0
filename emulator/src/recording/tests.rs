//! Every face says that a recording contradicts the emulation.

mod changed;

use std::fs;
use std::path::{Path, PathBuf};
use std::thread;

use vimc4_answers::past::differences;
use vimc4_debug::Debugger;
use vimc4_timeline::recording::{Recording, Tolerance, WALL, What, check};

use super::controller::Site;
use super::history::{Commands, open};
use crate::console::camera::time_line;
use crate::console::cancel::Cancel;
use crate::console::session::Session;
use crate::dap::open::recorded;

/// So many recordings are changed.
const RECORDINGS: u64 = 1_000;

/// They are shared among so many threads.
const THREADS: usize = 4;

/// What every face says.
const SAID: &str = "differs from the recording from ";

fn recordings() -> Vec<Recording> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples");
    let read = |name| Recording::read(&fs::read(folder.join(name)).unwrap()).unwrap();
    ["overlooked.jsonl", "limit.jsonl"].map(read).into()
}

/// A file with a recording.
struct RecordingFile {
    path: PathBuf,
    _folder: tempfile::TempDir,
}

impl RecordingFile {
    fn new() -> RecordingFile {
        let folder = tempfile::tempdir().unwrap();
        RecordingFile { path: folder.path().join("recording.jsonl"), _folder: folder }
    }

    fn keep(&self, recording: &Recording) {
        fs::write(&self.path, recording.write()).unwrap();
    }
}

/// What the faces say of the recording in a file: `replay`, the prompt and the screen of the console,
/// `dap`, and the page of `replay --html`.
fn said(path: &Path, recording: &Recording) -> Vec<(&'static str, bool)> {
    let site = Site::recorded(recording).unwrap();
    let tolerance = Tolerance::of(&recording.head);
    let read = |state: &_| site.read(state);
    let played = check(recording, site.player().unwrap(), tolerance, &read, &mut |_| {}).unwrap();
    let opened = open(path, Commands::Listed).unwrap();
    let (debugger, machine) = (opened.debugger.clone(), opened.machine.clone());
    let mut session = Session::new(debugger, machine, Cancel::default());
    let has_page = differences(&session.debugger, true).as_array().is_some_and(|it| !it.is_empty());
    let marks = time_line(&session.debugger).differences;
    let prompt = session.notice().unwrap_or_default();
    vec![
        ("replay", played.difference.is_some()),
        ("prompt", prompt.contains(SAID)),
        ("screen", !marks.is_empty() && session.said.iter().any(|said| said.text.contains(SAID))),
        ("page", has_page),
        ("dap", recorded(opened).said.contains(SAID)),
    ]
}

#[test]
fn a_recording_that_contradicts_the_emulation_is_shown_as_one() {
    let recordings = recordings();
    for recording in &recordings {
        let kept = RecordingFile::new();
        kept.keep(recording);
        let said = said(&kept.path, recording);
        assert!(said.iter().all(|(_, differs)| !differs), "{said:?}");
    }
    let say = |from: u64| {
        let kept = RecordingFile::new();
        for number in (from..RECORDINGS).step_by(THREADS) {
            let recording = &recordings[number as usize / 3 % recordings.len()];
            let (changed, what) = changed::changed(recording, number);
            kept.keep(&changed);
            let said = said(&kept.path, &changed);
            assert!(said.iter().all(|(_, differs)| *differs), "{number}, {what}: {said:?}");
        }
    };
    thread::scope(|scope| {
        for from in 0..THREADS as u64 {
            scope.spawn(move || say(from));
        }
    });
}

fn answered(debugger: &mut Debugger, line: &str) -> String {
    debugger.execute(line, &mut vimc4_debug::uninterrupted).unwrap().to_string()
}

#[test]
fn recorded_and_emulated_replies_are_shown_in_turn() {
    let [recording, _] = <[Recording; 2]>::try_from(recordings()).unwrap();
    let text = String::from_utf8(recording.write()).unwrap();
    let kept = RecordingFile::new();
    fs::write(&kept.path, text.replace(r#""out":"F""#, r#""out":"0""#)).unwrap();
    let mut debugger = open(&kept.path, Commands::Listed).unwrap().debugger;
    let listed = "  1  8.698321617s  reply to command 4: recorded 0, emulated F (line 16)";
    assert_eq!(answered(&mut debugger, "differences"), listed);
    assert_eq!(
        debugger.source().unwrap().lines[3],
        "@0A-20000,8000,0,900,0,900,0,900    ! recorded 0, emulated F"
    );
    assert!(answered(&mut debugger, "continue 9s").contains("answer to @A: F, stopped"));
    answered(&mut debugger, "goto start");
    answered(&mut debugger, "replies recorded");
    let said = answered(&mut debugger, "continue 9s");
    assert!(said.contains("answer to @A: 0") && said.contains("recorded 0, emulated F"), "{said}");
    answered(&mut debugger, "goto start");
    answered(&mut debugger, "replies emulated");
    assert!(answered(&mut debugger, "continue 9s").contains("answer to @A: F, stopped"));
    assert!(answered(&mut debugger, "goto difference 1").starts_with("8.698321617s"));
}

#[test]
fn a_missing_input_is_told_with_what_was_recorded_for_it() {
    let [recording, _] = <[Recording; 2]>::try_from(recordings()).unwrap();
    let text = String::from_utf8(recording.write()).unwrap();
    let lines = text.lines().filter(|line| !line.contains(r#""in":"@0R7\r""#));
    let kept = RecordingFile::new();
    fs::write(&kept.path, lines.map(|line| format!("{line}\n")).collect::<String>()).unwrap();
    let mut debugger = open(&kept.path, Commands::Unlisted).unwrap().debugger;
    let listed = answered(&mut debugger, "differences");
    let first = "  1  5.011500002s  after command 1: recorded 0, emulated nothing (line 6)\n";
    assert!(listed.starts_with(first), "{listed}");
}

/// The recording as one of a real controller, whose replies are on their way for a while.
fn of_a_real_one(recording: &Recording) -> Recording {
    let mut real = recording.clone();
    real.head.clock = WALL.to_owned();
    real.entries.retain(|entry| !matches!(entry.what, What::State { .. }));
    let mut late = 0;
    for entry in &mut real.entries {
        late += if matches!(entry.what, What::Sent(_)) { 20_000_000 } else { 0 };
        entry.at = entry.at.after_nanos(late);
    }
    real
}

#[test]
fn a_real_controller_may_be_late_but_may_not_reply_or_move_otherwise() {
    let kept = RecordingFile::new();
    let differences = |recording: &Recording| {
        kept.keep(recording);
        let debugger = open(&kept.path, Commands::Unlisted).unwrap().debugger;
        debugger.differences().iter().map(|own| own.mismatch.to_string()).collect::<Vec<_>>()
    };
    for recording in recordings() {
        let real = of_a_real_one(&recording);
        assert_eq!(differences(&real), [""; 0]);
        // The last reply of one of them is a position.
        let last = real.entries.iter().rposition(|entry| matches!(entry.what, What::Sent(_)));
        let What::Sent(bytes) = &real.entries[last.unwrap()].what else { unreachable!() };
        let mut other = bytes.to_vec();
        *other.last_mut().unwrap() ^= 1;
        let mut changed = real.clone();
        changed.entries[last.unwrap()].what = What::Sent(other.clone().into());
        let [recorded, emulated] = [&other[..], bytes].map(vimc4::escape);
        let found = differences(&changed);
        assert_eq!(found.len(), 1, "{found:?}");
        let said = format!("recorded {recorded}, emulated {emulated} ");
        assert!(found[0].contains(&said), "{found:?}: {said}");
        // One that is silent for a second differs, too.
        changed.entries.remove(last.unwrap());
        let end = changed.entries.last_mut().unwrap();
        end.at = end.at.after_nanos(1_000_000_000);
        let found = differences(&changed);
        assert!(found.iter().any(|own| own.contains("recorded nothing")), "{found:?}");
    }
}
