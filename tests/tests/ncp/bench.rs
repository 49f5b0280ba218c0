//! One job on one controller: read, played, and stored as a data field.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::sync::Arc;

use vimc4::{Machine, Model};
use vimc4_ncp::job::{self, InputTest, Order, Question, Step, Target};
use vimc4_ncp::{Diagnostic, Severity, language};
use vimc4_tests::jobs::JobCase;
use vimc4_tests::plain::debug_text;

use crate::circle::Course;
use crate::expect::{fits, same};
use crate::player::Player;

/// Holds everything that a job says against what becomes of it.
pub(crate) fn check(job: &JobCase) -> Result<(), String> {
    let bench = Bench::new(job)?;
    let mut said = Said::default();
    job::check(&bench.text, &bench.target, job.options, &mut |problem| said.hear(&bench, &problem));
    said.is("what is said", &job.diagnostics)?;
    if said.errors && !job.lenient {
        if job.commands.is_some() || job.field.is_some() || !job.end.is_empty() {
            return Err("a job with errors sends nothing; leave out what it would do".to_owned());
        }
        return bench.compile(&said, None);
    }
    let counters = bench.run(&said)?;
    bench.compile(&said, Some(&counters))
}

/// A job with the controller and the machine that it is run on.
struct Bench<'j> {
    job: &'j JobCase,
    model: Model,
    machine: Arc<Machine>,
    target: Target,
    text: Cow<'j, str>,
}

/// What is said about a job.
#[derive(Default)]
struct Said {
    /// `severity line:column code: message`.
    lines: Vec<String>,
    errors: bool,
}

