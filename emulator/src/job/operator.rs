//! The person who stands by, at a terminal or not at all.

use std::io::{self, IsTerminal, Write};
use std::mem;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use indicatif::ProgressBar;
use vimc4_device::{StartButton, escape};
use vimc4_ncp::Problem;
use vimc4_ncp::job::{InputTest, Question};
use vimc4_ncp::language::{Instruction, JobLine, TextLine, lines};

use super::channel::{Attendant, Decision};
use super::perform::shown;
use super::typing::Typing;
use crate::endings;
use crate::text::shown_in_line;

/// What is said to a person, and what they say.
pub(crate) struct Operator<'t> {
    text: &'t str,
    /// Everything is accepted.
    pub(crate) yes: bool,
    /// Inputs are not waited for.
    pub(crate) skip_waits: bool,
    /// Every command is told.
    pub(crate) verbose: bool,
    typed: Option<Receiver<Vec<String>>>,
    /// What came together with an answer, before anything else was asked.
    early: Vec<String>,
    /// Whether what is typed now is an answer.
    asking: Arc<AtomicBool>,
    /// Time is paused while the operator decides.
    at_leisure: bool,
    /// What else is shown.
    pub(crate) bar: Option<ProgressBar>,
    /// What was asked last, so that it is asked once.
    asked: Option<(u32, Asked)>,
    /// How a motion goes on, for people.
    resuming: String,
    /// Whether there is a START at the panel that goes on with it.
    has_start: bool,
    /// Whether every line waits for the operator.
    by_line: bool,
    /// The operator's permission for a line to begin.
    begun: Option<u32>,
    /// What the operator has typed that was done, and where.
    pub(crate) entered: Vec<Entered>,
}

/// A line that the operator typed at a question, and that was done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Entered {
    /// The line of the job that has asked; 0 before its first.
    pub(crate) line: u32,
    /// Whether it counts for nothing once the operator has taken the zero.
    pub(crate) finds_zero: bool,
    /// Whether it changes where the lines behind it go: the zero, the plane, the cylinder.
    pub(crate) changes_frame: bool,
    /// What was typed.
    pub(crate) typed: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asked {
    Question(Question),
    Wait(InputTest),
    Stopped,
    Held,
    Line,
}

