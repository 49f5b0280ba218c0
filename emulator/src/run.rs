//! `vimc4 run`: a command list or a stored program in virtual time.

pub(crate) mod driver;
pub(crate) mod meter;
pub(crate) mod report;
mod rounds;
pub(crate) mod script;
mod stream;
pub(crate) mod trace;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use vimc4::isel::ProgramStatus;
use vimc4::{Order, escape};
use vimc4_catalogue::{Controller, Handling, Machine};
use vimc4_device::{Device, Signal, SignalId, Time, Warning};

use crate::completions;
use crate::failure::Failure;
use crate::job::source::{self, JobArguments};
use crate::ncp::run as job;
use crate::output;
use crate::setup::Setup;
use driver::{Driver, Halt, News};
use meter::Meter;
use report::{Answer, Answered, End, Report, Why};
use script::{Kind, Line, Script};
use trace::Trace;

/// How long somebody keeps a button pressed.
const PRESS: Duration = Duration::from_millis(100);

#[derive(clap::Args)]
#[command(
    long_about = "\
Run a command list, a stored program or a plot file in virtual time, as fast as it goes

isel: a file whose first command begins with @ is a command list: its lines are sent one after the other,
each when the one before was answered. Any other is a data field, the lines of a program as they
stand between @0i and 9: it is stored; the final 9 may be left out.

What was stored and not started is then started with the START button, which is pressed for 0.1 s.
With --press start@TIME it is pressed then, and not before. Blank lines, and lines that begin with
; or #, mean nothing. Lines may end with LF, CR LF or CR.

A job file in the isel NC intermediate format is run as `vimc4 ncp run` does it, which has options of
its own.

LPKF: a file is a stream of commands, as it goes over the line. Each command is sent when the one
before was completed; in the mode without echo, as long as the buffer has room. Numbers that belong to
no command, such as pairs after PU and PD, mean nothing to most models: they are listed at the end,
with the value of the profile that would take them, and the exit code is 1. So are commands in
lower-case letters, which are none.

It ends with the last command or with the program; then the exit code is 0. An error reply ends it
with 1. It ends with 3 after --for, after --loops, or at once when nothing will ever go on.",
    after_long_help = "\
Examples:
  vimc4 run examples/commands.txt --machine mill
  vimc4 run examples/program.txt --model imc4-m --loops 3
  vimc4 run examples/program.txt --input 0.3=1@2s --press stop@5s --press start@8s --for 1min
  vimc4 run examples/board.plt --model smcu --machine board-plotter
  vimc4 run examples/board.plt --model smcu --keep-going --ignore-numbers
  (echo @07; vimc4 circle --radius 200) | vimc4 run -

Exit codes: 0 all was done, 1 an error reply, or something in a plot file that the controller would leave
out, 2 wrong usage, 3 the time or the rounds are over, or nothing will ever go on."
)]
pub(crate) struct Arguments {
    /// The file; `-` is standard input
    file: PathBuf,
    #[command(flatten)]
    setup: Setup,
    /// The axes a data field is stored with: 1, 3 or 7 for X, X+Y, X+Y+Z, and 8 more with A; those
    /// of its comment `; axes: N` if nothing is said, else 7
    #[arg(long, value_parser = axes, add = completions::words(&["1", "3", "7", "8", "9", "11", "15"]))]
    axes: Option<u8>,
    /// How much virtual time may pass, such as 90s, 5min or 1h
    #[arg(long = "for", value_name = "DURATION", default_value = "1h", value_parser = duration)]
    time: Duration,
    /// Stop when the program has made N rounds: jumped back N times, without a count, to the
    /// earliest line it comes to again
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    loops: Option<u64>,
    #[command(flatten)]
    world: World,
    /// Go on after commands that the controller does not know, in a plot file: they are left out and
    /// listed at the end
    #[arg(long)]
    keep_going: bool,
    /// Leave it at numbers that belong to no command, in a plot file: without this they make the
    /// exit code 1
    #[arg(long)]
    ignore_numbers: bool,
    /// Print one line of JSON instead
    #[arg(long)]
    json: bool,
    /// Say what the commands mean, and follow the program line by line
    #[arg(short, long)]
    verbose: bool,
}

