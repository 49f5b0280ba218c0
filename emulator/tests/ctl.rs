//! `vimc4 ctl` against a `vimc4 serve` that runs.

#![expect(clippy::too_many_lines, reason = "one test is one story")]
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::InTime;
use process::{Process, VIMC4, said, vimc4};

const PAGE: &str = include_str!("../../docs/ctl.md");

/// Where the page says that it listens.
const THERE: &str = "http://127.0.0.1:8080";

/// A server, and where it listens.
fn serve(folder: &Path, arguments: &[&str]) -> (Process, String) {
    let given = ["--machine", "mill", "--pty", "none", "--tcp", "none"];
    let given: Vec<&str> = given.iter().chain(arguments).copied().collect();
    let (serve, ready) = Process::serve(folder, &given);
    (serve, ready["http"].as_str().unwrap().to_owned())
}

/// What a command line of `ctl` ends with, prints and says.
fn ctl(folder: &Path, url: &str, arguments: &[&str]) -> (i32, String, String) {
    let mut command = vimc4(folder, &["ctl"]);
    said(
        command
            .args(arguments)
            .env("VIMC4_URL", url)
            .env_remove("VIMC4_TOKEN")
            .output_in_time()
            .unwrap(),
    )
}

/// What it says is wrong, with its remedy.
fn wrong(outcome: (i32, String, String)) -> (i32, String) {
    assert_eq!(outcome.1, "");
    let said: Vec<&str> =
        outcome.2.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    (outcome.0, said.join(" | "))
}

/// What a shell offers behind these words.
fn offered(folder: &Path, url: &str, words: &[&str]) -> String {
    let mut command = vimc4(folder, &["--", "vimc4", "ctl"]);
    command.args(words).env("VIMC4_COMPLETE", "bash").env("_CLAP_IFS", " ").env("VIMC4_URL", url);
    let place = (words.len() + 1).to_string();
    let (code, offered, wrong) =
        said(command.env("_CLAP_COMPLETE_INDEX", place).output_in_time().unwrap());
    assert_eq!((code, wrong.as_str()), (0, ""));
    offered
}

