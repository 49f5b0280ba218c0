//! Rules of scenarios.
//!
//! ```text
//! rule    = ["rule" [NAME] ["once" | NUMBER "times"]] trigger ":" act { ";" act }
//! trigger = "at" TIME ["every" TIME] | "every" TIME | "when" cue { "then" cue } | "while" CONDITION
//! cue     = [NTH] CONDITION | [NTH] "rule" NAME | TIME
//! act     = deed ["for" TIME | "until" CONDITION]
//! ruling  = rule | "end" NUMBER | "end" "all"
//! ```
//!
//! A deed is an order such as `press stop`, `input 0.3 1`, `power off` or `fault jam x`. The beginning of
//! a command alone, as in `when @0A`, says that it is that command.

use std::time::Duration;

use vimc4_device::{
    Act, Awaits, Cue, Lasts, Names, Rule, Ruling, Scenario, ScenarioNumber, Trigger, parse_duration,
};

use crate::lexer::Read;
use crate::{Lexer, SyntaxError, condition, deed, when};

/// Where a rule in parts is wrong.
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

/// Words that are no names.
const WORDS: [&str; 9] = ["at", "every", "when", "while", "rule", "once", "times", "end", "all"];

const TRIGGERS: &str = "`at 2s`, `every 100ms`, `when` or `while` and a condition, as in \
                        `when x > 1000: press stop`";

/// Reads a rule: `when x > 1000: press stop`.
///
/// # Errors
///
/// If it is not one rule.
pub fn read_rule(text: &str, names: &Names) -> Result<Rule, SyntaxError> {
    if let Ruling::Begin(_, Scenario { rules }) = read_ruling(text, names)?
        && let Ok([rule]) = <[Rule; 1]>::try_from(rules)
    {
        return Ok(rule);
    }
    Err(Lexer::new(text).wrong("one rule, as in `when x > 1000: press stop`"))
}

/// Reads an order about scenarios: a rule that begins, with a number before it unless it is the next,
/// `end 3` or `end all`. Rules of one scenario are on lines of their own.
///
/// # Errors
///
/// If it is no such order.
pub fn read_ruling(text: &str, names: &Names) -> Result<Ruling, SyntaxError> {
    ruling(Lexer::new(text), names)
}

/// Reads a rule in parts, as a file has them: its name, how often it acts, the text before its colon, and
/// the text behind it.
///
/// # Errors
///
/// If it is not a rule; with the part that is wrong.
pub fn read_rule_of(
    name: Option<&str>,
    times: Option<u64>,
    trigger_text: &str,
    acts_text: &str,
    names: &Names,
) -> Result<Rule, (RulePart, SyntaxError)> {
    if let Some(name) = name {
        check_name(Lexer::new(name), name.trim()).map_err(|error| (RulePart::Name, error))?;
    }
    if times == Some(0) {
        return Err((RulePart::Times, Lexer::new("0").wrong("at least once")));
    }
    let trigger = trigger(Lexer::new(trigger_text), names);
    let trigger = trigger.map_err(|error| (RulePart::Trigger, error))?;
    let acts = acts(Lexer::new(acts_text), names).map_err(|error| (RulePart::Do, error))?;
    Ok(Rule { name: name.map(str::to_owned), trigger, times, acts })
}

/// Reads an order about scenarios that is the whole rest.
pub(crate) fn ruling(mut lexer: Lexer<'_>, names: &Names) -> Read<Ruling> {
    let mut ends = lexer;
    ends.keyword("rule");
    if ends.keyword("end") {
        if ends.rest() == "all" {
            return Ok(Ruling::EndAll);
        }
        let expected = "the number of a scenario, or all; `rules` lists them";
        let number = ends.rest().parse().map_err(|_| ends.wrong(expected))?;
        return Ok(Ruling::End(ScenarioNumber(number)));
    }
    let number = lexer.value().map(ScenarioNumber);
    let rules = lexer.lines().map(|line| rule(line, names)).collect::<Read<Vec<_>>>()?;
    if rules.is_empty() && number.is_none() {
        return Err(lexer.wrong(format!("a rule begins with {TRIGGERS}")));
    }
    Ok(Ruling::Begin(number.unwrap_or(ScenarioNumber::NEXT), Scenario { rules }))
}

fn rule(line: Lexer<'_>, names: &Names) -> Read<Rule> {
    const ACTS: &str = "what is done, as in `when x > 1000: press stop`";
    let is_end = |next: Option<char>| next.is_none_or(char::is_whitespace);
    let Some((head, body)) = line.around_sign(':', is_end) else {
        let mut head = line;
        if head.keyword("rule") && head.is_at_end() {
            return Err(head.wrong(TRIGGERS));
        }
        // What is wrong before it is worth more than that it is missing.
        head_of(line, names)?;
        return Err(line.missing(format!("`:` and {ACTS}")));
    };
    let (name, times, trigger) = head_of(head, names)?;
    if body.is_at_end() {
        return Err(line.missing(ACTS));
    }
    Ok(Rule { name, trigger, times, acts: acts(body, names)? })
}

type Head = (Option<String>, Option<u64>, Trigger);

