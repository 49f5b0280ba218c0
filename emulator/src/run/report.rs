//! The output of a run, line by line as it goes, or as one line of JSON at its end.

use std::io::{self, BufWriter, IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::ProgressBar;
use serde_json::{Map, Value, json};
use vimc4_catalogue::{Machine, Measure};
use vimc4_device::{Grouped, Time, Warning, escape};

use super::arguments::Arguments;
use super::meter::Meter;
use crate::endings::INTERRUPTED;
use crate::failure::Failure;
use crate::output;
use crate::text::{self, explained, shortened, shown_in_line};
use vimc4_script::{Kind, Script, ScriptLine};

/// How many characters of a line are quoted.
const QUOTE: usize = 200;

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Why {
    /// Everything was done.
    Done,
    /// An error reply, or a program that ended with an error.
    Error,
    /// The time was over.
    Time,
    /// The rounds were made.
    Loops,
    /// Nothing would ever have gone on.
    Waits,
    /// Somebody has ended it.
    Interrupted,
}

impl Why {
    /// The exit code.
    pub(super) fn code(self) -> u8 {
        match self {
            Why::Done => 0,
            Why::Error => 1,
            Why::Time | Why::Loops | Why::Waits => 3,
            Why::Interrupted => INTERRUPTED,
        }
    }

    /// For scripts.
    fn word(self) -> &'static str {
        match self {
            Why::Done => "done",
            Why::Error => "error",
            Why::Time => "for",
            Why::Loops => "loops",
            Why::Waits => "waits",
            Why::Interrupted => "interrupted",
        }
    }
}

/// The end of a run.
#[derive(Debug)]
pub(super) struct End {
    pub(super) why: Why,
    pub(super) text: String,
    /// The line of the file where it ended.
    pub(super) line: Option<usize>,
    /// What a person can do, and what else there is to say of it, line by line.
    pub(super) help: Vec<String>,
}

impl End {
    pub(super) fn of(why: Why, text: impl Into<String>) -> End {
        End { why, text: text.into(), line: None, help: Vec::new() }
    }
}

/// What a controller leaves out of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Left {
    /// A command that it does not know.
    Command,
    /// Numbers that belong to no command.
    Numbers,
    /// What would be a command in capital letters.
    LowerCase,
    /// Numbers of an escape sequence.
    Escape,
    /// A command that another has taken out of the buffer.
    TakenAway,
}

/// What was left out, and where.
#[derive(Debug)]
struct LeftOut {
    what: Left,
    line: Option<usize>,
    text: String,
    /// How many numbers.
    numbers: usize,
}

/// What is to be done about escape sequences.
pub(crate) const ESCAPE: &str = "it is an escape sequence, ESC and a point, with which programs set up \
                                 the line of pen plotters: choose a plotter without a handshake where \
                                 the file is written, or take all of them out";

/// What is to be done about commands in lower-case letters.
pub(super) const LOWER_CASE: &str = "lower-case letters are not commands: write PA, not pa";

/// How many places with something left out are listed.
const PLACES: usize = 20;

/// What was answered.
#[derive(Debug, Default)]
pub(super) struct Answered {
    /// What was answered before the command was executed, if it was answered twice.
    pub(super) early: Vec<u8>,
    pub(super) bytes: Vec<u8>,
    /// Why, if it is an error.
    pub(super) why: Option<Box<str>>,
}

impl Answered {
    /// A refusal in words, as its bytes alone say it, with the reason in place of what they mean.
    pub(super) fn explain(&self, refusal: String) -> String {
        explained(refusal, self.why.as_deref())
    }
}

/// A command and its outcome.
pub(super) struct Answer<'a> {
    pub(super) line: &'a ScriptLine,
    /// `None` if nothing was answered.
    pub(super) answer: Option<&'a Answered>,
    /// Why it is an error, or why there is none.
    pub(super) why: Option<&'a str>,
    /// When it was sent.
    pub(super) at: Time,
    /// How long its answer took.
    pub(super) took: Duration,
    /// How long it ran: older cards answer some commands before they execute them.
    pub(super) ran: Duration,
    /// What people call it.
    pub(super) meaning: String,
}

/// What a run has come to.
struct Summary<'a> {
    end: &'a End,
    axes: Vec<Travelled<'a>>,
    /// Which of them are at an unknown place, for people.
    lost: Option<String>,
    path_mm: f64,
    /// How much of the path was made with the head down, and how long it took, where there is a head.
    down: Option<(f64, Duration)>,
    rounds: u64,
    time: Duration,
}