/// What happens around a run in virtual time, and who watches.
#[derive(clap::Args)]
pub(crate) struct World {
    /// Set a bit of an input port, or anything else by the name that `signals` of `vimc4 serve`
    /// lists, at a time or from the beginning
    #[arg(long, value_name = "PORT.BIT|NAME=VALUE[@TIME]", value_parser = timed_input, add = completions::inputs())]
    input: Vec<(String, Duration)>,
    /// Press a button at a time, and release it 0.1 s later; the emergency stop stays pressed
    #[arg(long, value_name = "BUTTON[@TIME]", value_parser = timed, add = completions::buttons())]
    press: Vec<(String, Duration)>,
    /// Write every step with its time into a file: seconds,X,Y,Z,A
    #[arg(long, value_name = "FILE")]
    pub(crate) trace: Option<PathBuf>,
}

pub(crate) fn run(mut arguments: Arguments) -> Result<ExitCode, Failure> {
    let bytes = source::read(&arguments.file, "a file of commands")?;
    arguments.setup.heed(&arguments.file, &bytes)?;
    let model = vimc4::model(arguments.setup.model())?;
    let machine = vimc4::machine(arguments.setup.machine())?;
    let handling = Handling::of(&model);
    source::no_g_code(&output::name(&arguments.file), &bytes)?;
    if source::takes_jobs(&model) && source::is_job(&bytes) {
        let Arguments { file, setup, world, json, verbose, time, .. } = arguments;
        let job = JobArguments::new(file, setup);
        let job = job::Arguments::new(job, world, time, json, verbose);
        return job::carry_out(&job, &source::decoded(&bytes));
    }
    let script = Script::of(&arguments.file, &bytes, &handling)?;
    let controller = Controller::new(&model, Arc::clone(&machine), b"").map_err(Failure::midway)?;
    let signals = arguments.world.signals(arguments.setup.model(), &controller)?;
    let mut meter = Meter::new(&machine);
    meter.trace = Trace::wanted(arguments.world.trace.as_deref(), model.axis_names())?;
    let driver = Driver::new(controller, meter, arguments.loops);
    let report = Report::new(&arguments, &script);
    let mut session = Session { handling, driver, report, stored: Vec::new() };
    let starts = arguments.world.press.iter().any(|(button, _)| button == "start");
    let outside = Outside { signals, starts, time: arguments.time };
    let axes = arguments.axes.or(script.axes).unwrap_or(7);
    let end = match script.kind {
        Kind::Commands => session.command_list(&script.lines, &outside),
        Kind::DataField => session.data_field(&script.lines, axes, &outside),
        Kind::Stream => session.stream(&script.lines, &outside),
    };
    session.finish(end.unwrap_or_else(|end| end), &machine)
}

/// What the world around the controller does.
pub(crate) struct Outside {
    pub(crate) signals: Vec<Scheduled>,
    /// Whether that includes pressing START.
    pub(crate) starts: bool,
    /// How much time there is.
    pub(crate) time: Duration,
}

impl Outside {
    /// Lets all of it happen, counted from now on.
    pub(crate) fn schedule(&self, driver: &mut Driver) {
        let now = driver.now();
        driver.stop_at(now + self.time);
        for &Scheduled { after, signal, value } in &self.signals {
            driver.schedule(now + after, signal, value);
        }
    }
}

/// A signal that takes a value some time after the beginning.
pub(crate) struct Scheduled {
    after: Duration,
    signal: SignalId,
    value: i32,
}

impl World {
    /// What the outside world will do.
    pub(crate) fn signals(
        &self,
        model: &str,
        device: &impl Device,
    ) -> Result<Vec<Scheduled>, Failure> {
        let mut scheduled = Vec::new();
        for (text, after) in &self.input {
            let (signal, value) = input(model, device, text)?;
            scheduled.push(Scheduled { after: *after, signal, value });
        }
        for (button, after) in &self.press {
            scheduled.extend(press(device, button, *after)?);
        }
        Ok(scheduled)
    }
}