/// What the operator has typed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer<'a> {
    /// Nothing yet.
    None,
    /// An empty line.
    Enter,
    /// The end of the job, in one of the words that people have for it.
    End,
    /// A letter, in lower case.
    Key(&'static str),
    /// Anything else.
    Text(&'a str),
}

impl<'a> Answer<'a> {
    fn of(typed: Option<&'a str>) -> Answer<'a> {
        let Some(typed) = typed else { return Answer::None };
        let word = typed.trim();
        match typed {
            "" => Answer::Enter,
            _ if is_end(word) => Answer::End,
            _ => match ["c", "k", "s"].into_iter().find(|key| word.eq_ignore_ascii_case(key)) {
                Some(key) => Answer::Key(key),
                // A blank is not Enter: letting a machine go on must be deliberate.
                None => Answer::Text(typed),
            },
        }
    }
}

/// Whether the operator wants the job to end.
fn is_end(word: &str) -> bool {
    ["q", "quit", "stop"].iter().any(|end| word.eq_ignore_ascii_case(end))
}

/// What START at the panel does to a motion that was stopped, for people.
fn says(start: StartButton) -> &'static str {
    match start {
        StartButton::Resumes => "START at the panel goes on",
        StartButton::IsSeen { .. } => "START at the panel, held until it moves, goes on",
    }
}

impl<'t> Operator<'t> {
    /// No operator, only the options. `text` is the job's, for its comments.
    pub(crate) fn new(text: &'t str, yes: bool, skip_waits: bool, verbose: bool) -> Operator<'t> {
        Operator {
            text,
            yes,
            skip_waits,
            verbose,
            typed: None,
            early: Vec::new(),
            asking: Arc::default(),
            at_leisure: false,
            bar: None,
            asked: None,
            resuming: "START goes on".to_owned(),
            has_start: true,
            by_line: false,
            begun: None,
            entered: Vec::new(),
        }
    }

    /// An operator at the terminal, if there is one, and at the panel. A line that is typed while
    /// nothing is asked is not an answer, and stops the job: `stop` is called. `woken` is called
    /// when an answer can be heard.
    pub(crate) fn listen(
        &mut self,
        start: Option<StartButton>,
        mut stop: impl FnMut() + Send + 'static,
        woken: impl Fn() + Send + 'static,
    ) {
        self.has_start = start.is_some();
        if !io::stdin().is_terminal() {
            self.resuming =
                start.map_or("nobody is at the terminal to continue it", says).to_owned();
            return;
        }
        let (sender, typed) = channel();
        let asking = Arc::clone(&self.asking);
        let reader = move || {
            let mut typing = Typing::begin();
            while let Some(lines) = typing.next() {
                if !asking.load(Ordering::SeqCst) {
                    stop();
                    continue;
                }
                if sender.send(lines).is_err() {
                    return;
                }
                woken();
            }
            // The input has ended, which a question may be waiting for.
            drop(sender);
            woken();
        };
        if thread::Builder::new().name("operator".to_owned()).spawn(reader).is_ok() {
            self.typed = Some(typed);
            let start = start.map(|start| format!("; {}, too", says(start))).unwrap_or_default();
            self.resuming = format!("Enter goes on, q ends the job{start}");
        }
    }

    /// An operator at the terminal whose answers are awaited one by one.
    pub(crate) fn listen_at_leisure(&mut self) {
        self.at_leisure = io::stdin().is_terminal();
        if self.at_leisure {
            self.resuming = "Enter goes on, q ends the job".to_owned();
        }
    }

    /// Whether there is an operator.
    fn has_listener(&self) -> bool {
        self.at_leisure || self.typed.is_some()
    }

    /// Prints a message. If it cannot be printed, the operator cannot be asked either.
    fn tell(&self, text: &str) {
        let say = || writeln!(io::stderr(), "{text}");
        let _ = match &self.bar {
            Some(bar) => bar.suspend(say),
            None => say(),
        };
    }

    /// Says something once. Only what is typed from then on is an answer to it.
    fn say(&mut self, line: u32, asked: Asked, text: impl FnOnce(&Self) -> String) {
        if self.asked != Some((line, asked)) {
            self.asked = Some((line, asked));
            let unread = self.typed.as_ref().into_iter().flat_map(Receiver::try_iter).flatten();
            self.early.extend(unread);
            for typed in mem::take(&mut self.early) {
                let what = match typed.trim() {
                    "" => "Enter".to_owned(),
                    typed => format!("`{}`", shown_in_line(typed)),
                };
                self.tell(&format!("{what} was typed before this was asked, and does not count"));
            }
            self.asking.store(true, Ordering::SeqCst);
            self.tell(&text(self));
        }
    }

    /// What is typed is an answer as long as something is asked.
    fn decided(&self, decision: Decision) -> Decision {
        let asks = matches!(decision, Decision::NotYet | Decision::Again);
        self.asking.store(asks, Ordering::SeqCst);
        decision
    }

    /// What missing input means: the operator is deciding, or there is none and will be none.
    fn silence(&self) -> Decision {
        if self.has_listener() { Decision::NotYet } else { Decision::Unattended }
    }

    /// Says what would be right instead of what was typed, and asks again.
    fn refuse(&mut self, typed: &str, right: &str) -> Decision {
        self.tell(&format!("`{}` is not an answer here; {right}", shown_in_line(typed)));
        Decision::Again
    }

    /// What was typed since the message; `None` if there is no operator.
    fn heard(&mut self) -> Option<String> {
        if self.at_leisure {
            self.asked = None;
            // The end of the input, and a request to end, end the job.
            let line = endings::unless_asked(|| io::stdin().lines().next().and_then(Result::ok));
            return Some(line.flatten().unwrap_or_else(|| "q".to_owned()));
        }
        let heard = self.typed.as_ref()?.try_recv();
        match heard {
            Ok(lines) => {
                self.asked = None;
                let mut lines = lines.into_iter();
                let answer = lines.next();
                self.early.extend(lines);
                answer
            }
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                self.typed = None;
                None
            }
        }
    }

    /// Whether the operator agrees to the last message. An operator who is already listening is
    /// asked here.
    pub(crate) fn agrees(&mut self) -> bool {
        if self.yes {
            return true;
        }
        self.asking.store(true, Ordering::SeqCst);
        self.tell("Type yes to begin:");
        let typed = self.typed.as_ref().and_then(|typed| typed.recv().ok());
        self.asking.store(false, Ordering::SeqCst);
        typed.is_some_and(|lines| lines.first().is_some_and(|line| line.trim() == "yes"))
    }

    /// The comments of a line and the next, which a HALT shows.
    fn comments(&self, number: u32) -> Vec<&'t str> {
        let from = lines(self.text).skip(number.saturating_sub(1) as usize);
        // Copies that double the ends of lines have an empty one between any two.
        let near =
            from.filter(|line| line.number == number || !line.text.trim().is_empty()).take(2);
        let comment = |line: TextLine<'t>| {
            let JobLine { command, comment, .. } =
                vimc4_ncp::language::parse(line.text, &mut |_, _| {});
            // The next line's comment belongs to the HALT only if it is nothing else.
            comment
                .filter(|comment| !comment.is_empty())
                .filter(|_| line.number == number || command.is_none())
        };
        near.filter_map(comment).collect()
    }

    fn question(&self, line: u32, question: Question) -> String {
        let mut text = match question {
            Question::Halt => format!("line {line}: HALT"),
            Question::Tool(number) => format!("line {line}: put in tool {number}"),
            Question::Teach if line == 0 => "find the work-piece zero".to_owned(),
            Question::Teach => format!("line {line}: find the work-piece zero"),
        };
        if question == Question::Halt {
            for comment in self.comments(line) {
                text += "\n  ";
                text += comment;
            }
        }
        if self.has_listener() {
            text += match question {
                Question::Halt | Question::Tool(_) => {
                    "\nEnter goes on, s goes on line by line, q ends the job"
                }
                Question::Teach => {
                    "\nmove with lines such as MOVEREL X500; Enter makes this place the zero, k \
                     keeps the old one, q ends the job"
                }
            };
        }
        text
    }
}