/// Where an axis is, and how far it has travelled.
struct Travelled<'a> {
    name: &'a str,
    position: i64,
    /// Whether that is where it is.
    is_known: bool,
    steps: u64,
    unit: Measure,
}

/// The axes that are configured, or not where they began.
fn travelled<'a>(view: &'a vimc4::View, meter: &Meter, machine: &Machine) -> Vec<Travelled<'a>> {
    let units = machine.measures();
    let axes = view.axes.iter().filter_map(|axis| {
        let number = usize::from(axis.index);
        let (steps, unit) = (*meter.steps.get(number)?, *units.get(number)?);
        let is_shown = axis.configured || axis.position != 0 || steps != 0;
        let (name, position) = (axis.name.as_str(), axis.position);
        let is_known = !meter.lost.contains(&number);
        is_shown.then_some(Travelled { name, position, is_known, steps, unit })
    });
    axes.collect()
}

/// Tells a person, or collects for a script.
pub(super) struct RunReport {
    file: String,
    kind: Kind,
    json: bool,
    verbose: bool,
    out: BufWriter<io::Stdout>,
    /// Whether everything could be written.
    written: io::Result<()>,
    progress: Progress,
    /// When time began to count.
    began: Time,
    answers: Vec<Value>,
    warnings: Vec<Value>,
    /// What rules and faults have done, for JSON.
    told: Vec<Value>,
    /// What the controller has left out.
    left: Vec<LeftOut>,
    /// The name of the model.
    model: String,
    keep_going: bool,
    ignore_numbers: bool,
    /// Characters to and from the controller.
    characters: u64,
}

impl RunReport {
    pub(super) fn new(arguments: &Arguments, script: &Script) -> RunReport {
        // Lines that run by are progress enough.
        let quiet = arguments.json || script.kind == Kind::DataField && !arguments.verbose;
        RunReport {
            file: text::name(&arguments.file),
            kind: script.kind,
            json: arguments.json,
            verbose: arguments.verbose,
            out: BufWriter::new(io::stdout()),
            written: Ok(()),
            progress: Progress::new(quiet || !io::stdout().is_terminal()),
            began: Time::ZERO,
            answers: Vec::new(),
            warnings: Vec::new(),
            told: Vec::new(),
            left: Vec::new(),
            model: arguments.setup.model().to_owned(),
            keep_going: arguments.keep_going,
            ignore_numbers: arguments.ignore_numbers,
            characters: 0,
        }
    }

    /// Lets time count from now on.
    pub(super) fn begin(&mut self, now: Time) {
        self.began = now;
    }

    /// A line, as it can be found in the file.
    pub(super) fn place(&self, line: &ScriptLine) -> String {
        let text = line.text();
        let text = shortened(&text, QUOTE);
        match line.number {
            Some(number) => format!("{}, line {number} (`{text}`)", self.file),
            None => format!("`{text}`"),
        }
    }

    /// A command was answered, or was not.
    pub(super) fn answer(&mut self, answer: Answer<'_>) {
        let Answer { line, answer, why, at, took, ran, meaning } = answer;
        let whole = answer.map(|answer| [answer.early.as_slice(), &answer.bytes].concat());
        let answer = whole.as_deref();
        let sent = line.length() + answer.map_or(0, <[u8]>::len);
        self.characters += sent as u64;
        if self.json {
            let mut answered = json!({
                "line": line.number,
                "command": line.text(),
                "answer": answer.map(escape),
                "at_ns": at.nanos_since(self.began),
                "took_ns": nanos(took),
            });
            if let Some(why) = why {
                answered["why"] = why.into();
            }
            self.answers.push(answered);
            return;
        }
        if self.kind == Kind::DataField && !self.verbose && answer == Some(b"0") {
            return;
        }
        let number = line.number.map(|number| number.to_string()).unwrap_or_default();
        let text = match (answer, self.kind) {
            (None, _) => "(no answer)".to_owned(),
            (Some(answer), Kind::Stream) => {
                let lines = answer.split(|&byte| byte == b'\r').filter(|line| !line.is_empty());
                lines.map(escape).collect::<Vec<_>>().join("  ")
            }
            (Some(answer), _) => escape(answer),
        };
        let sent = line.text();
        let mut said = format!("{number:>6}  {:<32}  {text}", shortened(&sent, QUOTE));
        if !took.is_zero() {
            said += &format!("  after {}", seconds(took));
        }
        if ran > took {
            said += &format!("  done after {}", seconds(ran));
        }
        if let Some(why) = why {
            said += &format!(": {}", shown_in_line(&shortened(why, QUOTE)));
        }
        if self.verbose {
            said += &format!("  ({})", shown_in_line(&shortened(&meaning, QUOTE)));
        }
        self.say(&said);
    }