/// Which signal `0.3=1` or `cover=open` sets, and to what.
fn input(model: &str, device: &impl Device, text: &str) -> Result<(SignalId, i32), Failure> {
    let signals = device.signals();
    let (name, value) = text.rsplit_once('=').unwrap_or((text, ""));
    let is_bit = name.starts_with(|first: char| first.is_ascii_digit());
    let order = format!("{} {name} {value}", if is_bit { "input" } else { "set" });
    let (name, value) = match Order::parse(&order, &signals).map_err(Failure::usage)? {
        Some(Order::Input { port, bit, level }) => {
            let signal = device.input_signal(port, bit).ok_or_else(|| {
                Failure::usage(format!(
                    "port {port} bit {bit} is no input of the model {model}; `vimc4 models show \
                     {model}` has its ports, and its inputs are {}",
                    inputs(&signals),
                ))
            })?;
            return Ok((signal, level.into()));
        }
        Some(Order::Set(name, value)) => (name, value.to_string()),
        Some(Order::Turn(name, position)) => (name, position),
        _ => (name.to_owned(), value.to_owned()),
    };
    let found = signals.iter().find(|signal| signal.name == name).and_then(|signal| {
        let named = signal.positions.iter().flatten().position(|position| *position == value);
        let value = named.map_or_else(|| value.parse().ok(), |place| i32::try_from(place).ok())?;
        Some((signal.id, value))
    });
    found.ok_or_else(|| Failure::usage(format!("there is no signal {name}")))
}

/// The names of the user inputs.
fn inputs(signals: &[Signal]) -> String {
    let names = signals.iter().filter_map(|signal| signal.name.strip_prefix("input "));
    names.collect::<Vec<_>>().join(", ")
}

/// A button goes down, and up again if it does not latch.
fn press(device: &impl Device, name: &str, after: Duration) -> Result<Vec<Scheduled>, Failure> {
    let button = match Order::parse(&format!("press {name}"), &device.signals()) {
        Ok(Some(Order::Press(button))) => button,
        Ok(_) => name.to_owned(),
        Err(error) => return Err(Failure::usage(error)),
    };
    let found = device.signals().into_iter().find(|signal| signal.name == button);
    let Some(signal) = found.map(|signal| signal.id) else {
        return Err(Failure::usage(format!("there is no button {button}")));
    };
    let mut scheduled = vec![Scheduled { after, signal, value: 1 }];
    if button != "estop" {
        scheduled.push(Scheduled { after: after + PRESS, signal, value: 0 });
    }
    Ok(scheduled)
}

// --- the values of options ---

fn axes(text: &str) -> Result<u8, String> {
    match text.parse() {
        Ok(axes @ (1 | 3 | 7 | 8 | 9 | 11 | 15)) => Ok(axes),
        _ => Err("1, 3, 7, 8, 9, 11 and 15 are possible".to_owned()),
    }
}

/// Durations are written as in the orders of `vimc4 serve`.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    match Order::parse(&format!("advance {text}"), &[]) {
        Ok(Some(Order::Advance(span))) => Ok(span),
        _ => Err("a number with a unit is needed, as in 250ms, 2s, 5min or 1h".to_owned()),
    }
}

/// `WHAT@TIME`, or `WHAT` for the beginning.
fn timed(text: &str) -> Result<(String, Duration), String> {
    match text.rsplit_once('@') {
        Some((what, time)) => Ok((what.to_owned(), duration(time)?)),
        None => Ok((text.to_owned(), Duration::ZERO)),
    }
}

fn timed_input(text: &str) -> Result<(String, Duration), String> {
    let (what, time) = timed(text)?;
    match what.contains('=') {
        true => Ok((what, time)),
        false => Err("an input, its value and the time are needed, as in 0.3=1@2s".to_owned()),
    }
}

// --- running ---

/// A run of one script.
struct Session {
    handling: Handling,
    driver: Driver,
    report: Report,
    /// The lines of the file that the controller has stored, in order.
    stored: Vec<Line>,
}

impl Session {
    /// Sends the lines one after the other, each when the one before was answered, and starts
    /// what they have stored.
    fn command_list(&mut self, lines: &[Line], outside: &Outside) -> Result<End, End> {
        self.begin(outside);
        for (place, line) in lines.iter().enumerate() {
            let answer = self.command(line)?;
            match answer.as_ref().map(|answer| answer.bytes.as_slice()) {
                // Who stops a motion may go on with it, once the button is let go.
                Some([b'F', ..]) if lines.get(place + 1).is_some_and(resumes) => {
                    self.driver.pass(PRESS).map_err(|halt| self.halted(halt, Some(line)))?;
                }
                _ => self.check(line, answer)?,
            }
        }
        let details = self.driver.device().details();
        match details.program().map(|program| program.status) {
            Some(ProgramStatus::Valid) if self.driver.rounds.last().is_none() => {
                self.start(outside)
            }
            Some(ProgramStatus::Incomplete) => {
                let text = "every command was answered, but the program lacks its final 9";
                Ok(End::of(Why::Done, text))
            }
            _ => Ok(End::of(Why::Done, "every command was answered")),
        }
    }

