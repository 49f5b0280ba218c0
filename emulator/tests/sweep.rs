//! Sweeps: over recorded sessions and over host commands, killed, resumed and put together.

#![expect(clippy::cognitive_complexity, reason = "one test is one story")]
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use rustix::process::{Pid, Signal, test_kill_process};
use serde_json::Value;

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{InTime, until};
use process::{Process, run, vimc4};

/// A recording in which an axis runs into its limit switch.
const LIMIT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/limit.jsonl");

/// Says a line and heeds the answer, as a shell can.
const CAREFUL: &str = "\
exec 3<>\"$VIMC4_PORT\"
for line in @07 @0R7 @0A80,900,0,900,0,900,0,900; do
    printf '%s\\r' \"$line\" >&3
    answer=$(timeout 30 head -c 1 <&3)
    [ \"$answer\" = 0 ] || exit 1
done
";

/// The files in a folder, with what is in them.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = fs::read_dir(folder).unwrap().map(|file| file.unwrap());
    let name = |file: &fs::DirEntry| file.file_name().into_string().unwrap();
    files.map(|file| (name(&file), fs::read(file.path()).unwrap())).collect()
}

/// Their names.
fn names(folder: &Path) -> Vec<String> {
    files(folder).into_keys().collect()
}

fn lines(folder: &Path, file: &str) -> usize {
    fs::read_to_string(folder.join(file)).map_or(0, |text| text.lines().count())
}

#[test]
fn a_recorded_session_gives_the_same_whoever_sweeps_it() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = |arguments: &[&str]| {
        let (code, said, errors) = run(folder.path(), &[&["sweep"], arguments].concat());
        assert_eq!((code, errors.as_str()), (0, ""), "{said}");
        said
    };
    // What can go wrong with STOP and switches alone: some hundred points.
    let only = ["--only", "stop,limit-switch,delayed", "--modes", "transient"];
    let of = |more: &[&str]| sweep(&[&[LIMIT], &only[..], more].concat());
    let one = of(&["--jobs", "1", "--out", "one"]);
    assert_eq!(of(&["--jobs", "3", "--out", "three"]), one);
    let whole = files(&folder.path().join("one"));
    assert_eq!(files(&folder.path().join("three")), whole);
    // Shards, put together.
    for shard in ["1/3", "2/3", "3/3"] {
        of(&["--shard", shard, "--out", &shard[..1]]);
    }
    let merged = sweep(&["merge", "1", "3", "2", "--out", "merged"]);
    assert_eq!(merged, one);
    assert_eq!(files(&folder.path().join("merged")), whole);
    // What is there is neither overwritten nor done again.
    let again = [&["sweep", LIMIT], &only[..], &["--out", "one"]].concat();
    let (code, _, errors) = run(folder.path(), &again);
    assert!(code == 2 && errors.contains("has results already"), "{errors}");
    assert_eq!(of(&["--out", "one", "--resume"]), one);
    assert_eq!(files(&folder.path().join("one")), whole);
    // A case that is lost is made again.
    fs::remove_file(folder.path().join("one").join(whole.keys().next().unwrap())).unwrap();
    assert_eq!(of(&["--out", "one", "--resume"]), one);
    assert_eq!(files(&folder.path().join("one")), whole);
    // What is missing is no all-clear, and what is there is not written over.
    let (code, said, errors) = run(folder.path(), &["sweep", "merge", "1", "3", "--out", "two"]);
    assert!(code == 2 && errors.contains("are in none of these folders"), "{errors}");
    assert!(said.contains("limit.jsonl: "), "{said}");
    let (code, _, errors) = run(folder.path(), &["sweep", "merge", "1", "2", "3", "--out", "1"]);
    assert!(code == 2 && errors.contains("1 has results already"), "{errors}");
    // Another sweep belongs elsewhere, also if it has as many points in the same places.
    let other = ["sweep", LIMIT, "--only", "stop", "--out", "one", "--resume"];
    let (code, _, errors) = run(folder.path(), &other);
    assert!(code == 2 && errors.contains("the results of another sweep: the harms"), "{errors}");
    let part = |only: &str, shard: &str, out: &str| {
        let what = ["sweep", LIMIT, "--modes", "transient", "--only", only];
        run(folder.path(), &[&what[..], &["--shard", shard, "--out", out]].concat())
    };
    let dropped = "the harms are `dropped` there and `garbled` here";
    assert_eq!(part("dropped", "1/2", "dropped").0, 0);
    // One part of each in one folder.
    let (code, _, errors) = part("garbled", "2/2", "dropped");
    assert!(code == 2 && errors.contains(dropped), "{errors}");
    assert_eq!(part("garbled", "2/2", "garbled").0, 0);
    let merge = ["sweep", "merge", "garbled", "dropped", "--out", "mixed"];
    let (code, _, errors) = run(folder.path(), &merge);
    assert!(code == 2 && errors.contains(dropped), "{errors}");
    assert!(!folder.path().join("mixed").exists());
    // Every case happens again as it was found, and shows what it is about.
    let cases: Vec<&String> = whole.keys().filter(|name| name.starts_with("case-")).collect();
    assert!(cases.len() > 5, "{cases:?}");
    for case in cases {
        let file = format!("one/{case}");
        assert!(lines(folder.path(), &file) <= 30, "{case}");
        let (code, said, errors) = run(folder.path(), &["replay", &file]);
        assert_eq!(code, 0, "{case}: {said}{errors}");
    }
}

