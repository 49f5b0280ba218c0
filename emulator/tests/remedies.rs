//! Every remedy that a message prints can be followed.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;

use tempfile::TempDir;

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::{Process, VIMC4, root, said, shell};

/// A wrong line, what its message says, and a line that follows it with its exit code.
const TRIED: [(&str, &str, &str, i32); 16] = [
    (
        "run commands.txt --machine board-plotter",
        "as in --machine mill",
        "run commands.txt --machine mill",
        0,
    ),
    (
        "run gate.txt",
        "as in --input 0.2=1@2s or --press start@5s",
        "run gate.txt --input 0.2=1@2s",
        0,
    ),
    (
        "run gate.txt",
        "as in --input 0.2=1@2s or --press start@5s",
        "run gate.txt --press start@5s",
        3,
    ),
    (
        "circle --radius 2.5mm",
        "as in --radius 2.5 --steps-per-mm 80",
        "circle --radius 2.5 --steps-per-mm 80",
        0,
    ),
    ("circle --help", "as in --from 0 --to 720", "circle --radius 200 --from 0 --to 720", 0),
    ("replay --help", "stop_reply=F0", "replay limit.jsonl --quirk stop_reply=F0", 0),
    ("minimise --help", "stop_reply=F0", "minimise limit.jsonl --quirk stop_reply=F0", 1),
    ("serve --http 0", "as in 127.0.0.1:0", "serve --pty none --tcp none --http 127.0.0.1:0", 0),
    ("serve --tcp 0", "or localhost:0", "serve --pty none --tcp localhost:0", 0),
    ("serve --http-token t", "or --web, too", "serve --pty none --http-token t --web", 0),
    (
        "record x.jsonl --device localhost:1",
        "--pty <LINK>|--tcp <ADDR>",
        "record x.jsonl --device localhost:1 --tcp 127.0.0.1:0",
        2,
    ),
    ("serve --modle imc4", "'--model'", "serve --pty none --tcp 127.0.0.1:0 --model imc4", 0),
    ("modles", "'models'", "models", 0),
    ("models show imc5", "built in are imc4", "models show imc4", 0),
    ("ctl send", r"as in `vimc4 ctl send '@07\r'`", r"ctl send '@07\r'", 0),
    ("conform", "as in `vimc4 conform ./vimc4.pty`", "conform ./vimc4.pty motion/none", 2),
];

fn bench() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("bin")).unwrap();
    symlink(VIMC4, folder.path().join("bin/vimc4")).unwrap();
    for name in ["commands.txt", "limit.jsonl"] {
        fs::copy(root().join("examples").join(name), folder.path().join(name)).unwrap();
    }
    let gate = root().join("emulator/tests/programs/gate.txt");
    fs::copy(gate, folder.path().join("gate.txt")).unwrap();
    fs::write(folder.path().join("t"), "0123456789abcdef\n").unwrap();
    folder
}

#[test]
fn each_remedy_can_be_followed() {
    let folder = bench();
    let (_serve, ready) = Process::serve(
        folder.path(),
        &["--pty", "none", "--time", "instant", "--http", "127.0.0.1:0"],
    );
    let url = ready["http"].as_str().unwrap();
    let run = |line: &str| {
        let line = format!("echo quit | VIMC4_URL={url} bin/vimc4 {line}");
        let (code, out, errors) = said(shell(folder.path(), &line));
        let words: Vec<_> = errors.split_whitespace().chain(out.split_whitespace()).collect();
        (code, words.join(" "))
    };
    for (wrong, remedy, right, code) in TRIED {
        let (_, told) = run(wrong);
        assert!(told.contains(remedy), "{wrong}: {told}");
        let (ended, told) = run(right);
        assert_eq!(ended, code, "{right}: {told}");
        assert!(!told.contains(remedy) || code == 3, "{right}: {told}");
    }
}

#[test]
fn what_is_not_alike_is_not_suggested() {
    let folder = bench();
    for line in ["init", "serve --config x"] {
        let (code, _, errors) = said(shell(folder.path(), &format!("bin/vimc4 {line}")));
        assert!(code == 2 && !errors.contains("similar"), "{line}: {errors}");
    }
}

/// A new remedy of this form has to be tried here.
#[test]
fn each_remedy_of_the_sources_is_tried() {
    let mut files = vec![root().join("emulator/src")];
    let mut untried = Vec::new();
    while let Some(path) = files.pop() {
        if path.is_dir() {
            files.extend(fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()));
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        let found = text.split("as in ").skip(1).filter(|rest| rest.starts_with("--"));
        for remedy in found.map(|rest| rest.split([' ', '"']).next().unwrap()) {
            if !TRIED.iter().any(|(_, tried, ..)| tried.contains(remedy)) {
                untried.push(format!("{}: {remedy}", name(&path)));
            }
        }
    }
    assert!(untried.is_empty(), "{}", untried.join("\n"));
}

fn name(path: &Path) -> String {
    path.file_name().unwrap().to_string_lossy().into_owned()
}