#[test]
fn the_page_says_what_is_so() {
    let folder = tempfile::tempdir().unwrap();
    let (_serve, url) = serve(folder.path(), &["--time", "manual", "--web"]);
    let block =
        PAGE.split("```console\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let mut count = 0;
    for part in block.split("$ ").skip(1) {
        let (line, shown) = part.split_once('\n').unwrap();
        if line.starts_with("export ") {
            assert!(line.ends_with(THERE));
            continue;
        }
        let line = line.strip_prefix("vimc4").unwrap();
        let command = format!("{VIMC4}{line} 2>&1");
        let output = Command::new("sh")
            .args(["-c", &command])
            .env("VIMC4_URL", &url)
            .output_in_time()
            .unwrap();
        let printed = String::from_utf8(output.stdout).unwrap();
        assert_eq!(printed.trim_end(), shown.trim_end(), "vimc4{line}");
        count += 1;
    }
    assert!(count >= 10, "only {count} command lines");
}

#[test]
fn what_is_wrong_says_so_and_what_would_be_right() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (mut server, url) = serve(folder, &["--time", "manual", "--web", "--count", "2"]);
    let try_it = |arguments: &[&str]| wrong(ctl(folder, &url, arguments));
    for (arguments, code, right) in [
        (vec!["position"], 2, "there are 2 controllers | help: give --controller, 1 to 2"),
        (vec!["position", "--controller", "3"], 2, "there is no controller `3`"),
        (
            vec!["prss", "stop", "--controller", "1"],
            2,
            "did you mean press? `vimc4 ctl help` lists them",
        ),
        // What is wrong anyway is told before which controller is meant.
        (
            vec!["prss", "stop"],
            2,
            "`prss` is not an order | help: did you mean press? `vimc4 ctl help` lists them",
        ),
        (vec!["veiw"], 2, "did you mean view? `vimc4 ctl help` lists them"),
        (
            vec!["help", "foo"],
            2,
            "wrong at `foo`: not an order | help: `vimc4 ctl help` lists them",
        ),
        (vec!["limit", "x+", "1"], 2, "`limit` is not an order"),
        (vec!["cover", "open"], 2, "help: give --controller, 1 to 2"),
        (vec!["send"], 2, "there is nothing to send | help: write it behind `send`, as in"),
        (vec!["send", "", "--controller", "1"], 2, "there is nothing to send"),
        (
            vec!["send", "€", "--controller", "1"],
            2,
            r"write the bytes that are meant, such as \xE2\x82\xAC",
        ),
        (
            vec!["clock", "resume", "--controller", "1"],
            1,
            "time is not paused | help: there is nothing to resume; give `clock pause` before it",
        ),
        (vec!["clock", "8x", "--controller", "1"], 1, "only a clock that runs by itself"),
        (vec!["send", r"\q", "--controller", "1"], 2, r"`\q` stands for nothing"),
        (vec![""], 2, "no order is given | help: `vimc4 ctl help` lists those that there are"),
        (vec![" ", ""], 2, "no order is given"),
        (vec!["view", "more"], 2, "`more` means nothing behind `view` | help: leave it out"),
        (vec!["view", "--count", "1"], 2, "--kinds, --after and --count are for `watch`"),
        (vec!["watch", "--kinds", "foo"], 2, "there is no kind of entry `foo`"),
        (vec!["watch", "--controller", "7"], 2, "there is no controller `7`"),
        (vec!["view", "--url", "https://localhost"], 2, "help: it is as in http://127.0.0.1:8080"),
    ] {
        let (ended, said) = try_it(&arguments);
        assert!(ended == code && said.contains(right), "{arguments:?}: {ended} {said}");
    }
    // The words of this command are explained as orders are.
    let (code, said, _) = ctl(folder, &url, &["help", "clock"]);
    assert_eq!((code, said.lines().count()), (0, 5), "{said}");
    assert!(said.contains("clock pause           time stands still"), "{said}");
    // Which controller is meant makes no difference.
    let (code, said, _) = ctl(folder, &url, &["help", "press"]);
    assert!(code == 0 && said.contains("press"), "{said}");
    let (code, all, _) = ctl(folder, &url, &["help"]);
    assert!(code == 0 && all.contains("press") && all.contains("clock pause"), "{all}");
    // A problem is JSON, too, where that is wanted.
    let (code, printed, _) = ctl(folder, "http://127.0.0.1:1", &["--json", "view"]);
    let problem: Value = serde_json::from_str(&printed).unwrap();
    assert!(code == 2 && problem["detail"].is_string(), "{printed}");
    let (code, printed, _) = ctl(folder, &url, &["--json", "--controller", "2", "cover", "shut"]);
    let problem: Value = serde_json::from_str(&printed).unwrap();
    assert_eq!((code, &problem["status"]), (2, &Value::from(422)));
    assert_eq!(problem["remedy"], "it can be open or closed");
    for (words, detail) in [
        (vec!["send"], "there is nothing to send"),
        (vec!["watch", "x"], "`x` means nothing behind `watch`"),
        (vec!["watch", "--kinds", "foo"], "there is no kind of entry `foo`"),
        (vec!["view", "--count", "1"], "--kinds, --after and --count are for `watch`"),
    ] {
        let (code, printed, _) = ctl(folder, &url, &[vec!["--json"], words].concat());
        let problem: Value = serde_json::from_str(&printed).unwrap();
        assert_eq!((code, &problem["detail"]), (2, &detail.into()), "{printed}");
    }
    // What is paused does not go on by itself; the other one does not mind.
    assert_eq!(ctl(folder, &url, &["--controller", "2", "clock", "pause"]).0, 0);
    let (code, said) = try_it(&["--controller", "2", "advance", "1s"]);
    let right =
        "time is paused | help: give `clock resume`, or `clock step` for the next thing only";
    assert!(code == 1 && said.contains(right), "{code} {said}");
    let advanced = ctl(folder, &url, &["--controller", "1", "advance", "1s"]);
    assert_eq!(advanced, (0, "now 1.000000000 s\n".to_owned(), String::new()));

    assert_eq!(ctl(folder, &url, &["--controller", "1", "quit"]).0, 0);
    assert_eq!(server.end().0, Some(0));
    let (code, said) = try_it(&["view"]);
    assert!(code == 2 && said.contains("is `vimc4 serve --http` running there?"), "{code} {said}");
    let (code, said) = wrong(ctl(folder, "", &["view"]));
    assert!(code == 2 && said.contains("give --url http://127.0.0.1:8080"), "{code} {said}");
}