    /// Whether commands that the controller does not know are left out.
    pub(super) fn keeps_going(&self) -> bool {
        self.keep_going
    }

    /// The controller leaves something out.
    pub(super) fn left(&mut self, what: Left, line: &ScriptLine) {
        let (text, numbers) = (escape(line.bytes.trim_ascii()), line.numbers);
        self.left.push(LeftOut { what, line: line.number, text, numbers });
    }

    /// A command was refused, and that is the end.
    pub(super) fn refused(
        &self,
        line: Option<&ScriptLine>,
        refusal: &str,
        help: Vec<String>,
    ) -> End {
        let text = match line {
            Some(line) => format!("{} was answered {refusal}", self.place(line)),
            None => format!("it said {refusal}"),
        };
        End { line: line.and_then(|line| line.number), help, ..End::of(Why::Error, text) }
    }

    /// The end of a stream: whether everything was carried out, and what was not.
    pub(super) fn carried_out(&self) -> End {
        let of = |what| self.left.iter().filter(move |left| left.what == what);
        let (commands, places) = (of(Left::Command).count(), of(Left::Numbers).count());
        let numbers: usize = of(Left::Numbers).map(|left| left.numbers).sum();
        let mut help = Vec::new();
        let mut unsaid = Vec::new();
        if commands > 0 {
            unsaid.push(match commands {
                1 => "1 command that the controller does not know was left out".to_owned(),
                _ => format!("{commands} commands that the controller does not know were left out"),
            });
            help.extend(listed(of(Left::Command)));
            if !self.keep_going {
                help.push("--keep-going leaves it at that".to_owned());
            }
        }
        if numbers > 0 {
            let at = if places == 1 { String::new() } else { format!(" at {places} places") };
            unsaid.push(match numbers {
                1 => "1 number that belongs to no command was ignored".to_owned(),
                _ => format!("{numbers} numbers that belong to no command were ignored{at}"),
            });
            help.extend(listed(of(Left::Numbers)));
            let model = &self.model;
            let takes =
                format!("with bare_pairs = \"repeat\" under [quirks] {model} takes them for moves");
            help.push(match vimc4_catalogue::models().contains(&model.as_str()) {
                true => {
                    format!("{takes}; your own begins with vimc4 models show {model} > my.toml")
                }
                false => takes,
            });
            if !self.ignore_numbers {
                help.push("--ignore-numbers leaves it at that".to_owned());
            }
        }
        let escapes = of(Left::Escape).count();
        if escapes > 0 {
            unsaid.push(match escapes {
                1 => {
                    "1 escape sequence that means nothing to the controller was ignored".to_owned()
                }
                _ => format!(
                    "{escapes} escape sequences that mean nothing to the controller were ignored"
                ),
            });
            help.extend(listed(of(Left::Escape)));
        }
        let lower_case = of(Left::LowerCase).count();
        if lower_case > 0 {
            unsaid.push(match lower_case {
                1 => "1 command in lower-case letters was ignored".to_owned(),
                _ => format!("{lower_case} commands in lower-case letters were ignored"),
            });
            help.extend(listed(of(Left::LowerCase)));
            help.push(LOWER_CASE.to_owned());
        }
        let taken = of(Left::TakenAway).count();
        if taken > 0 {
            unsaid.push(match taken {
                1 => "1 command was taken away before its turn".to_owned(),
                _ => format!("{taken} commands were taken away before their turn"),
            });
            help.extend(listed(of(Left::TakenAway)));
        }
        if unsaid.is_empty() {
            return End::of(Why::Done, "every command was carried out");
        }
        let fails =
            commands > 0 && !self.keep_going || numbers + lower_case > 0 && !self.ignore_numbers;
        let why = if fails { Why::Error } else { Why::Done };
        let line = self.left.first().and_then(|left| left.line).filter(|_| fails);
        let text = format!("the end of the file was reached, but {}", unsaid.join(", and "));
        End { line, help, ..End::of(why, text) }
    }

    /// A program was stored and is to be started.
    pub(super) fn stored(&mut self, lines: usize) {
        if !self.json {
            let s = if lines == 1 { "" } else { "s" };
            self.say(&format!(
                "        stored {} line{s}, start with START",
                Grouped(lines as i64)
            ));
        }
    }

