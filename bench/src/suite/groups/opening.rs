//! A recording of a gigabyte: when it is seen for the first time, and what it takes to read all of it.

use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Stdio};
use std::time::Instant;

use serde_json::Value;

use crate::suite::Bench;
use crate::suite::failure::{Doing, Failure, Outcome};
use crate::suite::numbers::{bytes, count, nanos};
use crate::suite::report::{Figure, Section};
use crate::suite::stats::Sample;
use crate::suite::usage::peak;

/// Two moves and two questions, three times: the second time is what the recording goes on with.
const COMMANDS: &str = "@01\n\
    @0A100,5000\n@0P\n@0A-100,5000\n@0P\n\
    @0A100,5000\n@0P\n@0A-100,5000\n@0P\n\
    @0A100,5000\n@0P\n@0A-100,5000\n@0P\n";

/// The lines that two moves and two questions take.
const ROUND: usize = 8;

/// How long the first picture may take, nanoseconds.
const FIRST: f64 = 1e9;

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let size: u64 = bench.either(1_000_000_000, 50_000_000);
    let file = bench.launcher.file("long", COMMANDS)?;
    let commands = generate(bench, &file, size)?;
    let file = file.with_extension("jsonl");

    let mut first = Sample::default();
    for _ in 0..bench.either(10, 3) {
        let began = Instant::now();
        let mut console = Console::open(bench, &file)?;
        console.ask("where")?;
        first.add(began.elapsed().as_nanos() as f64);
    }
    let mut console = Console::open(bench, &file)?;
    let began = Instant::now();
    console.ask("goto end")?;
    let whole = began.elapsed().as_nanos() as f64;
    let memory = peak(console.child.id()).doing("read how much memory the console takes")?;
    drop(console);
    std::fs::remove_file(&file).doing("remove the recording")?;

    let mut section = Section::default();
    let worst = first.quantile(1.0);
    section.add(
        Figure::new(
            "from the start of `vimc4 console FILE` to its first answer",
            format!("{}, {}", nanos(first.median()), nanos(worst)),
        )
        .target(format!("≤ {} each", nanos(FIRST)), worst <= FIRST),
    );
    section.add(Figure::new("`goto end`, which reads all of it", nanos(whole)));
    section.add(Figure::new("the most memory until then", bytes(memory)));
    section.note(format!(
        "A recording of {}, with {} commands. The first number is the median, the second the worst. \
         It is in the memory of the operating system.",
        bytes(size as f64),
        count(commands as f64),
    ));
    Ok(section)
}

/// A console with a typing user.
struct Console {
    child: Child,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Console {
    fn open(bench: &Bench, file: &Path) -> Outcome<Console> {
        let mut command = bench.launcher.command();
        command.arg("console").arg(file).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().doing("start the console")?;
        let orders = child.stdin.take().doing("write to the console")?;
        let answers = BufReader::new(child.stdout.take().doing("read from the console")?);
        Ok(Console { child, orders, answers })
    }

    /// Types a line and waits until it has been carried out.
    fn ask(&mut self, line: &str) -> Outcome<()> {
        writeln!(self.orders, "{line}\nprint 123454321").doing("write to the console")?;
        for answer in self.answers.by_ref().lines() {
            if answer.doing("read from the console")? == "123454321" {
                return Ok(());
            }
        }
        Err(Failure::new("the console has ended"))
    }
}

impl Drop for Console {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Writes a recording of so many bytes, in which the same happens again and again, and says how many
/// commands it has.
fn generate(bench: &Bench, commands: &Path, size: u64) -> Outcome<u64> {
    let short = commands.with_extension("short.jsonl");
    let mut run = bench.launcher.command();
    run.arg("run").arg(commands).args(["--machine", "mill", "--record"]).arg(&short);
    let output = run.output().doing("run the commands")?;
    if !output.status.success() {
        return Err(Failure::new(String::from_utf8_lossy(&output.stderr)));
    }
    let text = std::fs::read_to_string(&short).doing("read the short recording")?;
    let mut head = text.lines();
    let said = head.clone().skip(2);
    let mut rounds = Vec::new();
    for line in said {
        let mut line: Value = serde_json::from_str(line).doing("read a line of it")?;
        if line.get("in").is_some() || line.get("out").is_some() {
            let at = line["at"].as_u64().doing("read its time")?;
            line.as_object_mut().and_then(|line| line.remove("at"));
            // Behind its brace stands its time.
            rounds.push((at, line.to_string().split_off(1)));
        }
    }
    let first = rounds.get(2).doing("find the first round")?.0;
    let second = rounds.get(2 + ROUND).doing("find the second round")?.0;
    let file = File::create_new(commands.with_extension("jsonl")).doing("make the recording")?;
    let mut file = BufWriter::with_capacity(1 << 20, file);
    let mut written = 0;
    let mut write = |text: &str| {
        written += text.len() as u64;
        file.write_all(text.as_bytes()).doing("write the recording").map(|()| written)
    };
    for line in head.by_ref().take(2) {
        write(&format!("{line}\n"))?;
    }
    for (at, line) in &rounds[..2] {
        write(&format!("{{\"at\":{at},{line}\n"))?;
    }
    let (mut made, mut later) = (1, 0);
    loop {
        for (at, line) in &rounds[2..2 + ROUND] {
            write(&format!("{{\"at\":{},{line}\n", at + later))?;
        }
        (made, later) = (made + 4, later + (second - first));
        if write("")? >= size {
            break;
        }
    }
    write(&format!("{{\"at\":{},\"end\":\"it is long enough\"}}\n", first + later))?;
    file.flush().doing("write the recording")?;
    Ok(made)
}
