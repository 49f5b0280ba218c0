//! Rules as people write them.

use std::error::Error;
use std::fmt::{self, Write};
use std::ops::Range;
use std::time::Duration;

use super::{Act, Awaits, Cue, Lasts, Rule, Ruling, Scenario, ScenarioNumber, Trigger};
use crate::condition::{excerpt, without_names};
use crate::nth::Nth;
use crate::{Condition, Deed, Fault, Faulting, Names, parse_duration, show_nanos};

/// Why a text is not a rule: where it goes wrong, and what would be right there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RuleError {
    text: String,
    at: usize,
    right: String,
}

impl RuleError {
    pub(crate) fn new(text: &str, at: usize, right: &str) -> RuleError {
        RuleError { text: text.to_owned(), at, right: right.to_owned() }
    }

    /// From which byte of the text on it is wrong; its length if something is missing at its end.
    #[must_use]
    pub fn at(&self) -> usize {
        self.at
    }

    /// What would be right, for people.
    #[must_use]
    pub fn right(&self) -> &str {
        &self.right
    }
}

impl fmt::Display for RuleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rest = self.text.get(self.at..).unwrap_or_default();
        excerpt(f, &self.text, rest, &self.right)
    }
}

impl Error for RuleError {}

/// Where a text of several parts is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RulePart {
    /// The name.
    Name,
    /// How often.
    Times,
    /// What it waits for.
    Trigger,
    /// What it does.
    Do,
}

/// A rule in parts, as a file has them. The trigger is all that would stand before the colon.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RuleTexts<'t> {
    pub(crate) name: Option<&'t str>,
    pub(crate) times: Option<u64>,
    pub(crate) trigger: &'t str,
    /// All that would stand behind it.
    pub(crate) acts: &'t str,
}

/// Reads a deed; else from which byte on the text is none, and what would be right.
pub(crate) type ReadDeed<'r> = &'r dyn Fn(&str) -> Result<Deed, (usize, String)>;

/// Words that are no names.
const WORDS: [&str; 9] = ["at", "every", "when", "while", "rule", "once", "times", "end", "all"];

const TRIGGERS: &str = "`at 2s`, `every 100ms`, `when` or `while` and a condition, as in \
                        `when x > 1000: press stop`";

/// A part of a text that knows where it stands in it.
#[derive(Clone, Copy)]
struct Part<'t> {
    whole: &'t str,
    text: &'t str,
}

impl<'t> Part<'t> {
    fn of(whole: &'t str) -> Part<'t> {
        Part { whole, text: whole.trim() }
    }

    /// Where a piece of the whole begins.
    fn place(self, piece: &str) -> usize {
        (piece.as_ptr() as usize).saturating_sub(self.whole.as_ptr() as usize).min(self.whole.len())
    }

    fn wrong(self, right: impl Into<String>) -> RuleError {
        self.wrong_at(0, right)
    }

    /// From a byte of this part on.
    fn wrong_at(self, at: usize, right: impl Into<String>) -> RuleError {
        let at = self.place(self.text) + at;
        RuleError { text: self.whole.to_owned(), at, right: right.into() }
    }

    fn missing(self, right: impl Into<String>) -> RuleError {
        self.wrong_at(self.text.len(), right)
    }

    /// A piece of it.
    fn piece(self, range: Range<usize>) -> Part<'t> {
        let text = self.text.get(range).unwrap_or_default();
        Part { text: text.trim(), ..self }
    }