    /// A line of the stored program is executed.
    pub(super) fn line(&mut self, at: Time, line: Option<&ScriptLine>, number: u32) {
        if self.verbose && !self.json {
            let place = line.and_then(|line| line.number);
            let place = place.map_or_else(|| format!("#{number}"), |number| number.to_string());
            let text = line.map(ScriptLine::text).unwrap_or_default();
            let text = shortened(&text, QUOTE);
            let at = seconds(at - self.began);
            self.say(&format!("{place:>6}  {text:<32}  at {at}"));
        }
    }

    /// The controller sent something that is not an answer; why, if that is an error.
    pub(super) fn sent(&mut self, at: Time, bytes: &[u8], why: Option<&str>) {
        self.characters += bytes.len() as u64;
        let (text, after) = (escape(bytes), at - self.began);
        if self.json {
            self.answers.push(json!({ "sent": text, "at_ns": nanos(after) }));
        } else {
            let why = why.map(|why| format!(": {}", shown_in_line(why))).unwrap_or_default();
            self.say(&format!("        sends {text} at {}{why}", seconds(after)));
        }
    }

    /// Something was lost or assumed. The text is for those that need more than they know.
    pub(super) fn warning(&mut self, at: Time, warning: &Warning, text: Option<String>) {
        if self.json {
            self.warnings.push(serde_json::to_value(warning).unwrap_or_default());
            return;
        }
        let text = text.unwrap_or_else(|| warning.to_string());
        self.say(&format!("        warning: {text} at {}", seconds(at - self.began)));
    }

    /// A rule or a fault has done something.
    pub(super) fn told(&mut self, at: Time, text: &str) {
        let after = at - self.began;
        if self.json {
            self.told.push(json!({ "told": text, "at_ns": nanos(after) }));
        } else {
            self.say(&format!("        {text} at {}", seconds(after)));
        }
    }

    /// Time has passed.
    pub(super) fn progress(&mut self, now: Time) {
        self.progress.tick(|| format!("{} of virtual time", seconds(now - self.began)));
    }

    /// Says how it ended.
    pub(super) fn finish(
        mut self,
        end: &End,
        view: &vimc4::View,
        meter: &Meter,
        rounds: u64,
        machine: &Machine,
        baud: u32,
    ) -> Result<(), Failure> {
        self.progress.clear();
        let down = view.details.is_head_down().map(|_| meter.down);
        let time = view.at - self.began;
        let axes = travelled(view, meter, machine);
        let lost = meter.lost_in_words(|axis| view.axes[axis].name.clone());
        let summary = Summary { end, axes, lost, path_mm: meter.path_mm, down, rounds, time };
        match self.json {
            true => {
                let summary = self.as_json(&summary).to_string();
                self.say(&summary);
            }
            false => self.print(&summary, baud),
        }
        output::written(self.written.and_then(|()| self.out.flush()))
    }

    fn as_json(&mut self, summary: &Summary<'_>) -> Value {
        let axes = summary.axes.iter().map(|axis| {
            let mut value = json!({
                "position": axis.position,
                "travelled": axis.steps,
                "unit": axis.unit.name,
                "unit_per_step": axis.unit.per_step,
            });
            if !axis.is_known {
                value["position_known"] = false.into();
            }
            (axis.name.to_owned(), value)
        });
        let mut shown = json!({
            "ended": summary.end.why.word(),
            "text": summary.end.text,
            "line": summary.end.line,
            "time_ns": nanos(summary.time),
            "rounds": summary.rounds,
            "axes": axes.collect::<Map<_, _>>(),
            "path_mm": summary.path_mm,
            "answers": self.answers,
            "warnings": self.warnings,
        });
        if self.kind == Kind::Stream {
            for (key, what) in [
                ("unknown", Left::Command),
                ("ignored", Left::Numbers),
                ("escapes", Left::Escape),
                ("lower_case", Left::LowerCase),
                ("taken_away", Left::TakenAway),
            ] {
                let left = self.left.iter().filter(|left| left.what == what);
                shown[key] = left.map(LeftOut::json).collect();
            }
        }
        if !self.told.is_empty() {
            shown["told"] = std::mem::take(&mut self.told).into();
        }
        if let Some((path_mm, time)) = summary.down {
            shown["head_down"] = json!({ "path_mm": path_mm, "time_ns": nanos(time) });
        }
        shown
    }