    /// Stores the lines and starts the program. Time counts from the start.
    fn data_field(&mut self, lines: &[Line], axes: u8, outside: &Outside) -> Result<End, End> {
        let set_axes = [axes & 7, axes & 8].into_iter().filter(|axes| *axes != 0);
        let mut commands: Vec<Line> =
            set_axes.map(|axes| Line::added(&format!("@0{axes}"))).collect();
        commands.push(Line::added("@0i"));
        commands.extend_from_slice(lines);
        if !lines.last().is_some_and(|line| line.is("9")) {
            commands.push(Line::added("9"));
        }
        for line in &commands {
            let answer = self.command(line)?;
            self.check(line, answer)?;
        }
        self.begin(outside);
        self.start(outside)
    }

    /// Lets time count from now on.
    fn begin(&mut self, outside: &Outside) {
        outside.schedule(&mut self.driver);
        self.report.begin(self.driver.now());
    }

    /// Presses START, if nobody else does, and lets the program run.
    fn start(&mut self, outside: &Outside) -> Result<End, End> {
        self.report.stored(self.stored.len());
        if !outside.starts {
            let now = self.driver.now();
            for press in press(self.driver.device(), "start", Duration::ZERO).unwrap_or_default() {
                self.driver.schedule(now + press.after, press.signal, press.value);
            }
        }
        self.program()
    }

    /// Sends a line and waits for its answer; `None` if it gets none. Older cards answer some
    /// commands before they execute them: the next line would wait until that is over, and so do
    /// we, for what is said meanwhile belongs to this one.
    fn command(&mut self, line: &Line) -> Result<Option<Answered>, End> {
        let at = self.driver.now();
        let meaning = self.driver.device().explain(&line.bytes);
        self.driver.send(&line.whole());
        let mut answered = None;
        loop {
            while let Some((now, news)) = self.driver.news.pop_front() {
                let News::Answer(bytes, why) = news else {
                    self.tell(now, news);
                    continue;
                };
                self.remember(line, &bytes);
                answered = Some(match answered.take() {
                    None => Answered { early: Vec::new(), bytes, why },
                    Some(Answered { early, bytes: before, .. }) => {
                        Answered { early: [early, before].concat(), bytes, why }
                    }
                });
            }
            if self.driver.device().is_idle() {
                let took = self.driver.now() - at;
                let answer = answered.as_ref();
                self.report.answer(Answer { line, answer, at, took, meaning });
                return Ok(answered);
            }
            if let Err(halt) = self.driver.advance() {
                return Err(self.halted(halt, Some(line)));
            }
            self.report.progress(self.driver.now());
        }
    }

    /// Lets the program run until it is over.
    fn program(&mut self) -> Result<End, End> {
        loop {
            let halted = self.driver.advance().err();
            while let Some((now, news)) = self.driver.news.pop_front() {
                if let News::Warning(Warning::ProgramError { code, line, why }) = news {
                    let text = self.program_error(code, line, &why);
                    return Err(End { line: self.number(line), ..End::of(Why::Error, text) });
                }
                self.tell(now, news);
            }
            if let Some(halt) = halted {
                return Err(self.halted(halt, None));
            }
            if self.driver.device().is_idle() && self.driver.rounds.last().is_some() {
                let details = self.driver.device().details();
                if details.program().is_none_or(|program| program.marker.is_none()) {
                    return Ok(End::of(Why::Done, "the program came to its end"));
                }
            }
            self.report.progress(self.driver.now());
        }
    }

    /// Keeps count of what the controller has stored, so that its lines can be found again.
    fn remember(&mut self, line: &Line, answer: &[u8]) {
        match line.bytes.trim_ascii_start().first() {
            Some(b'@') if answer == b"0" && line.is("@0i") => self.stored.clear(),
            Some(b'@') => {}
            _ if answer == b"0" && line.is("9") => {
                let lines: Vec<String> = self.stored.iter().map(Line::text).collect();
                self.driver.rounds.begin(&lines);
            }
            _ if answer == b"0" => self.stored.push(line.clone()),
            _ => {}
        }
    }