    fn first(self) -> &'t str {
        self.text.split_whitespace().next().unwrap_or_default()
    }

    fn behind(self, length: usize) -> Part<'t> {
        // An empty rest still stands behind what was before it.
        let text = self.text.get(length..).unwrap_or_default();
        Part { text: text.trim(), ..self }
    }

    fn take(&mut self, word: &str) -> bool {
        let is = self.first() == word;
        if is {
            *self = self.behind(word.len());
        }
        is
    }

    /// Where a piece of its text stands that is not between quotation marks, as a word of its own.
    fn find_word(self, word: &str) -> Option<usize> {
        let is_end = |at: usize| {
            let next = self.text.get(at..).and_then(|rest| rest.chars().next());
            next.is_none_or(char::is_whitespace)
        };
        let before = |at: usize| {
            self.text.get(..at).is_none_or(|before| before.ends_with(char::is_whitespace))
        };
        bare(self.text)
            .filter(|at| self.text.get(*at..).is_some_and(|rest| rest.starts_with(word)))
            .find(|at| is_end(at + word.len()) && before(*at))
    }

    /// Where a sign stands that ends a part: followed by a blank, or at the end.
    fn find_sign(self, sign: char) -> Option<usize> {
        bare(self.text).find(|at| {
            let mut rest = self.text.get(*at..).unwrap_or_default().chars();
            rest.next() == Some(sign) && rest.next().is_none_or(char::is_whitespace)
        })
    }

    fn time(self, example: &str) -> Result<Duration, RuleError> {
        let right = || format!("a time, as in `{example}`");
        if self.text.is_empty() {
            return Err(self.missing(right()));
        }
        parse_duration(self.text).map_err(|_| self.wrong(right()))
    }
}

/// The places of characters outside of quotation marks.
fn bare(text: &str) -> impl Iterator<Item = usize> {
    let (mut quoted, mut escaped) = (false, false);
    text.char_indices().filter_map(move |(at, c)| {
        let outside = !quoted;
        if escaped {
            escaped = false;
        } else if quoted && c == '\\' {
            escaped = true;
        } else if c == '"' {
            quoted = !quoted;
        }
        outside.then_some(at)
    })
}

/// Reads what is done about scenarios: a rule that begins, with a number before it unless it is the
/// next, `end 3` or `end all`. Rules of one scenario stand on lines of their own.
pub(crate) fn read_ruling(
    text: &str,
    names: &Names,
    deed: ReadDeed<'_>,
) -> Result<Ruling, RuleError> {
    let mut part = Part::of(text);
    let mut behind = part;
    let ends = match behind.take("rule") {
        true => behind.take("end"),
        false => behind.take("end"),
    };
    if ends {
        return match behind.text {
            "all" => Ok(Ruling::EndAll),
            number => {
                let right = "the number of a scenario, or all; `rules` lists them";
                let number = number.parse().map_err(|_| behind.wrong(right))?;
                Ok(Ruling::End(ScenarioNumber(number)))
            }
        };
    }
    let first = part.first();
    let number = first.parse().ok().map(ScenarioNumber);
    if number.is_some() {
        part = part.behind(first.len());
    }
    let mut rules = Vec::new();
    let mut lines = part.text.split('\n').filter(|line| !line.trim().is_empty()).peekable();
    if lines.peek().is_none() && number.is_none() {
        return Err(part.missing(format!("a rule begins with {TRIGGERS}")));
    }
    for line in lines {
        let line = Part { text: line.trim(), ..part };
        rules.push(whole_rule(line, names, deed)?);
    }
    Ok(Ruling::Begin(number.unwrap_or(ScenarioNumber::NEXT), Scenario { rules }))
}

/// Reads a rule in parts.
pub(crate) fn read_rule(
    texts: &RuleTexts<'_>,
    names: &Names,
    read_deed: ReadDeed<'_>,
) -> Result<Rule, (RulePart, RuleError)> {
    if let Some(name) = texts.name {
        check_name(Part::of(name)).map_err(|error| (RulePart::Name, error))?;
    }
    if texts.times == Some(0) {
        let error = Part::of("0").wrong("at least once");
        return Err((RulePart::Times, error));
    }
    let trigger = trigger(Part::of(texts.trigger), names);
    let trigger = trigger.map_err(|error| (RulePart::Trigger, error))?;
    let acts = acts(Part::of(texts.acts), names, read_deed);
    let acts = acts.map_err(|error| (RulePart::Do, error))?;
    Ok(Rule { name: texts.name.map(str::to_owned), trigger, times: texts.times, acts })
}