/// What is asked, and what that decides.
impl Operator<'_> {
    fn on_ask(&mut self, line: u32, question: Question) -> Decision {
        self.say(line, Asked::Question(question), |operator| operator.question(line, question));
        if self.yes {
            return Decision::GoOn;
        }
        let typed = self.heard();
        match Answer::of(typed.as_deref()) {
            Answer::None => self.silence(),
            Answer::Enter => Decision::GoOn,
            Answer::End => Decision::End,
            Answer::Key("k") if question == Question::Teach => Decision::Skip,
            Answer::Key("s") if question != Question::Teach => {
                self.by_line = true;
                // The question was its line's beginning.
                self.begun = Some(line);
                Decision::GoOn
            }
            Answer::Text(typed) if typed.trim().is_empty() => {
                let right = match question {
                    Question::Teach => "Enter makes this place the zero, k keeps the old one",
                    _ => "Enter goes on, s goes on line by line, q ends the job",
                };
                self.refuse(typed, right)
            }
            Answer::Key(typed) => Decision::First(typed.to_owned()),
            Answer::Text(typed) => Decision::First(typed.trim().to_owned()),
        }
    }

    fn on_wait(&mut self, line: u32, test: InputTest) -> Decision {
        if self.skip_waits {
            return Decision::Skip;
        }
        self.say(line, Asked::Wait(test), |operator| {
            let InputTest { port, bit, value } = test;
            let what = match bit {
                Some(bit) => format!("port {port} bit {bit} to be {value}"),
                None => format!("port {port} to be {value}"),
            };
            let skip =
                if operator.has_listener() { "; Enter skips it, q ends the job" } else { "" };
            format!("line {line}: waiting for {what}{skip}")
        });
        let typed = self.heard();
        match Answer::of(typed.as_deref()) {
            // The input may still come.
            Answer::None => Decision::NotYet,
            Answer::Enter => Decision::Skip,
            Answer::End => Decision::End,
            Answer::Key(typed) | Answer::Text(typed) => {
                self.refuse(typed, "Enter skips the wait, q ends the job")
            }
        }
    }

    fn on_stopped(&mut self, line: u32) -> Decision {
        self.say(line, Asked::Stopped, |operator| {
            format!("line {line}: stopped; {}", operator.resuming)
        });
        let typed = self.heard();
        match Answer::of(typed.as_deref()) {
            Answer::None if self.has_start => Decision::NotYet,
            Answer::None => self.silence(),
            Answer::Enter => Decision::GoOn,
            Answer::End => Decision::End,
            Answer::Key(typed) | Answer::Text(typed) => {
                self.refuse(typed, "Enter goes on, q ends the job")
            }
        }
    }

    fn on_held(&mut self, line: u32) -> Decision {
        self.say(line, Asked::Held, |_| {
            format!("line {line}: held; Enter goes on, q ends the job")
        });
        let typed = self.heard();
        match Answer::of(typed.as_deref()) {
            Answer::None => self.silence(),
            Answer::Enter => Decision::GoOn,
            Answer::End => Decision::End,
            Answer::Key(typed) | Answer::Text(typed) => {
                self.refuse(typed, "Enter goes on, q ends the job")
            }
        }
    }

    fn on_step(&mut self, line: u32) -> Decision {
        // What stands before the first line is its beginning too.
        if !self.by_line || self.begun == Some(line) {
            return Decision::GoOn;
        }
        self.say(line, Asked::Line, |operator| {
            let text = lines(operator.text).nth(line.saturating_sub(1) as usize);
            let text = text.map(|line| line.text.trim()).unwrap_or_default();
            format!("line {line}: {text}\nEnter does it, c goes on without a halt, q ends the job")
        });
        let typed = self.heard();
        match Answer::of(typed.as_deref()) {
            Answer::None => return self.silence(),
            Answer::Enter => {}
            Answer::End => return Decision::End,
            Answer::Key("c") => self.by_line = false,
            Answer::Key(typed) | Answer::Text(typed) => {
                let right = "Enter does the line, c goes on without a halt, q ends the job";
                return self.refuse(typed, right);
            }
        }
        self.begun = Some(line);
        Decision::GoOn
    }
}