    fn tell(&mut self, at: Time, news: News) {
        match news {
            News::Line(line) => {
                self.report.line(at, self.stored.get(index_of(line)), line);
            }
            News::Sent(bytes) => self.report.sent(at, &bytes, None),
            News::Warning(warning) => {
                let text = match &warning {
                    Warning::ProgramError { code, line, why } => {
                        Some(self.program_error(*code, *line, why))
                    }
                    _ => None,
                };
                self.report.warning(at, &warning, text);
            }
            News::Begun(_) | News::Answer(..) => {}
        }
    }

    fn program_error(&self, code: char, line: u32, why: &str) -> String {
        format!("{} ended the program with {code}: {why}", self.place(line))
    }

    /// An error reply ends the run.
    fn check(&self, line: &Line, answer: Option<Answered>) -> Result<(), End> {
        let Some(answer) = answer else { return Ok(()) };
        let Some(refusal) = self.handling.refusal(&line.bytes, &answer.bytes) else {
            return Ok(());
        };
        let refusal = answer.explain(refusal);
        let at = self.report.place(line);
        let early = match answer.early.as_slice() {
            [] => String::new(),
            early => format!("{}, and then ", escape(early)),
        };
        let text = format!("{at} was answered {early}{refusal}");
        Err(End { line: line.number, ..End::of(Why::Error, text) })
    }

    /// Why nothing goes on.
    fn halted(&mut self, halt: Halt, waiting: Option<&Line>) -> End {
        let now = self.driver.now();
        let view = self.driver.device().view(now);
        let marker = view.details.program().and_then(|program| program.marker).map(|at| at + 1);
        let place = match (marker, waiting) {
            (Some(line), _) => self.place(line),
            (None, Some(line)) => self.report.place(line),
            (None, None) => "the program".to_owned(),
        };
        let line = marker.map_or_else(|| waiting.and_then(|line| line.number), |l| self.number(l));
        let (why, text) = match halt {
            Halt::Time => (Why::Time, format!("the time of --for is over, in {place}")),
            Halt::Rounds => {
                let rounds = self.driver.rounds.made();
                let s = if rounds == 1 { "" } else { "s" };
                (Why::Loops, format!("the program has made {rounds} round{s}"))
            }
            Halt::Waiting if self.driver.rounds.last().is_none() && waiting.is_none() => {
                (Why::Waits, "START did not start the program".to_owned())
            }
            Halt::Waiting => {
                let activity = view.activity;
                (Why::Waits, format!("{place}: {activity}, and nothing will change that"))
            }
            Halt::Idling => {
                let text =
                    format!("{place}: it goes round and round, and nothing will change that");
                (Why::Waits, text)
            }
        };
        End { line, ..End::of(why, text) }
    }

    /// A line of the stored program, by its number, as it can be found in the file.
    fn place(&self, line: u32) -> String {
        match self.stored.get(index_of(line)) {
            Some(line) => self.report.place(line),
            None => format!("line {line} of the program"),
        }
    }

    fn number(&self, line: u32) -> Option<usize> {
        self.stored.get(index_of(line))?.number
    }

    fn finish(mut self, end: End, machine: &Machine) -> Result<ExitCode, Failure> {
        let now = self.driver.now();
        self.driver.meter.stop(now);
        while let Some((at, news)) = self.driver.news.pop_front() {
            self.tell(at, news);
        }
        let view = self.driver.device().view(now);
        let baud = self.driver.device().baud();
        let rounds = self.driver.rounds.made();
        self.report.finish(&end, &view, &self.driver.meter, rounds, machine, baud)?;
        self.driver.meter.trace.take().map_or(Ok(()), Trace::finish)?;
        Ok(ExitCode::from(end.why.code()))
    }
}

/// Whether a command goes on with a stopped motion.
fn resumes(line: &Line) -> bool {
    let mut bytes = line.bytes.iter().filter(|&&byte| byte != b' ');
    matches!(
        (bytes.next(), bytes.next(), bytes.next(), bytes.next()),
        (Some(b'@'), Some(b'0'..=b'9'), Some(b'S' | b's'), None)
    )
}

/// Where the line of a program with this number, from 1, is among the stored ones.
fn index_of(line: u32) -> usize {
    (line as usize).wrapping_sub(1)
}