fn head_of(mut head: Lexer<'_>, names: &Names) -> Read<Head> {
    let (mut name, mut times) = (None, None);
    if head.keyword("rule") {
        let here = head;
        let is_name = |word: &&str| !is_keyword(word) && word.parse::<u64>().is_err();
        match head.chunk().filter(is_name) {
            Some(word) => name = Some(check_name(here, word)?.to_owned()),
            None => head = here,
        }
        let here = head;
        if head.keyword("once") {
            times = Some(1);
        } else if let Some(number) = head.value() {
            if !head.keyword("times") || number == 0 {
                return Err(here.wrong("how often, as in `3 times`"));
            }
            times = Some(number);
        }
    }
    Ok((name, times, trigger(head, names)?))
}

fn is_keyword(word: &str) -> bool {
    WORDS.iter().any(|known| known.eq_ignore_ascii_case(word))
}

/// Checks a name that begins here.
fn check_name<'t>(here: Lexer<'_>, name: &'t str) -> Read<&'t str> {
    let is_letter = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_');
    if name.starts_with(char::is_alphabetic) && name.chars().all(is_letter) && !is_keyword(name) {
        return Ok(name);
    }
    Err(here.wrong(format!(
        "a name of letters, digits, `-` and `_`, which is none of {}; or {TRIGGERS}",
        WORDS.join(", ")
    )))
}

fn trigger(mut lexer: Lexer<'_>, names: &Names) -> Read<Trigger> {
    let here = lexer;
    if lexer.keyword("at") {
        let Some((first, mut rest)) = lexer.before_keyword(&["every"]) else {
            return lexer.last_span("at 2s").map(Trigger::At);
        };
        rest.keyword("every");
        let span = interval(rest)?;
        return Ok(Trigger::Every { first: first.last_span("at 2s")?, span });
    }
    if lexer.keyword("every") {
        let span = interval(lexer)?;
        return Ok(Trigger::Every { first: span, span });
    }
    if lexer.keyword("when") {
        return cues(lexer, names).map(Trigger::When);
    }
    if lexer.keyword("while") {
        return when::lasting(lexer, names).map(Trigger::While);
    }
    Err(here.wrong(TRIGGERS))
}

fn interval(lexer: Lexer<'_>) -> Read<Duration> {
    let span = lexer.last_span("every 100ms")?;
    if span < Rule::SHORTEST {
        return Err(lexer.wrong("a time of 1ms at least"));
    }
    Ok(span)
}

fn cues(mut lexer: Lexer<'_>, names: &Names) -> Read<Vec<Cue>> {
    let mut cues = Vec::new();
    loop {
        let then = lexer.before_keyword(&["then"]);
        let part = then.map_or(lexer, |(part, _)| part);
        let cue = cue(part, names)?;
        if cues.is_empty() && matches!(cue.awaits, Awaits::Time(_)) {
            let expected = "something that happens or becomes so; or `at` or `every` and a time";
            return Err(part.wrong(expected));
        }
        cues.push(cue);
        let Some((_, rest)) = then else { return Ok(cues) };
        lexer = rest;
        lexer.keyword("then");
    }
}

fn cue(mut lexer: Lexer<'_>, names: &Names) -> Read<Cue> {
    if let Ok(span) = parse_duration(lexer.rest()) {
        return Ok(Cue { awaits: Awaits::Time(span), times: 1 });
    }
    let nth = |word: &_| vimc4_device::Nth::read(word).and_then(|nth| u32::try_from(nth).ok());
    let times = lexer.word_as(nth).unwrap_or(1);
    let awaits = match lexer.keyword("rule") {
        true => Awaits::Rule(check_name(lexer, lexer.rest())?.to_owned()),
        false => Awaits::Condition(condition::awaited(lexer, names)?),
    };
    Ok(Cue { awaits, times })
}

/// What a rule does, one thing after the other.
fn acts(mut lexer: Lexer<'_>, names: &Names) -> Read<Vec<Act>> {
    let mut acts = Vec::new();
    loop {
        let (part, rest) = lexer.around_sign(';', |_| true).unwrap_or((lexer, lexer.at_end()));
        acts.push(act(part, names)?);
        lexer = rest;
        if lexer.is_at_end() {
            return Ok(acts);
        }
    }
}

fn act<'t>(lexer: Lexer<'t>, names: &Names) -> Read<Act> {
    // A fault says itself how long.
    let says_how_long = |part: Lexer<'t>| {
        if lexer.peek().eq_ignore_ascii_case("fault") {
            None
        } else {
            part.before_keyword(&["for"])
        }
    };
    let (mut done, mut lasts) = (lexer, None);
    if let Some((before, until)) = lexer.before_keyword(&["until"]) {
        let mut rest = until;
        rest.keyword("until");
        lasts = Some(Lasts::Until(condition::awaited(rest, names)?));
        done = before;
        if says_how_long(done).is_some() {
            return Err(until.wrong("`for` and a time, or `until` and a condition: one of the two"));
        }
    } else if let Some((before, mut rest)) = says_how_long(lexer) {
        rest.keyword("for");
        lasts = Some(Lasts::For(rest.last_span("power off for 100ms")?));
        done = before;
    }
    if done.is_at_end() {
        return Err(done.wrong("what is done, as in `press stop`"));
    }
    Ok(Act { deed: deed::deed(done, names)?, lasts })
}