fn whole_rule(line: Part<'_>, names: &Names, read_deed: ReadDeed<'_>) -> Result<Rule, RuleError> {
    let Some(colon) = line.find_sign(':') else {
        let mut head = line;
        if head.take("rule") && head.text.is_empty() {
            return Err(head.missing(TRIGGERS));
        }
        // What is wrong before it is worth more than that it is missing.
        head_of(line, names)?;
        return Err(line.missing("`:` and what is done, as in `when x > 1000: press stop`"));
    };
    let (name, times, trigger) = head_of(line.piece(0..colon), names)?;
    let body = line.behind(colon + 1);
    if body.text.is_empty() {
        return Err(line.missing("what is done, as in `when x > 1000: press stop`"));
    }
    Ok(Rule { name, trigger, times, acts: acts(body, names, read_deed)? })
}

/// What a rule does, one thing after the other.
fn acts(body: Part<'_>, names: &Names, read_deed: ReadDeed<'_>) -> Result<Vec<Act>, RuleError> {
    let mut acts = Vec::new();
    let mut rest = body;
    loop {
        let is_end = |at: &usize| rest.text.get(*at..).is_some_and(|text| text.starts_with(';'));
        let bare = bare(rest.text).find(is_end);
        let end = bare.unwrap_or(rest.text.len());
        acts.push(act(rest.piece(0..end), names, read_deed)?);
        rest = rest.behind(end + 1);
        if rest.text.is_empty() {
            return Ok(acts);
        }
    }
}

type Head = (Option<String>, Option<u64>, Trigger);

fn head_of(mut head: Part<'_>, names: &Names) -> Result<Head, RuleError> {
    let (mut name, mut times) = (None, None);
    if head.take("rule") {
        let first = head.first();
        if !WORDS.contains(&first) && first.parse::<u64>().is_err() && !first.is_empty() {
            check_name(head.piece(0..first.len()))?;
            name = Some(first.to_owned());
            head = head.behind(first.len());
        }
        if head.take("once") {
            times = Some(1);
        } else if let Ok(number) = head.first().parse::<u64>() {
            let here = head;
            head = head.behind(head.first().len());
            if !head.take("times") || number == 0 {
                return Err(here.wrong("how often, as in `3 times`"));
            }
            times = Some(number);
        }
    }
    Ok((name, times, trigger(head, names)?))
}

fn check_name(name: Part<'_>) -> Result<(), RuleError> {
    let is_letter = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_');
    let begins = name.text.starts_with(char::is_alphabetic);
    if begins && name.text.chars().all(is_letter) && !WORDS.contains(&name.text) {
        return Ok(());
    }
    let right = format!(
        "a name of letters, digits, `-` and `_`, which is none of {}; or {TRIGGERS}",
        WORDS.join(", ")
    );
    Err(name.wrong(right))
}

fn trigger(mut part: Part<'_>, names: &Names) -> Result<Trigger, RuleError> {
    if part.take("at") {
        let (first, span) = match part.find_word("every") {
            Some(at) => {
                let span = part.behind(at + "every".len());
                (part.piece(0..at), Some(repeats(span)?))
            }
            None => (part, None),
        };
        let first = first.time("at 2s")?;
        return Ok(span.map_or(Trigger::At(first), |span| Trigger::Every { first, span }));
    }
    if part.take("every") {
        let span = repeats(part)?;
        return Ok(Trigger::Every { first: span, span });
    }
    if part.take("when") {
        let mut cues = Vec::new();
        loop {
            let end = part.find_word("then");
            let piece = part.piece(0..end.unwrap_or(part.text.len()));
            let cue = cue(piece, names)?;
            if cues.is_empty() && matches!(cue.awaits, Awaits::Time(_)) {
                let right = "something that happens or becomes so; or `at` or `every` and a time";
                return Err(piece.wrong(right));
            }
            cues.push(cue);
            let Some(end) = end else { break };
            part = part.behind(end + "then".len());
        }
        return Ok(Trigger::When(cues));
    }
    if part.take("while") {
        let condition = condition(part, names)?;
        if condition.has_happenings() {
            return Err(part.wrong("a state, which lasts, as in `while x > 1000`"));
        }
        return Ok(Trigger::While(condition));
    }
    if part.text.is_empty() { Err(part.missing(TRIGGERS)) } else { Err(part.wrong(TRIGGERS)) }
}

