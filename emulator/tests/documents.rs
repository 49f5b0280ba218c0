//! What the documents say is so: every command line of README, docs and `--help` runs, every file that
//! they name is there, and the sessions that they show go as shown.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::collections::BTreeSet;
use std::fs;
use std::io::{Read, Write};
use std::os::unix::fs::symlink;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;
use vimc4::{Clock, Emulator};

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{EndsInTime, InTime, LIMIT, Timed};
use process::{Process, VIMC4, pseudo_terminal, root, terminal};

const PAGES: [(&str, &str); 24] = [
    ("README.md", include_str!("../../README.md")),
    ("CONTRIBUTING.md", include_str!("../../CONTRIBUTING.md")),
    ("docs/api.md", include_str!("../../docs/api.md")),
    ("docs/conform.md", include_str!("../../docs/conform.md")),
    ("docs/connect.md", include_str!("../../docs/connect.md")),
    ("docs/coverage.md", include_str!("../../docs/coverage.md")),
    ("docs/ctl.md", include_str!("../../docs/ctl.md")),
    ("docs/debugging.md", include_str!("../../docs/debugging.md")),
    ("docs/design.md", include_str!("../../docs/design.md")),
    ("docs/editors.md", include_str!("../../docs/editors.md")),
    ("docs/install.md", include_str!("../../docs/install.md")),
    ("docs/library.md", include_str!("../../docs/library.md")),
    ("docs/panel.md", include_str!("../../docs/panel.md")),
    ("docs/ncp.md", include_str!("../../docs/ncp.md")),
    ("docs/performance.md", include_str!("../../docs/performance.md")),
    ("docs/profiles.md", include_str!("../../docs/profiles.md")),
    ("docs/python.md", include_str!("../../docs/python.md")),
    ("docs/recordings.md", include_str!("../../docs/recordings.md")),
    ("docs/scenarios.md", include_str!("../../docs/scenarios.md")),
    ("docs/stepping.md", include_str!("../../docs/stepping.md")),
    ("docs/sweep.md", include_str!("../../docs/sweep.md")),
    ("docs/timing.md", include_str!("../../docs/timing.md")),
    ("docs/waves.md", include_str!("../../docs/waves.md")),
    ("docs/windows.md", include_str!("../../docs/windows.md")),
];

/// Command lines that are not run here: where they are in the documents, how they begin, and why not.
const ELSEWHERE: &[(&str, &str, &str)] = &[
    ("README.md", "cd ", "part of the one before"),
    ("", "cargo ", "builds or tests what is being tested; `.ci/run` does"),
    ("docs/editors.md", "cd ", "begins the building of the extension; `.ci/run` does that"),
    ("docs/install.md", "cd ", "part of the one before"),
    ("docs/install.md", "vimc4 console session.jsonl", "needs the recording of a test that failed"),
    ("docs/library.md", "export ", "emulator/tests/recipes.rs"),
    ("docs/library.md", "python3 -m unittest", "emulator/tests/recipes.rs"),
    ("docs/library.md", "cc ", "emulator/tests/recipes.rs"),
    ("docs/library.md", "./axis ", "emulator/tests/recipes.rs"),
    ("docs/library.md", "LD_LIBRARY_PATH=", "crates/capi/tests/c.rs"),
    ("docs/library.md", "mcs ", "crates/capi/tests/c.rs"),
    ("docs/python.md", "pip ", "installs what is being tested; `.ci/run` does"),
    ("README.md", "python3 examples/tour.py", "a test of its own below"),
    ("", "socat ", "emulator/tests/connect"),
    ("docs/api.md", "curl ", "emulator/tests/api.rs"),
    ("docs/api.md", "vimc4 serve --http 0.0.0.0:8080", "emulator/tests/api.rs"),
    ("", "vimc4 ctl", "emulator/tests/ctl.rs"),
    ("", "vimc4 console --connect", "emulator/tests/console.rs"),
    ("docs/ctl.md", "export ", "emulator/tests/ctl.rs"),
    ("docs/connect.md", "printf ", "needs socat; emulator/tests/connect"),
    ("", "vimc4 lines --serve -- python3 examples/tour.py", "waits for STOP; a test below"),
    ("docs/connect.md", "vimc4 lines --serve --model smcu", "needs pyserial; a test below"),
    ("vimc4 lines", "vimc4 lines --serve --model smcu", "needs pyserial; a test below"),
    ("", "vimc4 lines -- picocom", "needs a terminal; emulator/tests/connect"),
    ("", "vimc4 lines -- node", "emulator/tests/connect"),
    ("", "vimc4 lines -- mono", "emulator/tests/connect"),
    ("", "vimc4 lines --pty", "emulator/tests/connect: Wine and DOSBox"),
    ("docs/sweep.md", "vimc4 sweep --modes", "needs pyserial; emulator/tests/recipes.rs"),
    ("docs/sweep.md", "vimc4 sweep --shard", "emulator/tests/sweep.rs"),
    ("", "vimc4 sweep merge", "emulator/tests/sweep.rs"),
    ("vimc4 sweep", "vimc4 sweep", "emulator/tests/sweep.rs and recipes.rs"),
    ("docs/recordings.md", "jq ", "needs jq"),
    ("", "vimc4 record ", "waits for Ctrl-C; emulator/tests/recording.rs"),
    ("docs/connect.md", "gensiot ", "emulator/tests/connect"),
    ("docs/connect.md", "ser2net ", "emulator/tests/connect"),
    ("docs/connect.md", "picocom ", "emulator/tests/connect"),
    ("docs/connect.md", "minicom ", "emulator/tests/connect"),
    ("docs/connect.md", "screen ", "emulator/tests/connect"),
    ("docs/connect.md", "ln ", "emulator/tests/connect: Wine"),
    ("docs/connect.md", "wine ", "emulator/tests/connect: Wine"),
    ("docs/connect.md", "wineserver ", "emulator/tests/connect: Wine"),
    ("docs/connect.md", "VBoxManage ", "not tried, as the page says"),
    ("docs/windows.md", "hub4com ", "not tried, as the page says"),
    ("docs/windows.md", "vimc4 doctor COM8", "needs Windows; ci/windows.sh"),
    ("docs/windows.md", "vimc4 completions powershell", "needs PowerShell"),
    ("docs/connect.md", "vimc4 serve --serial", "needs a serial port; emulator/tests/hostile.rs"),
    ("docs/profiles.md", "vimc4 serve --machine mine.toml", "is refused; a test below"),
    ("docs/ncp.md", "vimc4 ncp check examples/plate.ncp --machine mill", "a test below"),
    (
        "",
        "vimc4 console examples/plate.ncp --machine mill --screen",
        "needs a terminal; emulator/tests/console.rs",
    ),
    ("", "vimc4 dap", "waits for an editor; emulator/tests/dap"),
    ("", "vimc4 ncp lsp", "waits for an editor; emulator/tests/lsp.rs"),
    (
        "vimc4 send",
        "vimc4 send examples/plate.ncp --to /dev/ttyUSB0 --model imc-s8 --machine \
      examples/machine.toml --teach",
        "needs somebody at the terminal; emulator/tests/job.rs",
    ),
];