impl Attendant for Operator<'_> {
    fn ask(&mut self, line: u32, question: Question) -> Decision {
        let decision = self.on_ask(line, question);
        self.decided(decision)
    }

    fn wait(&mut self, line: u32, test: InputTest) -> Decision {
        let decision = self.on_wait(line, test);
        self.decided(decision)
    }

    fn stopped(&mut self, line: u32) -> Decision {
        let decision = self.on_stopped(line);
        self.decided(decision)
    }

    fn held(&mut self, line: u32) -> Decision {
        let decision = self.on_held(line);
        self.decided(decision)
    }

    fn step(&mut self, line: u32) -> Decision {
        let decision = self.on_step(line);
        self.decided(decision)
    }

    fn leaves(&mut self) -> bool {
        self.asking.store(false, Ordering::SeqCst);
        self.asked = None;
        self.typed.as_ref().is_some_and(|typed| typed.try_iter().count() > 0)
    }

    fn answered(&mut self, line: u32, sent: &[u8], answer: &[u8]) {
        if self.verbose {
            let (sent, answer) = (shown(sent), escape(answer));
            let place = if line == 0 { String::new() } else { line.to_string() };
            let _ = writeln!(io::stdout(), "{place:>6}  {sent:<48}  {answer}");
        }
    }

    fn entered(&mut self, line: u32, question: Question, typed: &str, changes_frame: bool) {
        let command = vimc4_ncp::language::parse(typed, &mut |_, _| {}).command;
        let Some(command) = command.map(|command| command.value) else { return };
        let sets_zero = matches!(
            command,
            Instruction::ZeroHere
                | Instruction::ZeroStandard
                | Instruction::ZeroAt(_)
                | Instruction::ZeroClear
                | Instruction::Recall(_)
        );
        let finds_zero =
            question == Question::Teach && (sets_zero || matches!(command, Instruction::Move(..)));
        self.entered.push(Entered { line, finds_zero, changes_frame, typed: typed.to_owned() });
    }

    fn tell(&mut self, text: &str) {
        Operator::tell(self, text);
    }

    fn object(&mut self, problem: Problem) {
        // Moving by hand does not need what a file needs.
        match problem.code() {
            "beyond-travel" | "beyond-limit" => self.tell(&problem.to_string()),
            _ => self.tell(&vimc4_script::said(&problem)),
        }
    }
}