fn repeats(part: Part<'_>) -> Result<Duration, RuleError> {
    let span = part.time("every 100ms")?;
    if span < Rule::SHORTEST {
        return Err(part.wrong("a time of 1ms at least"));
    }
    Ok(span)
}

fn cue(part: Part<'_>, names: &Names) -> Result<Cue, RuleError> {
    if let Ok(span) = parse_duration(part.text) {
        return Ok(Cue { awaits: Awaits::Time(span), times: 1 });
    }
    let (mut rest, mut times) = (part, 1);
    if let Some(nth) = Nth::read(part.first()).and_then(|nth| u32::try_from(nth).ok()) {
        (rest, times) = (part.behind(part.first().len()), nth);
    }
    if rest.take("rule") {
        check_name(rest)?;
        return Ok(Cue { awaits: Awaits::Rule(rest.text.to_owned()), times });
    }
    Ok(Cue { awaits: Awaits::Condition(condition(rest, names)?), times })
}

/// A condition; the beginning of a command alone says that it is that command.
fn condition(part: Part<'_>, names: &Names) -> Result<Condition, RuleError> {
    let read = match part.text.starts_with(['@', '!']) {
        true => names.read(&format!("command {}", part.text)),
        false => names.read(part.text),
    };
    read.map_err(|error| {
        let at = part.text.len() - error.rest().len().min(part.text.len());
        part.wrong_at(at, error.right())
    })
}

fn act(part: Part<'_>, names: &Names, read_deed: ReadDeed<'_>) -> Result<Act, RuleError> {
    let (mut done, mut lasts) = (part, None);
    if let Some(at) = part.find_word("until") {
        lasts = Some(Lasts::Until(condition(part.behind(at + "until".len()), names)?));
        done = part.piece(0..at);
        if part.first() != "fault" && done.find_word("for").is_some() {
            let right = "`for` and a time, or `until` and a condition: one of the two";
            return Err(part.wrong_at(at, right));
        }
    } else if part.first() != "fault"
        && let Some(at) = part.find_word("for")
    {
        lasts = Some(Lasts::For(part.behind(at + "for".len()).time("power off for 100ms")?));
        done = part.piece(0..at);
    }
    if done.text.is_empty() {
        return Err(part.wrong("what is done, as in `press stop`"));
    }
    let deed = read_deed(done.text).map_err(|(at, right)| done.wrong_at(at, right))?;
    Ok(Act { deed, lasts })
}

impl Names {
    /// Writes a rule so that [`read_rule`](Names::read_rule) reads the same.
    #[must_use]
    pub fn write_rule(&self, rule: &Rule) -> String {
        let Rule { name, trigger, times, acts } = rule;
        let mut text = String::new();
        // Writing to a string cannot fail.
        if name.is_some() || times.is_some() {
            let name = name.as_ref().map_or_else(String::new, |name| format!(" {name}"));
            let times = match times {
                None => String::new(),
                Some(1) => " once".to_owned(),
                Some(times) => format!(" {times} times"),
            };
            let _ = write!(text, "rule{name}{times} ");
        }
        text.push_str(&self.write_trigger(trigger));
        let _ = write!(text, ": {}", self.write_acts(acts));
        text
    }

    /// What a rule does, as it stands behind the colon.
    #[must_use]
    pub fn write_acts(&self, acts: &[Act]) -> String {
        acts.iter().map(|act| self.write_act(act)).collect::<Vec<_>>().join("; ")
    }

    /// What a rule waits for, as it stands before the colon.
    #[must_use]
    pub fn write_trigger(&self, trigger: &Trigger) -> String {
        match trigger {
            Trigger::At(time) => format!("at {}", shown(*time)),
            Trigger::Every { first, span } if first == span => format!("every {}", shown(*span)),
            Trigger::Every { first, span } => {
                format!("at {} every {}", shown(*first), shown(*span))
            }
            Trigger::When(cues) => {
                let cues: Vec<String> = cues.iter().map(|cue| self.write_cue(cue)).collect();
                format!("when {}", cues.join(" then "))
            }
            Trigger::While(condition) => format!("while {}", self.write(condition)),
        }
    }