/// The programs with which command lines begin in blocks that do not mark them with `$`.
const PROGRAMS: [&str; 18] = [
    "vimc4",
    "cargo",
    "git",
    "cd",
    "socat",
    "gensiot",
    "ser2net",
    "picocom",
    "minicom",
    "screen",
    "ln",
    "wine",
    "wineserver",
    "qemu-system-i386",
    "hub4com",
    "VBoxManage",
    "python3",
    "(echo",
];

/// Command lines that end with another exit code than 0.
const ENDS: [(&str, i32); 5] = [
    ("vimc4 run examples/board.plt --model smcu --machine board-plotter --coverage", 2),
    ("vimc4 run examples/program.txt", 3),
    ("vimc4 run examples/commands.txt --machine mill --scenario examples/scenario.toml", 1),
    ("vimc4 replay examples/limit.jsonl --quirk", 1),
    ("vimc4 diff drill.jsonl examples/limit.jsonl", 1),
];

/// A piece of code in a document.
#[derive(Debug)]
struct Code<'a> {
    line: usize,
    text: &'a str,
    /// Whether it stands in a block, and not in running text.
    block: bool,
}

/// Lines of blocks that are or may be the shell's, and all code in running text.
fn code(text: &str) -> Vec<Code<'_>> {
    let mut found = Vec::new();
    let mut block: Option<(&str, bool)> = None;
    let mut inside = false;
    let lines: Vec<&str> = text.lines().collect();
    for (line, text) in (1..).zip(&lines) {
        let at = |text| Code { line, text, block: true };
        let within = |text| Code { line, text, block: false };
        match (block, text.trim_start().strip_prefix("```")) {
            (None, Some(language)) => {
                let rest =
                    lines[line..].iter().take_while(|line| !line.trim_start().starts_with("```"));
                block = Some((language, rest.clone().any(|line| line.starts_with("$ "))));
            }
            (Some(_), Some(_)) => block = None,
            (Some((_, true)), None) => found.extend(text.strip_prefix("$ ").map(at)),
            (Some(("" | "console" | "sh", false)), None) => {
                let first = text.split(' ').next().unwrap_or_default();
                found.extend(PROGRAMS.contains(&first).then(|| at(text)));
            }
            (Some(_), None) => {}
            // Code in running text may begin in one line and end in the next.
            (None, None) => {
                let pieces = text.split('`').skip(usize::from(!inside)).step_by(2);
                found.extend(pieces.filter(|code| code.starts_with("vimc4 ")).map(within));
                let ends = text.matches('`').count() % 2 == 0;
                inside = !text.is_empty() && inside == ends;
            }
        }
    }
    found
}

/// A command line without its comment; `None` where it only speaks of a command.
fn command_line<'a>(code: &Code<'a>) -> Option<&'a str> {
    let text = code.text.split("   ").next()?.trim_end();
    let placeholders = ["FILE", "LINK", "PORT", "PROGRAM", "NAME", "COMMAND", "ADDRESS", "…"];
    if text.split([' ', ',', '=']).any(|word| placeholders.contains(&word)) {
        return None;
    }
    // In running text a command on its own is a name.
    let is_name = |word: &str| word.chars().all(|c| c.is_ascii_lowercase());
    let name = text.strip_prefix("vimc4 ").is_some_and(|rest| rest.split(' ').all(is_name));
    (code.block || !name).then_some(text)
}

// --- the help of every command ---