    fn print(&mut self, summary: &Summary<'_>, baud: u32) {
        let mut table = format!("\n{:<10}{:>14}{:>32}\n", "axis", "position", "travelled");
        for Travelled { name, position, is_known, steps, unit } in &summary.axes {
            let length = |steps: f64| format!("{:.3} {:<2}", steps * unit.per_step, unit.name);
            let place = match is_known {
                true => length(*position as f64),
                false => "unknown".to_owned(),
            };
            table += &format!(
                "{name:<10}{:>14}{place:>18}{:>14}{:>18}\n",
                Grouped(*position),
                Grouped(i64::try_from(*steps).unwrap_or(i64::MAX)),
                length(*steps as f64),
            );
        }
        self.say(table.trim_end_matches('\n'));
        if let Some(lost) = &summary.lost {
            self.say(&format!("unknown   {lost}"));
        }
        self.say(&format!("path      {:.3} mm", summary.path_mm));
        if let Some((path_mm, time)) = summary.down {
            let time = seconds(time);
            self.say(&format!("          {path_mm:.3} mm of it with the head down, in {time}"));
        }
        if summary.rounds > 0 {
            self.say(&format!("rounds    {}", summary.rounds));
        }
        let mut line = format!("time      {}", seconds(summary.time));
        if self.kind != Kind::DataField {
            let characters = self.characters;
            let nanos = characters.saturating_mul(10_000_000_000) / u64::from(baud.max(1));
            line += &format!(
                ", and {} on the line for {} characters at {baud} baud",
                seconds(Duration::from_nanos(nanos)),
                Grouped(i64::try_from(characters).unwrap_or(i64::MAX)),
            );
        }
        self.say(&line);
        let end = summary.end;
        self.say(&format!("ended     {}", end.text));
        for line in &end.help {
            self.say(&format!("          {line}"));
        }
        if end.why == Why::Waits && end.help.is_empty() {
            // A reference run without a switch ahead of it waits for nothing that could be given.
            self.say(match end.text.contains("reference run") {
                true => "          choose a machine with switches, as in --machine mill",
                false => {
                    "          give it what it waits for, as in --input 0.2=1@2s or --press start@5s"
                }
            });
        }
    }

    fn say(&mut self, text: &str) {
        if self.written.is_ok() {
            self.written = writeln!(self.out, "{text}");
        }
    }
}

impl LeftOut {
    fn json(&self) -> Value {
        match self.what {
            Left::Command | Left::LowerCase | Left::TakenAway => {
                json!({ "line": self.line, "command": self.text })
            }
            Left::Numbers | Left::Escape => {
                json!({ "line": self.line, "text": self.text, "numbers": self.numbers })
            }
        }
    }
}

/// Where something was left out, a line each.
fn listed<'l>(left: impl Iterator<Item = &'l LeftOut> + Clone) -> Vec<String> {
    let more = left.clone().count().saturating_sub(PLACES);
    let place = |left: &LeftOut| {
        let line = left.line.map(|line| line.to_string()).unwrap_or_default();
        format!("line {line:<6}{}", left.text)
    };
    let mut lines: Vec<String> = left.take(PLACES).map(place).collect();
    if more > 0 {
        lines.push(format!("and {more} more"));
    }
    lines
}

/// Shows progress on a terminal.
struct Progress {
    wanted: bool,
    began: Instant,
    calls: u32,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// The number of calls between two looks at the clock.
    const CALLS: u32 = 1_024;
    /// A run that is over sooner shows no progress.
    const SHOWN_AFTER: Duration = Duration::from_millis(500);

    fn new(wanted: bool) -> Progress {
        let wanted = wanted && io::stderr().is_terminal();
        Progress { wanted, began: Instant::now(), calls: 0, bar: None }
    }

    fn tick(&mut self, text: impl FnOnce() -> String) {
        self.calls = self.calls.wrapping_add(1);
        if self.wanted
            && self.calls.is_multiple_of(Self::CALLS)
            && self.began.elapsed() > Self::SHOWN_AFTER
        {
            let bar = self.bar.get_or_insert_with(ProgressBar::new_spinner);
            bar.set_message(text());
            bar.tick();
        }
    }

    fn clear(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

pub(crate) fn nanos(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(u64::MAX)
}

/// `5.655556 s`, to the microsecond and no further than there is something to say.
pub(crate) fn seconds(span: Duration) -> String {
    let text = format!("{}.{:06}", Grouped(span.as_secs() as i64), span.subsec_micros());
    format!("{} s", text.trim_end_matches('0').trim_end_matches('.'))
}
