//! A run of one script: a list of commands, or a program that is stored and started.

use std::process::ExitCode;
use std::time::Duration;

use vimc4::escape;
use vimc4::isel::ProgramStatus;
use vimc4_catalogue::{Handling, Machine};
use vimc4_device::{Device, Time, Warning};

use super::driver::{Driver, Halt, News};
use super::report::{Answer, Answered, End, RunReport, Why};
use super::world::{Outside, PRESS, press};
use crate::failure::Failure;
use vimc4_script::ScriptLine;

/// A run of one script.
pub(super) struct Session {
    pub(super) handling: Handling,
    pub(super) driver: Driver,
    pub(super) report: RunReport,
    /// The lines of the file that the controller has stored, in order.
    pub(super) stored: Vec<ScriptLine>,
    /// Where in the file commands stand that are for another controller.
    pub(super) unanswered: Vec<Option<usize>>,
}

impl Session {
    /// Sends the lines one after the other, each when the one before was answered, and starts
    /// what they have stored.
    pub(super) fn command_list(
        &mut self,
        lines: &[ScriptLine],
        outside: &Outside,
    ) -> Result<End, End> {
        self.begin(outside);
        for (place, line) in lines.iter().enumerate() {
            let answer = self.command(line)?;
            match answer.as_ref().map(|answer| answer.bytes.as_slice()) {
                // Whatever stopped a motion may continue it once the button is released.
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
            Some(ProgramStatus::Incomplete) if self.unanswered.is_empty() => {
                let text = "every command was answered, but the program lacks its final 9";
                Ok(End::of(Why::Done, text))
            }
            _ => Ok(self.all_sent()),
        }
    }

    /// Stores the lines and starts the program. Time counts from the start.
    pub(super) fn data_field(
        &mut self,
        lines: &[ScriptLine],
        axes: u8,
        outside: &Outside,
    ) -> Result<End, End> {
        let set_axes = [axes & 7, axes & 8].into_iter().filter(|axes| *axes != 0);
        let mut commands: Vec<ScriptLine> =
            set_axes.map(|axes| ScriptLine::added(&format!("@0{axes}"))).collect();
        commands.push(ScriptLine::added("@0i"));
        commands.extend_from_slice(lines);
        if !lines.last().is_some_and(|line| line.is("9")) {
            commands.push(ScriptLine::added("9"));
        }
        for line in &commands {
            let answer = self.command(line)?;
            self.check(line, answer)?;
        }
        self.begin(outside);
        self.start(outside)
    }

    /// Lets time count from now on.
    pub(super) fn begin(&mut self, outside: &Outside) {
        outside.schedule(&mut self.driver);
        self.report.begin(self.driver.now());
    }

    /// Presses START, unless it is scheduled, and lets the program run.
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
    fn command(&mut self, line: &ScriptLine) -> Result<Option<Answered>, End> {
        let at = self.driver.now();
        let meaning = self.driver.device().explain(&line.bytes);
        self.driver.send(&line.whole());
        let mut answered = None;
        let mut ignored = None;
        let mut took = Duration::ZERO;
        loop {
            while let Some((now, news)) = self.driver.news.pop_front() {
                let (bytes, why) = match news {
                    News::Answer(bytes, why) => (bytes, why),
                    News::Ignored(why) => {
                        ignored = Some(why);
                        continue;
                    }
                    news => {
                        self.tell(now, news);
                        continue;
                    }
                };
                self.remember(line, &bytes);
                took = now - at;
                answered = Some(match answered.take() {
                    None => Answered { early: Vec::new(), bytes, why },
                    Some(Answered { early, bytes: before, .. }) => {
                        Answered { early: [early, before].concat(), bytes, why }
                    }
                });
            }
            // Without an answer a host waits on, unless the line is for another controller.
            let idle = self.driver.device().is_idle();
            if idle && (answered.is_some() || ignored.is_some()) {
                let answer = answered.as_ref();
                let why = answer.map_or(ignored.as_deref(), |answer| answer.why.as_deref());
                let ran = self.driver.now() - at;
                self.report.answer(Answer { line, answer, why, at, took, ran, meaning });
                if answered.is_none() {
                    self.unanswered.push(line.number);
                }
                return Ok(answered);
            }
            if let Err(halt) = self.driver.advance() {
                if !idle {
                    return Err(self.halted(halt, Some(line)));
                }
                let ran = self.driver.now() - at;
                let (answer, why, took) = (None, None, ran);
                self.report.answer(Answer { line, answer, why, at, took, ran, meaning });
                return Err(self.never_answered(halt, line));
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
    fn remember(&mut self, line: &ScriptLine, answer: &[u8]) {
        match line.bytes.trim_ascii_start().first() {
            Some(b'@') if answer == b"0" && line.is("@0i") => self.stored.clear(),
            Some(b'@') => {}
            _ if answer == b"0" && line.is("9") => {
                let lines: Vec<String> = self.stored.iter().map(ScriptLine::text).collect();
                self.driver.rounds.begin(&lines);
            }
            _ if answer == b"0" => self.stored.push(line.clone()),
            _ => {}
        }
    }

    pub(super) fn tell(&mut self, at: Time, news: News) {
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
            News::Told(text) => self.report.told(at, &text),
            News::Begun(_) | News::Ignored(_) | News::Answer(..) => {}
        }
    }

    fn program_error(&self, code: char, line: u32, why: &str) -> String {
        format!("{} ended the program with {code}: {why}", self.place(line))
    }

    /// An error reply ends the run.
    fn check(&self, line: &ScriptLine, answer: Option<Answered>) -> Result<(), End> {
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

    /// The end of a list of commands that were all sent.
    fn all_sent(&self) -> End {
        let text = match self.unanswered.len() {
            0 => return End::of(Why::Done, "every command was answered"),
            1 => "every command was sent, but 1 was not answered".to_owned(),
            count => format!("every command was sent, but {count} were not answered"),
        };
        End { line: self.unanswered.first().copied().flatten(), ..End::of(Why::Error, text) }
    }

    /// The end of a host that waits for an answer from a controller that has forgotten the command.
    fn never_answered(&mut self, halt: Halt, line: &ScriptLine) -> End {
        let mut end = self.halted(halt, Some(line));
        if end.why == Why::Waits {
            end.text = format!("{} was never answered", self.report.place(line));
            let help = "a host that waits for the answer waits for ever: what was done to the \
                        controller before is said above";
            end.help.push(help.to_owned());
        }
        end
    }

    /// Why nothing goes on.
    fn halted(&mut self, halt: Halt, waiting: Option<&ScriptLine>) -> End {
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
            Halt::Interrupted => (Why::Interrupted, format!("it was interrupted, in {place}")),
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

    pub(super) fn finish(mut self, end: End, machine: &Machine) -> Result<ExitCode, Failure> {
        let now = self.driver.now();
        // What shows how far the files are is gone from the terminal before the report comes.
        let closed = self.driver.close();
        while let Some((at, news)) = self.driver.news.pop_front() {
            self.tell(at, news);
        }
        let view = self.driver.device().view(now);
        let baud = self.driver.device().baud();
        let rounds = self.driver.rounds.made();
        self.report.finish(&end, &view, &self.driver.meter, rounds, machine, baud)?;
        closed?;
        self.driver.done();
        Ok(ExitCode::from(end.why.code()))
    }
}

/// Whether a command goes on with a stopped motion.
fn resumes(line: &ScriptLine) -> bool {
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