    fn write_cue(&self, cue: &Cue) -> String {
        let nth = match cue.times {
            0 | 1 => String::new(),
            times => format!("{} ", Nth(times.into())),
        };
        match &cue.awaits {
            Awaits::Condition(condition) => format!("{nth}{}", self.write(condition)),
            Awaits::Rule(name) => format!("{nth}rule {name}"),
            Awaits::Time(span) => shown(*span),
        }
    }

    fn write_act(&self, act: &Act) -> String {
        let deed = self.write_deed(&act.deed);
        match (&act.lasts, &act.deed) {
            (None, _) => deed,
            // A fault says itself how long.
            (Some(Lasts::For(span)), Deed::Fault(faulting)) => {
                let mut faulting = (**faulting).clone();
                if let Faulting::Begin(_, fault) = &mut faulting {
                    match fault {
                        Fault::Line(fault) => fault.when.lasts = Some(*span),
                        Fault::Machine(fault) => fault.when.lasts = Some(*span),
                    }
                }
                self.write_deed(&Deed::Fault(faulting.into()))
            }
            (Some(Lasts::For(span)), _) => format!("{deed} for {}", shown(*span)),
            (Some(Lasts::Until(condition)), _) => format!("{deed} until {}", self.write(condition)),
        }
    }

    /// Writes a deed so that it is ordered by the same words.
    #[must_use]
    pub fn write_deed(&self, deed: &Deed) -> String {
        match deed {
            Deed::Fault(faulting) => format!("fault {}", self.write_faulting(faulting)),
            deed => deed.to_string(),
        }
    }

    /// Writes what is done about scenarios so that [`read_ruling`](Names::read_ruling) reads the same.
    #[must_use]
    pub fn write_ruling(&self, ruling: &Ruling) -> String {
        match ruling {
            Ruling::Begin(number, scenario) => {
                let mut rules: Vec<String> =
                    scenario.rules.iter().map(|rule| self.write_rule(rule)).collect();
                let single = rules.len() == 1;
                match (*number, single) {
                    (ScenarioNumber::NEXT, true) => {}
                    (number, true) => rules = vec![format!("{number} {}", rules.concat())],
                    (number, false) => rules.insert(0, number.to_string()),
                }
                rules.join("\n")
            }
            Ruling::End(number) => format!("end {number}"),
            Ruling::EndAll => "end all".to_owned(),
        }
    }
}

fn shown(span: Duration) -> String {
    show_nanos(u64::try_from(span.as_nanos()).unwrap_or(u64::MAX))
}

/// With numbers for signals; [`Names::write_rule`] has their names.
impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&without_names().write_rule(self))
    }
}

/// With numbers for signals; [`Names::write_ruling`] has their names.
impl fmt::Display for Ruling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&without_names().write_ruling(self))
    }
}

/// The forms of a rule, and what each says.
pub(crate) fn help_on_rules() -> Vec<(String, String)> {
    let forms = [
        ("at 2s: ORDER", "once, so long after the rule was given"),
        ("every 100ms: ORDER", "again and again; `at 2s every 100ms: ORDER` begins later"),
        (
            "when x > 1000: ORDER",
            "whenever this happens or becomes so; `help run until` has the conditions",
        ),
        ("when 2nd @0A: ORDER", "each second time"),
        ("when @0A then 5ms: ORDER", "one after the other; a time is a pause"),
        ("when rule jam: ORDER", "whenever the rule of that name acts"),
        ("while x > 1000: ORDER", "as long as this is so; what the order changes is set back then"),
        ("rule jam once when …", "a name and how often, `once` or `3 times`; both may be left out"),
        ("press stop; power off", "several orders at the same instant"),
        ("power off for 100ms", "an order that is undone after a time"),
        ("hold stop until idle", "and one that is undone when something happens or is so"),
        (
            "rule end 3",
            "what rules have changed is set back when they end; `rule end all`, `reset`",
        ),
    ];
    forms.map(|(form, about)| (form.to_owned(), about.to_owned())).to_vec()
}