#[test]
fn a_sweep_that_was_killed_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["sweep", LIMIT, "--modes", "transient", "--jobs", "1", "--json"];
    let (code, whole, _) = run(folder.path(), &[&arguments[..], &["--out", "whole"]].concat());
    assert_eq!(code, 0);
    let results = "killed/results-1-of-1.jsonl";
    let mut killed = Process::of(
        vimc4(folder.path(), &[&arguments[..], &["--out", "killed"]].concat()).start().unwrap(),
    );
    until("nothing is found", || lines(folder.path(), results) > 10);
    killed.signal(Signal::KILL);
    killed.ended();
    let resumed = [&arguments[..], &["--out", "killed", "--resume"]].concat();
    let (code, said, errors) = run(folder.path(), &resumed);
    assert_eq!(code, 0, "{errors}");
    assert_eq!(said.replace("killed/", "whole/"), whole);
    let here = files(&folder.path().join("killed"));
    assert_eq!(here, files(&folder.path().join("whole")));
}

/// Sweeps a host that a shell is, and returns the exit code and the report.
fn sweep(folder: &Path, arguments: &[&str], host: &str) -> (i32, Value) {
    let all = [&["sweep", "--json"], arguments, &["--", "sh", "-c", host]].concat();
    let (code, said, errors) = run(folder, &all);
    let report = serde_json::from_str(&said);
    assert!(report.is_ok(), "{code}: {said}{errors}");
    (code, report.unwrap())
}

#[test]
fn a_host_that_heeds_its_answers_is_told_from_one_that_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--only", "stop", "--modes", "transient", "--limit", "60s", "--out"];
    let careful = [&arguments[..], &["careful"]].concat();
    let (code, report) = sweep(folder.path(), &careful, CAREFUL);
    assert_eq!((code, &report["bad"]), (0, &Value::from(0)), "{report}");
    let careless = CAREFUL.replace("[ \"$answer\" = 0 ] || exit 1", ":");
    let out = [&arguments[..], &["careless"]].concat();
    let (code, report) = sweep(folder.path(), &out, &careless);
    assert_eq!(code, 1, "{report}");
    let bad = &report["outcomes"][0];
    assert_eq!(bad["title"], "it reports success, but the machine is not where it should be");
    assert_eq!(bad["heard"], "`F` as the answer to `@#A#,#,#,#,#,#,#,#`");
    assert_eq!(bad["did"], "went on as if nothing had happened; exit code 0: success");
    let should = bad["should"].as_str().unwrap();
    assert!(should.contains("stopped by STOP"), "{should}");
    let case = bad["recording"].as_str().unwrap();
    assert!(lines(folder.path(), case) <= 30);
    let (code, said, errors) = run(folder.path(), &["replay", case]);
    assert_eq!(code, 0, "{said}{errors}");
    // Jobs make no difference.
    let alone = [&arguments[..], &["alone", "--jobs", "1"]].concat();
    let (_, same) = sweep(folder.path(), &alone, &careless);
    assert_eq!(same.to_string().replace("alone/", "careless/"), report.to_string());
    // What lasts for a time may be over or not when a host says more: its cases can differ in that.
    assert_eq!(names(&folder.path().join("alone")), names(&folder.path().join("careless")));
}