fn help(path: &[String]) -> String {
    let output = Command::new(VIMC4).args(path).arg("--help").output_in_time().unwrap();
    assert!(output.status.success(), "{path:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// All commands with their helps, `vimc4` itself first.
fn helps() -> Vec<(String, String)> {
    let mut helps = Vec::new();
    let mut paths = vec![Vec::new()];
    while let Some(path) = paths.pop() {
        let text = help(&path);
        let commands = text.lines().skip_while(|line| *line != "Commands:").skip(1);
        for line in commands.take_while(|line| line.starts_with("  ")) {
            let name = line.split_whitespace().next().unwrap();
            if name != "help" && !line.starts_with("   ") {
                paths.push([path.as_slice(), &[name.to_owned()]].concat());
            }
        }
        helps.push((format!("vimc4 {}", path.join(" ")).trim_end().to_owned(), text));
    }
    assert!(helps.len() >= 17, "{helps:?}");
    helps
}

#[test]
fn the_help_of_every_command_has_examples_and_exit_codes() {
    for (command, text) in helps() {
        let section = |title: &str| text.lines().any(|line| line.starts_with(title));
        assert!(section("Examples:"), "`{command} --help` has no examples:\n{text}");
        assert!(section("Exit codes: "), "`{command} --help` has no exit codes:\n{text}");
    }
}

#[test]
fn every_command_has_a_manual_page() {
    let bench = Bench::new();
    let output = bench.run("vimc4 man man1", "");
    assert!(output.status.success(), "{}", text(&output));
    let pages = fs::read_dir(bench.path("man1")).unwrap().count();
    assert_eq!(text(&output), format!("{pages} pages in man1"));
    assert_eq!(pages, helps().len());
    for (command, _) in helps() {
        let page = bench.path(&format!("man1/{}.1", command.replace(' ', "-")));
        let page = fs::read_to_string(&page).unwrap_or_else(|_| panic!("{command} has no page"));
        assert!(page.contains("\nExit codes: "), "{command}: {page}");
        assert!(!page.contains("target: "), "the page of {command} is of one system");
        // What else there is has a form in ASCII that groff knows.
        let strange = page.chars().find(|c| !c.is_ascii() && *c != 'µ');
        assert_eq!(strange, None, "the page of {command} loses it where there is only ASCII");
    }
}

#[test]
fn every_help_leads_to_the_same_page_about_scenarios() {
    let helps = helps();
    let with = helps.iter().filter(|(_, text)| text.contains("--scenario <FILE>"));
    for (command, text) in with.clone() {
        let (_, about) = text.split_once("--scenario <FILE>").unwrap();
        let about = about.split_whitespace().take(20).collect::<Vec<_>>().join(" ");
        assert!(about.contains("as docs/scenarios.md shows"), "{command}: {about}");
    }
    assert_eq!(with.count(), 4);
}

/// The headings of options besides `Options`, each with all that stand under it.
const HEADINGS: [(&str, &[&str]); 3] = [
    ("Waveforms", &["--vcd", "--fst", "--csv", "--perfetto"]),
    (
        "A controller behind ports",
        &[
            "--pty",
            "--replace",
            "--tcp",
            "--serial",
            "--time",
            "--flash",
            "--count",
            "--tcp-clients",
            "--fresh-clients",
        ],
    ),
    ("A controller elsewhere", &["--connect", "--token", "--controller"]),
];

/// The options under each heading of a text, by what a heading looks like. What an option means is
/// indented further than its name.
fn headed<'t>(
    text: &'t str,
    heading: impl Fn(&'t str) -> Option<&'t str>,
) -> Vec<(&'t str, Vec<&'t str>)> {
    let mut headed: Vec<(&str, Vec<&str>)> = Vec::new();
    for line in text.lines().take_while(|line| *line != "Examples:") {
        if let Some(heading) = heading(line) {
            headed.push((heading, Vec::new()));
        }
        let line = line.strip_prefix("      ").or(line.strip_prefix("  ")).unwrap_or(line);
        let mut words = line.split([' ', '[', '=']).filter(|_| line.starts_with('-'));
        let option = words.find(|word| word.starts_with("--"));
        if let (Some(option), Some((_, options))) = (option, headed.last_mut()) {
            options.push(option);
        }
    }
    headed
}

#[test]
fn no_heading_has_options_that_follow_its_own() {
    let check = |of: &str, sections: Vec<(&str, Vec<&str>)>| {
        let mut met = 0;
        for (heading, options) in sections {
            let is_meant = |known: &&(&str, &[&str])| known.0.eq_ignore_ascii_case(heading);
            match HEADINGS.iter().find(is_meant) {
                Some((_, own)) => assert_eq!(options, *own, "{of}: {heading}"),
                None => {
                    let is_plain = options.is_empty() || heading.eq_ignore_ascii_case("options");
                    assert!(is_plain, "{of}: {heading} is not known here: {options:?}");
                }
            }
            met += options.len();
        }
        met
    };
    let bench = Bench::new();
    assert!(bench.run("vimc4 man man1", "").status.success());
    let mut all = 0;
    for (command, text) in helps() {
        let title = |line: &'_ str| line.ends_with(':') && line.starts_with(char::is_alphabetic);
        let told = headed(&text, |line| line.strip_suffix(':').filter(|_| title(line)));
        let of_help = check(&command, told);
        let page = bench.path(&format!("man1/{}.1", command.replace(' ', "-")));
        let page = fs::read_to_string(&page).unwrap().replace("\\-", "-").replace("\\fB", "");
        let page = page.replace("\\fR", "");
        // What stands before is prose.
        let page = page.find(".SH OPTIONS").map_or("", |at| &page[at..]);
        let told = headed(page, |line| line.strip_prefix(".SH ").map(|it| it.trim_matches('"')));
        let of_page = check(&format!("the page of {command}"), told);
        all += of_help + of_page;
    }
    assert!(all > 200, "{all}");
}

// --- command lines ---

/// A folder with the examples, in which the shell finds this vimc4.
struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new() -> Bench {
        let folder = tempfile::tempdir().unwrap();
        for name in ["examples", "bin"] {
            fs::create_dir_all(folder.path().join(name)).unwrap();
        }
        symlink(VIMC4, folder.path().join("bin/vimc4")).unwrap();
        for entry in fs::read_dir(root().join("examples")).unwrap() {
            let entry = entry.unwrap();
            if entry.file_type().unwrap().is_file() {
                fs::copy(entry.path(), folder.path().join("examples").join(entry.file_name()))
                    .unwrap();
            }
        }
        Bench { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn shell(&self, line: &str) -> Command {
        let mut shell = Command::new("sh");
        let path = std::env::var("PATH").unwrap_or_default();
        shell.args(["-c", line]).current_dir(self.folder.path()).env("HOME", self.folder.path());
        shell.env("PATH", format!("{}:{path}", self.path("bin").display()));
        shell
    }

    /// Runs a line with this typed at it.
    fn run(&self, line: &str, typed: &str) -> Output {
        let mut shell =
            self.shell(&format!("exec timeout 300 sh -c '{}'", line.replace('\'', "'\\''")));
        shell.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = shell.start().unwrap();
        // It may end without having read anything.
        let _ = child.stdin.take().unwrap().write_all(typed.as_bytes());
        child.output_in_time().unwrap()
    }
}

/// What stands behind an option of a command line.
fn option<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    line.split_once(name)?.1.trim_start().split(' ').next()
}

/// Runs a command line of a document; the reason if it does not run.
fn check(bench: &Bench, page: &str, line: &str) -> Result<(), String> {
    let excepted = ELSEWHERE.iter().any(|(where_, begins, _)| {
        (where_.is_empty() || *where_ == page) && line.starts_with(begins)
    });
    if excepted {
        return Ok(());
    }
    let serves = line.starts_with("vimc4 serve");
    let takes_port = ["./vimc4.pty", "/dev/tty", "COM3", "127.0.0.1:4004"];
    let emulator = (!serves && takes_port.iter().any(|port| line.contains(port))).then(|| {
        let model = option(line, "--model ").unwrap_or("imc4");
        let machine = option(line, "--machine ").unwrap_or("bench");
        let builder = Emulator::builder().model(model).machine(machine).time(Clock::Instant);
        builder.pty(bench.path("vimc4.pty")).tcp("127.0.0.1:0").start().unwrap()
    });
    let mut run = line.to_owned();
    if let Some(emulator) = &emulator {
        let address = emulator.tcp_addr().unwrap().to_string();
        run = run.replace("/dev/ttyUSB0", "./vimc4.pty").replace("COM3", "./vimc4.pty");
        run = run.replace("127.0.0.1:4004", &address);
    }
    if serves {
        run = run.replace("127.0.0.1:8080", "127.0.0.1:0").replace(":4004", ":0");
        if !run.contains(" --tcp ") {
            run += " --tcp 127.0.0.1:0";
        }
    }
    // Playing takes a quarter of a minute; emulator/tests/conform.rs does. Here its options count.
    if line.starts_with("vimc4 conform") {
        // Which needs no port, and no word that is one.
        run = run
            .split(' ')
            .filter(|word| !word.contains("vimc4.pty") && !word.contains("127.0.0.1"))
            .collect::<Vec<_>>()
            .join(" ");
        if !run.contains(" --list") {
            run += " --list";
        }
    }
    // Nobody is there to agree.
    if line.starts_with("vimc4 send") && !line.contains(" --yes") {
        run += " --yes";
    }
    let output = bench.run(&run, if serves { "quit\n" } else { "" });
    let wanted =
        ENDS.iter().find(|(begins, _)| line.starts_with(begins)).map_or(0, |(_, code)| *code);
    let said = String::from_utf8_lossy(&output.stderr);
    match output.status.code() == Some(wanted) {
        true => Ok(()),
        false => Err(format!(
            "{page}: `{line}` (as `{run}`) ended with {}\n{}{said}",
            output.status,
            String::from_utf8_lossy(&output.stdout)
        )),
    }
}

#[test]
fn every_command_line_of_the_documents_runs() {
    let bench = Bench::new();
    let mut wrong = Vec::new();
    let mut count = 0;
    for (page, text) in PAGES {
        for code in code(text) {
            let Some(line) = command_line(&code) else { continue };
            count += 1;
            wrong.extend(
                check(&bench, page, line).map_err(|why| format!("line {}, {why}", code.line)).err(),
            );
        }
    }
    assert!(count > 60, "only {count} command lines were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn every_command_line_of_the_help_runs() {
    let bench = Bench::new();
    let mut wrong = Vec::new();
    for (command, text) in helps() {
        let examples = text.lines().skip_while(|line| *line != "Examples:").skip(1);
        for line in examples.take_while(|line| line.starts_with("  ")).map(str::trim_start) {
            if !line.starts_with("vimc4 ") && !line.starts_with("(echo") {
                continue;
            }
            let line = line.split("   ").next().unwrap();
            wrong.extend(check(&bench, &command, line).err());
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn no_exception_is_left_over() {
    let mut lines = Vec::new();
    for (page, text) in PAGES {
        let code = code(text);
        lines.extend(
            code.iter().filter_map(|code| Some((page.to_owned(), command_line(code)?.to_owned()))),
        );
    }
    for (command, text) in helps() {
        lines.extend(text.lines().map(|line| (command.clone(), line.trim_start().to_owned())));
    }
    for (page, begins, _) in ELSEWHERE {
        let used = lines
            .iter()
            .any(|(at, line)| (page.is_empty() || page == at) && line.starts_with(begins));
        assert!(used, "{page} has no command line that begins with {begins}");
    }
}

// --- names ---

/// All that is a name behind this option, in documents and help.
fn names(option: &str, call: &str) -> BTreeSet<(String, String)> {
    let mut names = BTreeSet::new();
    let helps = helps();
    let texts =
        PAGES.into_iter().chain(helps.iter().map(|(name, text)| (name.as_str(), text.as_str())));
    for (page, text) in texts {
        for opening in [format!("--{option} "), format!("\"--{option}\", \""), format!("{call}(\"")]
        {
            for place in text.split(&opening).skip(1) {
                let end = place.find(|c: char| !c.is_ascii_alphanumeric() && !"-_./".contains(c));
                let name = &place[..end.unwrap_or(place.len())];
                if !name.is_empty() {
                    names.insert((page.to_owned(), name.trim_end_matches('.').to_owned()));
                }
            }
        }
    }
    names
}

#[test]
fn every_model_and_machine_that_is_named_exists() {
    let placeholders = ["NAME", "FILE"];
    for (option, call, built_in) in
        [("model", ".model", vimc4::models()), ("machine", ".machine", vimc4::machines())]
    {
        let names = names(option, call);
        assert!(names.len() > 5, "{names:?}");
        for (page, name) in names {
            // Made by a command of the same page, or there.
            let own =
                ["my.toml", "mine.toml"].contains(&name.as_str()) || root().join(&name).is_file();
            let known =
                built_in.contains(&name.as_str()) || placeholders.contains(&name.as_str()) || own;
            assert!(known, "{page}: there is no {option} {name}; there are {built_in:?}");
        }
    }
}

/// The rows of tables whose first cell is a key and whose second lists values.
fn rows() -> Vec<(&'static str, Vec<&'static str>)> {
    let profiles = include_str!("../../docs/profiles.md");
    let code = |cell: &'static str| cell.split('`').skip(1).step_by(2).collect::<Vec<_>>();
    let mut rows = Vec::new();
    let mut of_values = false;
    for line in profiles.lines() {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        match cells.as_slice() {
            ["", "key", "values", ..] => of_values = true,
            ["", key, values, _, ""] if of_values && key.starts_with('`') => {
                rows.push((code(key)[0], code(values)));
            }
            [""] => of_values = false,
            _ => {}
        }
    }
    rows
}

#[test]
fn every_quirk_of_profiles_md_takes_the_values_that_it_lists() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("profile.toml");
    let takes = |profile: &str, key: &str, value: &str| {
        let begins = format!("{key} = ");
        let lines: Vec<String> = profile
            .lines()
            .map(|line| match line.starts_with(&begins) {
                true => format!("{key} = {value}"),
                false => line.to_owned(),
            })
            .collect();
        fs::write(&file, lines.join("\n")).unwrap();
        vimc4::model(file.to_str().unwrap()).is_ok()
    };
    let rows = rows();
    assert!(rows.len() > 40, "{rows:?}");
    for (key, values) in &rows {
        let begins = format!("\n{key} = ");
        let profiles: Vec<&str> = vimc4::models()
            .into_iter()
            .map(|name| vimc4::model_profile(name).unwrap())
            .filter(|profile| profile.contains(&begins))
            .collect();
        assert!(!profiles.is_empty(), "no profile has {key}");
        for value in values {
            let taken = profiles.iter().any(|profile| {
                takes(profile, key, value) || takes(profile, key, &format!("\"{value}\""))
            });
            assert!(taken, "no profile takes {key} = {value}");
        }
        assert!(!takes(profiles[0], key, "\"nonsense\""), "{key} takes everything");
    }
    // And none is left out.
    for name in vimc4::models() {
        let profile = vimc4::model_profile(name).unwrap();
        let sections = ["[quirks]", "[language]"].into_iter();
        let bodies = sections.filter_map(|name| Some(profile.split_once(name)?.1));
        for line in bodies.flat_map(|body| body.lines().take_while(|line| !line.starts_with('['))) {
            let Some((key, _)) = line.split_once(" = ").filter(|_| !line.starts_with('#')) else {
                continue;
            };
            assert!(
                rows.iter().any(|(row, _)| *row == key),
                "docs/profiles.md lacks {key} of {name}"
            );
        }
    }
}

#[test]
fn the_readme_names_the_oldest_rust_that_will_do() {
    let manifest = include_str!("../../Cargo.toml");
    let version = manifest.split_once("rust-version = \"").unwrap().1.split('"').next().unwrap();
    assert!(PAGES[0].1.contains(&format!("Rust {version} or newer")), "README.md: {version}");
}

/// Files and what they have, as docs/a-byte-comes-in.md writes them: the file with the names in
/// brackets behind it, or a name, `in`, and the file.
#[test]
fn what_the_walk_names_is_where_it_says() {
    let page = include_str!("../../docs/a-byte-comes-in.md");
    // In turn text and code, and a blank for every end of line.
    let text = page.split_whitespace().collect::<Vec<_>>().join(" ");
    let parts: Vec<&str> = text.split('`').collect();
    let is_file = |code: &str| code.ends_with(".rs");
    let mut file = "";
    let mut names = Vec::new();
    for place in (1..parts.len()).step_by(2) {
        let (before, code, after) = (parts[place - 1], parts[place], parts[place + 1]);
        if is_file(code) {
            assert!(root().join(code).is_file(), "there is no {code}");
            file = code;
        } else if after == " in " {
            names.push((code, parts[place + 2]));
        } else if before == " (" || (before == ", " && !file.is_empty()) {
            names.push((code, file));
        } else {
            file = "";
        }
    }
    assert!(names.len() >= 20, "{names:?}");
    for (name, file) in names {
        let source = fs::read_to_string(root().join(file)).unwrap();
        let there = ["fn", "struct", "enum"].iter().any(|kind| {
            let begins = format!("{kind} {name}");
            let ends = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_');
            source.split(&begins).skip(1).any(ends)
        });
        assert!(there, "{file} has no {name}");
    }
}

// --- sessions as they are shown ---

/// The lines of a block in a document, from one that is this.
fn shown(page: &str, first: &str) -> Vec<&'static str> {
    let (_, text) = PAGES.into_iter().find(|(name, _)| *name == page).unwrap();
    let lines = text.lines().skip_while(|line| *line != first);
    let lines: Vec<&str> = lines.skip(1).take_while(|line| !line.starts_with("```")).collect();
    assert!(!lines.is_empty(), "{page} shows nothing behind {first}");
    lines
}

fn text(output: &Output) -> String {
    let all = [output.stdout.as_slice(), output.stderr.as_slice()].concat();
    String::from_utf8(all).unwrap().trim_end().to_owned()
}

#[test]
fn the_job_of_ncp_md_goes_as_shown() {
    let bench = Bench::new();
    let job = fs::read_to_string(bench.path("examples/plate.ncp")).unwrap();
    assert!(include_str!("../../docs/ncp.md").contains(&format!("```\n{job}```")), "{job}");
    let line = "vimc4 ncp run examples/plate.ncp --machine mill";
    let output = bench.run(line, "");
    assert_eq!(text(&output), shown("docs/ncp.md", &format!("$ {line}")).join("\n").trim_end());
    fs::write(bench.path("examples/plate.ncp"), job.replace("X23000", "X230000")).unwrap();
    let line = "vimc4 ncp check examples/plate.ncp --machine mill";
    let output = bench.run(line, "");
    assert_eq!(text(&output), shown("docs/ncp.md", &format!("$ {line}")).join("\n"));
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn the_error_of_profiles_md_is_as_shown() {
    let bench = Bench::new();
    let mill = vimc4::machine_profile("mill").unwrap();
    fs::write(bench.path("mine.toml"), mill.replacen("lead_um = 5000", "lead_um = \"5 mm\"", 1))
        .unwrap();
    let output = bench.run("vimc4 serve --machine mine.toml", "");
    assert_eq!(output.status.code(), Some(2));
    let shown = shown("docs/profiles.md", "$ vimc4 serve --machine mine.toml").join("\n");
    assert_eq!(text(&output), shown);
}

#[test]
fn the_circle_of_the_readme_is_as_shown() {
    let bench = Bench::new();
    let readme = PAGES[0].1;
    let line = "vimc4 circle --radius 200 --from 135 --to 225 --ccw --speed 1500";
    assert!(readme.contains(&format!("`{line}`")), "README.md has no {line}");
    let output = bench.run(line, "");
    for command in String::from_utf8(output.stdout).unwrap().lines() {
        assert!(readme.contains(&format!("`{command}`")), "README.md has no {command}");
    }
}

/// What is compiled says what it is for, so that nobody has to.
#[test]
fn what_compile_writes_runs_without_options() {
    let bench = Bench::new();
    let run = |line: &str, code: i32| {
        let output = bench.run(line, "");
        assert_eq!(output.status.code(), Some(code), "{line}: {}", text(&output));
        text(&output)
    };
    run("vimc4 ncp compile examples/plate.ncp --model imc-s8 --machine mill -o plate.cnc", 0);
    let field = fs::read_to_string(bench.path("plate.cnc")).unwrap();
    assert!(field.starts_with("; model: imc-s8\n; machine: mill\n; axes: 15 ("), "{field}");
    let told = "vimc4 run plate.cnc --model imc-s8 --machine mill --axes 15";
    assert_eq!(run("vimc4 run plate.cnc", 0), run(told, 0));
    // What is told is used, and both are named where they differ.
    let differs = run("vimc4 run plate.cnc --machine bench", 0);
    let note = "plate.cnc was made for the machine mill; --machine bench is used";
    assert!(differs.contains(note) && !differs.contains("the model"), "{differs}");
    // A profile of one's own that is not here.
    run("vimc4 ncp compile examples/plate.ncp --machine examples/machine.toml -o plate.cnc", 0);
    run("vimc4 run plate.cnc", 0);
    fs::remove_file(bench.path("examples/machine.toml")).unwrap();
    let gone = run("vimc4 run plate.cnc", 2);
    assert!(gone.contains("made for the machine examples/machine.toml"), "{gone}");
    assert!(gone.contains("say where it is with --machine"), "{gone}");
    run("vimc4 run plate.cnc --machine mill", 0);
    // A name that would not stay a comment is left out.
    let name = bench.path("a\n0100,900.toml");
    fs::write(&name, vimc4::machine_profile("mill").unwrap()).unwrap();
    let odd = Command::new(VIMC4)
        .args(["ncp", "compile"])
        .arg(bench.path("examples/plate.ncp"))
        .arg("--machine")
        .arg(&name)
        .output_in_time()
        .unwrap();
    let field = String::from_utf8(odd.stdout).unwrap();
    assert!(field.starts_with("; model: imc4\n; axes: 15 ("), "{field}");
    // `send` reads it too: the controller that is asked is another one.
    run("vimc4 ncp compile examples/plate.ncp --model imc-s8 --machine mill -o plate.cnc", 0);
    let pty = bench.path("vimc4.pty");
    for (model, code) in [("imc-s8", 0), ("imc4", 1)] {
        let builder = Emulator::builder().model(model).machine("mill").time(Clock::Instant);
        let emulator = builder.pty(pty.as_path()).start().unwrap();
        let sent = bench.run("vimc4 send plate.cnc --to ./vimc4.pty --yes", "");
        assert_eq!(sent.status.success(), code == 0, "{}", text(&sent));
        drop(emulator);
    }
}

// --- the tour ---

fn has(program: &str, arguments: &[&str]) -> bool {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status_in_time().is_ok_and(|status| status.success())
}

/// The tour of the README, with STOP pressed in its long move. What depends on when it is pressed is
/// the only thing that may differ.
#[test]
fn the_tour_goes_as_shown() {
    let readme = PAGES[0].1;
    let bench = Bench::new();
    let tour = fs::read_to_string(bench.path("examples/tour.py")).unwrap();
    assert!(readme.contains(&format!("```python\n{tour}```")), "README.md quotes another tour");
    if !has("python3", &["--version"]) {
        assert!(std::env::var_os("VIMC4_REQUIRE_TOOLS").is_none(), "needs python3");
        return;
    }
    let mut serve = bench.shell("exec vimc4 serve -v --tcp 127.0.0.1:0 --time 8x");
    let mut serve = Process::start(serve.stderr(Stdio::piped()));
    while serve.line() != "ready" {}
    let mut host = Process::start(&mut bench.shell("exec python3 examples/tour.py"));
    let told = serve.errors();
    let mut log: Vec<String> = Vec::new();
    while log.last().is_none_or(|line| !line.contains("@0A-40000")) {
        log.push(told.recv_timeout(LIMIT).expect("the move in the log"));
    }
    serve.give("press stop\n");
    let mut answers = String::new();
    host.output.as_mut().unwrap().read_to_string(&mut answers).unwrap();
    let answers: Vec<&str> = answers.lines().collect();
    let shown_answers = shown("README.md", "$ python3 examples/tour.py");
    assert_eq!(answers.len(), shown_answers.len(), "{answers:?}");
    let mut differ = Vec::new();
    for (answer, shown) in answers.iter().zip(&shown_answers) {
        differ.extend((answer != shown).then_some(*shown));
    }
    // Where STOP halted it.
    assert!(
        differ.len() <= 1 && differ.iter().all(|line| line.starts_with("@0P -> 000")),
        "{answers:?}"
    );
    // The tour ends where the next command that is shown begins.
    assert_eq!(answers.last(), Some(&"@0P -> 0000000000000000000"));
    serve.give("quit\n");
    log.extend(told);
    // Times and places differ; what is said of the commands does not.
    let explained = shown("README.md", "Meanwhile `serve` has been showing what it understood:");
    for line in explained.iter().filter(|line| line.contains(" s  @")) {
        let line = line.split_once(" s  ").unwrap().1.trim_end_matches('…').trim_end();
        assert!(log.iter().any(|told| told.contains(line)), "{line}: {log:#?}");
    }
}

/// The plot of the examples, sent by a program that heeds CTS.
#[test]
fn the_plot_of_the_examples_is_sent_under_lines() {
    if !cfg!(target_os = "linux") || !has("python3", &["-c", "import serial"]) {
        assert!(std::env::var_os("VIMC4_REQUIRE_TOOLS").is_none(), "needs Linux and pyserial");
        return;
    }
    let bench = Bench::new();
    let line = "vimc4 lines --serve --model smcu --machine board-plotter --time instant -- python3 \
                examples/plot.py ./vimc4.pty";
    let output = bench.run(line, "");
    assert!(output.status.success(), "{}", text(&output));
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim_end(), "0,0,0");
}

#[test]
fn the_scripts_for_ci_are_found_in_a_folder_whose_name_has_a_blank() {
    let bench = Bench::new();
    let scripts = bench.path("a blank/ci");
    fs::create_dir_all(&scripts).unwrap();
    for name in ["serve.sh", "finish.sh"] {
        fs::write(scripts.join(name), "exit").unwrap();
        let runs =
            Command::new("chmod").arg("+x").arg(scripts.join(name)).status_in_time().unwrap();
        assert!(runs.success());
    }
    let lines = include_str!("../../docs/install.md").lines();
    let lines: Vec<&str> = lines.filter(|line| line.contains("$VIMC4/ci")).collect();
    assert_eq!(lines.len(), 4);
    for line in lines {
        // As a string of YAML and of Groovy; what follows runs the tests.
        let line = line.split('\'').nth(1).unwrap_or_else(|| panic!("{line} is no string"));
        let line = line.split(" && ").next().unwrap();
        let output = bench.run(&format!("VIMC4=\"$PWD/a blank\"; {line}"), "");
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

// --- completion ---

/// A shell at a terminal, with the completion of vimc4 in its settings.
struct Shell {
    terminal: Timed<fs::File>,
    _shell: Process,
}

impl Shell {
    /// Ctrl-T shows the line as it is. All that can be meant is listed at the first Tab.
    fn bash(bench: &Bench) -> Shell {
        let settings = "source <(vimc4 completions bash)\nPS1='$ '\n\
            bind -x '\"\\C-t\": printf \"<%s>\\\\n\" \"$READLINE_LINE\"'\n\
            for setting in 'completion-query-items 0' 'page-completions off' 'bell-style none' \
            'enable-bracketed-paste off' 'show-all-if-ambiguous on'; do bind \"set $setting\"; done\n";
        fs::write(bench.path("bashrc"), settings).unwrap();
        fs::write(bench.path("inputrc"), "").unwrap();
        let mut bash = bench.shell("exec timeout --foreground 300 bash --rcfile bashrc -i");
        bash.env("INPUTRC", bench.path("inputrc"));
        Shell::of(bash)
    }

    /// The same, with these lines for completion.
    fn zsh(bench: &Bench, completion: &str) -> Shell {
        let settings = format!(
            "{completion}\nPS1='$ '\nunsetopt prompt_sp prompt_cr beep\n\
             shown() {{ print -r -- \"<$BUFFER>\" }}\nzle -N shown\nbindkey -e\n\
             bindkey '^T' shown\n"
        );
        fs::write(bench.path(".zshrc"), settings).unwrap();
        let mut zsh = bench.shell("exec timeout --foreground 300 zsh -d -i");
        zsh.env("ZDOTDIR", bench.path(""));
        Shell::of(zsh)
    }

    fn of(mut shell: Command) -> Shell {
        let (near, name) = pseudo_terminal();
        let far = terminal(name).into_inner();
        shell.env("TERM", "dumb");
        shell.stdin(far.try_clone().unwrap()).stdout(far.try_clone().unwrap()).stderr(far);
        let shell = Process::of(shell.start().unwrap());
        let mut shell =
            Shell { terminal: Timed::new("the shell", fs::File::from(near)), _shell: shell };
        shell.until("$ ");
        shell
    }

    /// What comes up to this, and no further.
    fn until(&mut self, end: &str) -> String {
        let mut said = Vec::new();
        while !said.ends_with(end.as_bytes()) {
            let mut byte = [0];
            let read = self.terminal.read_exact(&mut byte);
            assert!(read.is_ok(), "{read:?} behind {:?}", String::from_utf8_lossy(&said));
            said.extend(byte);
        }
        String::from_utf8(said).unwrap()
    }

    /// What is offered when Tab is pressed behind this, and the line after that.
    fn tab(&mut self, typed: &str) -> (Vec<String>, String) {
        write!(self.terminal, "{typed}\t\x14").unwrap();
        let offered = self.until("<");
        let line = self.until(">\r\n").trim_end_matches(">\r\n").to_owned();
        write!(self.terminal, "\x15").unwrap();
        let lines =
            offered.trim_end_matches('<').split("\r\n").filter(|line| !line.starts_with("$ "));
        // In columns, with two blanks or more between them.
        let offered = lines.flat_map(|line| line.split("  ")).map(str::trim);
        (offered.filter(|word| !word.is_empty()).map(str::to_owned).collect(), line)
    }
}

#[test]
fn names_are_completed() {
    let bench = Bench::new();
    fs::write(bench.path("imc-mine.toml"), "").unwrap();
    let mut bash = Shell::bash(&bench);
    // The line becomes longer by this.
    let mut becomes = |typed: &str, more: &str| {
        let (offered, line) = bash.tab(typed);
        assert_eq!(line, format!("{typed}{more}"), "{offered:?}");
    };
    becomes("vimc4 ser", "ve ");
    becomes("vimc4 serve --mod", "el ");
    becomes("vimc4 serve --machine posit", "ioner ");
    becomes("vimc4 run --machine=posit", "ioner ");
    becomes("vimc4 serve --tcp-clients o", "bserve ");
    // bash takes =, : and @ for ends of words, and offers the names of hosts behind @.
    becomes("vimc4 run --input cov", "er");
    becomes("vimc4 run --input=cover=o", "pen ");
    becomes("vimc4 run --input cover=c", "losed ");
    becomes("vimc4 run --press start@", "");
    becomes("vimc4 run --press start@l", "");
    becomes("vimc4 serve --tcp 0.0.0.0:", "4004 ");
    becomes("vimc4 send --to tcp:", "127.0.0.1:4004 ");
    becomes("vimc4 doctor 12", "7.0.0.1:4004 ");
    becomes("vimc4 replay examples/lim", "it.jsonl ");
    becomes("vimc4 minimise --quirk stop_rep", "ly=F");
    becomes("vimc4 record --device 12", "7.0.0.1:4004 ");
    // And blanks too.
    becomes("vimc4 run --input limit", "\\ ");
    becomes("vimc4 run --input limit\\ x", "");
    becomes("vimc4 run --input \"limit z+", "=");
    becomes("vimc4 run --model \"smcu\" --input spindle-f", "ault=");
    becomes("cd .; vimc4 run --model smcu --press ", "stop ");
    becomes("vimc4 lines -- vimc", "4 ");
    becomes("vimc4 lines --serve -- vimc4 exam", "ples/");
    let mut has = |typed: &str, wanted: &[&str], unwanted: &[&str]| {
        let (offered, line) = bash.tab(typed);
        let has = |word: &&str| offered.iter().any(|offered| offered == word);
        assert!(wanted.iter().all(has), "{line}: {offered:?}");
        assert!(!unwanted.iter().any(has), "{line}: {offered:?}");
    };
    has("vimc4 serve --model imc-", &["imc-s8", "imc-mp", "imc-mine.toml"], &["imc4"]);
    has("vimc4 run --machine ", &vimc4::machines(), &["imc4"]);
    has("vimc4 machines show m", &["mill", "mill-4axis"], &["motionsystem"]);
    has("vimc4 run --press st", &["start", "stop"], &["on"]);
    has("vimc4 run --input 0.3", &["0.3=0", "0.3=1"], &["0.2=1"]);
    has("vimc4 run --input 0.3=", &["0", "1"], &["--model"]);
    has("vimc4 run --input cov", &["cover=open", "cover=closed"], &["0.3=1"]);
    has("vimc4 run --input cover=", &["open", "closed"], &["--model"]);
    has("vimc4 run --input limit\\ x", &["limit\\ x-=0", "limit\\ x+=1"], &["limit\\ y-=0"]);
    has(
        "vimc4 run --model smcu --input ",
        &["limit\\ x-=0", "stop=1", "ball\\ axis=2"],
        &["cover=open"],
    );
    has("vimc4 serve --tcp 127.0.0.1:", &["4004", "0"], &["--model"]);
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let output = bench.run(&format!("vimc4 completions {shell}"), "");
        assert!(text(&output).contains("VIMC4_COMPLETE"), "{shell}: {}", text(&output));
    }
    let mut fish = Command::new(VIMC4);
    let asked =
        fish.env("VIMC4_COMPLETE", "fish").args(["--", "vimc4", "serve", "--machine", "mi"]);
    let output = asked.output_in_time().unwrap();
    let offered = String::from_utf8(output.stdout).unwrap();
    assert!(offered.contains("mill\ta flat-bed milling machine"), "{offered}");
}

#[test]
fn zsh_completes_names_from_its_settings_and_from_a_folder_of_scripts() {
    if !Command::new("zsh").arg("--version").output_in_time().is_ok_and(|zsh| zsh.status.success())
    {
        assert!(std::env::var_os("VIMC4_REQUIRE_TOOLS").is_none(), "needs zsh");
        return;
    }
    let bench = Bench::new();
    let script = bench.run("vimc4 completions zsh", "");
    fs::create_dir(bench.path("scripts")).unwrap();
    fs::write(bench.path("scripts/_vimc4"), script.stdout).unwrap();
    let begun = "autoload -U compinit; compinit -u -D";
    for completion in [
        format!("{begun}; source <(vimc4 completions zsh)"),
        format!("fpath=($PWD/scripts $fpath); {begun}"),
    ] {
        let mut zsh = Shell::zsh(&bench, &completion);
        // The first Tab of a session counts as much as the next.
        for (typed, more) in [("vimc4 ser", "ve "), ("vimc4 serve --machine posit", "ioner ")] {
            let (offered, line) = zsh.tab(typed);
            assert_eq!(line, format!("{typed}{more}"), "{completion}: {offered:?}");
        }
    }
}
