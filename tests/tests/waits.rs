//! Tests start programs and wait for them through `emulator/tests/process/limits.rs` only, where every wait has a
//! limit and every program gets default signal dispositions.

#![expect(clippy::unwrap_used, reason = "a test that cannot read the sources has failed")]

use std::fs;
use std::path::{Path, PathBuf};

/// Calls of the standard library that wait without a limit, or start a program with the signals that the tests ignore.
const WITHOUT_A_LIMIT: [&str; 10] = [
    ".spawn()",
    ".output()",
    ".status()",
    ".wait_with_output()",
    "child.wait()",
    "client.wait()",
    "0.wait()",
    ".recv()",
    "writer.join()",
    "heard.join()",
];

/// The folders whose tests start programs.
const FOLDERS: [&str; 2] = ["emulator/tests", "tests/tests"];

#[test]
fn every_wait_has_a_limit() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut files = Vec::new();
    for folder in FOLDERS {
        collect(&root.join(folder), &mut files);
    }
    assert!(files.len() > 50, "{} files are too few", files.len());
    let mut found = Vec::new();
    for path in files {
        // These two name the calls.
        if path.ends_with("process/limits.rs") || path.ends_with("tests/waits.rs") {
            continue;
        }
        for (number, line) in fs::read_to_string(&path).unwrap().lines().enumerate() {
            let code = line.split("//").next().unwrap_or_default();
            let calls = WITHOUT_A_LIMIT.iter().filter(|call| code.contains(**call));
            found.extend(calls.map(|call| format!("{}:{}: {call}", path.display(), number + 1)));
        }
    }
    assert!(found.is_empty(), "use process/limits.rs instead:\n{}", found.join("\n"));
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}