#[test]
fn a_host_is_not_run_where_it_hears_what_it_has_heard_before() {
    let folder = tempfile::tempdir().unwrap();
    let host = format!("echo \"$VIMC4_POINT\" >> points; {CAREFUL}");
    let only = ["--only", "stop,limit-switch", "--modes", "transient,persistent", "--out"];
    let alone = [&only[..], &["few", "--jobs", "1", "--limit", "60s"]].concat();
    let (code, report) = sweep(folder.path(), &alone, &host);
    let few = lines(folder.path(), "points");
    fs::remove_file(folder.path().join("points")).unwrap();
    let all = [&only[..], &["all", "--run-all", "--limit", "60s"]].concat();
    let (same, whole) = sweep(folder.path(), &all, &host);
    // Twice without a fault, and then for each point.
    let points = usize::try_from(report["points"].as_u64().unwrap()).unwrap();
    assert_eq!(lines(folder.path(), "points"), points + 2);
    assert!(few < points / 2, "{few} of {points}");
    // What is found is the same, and every case was seen.
    assert_eq!((code, report.to_string()), (same, whole.to_string().replace("all/", "few/")));
    assert_eq!(names(&folder.path().join("few")), names(&folder.path().join("all")));
}

#[test]
fn a_host_that_hangs_is_ended_with_all_that_it_has_started() {
    let folder = tempfile::tempdir().unwrap();
    // It waits for an answer for ever, and so does what it has started.
    let waits = "sleep 3000 & echo $! >> pids; exec 3<>\"$VIMC4_PORT\"; printf '@07\\r' >&3; head -c 1 <&3 > /dev/null";
    let arguments = ["--only", "dropped", "--modes", "transient", "--limit", "3s", "--out", "out"];
    let (code, report) = sweep(folder.path(), &arguments, waits);
    assert_eq!(code, 1, "{report}");
    assert_eq!(report["outcomes"][0]["title"], "it hangs");
    let pids = fs::read_to_string(folder.path().join("pids")).unwrap();
    let is_gone = |pid: &str| {
        let pid = Pid::from_raw(pid.parse().unwrap()).unwrap();
        test_kill_process(pid).is_err() || is_zombie(pid)
    };
    assert!(pids.lines().count() > 3);
    until("something is left", || pids.lines().all(is_gone));
}

/// Whether a process has ended, and only its parent does not know yet.
fn is_zombie(pid: Pid) -> bool {
    let state = fs::read_to_string(format!("/proc/{}/stat", pid.as_raw_nonzero()));
    state.is_ok_and(|state| state.rsplit_once(')').is_some_and(|(_, rest)| rest.starts_with(" Z")))
}

#[test]
fn nothing_is_left_of_a_sweep_that_was_killed() {
    let folder = tempfile::tempdir().unwrap();
    // Without a fault it ends, with one it does not.
    let host = "echo $$ >> pids; exec 3<>\"$VIMC4_PORT\"; printf '@07\\r' >&3; [ \"$VIMC4_POINT\" = 'without a fault' ] || exec sleep 3000";
    let arguments = ["sweep", "--only", "dropped", "--limit", "1h", "--jobs", "2"];
    let arguments = [&arguments[..], &["--", "sh", "-c", host]].concat();
    let mut sweep = Process::of(vimc4(folder.path(), &arguments).start().unwrap());
    until("no host runs", || lines(folder.path(), "pids") >= 4);
    sweep.signal(Signal::KILL);
    sweep.ended();
    let pids = fs::read_to_string(folder.path().join("pids")).unwrap();
    until("a host is left", || {
        pids.lines().all(|pid| {
            let pid = Pid::from_raw(pid.parse().unwrap()).unwrap();
            test_kill_process(pid).is_err() || is_zombie(pid)
        })
    });
}

#[test]
fn results_of_another_sweep_are_not_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let only = ["--only", "lost-steps", "--modes", "transient", "--limit", "60s", "--out", "one"];
    sweep(folder.path(), &only, CAREFUL);
    let kept = files(&folder.path().join("one"));
    let other = |more: &[&str], host: &str| {
        let all = [&["sweep", "--resume"], &only[2..], more, &["--", "sh", "-c", host]].concat();
        let (code, said, errors) = run(folder.path(), &all);
        assert_eq!((code, said.as_str()), (2, ""), "{errors}");
        errors
    };
    let lost = ["--only", "lost-steps"];
    let mended = other(&lost, &format!("{CAREFUL}: mended"));
    assert!(mended.contains("results of another sweep: what is swept is `sh -c"), "{mended}");
    // What has as many points.
    let stopped = other(&["--only", "emergency-stop"], CAREFUL);
    let says = "the harms are `lost-steps` there and `emergency-stop` here";
    assert!(stopped.contains(says), "{stopped}");
    let model = other(&[&lost[..], &["--model", "imc-s8"]].concat(), CAREFUL);
    assert!(model.contains("the model is `imc4` there and `imc-s8` here"), "{model}");
    let machine = other(&[&lost[..], &["--machine", "bench"]].concat(), CAREFUL);
    assert!(machine.contains("the machine is `mill` there and `bench` here"), "{machine}");
    assert_eq!(files(&folder.path().join("one")), kept);
}