impl Said {
    fn hear(&mut self, bench: &Bench<'_>, diagnostic: &Diagnostic) {
        let Diagnostic { line, span, problem, .. } = diagnostic;
        let severity = match problem.severity() {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        self.errors |= problem.severity() == Severity::Error;
        let text = language::lines(&bench.text).nth(*line as usize - 1);
        let before = text.and_then(|text| text.text.get(..span.start as usize)).unwrap_or_default();
        let column = before.chars().count() + 1;
        self.lines.push(format!("{severity} {line}:{column} {}: {problem}", problem.code()));
        let texts = [Some(problem.to_string()), problem.help()];
        for text in texts.into_iter().flatten().filter(|text| debug_text(text).is_some()) {
            self.lines.push(format!("not in words: {text}"));
        }
    }

    /// Whether it is what a job expects, which may leave out messages.
    fn is(&self, what: &str, expected: &[String]) -> Result<(), String> {
        let whole =
            |line: &String| if line.contains(": ") { line.clone() } else { format!("{line}: ...") };
        fits(what, &expected.iter().map(whole).collect::<Vec<_>>(), &self.lines)
    }
}

impl<'j> Bench<'j> {
    fn new(job: &'j JobCase) -> Result<Bench<'j>, String> {
        let (model, machine) = (job.model()?, job.machine()?);
        let target = job.target(&model, &machine)?;
        Ok(Bench { job, model, machine, target, text: language::decode(&job.program) })
    }

    fn player(&self) -> Result<Player, String> {
        let device = vimc4::bare(&self.model, &self.machine, &[]).map_err(|e| e.to_string())?;
        Player::new(device, &self.job.inputs)
    }

    /// Plays the job and says where the counters end.
    fn run(&self, said: &Said) -> Result<Vec<i64>, String> {
        let job = self.job;
        let course = job.arc.as_ref().map(|arc| Course::new(arc, &self.target)).transpose()?;
        let mut answers: VecDeque<&String> = job.answers.iter().collect();
        let mut player = self.player()?;
        let mut again = Said::default();
        let mut done = Vec::new();
        let mut running = job::Job::new(&self.text, &self.target, job.options);
        while let Some(Order { line, step, .. }) =
            running.next(&mut |problem| again.hear(self, &problem))
        {
            done.push(self.shown(&step));
            let at = |error: String| format!("line {line}, {}: {error}", self.shown(&step));
            match &step {
                Step::Send(_) | Step::Output(..) => {
                    let line = step
                        .line(self.target.controller.dialect)
                        .ok_or_else(|| at("no command".into()))?;
                    player.send(&line).map_err(at)?;
                }
                Step::Dwell(micros) => player.pass(micros * 1_000)?,
                Step::Await(test) => {
                    while !test.is_met_by(player.read(test.port).map_err(at)?) {
                        player.pass_to_change().map_err(at)?;
                    }
                }
                Step::Ask(Question::Teach) => {
                    let answer = answers.pop_front().map_or("ok", String::as_str);
                    Self::teach(&mut running, answer, &mut |problem| again.hear(self, &problem));
                }
                Step::Ask(_) => {}
            }
            let motions = player.take_motions();
            if let Some(course) = course.as_ref().filter(|_| self.is_arc(line)) {
                for (origin, segment) in motions {
                    course.check(&origin, &segment).map_err(at)?;
                }
            }
        }
        if job.answers.is_empty() && !running.has_failed() {
            same("what is said on the way", &said.lines, &again.lines)?;
        }
        if let Some(commands) = &job.commands {
            fits("what is done", commands, &done)?;
        }
        if let Some(found) =
            done.iter().find(|done| job.never.iter().any(|no| done.starts_with(no)))
        {
            return Err(format!("{found} must not be sent"));
        }
        let counters = player.counters();
        let expected = running.counters();
        let unforeseen = self.unforeseen(&player);
        if !unforeseen.is_empty() {
            return Err(format!("the controller warns: {}", unforeseen.join(", ")));
        }
        // A line that is refused is read as if it had been carried out.
        let elsewhere = |axis| counters.get(axis) != expected.get(axis);
        if !running.has_failed() && self.target.axes.iter().any(elsewhere) {
            return Err(format!(
                "the counters are {counters:?}, the job takes them to {expected:?}"
            ));
        }
        for (axis, end) in &job.end {
            if counters.get(*axis) != Some(end) {
                return Err(format!("the counters end at {counters:?}, not at {:?}", job.end));
            }
        }
        let took = player.now().as_nanos();
        if job.time.is_some_and(|time| time != took) || job.at_least.is_some_and(|time| took < time)
        {
            return Err(format!("it takes {} s", took as f64 / 1e9));
        }
        Ok(counters)
    }

    /// What the operator says at WPTEACH: `ok`, `keep`, or a line as in a file, after which the
    /// question comes again.
    fn teach(running: &mut job::Job<'_>, answer: &str, report: &mut dyn FnMut(Diagnostic)) {
        match answer {
            "ok" => running.take_zero(),
            "keep" => {}
            line => {
                running.enter(line, Question::Teach, report);
            }
        }
    }

    /// Whether a line of the job asks for an arc.
    fn is_arc(&self, line: u32) -> bool {
        let text = language::lines(&self.text).nth((line as usize).saturating_sub(1));
        text.is_some_and(|line| {
            let read = language::parse(line.text, &mut |_, _| {});
            matches!(read.command.map(|read| read.value), Some(language::Instruction::Arc { .. }))
        })
    }

    /// A step as fixtures have it.
    fn shown(&self, step: &Step) -> String {
        match step {
            Step::Send(_) | Step::Output(..) => {
                let line = step.line(self.target.controller.dialect).unwrap_or_default();
                String::from_utf8_lossy(&line).trim_end().to_owned()
            }
            Step::Dwell(micros) if *micros >= 1_000_000 => {
                format!("pause {}s", *micros as f64 / 1e6)
            }
            Step::Dwell(micros) => format!("pause {}ms", *micros as f64 / 1e3),
            Step::Await(InputTest { port, bit: Some(bit), value }) => {
                format!("until {port}.{bit} = {value}")
            }
            Step::Await(InputTest { port, bit: None, value }) => format!("until {port} = {value}"),
            Step::Ask(Question::Halt) => "ask halt".to_owned(),
            Step::Ask(Question::Tool(number)) => format!("ask tool {number}"),
            Step::Ask(Question::Teach) => "ask teach".to_owned(),
        }
    }

    /// Makes a data field of the job and runs it; it must end where the job did.
    fn compile(&self, said: &Said, counters: Option<&[i64]>) -> Result<(), String> {
        let job = self.job;
        let mut heard = Said::default();
        let field = job::compile(&self.text, &self.target, job.options, &mut |problem| {
            heard.hear(self, &problem);
        });
        let field = field.filter(|_| !heard.errors || job.lenient);
        match (&job.field_diagnostics, &job.field) {
            (Some(expected), _) => heard.is("what is said of the field", expected)?,
            (None, Some(_)) => same("what is said of the field", &said.lines, &heard.lines)?,
            (None, None) => {}
        }
        let (Some(field), Some(counters)) = (field, counters) else {
            return if job.field.is_some() { Err("there is no field".to_owned()) } else { Ok(()) };
        };
        let lines: Vec<String> = field.text.lines().map(str::to_owned).collect();
        if let Some(expected) = &job.field {
            same("the field", expected, &lines)?;
        }
        if field.lines as usize != lines.len() {
            return Err(format!("the field has {} lines, not {}", lines.len(), field.lines));
        }
        let found = self.run_field(&field, &lines)?;
        // Who runs a field cannot move the tool at WPTEACH; all else is the same.
        if found == counters {
            return Ok(());
        }
        Err(format!("the field ends at {found:?}, the job at {counters:?}"))
    }

    /// What the controller warns of and the check has not foreseen, as it does that only STOP ends a
    /// reference run.
    fn unforeseen(&self, player: &Player) -> Vec<String> {
        let foreseen = |warning: &&String| {
            warning.starts_with("EndlessReference")
                && self.job.diagnostics.iter().any(|line| line.contains("no-reference-switch"))
        };
        player.warnings.iter().filter(|warning| !foreseen(warning)).cloned().collect()
    }

    fn run_field(&self, field: &job::Field, lines: &[String]) -> Result<Vec<i64>, String> {
        let mut player = self.player()?;
        let axes = [field.axes.bits() & 0b0111, field.axes.bits() & 0b1000];
        for axes in axes.iter().filter(|axes| **axes != 0) {
            player.send(format!("@0{axes}\r").as_bytes())?;
        }
        player.send(b"@0i\r")?;
        for line in lines {
            player.send(format!("{line}\r").as_bytes())?;
        }
        player.run_program()?;
        let unforeseen = self.unforeseen(&player);
        if !unforeseen.is_empty() {
            return Err(format!("the field makes it warn: {}", unforeseen.join(", ")));
        }
        Ok(player.counters())
    }
}