#[test]
fn a_token_is_in_a_file_or_the_environment() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("token.txt"), "0123456789abcdef\n").unwrap();
    let (_serve, url) = serve(folder, &["--web", "--http-token", "token.txt"]);
    for arguments in [&["position"][..], &["watch", "--count", "1", "--after", "0"]] {
        let (code, said) = wrong(ctl(folder, &url, arguments));
        assert!(code == 2 && said.contains("the token is missing or wrong"), "{code} {said}");
        assert!(said.contains("into VIMC4_TOKEN, or name its file with --token"), "{said}");
    }
    let with =
        |arguments: &[&str]| ctl(folder, &url, &[arguments, &["--token", "token.txt"]].concat());
    assert_eq!(with(&["cover", "open"]), (0, "ok\n".to_owned(), String::new()));
    let (code, seen, _) = with(&["watch", "--count", "1", "--after", "0"]);
    assert!(code == 0 && seen.contains("the API: cover open"), "{seen}");
    let mut command = vimc4(folder, &["ctl", "--url", &url, "position"]);
    let (code, seen, _) =
        said(command.env("VIMC4_TOKEN", "0123456789abcdef").output_in_time().unwrap());
    let position = "X 0 Y 0 Z 0 A 0, cannot move; X, Y, Z need a reference run\n";
    assert_eq!((code, seen.as_str()), (0, position));
    // What cannot be sent is not taken for another server.
    fs::write(folder.join("token.txt"), "0123456789\nabcdef\n").unwrap();
    let (code, told) = wrong(with(&["position"]));
    assert!(code == 2 && told.contains("the token has a blank, a line break"), "{code} {told}");
    let (code, said) = wrong(said(
        vimc4(folder, &["serve", "--web", "--http-token", "token.txt"]).output_in_time().unwrap(),
    ));
    assert!(code == 2 && said.contains("letters, digits or signs in one line"), "{code} {said}");
}

#[test]
fn watch_prints_what_happens_until_the_server_ends() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (_serve, url) = serve(folder, &["--time", "manual", "--web", "--count", "2"]);
    assert_eq!(ctl(folder, &url, &["--controller", "2", "send", r"@07\r"]).0, 0);
    let mut command = vimc4(folder, &["ctl", "--url", &url, "--json", "watch", "--after", "0"]);
    let mut watch = Process::start(command.args(["--kinds", "answer,command"]));
    let mut next = || {
        let entry: Value = serde_json::from_str(&watch.line()).unwrap();
        (entry["controller"].as_u64(), entry["bytes"].as_str().unwrap().to_owned())
    };
    assert_eq!(next(), (Some(2), "@07".to_owned()));
    assert_eq!(next(), (Some(2), "0".to_owned()));
    // It hears of what is still to come.
    assert_eq!(ctl(folder, &url, &["--controller", "1", "send", r"@01\r"]).0, 0);
    assert_eq!(next(), (Some(1), "@01".to_owned()));
    assert_eq!(next(), (Some(1), "0".to_owned()));
    // Half a command is sent, and a message names the missing end.
    let (code, _, told) = ctl(folder, &url, &["--controller", "1", "send", "@0P"]);
    assert!(code == 0 && told.contains("note: `@0P` has no end"), "{told}");
    for whole in [r"\r", r"\xFD", "PU;"] {
        assert_eq!(ctl(folder, &url, &["--controller", "1", "send", whole]).2, "", "{whole}");
    }
    assert_eq!(ctl(folder, &url, &["--controller", "1", "quit"]).0, 0);
    assert_eq!(watch.end().0, Some(0));
}

#[test]
fn a_shell_is_offered_what_the_server_has() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (_serve, url) = serve(folder, &["--time", "manual", "--web", "--count", "2"]);
    let offers = |words: &[&str]| offered(folder, &url, words);
    assert_eq!(offers(&["--controller", ""]), "1 2");
    assert_eq!(offers(&["clock", "re"]), "resume");
    assert_eq!(offers(&["vi"]), "view");
    assert_eq!(offers(&["watch", "--kinds", "co"]), "command course");
    for (words, some) in [
        (vec!["--controller", "2", "press", ""], "estop"),
        (vec!["--controller=2", "cover", ""], "closed"),
        (vec!["--json", "--controller", "1", "set", "limit"], "limit"),
        (vec!["--controller", "1", "run", ""], "until"),
    ] {
        let offered = offers(&words);
        assert!(offered.split(' ').any(|word| word == some), "{words:?}: {offered}");
    }
    // Without a server there are the words that are always there.
    let alone = offered(folder, "http://127.0.0.1:1", &["cl"]);
    assert_eq!(alone, "clock");
}