#[test]
fn of_a_host_that_does_not_repeat_itself_the_report_says_so() {
    let folder = tempfile::tempdir().unwrap();
    // Every other time the answer is not understood it claims success.
    let fickle =
        CAREFUL.replace("exit 1", "{ echo >> failures; exit $(( $(wc -l < failures) % 2 )); }");
    let only = ["--only", "stop,emergency-stop", "--modes", "transient,persistent", "--jobs", "1"];
    let of = |more: &[&str], host: &str| {
        let all = [&["sweep"], &only[..], more, &["--", "sh", "-c", host]].concat();
        run(folder.path(), &all).1
    };
    let says = "has not always done the same";
    let report = of(&["--out", "fickle", "--limit", "60s"], &fickle);
    assert!(report.contains(says), "{report}");
    // It is remembered.
    let report = run(folder.path(), &["sweep", "merge", "fickle", "--out", "merged"]).1;
    assert!(report.contains(says), "{report}");
    let report = of(&["--out", "careful", "--limit", "60s"], CAREFUL);
    assert!(!report.contains(says), "{report}");
}

#[test]
fn two_sweeps_do_not_write_into_one_folder() {
    let folder = tempfile::tempdir().unwrap();
    let host = "exec 3<>\"$VIMC4_PORT\"; printf '@07\\r' >&3; [ \"$VIMC4_POINT\" = 'without a fault' ] || exec sleep 3000";
    let arguments = ["sweep", "--only", "dropped", "--limit", "1h", "--resume"];
    let arguments = [&arguments[..], &["--", "sh", "-c", host]].concat();
    let mut sweep = Process::of(vimc4(folder.path(), &arguments).start().unwrap());
    let results = "sweep-results/results-1-of-1.jsonl";
    until("nothing is written", || lines(folder.path(), results) > 0);
    let (code, _, errors) = run(folder.path(), &arguments);
    assert!(code == 2 && errors.contains("another sweep writes into"), "{errors}");
    sweep.signal(Signal::KILL);
    sweep.ended();
}

#[test]
fn a_recording_without_a_session_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let whole = fs::read_to_string(LIMIT).unwrap();
    let (first, rest) = whole.split_once('\n').unwrap();
    let torn = format!("{first}\n{}", &rest[..20]);
    for (text, says) in [("", "recording"), ("junk\n", "recording"), (&*torn, "no input of a host")]
    {
        fs::write(folder.path().join("file.jsonl"), text).unwrap();
        let (code, said, errors) = run(folder.path(), &["sweep", "file.jsonl"]);
        assert_eq!((code, said.as_str()), (2, ""), "{errors}");
        assert!(errors.contains(says), "{errors}");
        assert_eq!(errors.contains("Line 2 was torn off"), text == torn, "{errors}");
    }
}

#[test]
fn what_cannot_be_swept_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let said = |arguments: &[&str]| {
        let (code, said, errors) = run(folder.path(), &[&["sweep"], arguments].concat());
        assert_eq!((code, said.as_str()), (2, ""), "{errors}");
        errors
    };
    let fails = said(&["--", "sh", "-c", "echo no machine; exit 3"]);
    assert!(
        fails.contains("ends with exit code 3 without any fault, having printed \"no machine\""),
        "{fails}"
    );
    let silent = said(&["--", "true"]);
    assert!(silent.contains("has sent nothing"), "{silent}");
    let chance = "printf '@0A%s,900\\r' $$ > \"$VIMC4_PORT\"";
    let chance = said(&["--", "sh", "-c", chance]);
    assert!(chance.contains("something else each time it runs: first it sent `@0A"), "{chance}");
    let none = said(&["--", "./no-such-program"]);
    assert!(none.contains("cannot run ./no-such-program"), "{none}");
    assert!(said(&["--shard", "4/3", "--", "true"]).contains("is no shard"));
    assert!(said(&[]).contains("required"));
    assert!(said(&["merge", ".", "--out", "x"]).contains("no results in these folders"));
}
