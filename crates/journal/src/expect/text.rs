//! Expectations as people read them in a [`Failure`](super::Failure), and as they can write them.
//!
//! ```text
//! sentence = rule | stage { "; then " stage }
//! stage    = clause { ", and " clause } [", no sooner than after" SPAN] [", within" SPAN]
//! clause   = ( command | CONDITION ) ", " count
//! command  = "command" TEXT ["answered" [TEXT | "with an error" | "with error" CODE]] ["within" SPAN]
//! count    = "once" | "twice" | N "times" | "never" | "at least" count | "at most" count | N "to" count
//! rule     = "whenever" ( command | CONDITION ) [", if at all"] ": "
//!            ( CONDITION ["for at least" SPAN] | ( command | CONDITION ) "within" SPAN )
//! ```
//!
//! A TEXT with blanks needs quotation marks. `times` may be left out.

use std::time::Duration;

use vimc4_device::{Names, parse_duration};

use super::sentence::{Clauses, CommandClause, Expect, Sentence};
use super::{Expectation, Mistake};
use crate::words::OF_ANSWERS;

impl Expectation {
    /// Reads an expectation in the words of [`in_words`](Expectation::in_words), with the names of the
    /// device.
    ///
    /// ```
    /// # use vimc4_catalogue::{bare, machine, model};
    /// # use vimc4_device::Device;
    /// use vimc4_journal::expect::Expectation;
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let (model, mill) = (model("imc4")?, machine("mill")?);
    /// # let imc4 = bare(&model, &mill, b"")?;
    /// # let names = model.names(imc4.signals()).with_scales(mill.scales());
    /// let text = "command @A answered 0, at least twice; then signal cover is open, never";
    /// assert_eq!(Expectation::read(text, &names)?.in_words(&names), text);
    /// let wrong = Expectation::read("command @A", &names).unwrap_err();
    /// assert!(wrong.to_string().ends_with("say how often, as in `command @A, once`"), "{wrong}");
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// If it is no such sentence, or could never be met.
    pub fn read(text: &str, names: &Names) -> Result<Expectation, Mistake> {
        let text = text.trim();
        let expect = Expect::of((), names.clone());
        if let Some(text) = text.strip_prefix("whenever ") {
            return rule(expect, text)?.ready();
        }
        let mut sentence: Option<Sentence<()>> = None;
        for text in parts(text, "; then ") {
            let expect = match sentence {
                Some(before) => before.and(),
                None => expect.clone(),
            };
            joined(&expect, text)?;
            sentence = Some(stage(expect, text)?);
        }
        match sentence {
            Some(sentence) => sentence.ready(),
            None => Err(Mistake::new("it says nothing".to_owned())),
        }
    }
}

/// Refuses what is joined in another way than stages are.
fn joined(expect: &Expect<()>, text: &str) -> Result<(), Mistake> {
    let text = text.trim();
    if text == "always" || text.starts_with("always ") || text.ends_with(", always") {
        let why =
            "what is always so is what never happens otherwise; write it as in `x < 0, never`";
        return Err(Mistake::new(why.to_owned()));
    }
    for by in ["; ", ";", ", then ", " then "] {
        let mut found = text.match_indices(by).filter(|(place, _)| is_outside(text, *place));
        if let Some((place, _)) = found.next() {
            let (before, behind) = (&text[..place], text[place + by.len()..].trim_start());
            let behind = behind.strip_prefix("then ").unwrap_or(behind);
            if !before.trim().is_empty() && !behind.is_empty() && behind != "then" {
                let [before, behind] = [before, behind].map(|text| counted(expect, text));
                return Err(Mistake::new(format!(
                    "what comes after something else stands behind `; then `; write \
                     `{before}; then {behind}`"
                )));
            }
        }
    }
    Ok(())
}

/// With how often, if only that is missing.
fn counted(expect: &Expect<()>, text: &str) -> String {
    let text = text.trim();
    let once = format!("{text}, once");
    let reads = |text: &str| stage(expect.clone(), text).and_then(Sentence::ready).is_ok();
    if reads(text) || !reads(&once) { text.to_owned() } else { once }
}

fn stage(expect: Expect<()>, text: &str) -> Result<Sentence<()>, Mistake> {
    const SOONEST: &str = ", no sooner than after ";
    const LATEST: &str = ", within ";
    // In either order.
    let (text, after, within) = if text.rfind(SOONEST) > text.rfind(LATEST) {
        let (text, after) = ending(text, SOONEST)?;
        let (text, within) = ending(text, LATEST)?;
        (text, after, within)
    } else {
        let (text, within) = ending(text, LATEST)?;
        let (text, after) = ending(text, SOONEST)?;
        (text, after, within)
    };
    let mut expect = expect.stage(after, within);
    let mut clauses = parts(text, ", and ").into_iter();
    let mut said = clause(expect, clauses.next().unwrap_or_default())?;
    for text in clauses {
        expect = said.and();
        said = clause(expect, text)?;
    }
    Ok(said)
}

fn clause(expect: Expect<()>, text: &str) -> Result<Sentence<()>, Mistake> {
    let text = text.trim();
    if text.is_empty() {
        let why = "nothing is expected here; write it as in `command @A, once`";
        return Err(Mistake::new(why.to_owned()));
    }
    for word in ["; then", ", and"] {
        if let Some(before) = text.strip_suffix(word) {
            let before = counted(&expect, before);
            let why =
                format!("nothing follows `{word}`; go on as in `{before}{word} x > 100, once`");
            return Err(Mistake::new(why));
        }
    }
    let Some((what, number)) = last(text, ", ").and_then(|(what, often)| {
        let alone = || often.trim().parse().ok().map(|times| (times, Some(times)));
        Some((what, count(often).or_else(alone)?))
    }) else {
        if let Some((what, often)) = run_together(&expect, text) {
            let why = format!("`{often}` follows a comma and a blank; write `{what}, {often}`");
            return Err(Mistake::new(why));
        }
        // What would be refused then is told as it is at once.
        let text = text.strip_suffix(',').unwrap_or(text);
        let what = last(text, ", ").map_or(text, |(what, _)| what);
        pattern(expect, what)?.number(1, Some(1)).ready()?;
        let why = format!("`{text}` has no number; say how often, as in `{what}, once`");
        return Err(Mistake::new(why));
    };
    let (least, most) = number;
    Ok(pattern(expect, what)?.number(least, most))
}

/// What happens and how often, where only the comma between them is missing, or its blank.
fn run_together<'a>(expect: &Expect<()>, text: &'a str) -> Option<(&'a str, &'a str)> {
    // `at least 3 times` are four words.
    let mut gaps = text.rmatch_indices([' ', ',']).take(4);
    gaps.find_map(|(place, gap)| {
        let (what, often) = (text[..place].trim_end(), text[place + gap.len()..].trim_start());
        count(often)?;
        pattern(expect.clone(), what).ok()?.once().ready().ok()?;
        Some((what, often))
    })
}

fn pattern(expect: Expect<()>, text: &str) -> Result<Clauses<()>, Mistake> {
    Ok(match command(expect.clone(), text)? {
        Some(command) => command.clauses(),
        None => expect.when(text),
    })
}

/// A command, unless it is part of a condition.
fn command(expect: Expect<()>, text: &str) -> Result<Option<CommandClause<()>>, Mistake> {
    let Some(text) = text.strip_prefix("command ") else { return Ok(None) };
    let (like, rest) = word(text)?;
    let answered =
        rest.strip_prefix("answered").filter(|rest| rest.is_empty() || rest.starts_with(' '));
    if answered.is_none() && !rest.is_empty() && !rest.starts_with("within ") {
        return Ok(None);
    }
    let padded = format!(" {}", answered.unwrap_or(rest).trim());
    let (said, within) = ending(&padded, " within ")?;
    let mut command = expect.command(like);
    command = match (answered.is_some(), said.trim()) {
        (false, _) => command,
        (true, "") => command.answered_at_all(),
        (true, "with an error") => command.refused(),
        (true, said) if is_no_answer(said) => {
            let code = said.strip_prefix("error ").unwrap_or("2");
            return Err(Mistake::new(format!(
                "`answered {said}` does not say what the answer is; write it as in `answered with an \
                 error`, `answered with error {code}`, `answered within 1 s` or `answered \"{said}\"`"
            )));
        }
        (true, said) => match said.strip_prefix("with error ") {
            Some(code) => command.refused_with(only(code)?),
            None => command.answered(only(said)?),
        },
    };
    Ok(Some(match within {
        Some(span) => command.within(span),
        None => command,
    }))
}

/// Whether an answer is only begun in words that mean something of their own.
fn is_no_answer(said: &str) -> bool {
    OF_ANSWERS.contains(&said) || said == "with error" || said.starts_with("error ")
}

fn rule(expect: Expect<()>, text: &str) -> Result<Sentence<()>, Mistake> {
    let mut parts = parts(text, ": ").into_iter();
    let (Some(whenever), Some(then), None) = (parts.next(), parts.next(), parts.next()) else {
        let why = "a sentence with `whenever` has one colon; write `whenever z < 0: signal cover is closed`";
        return Err(Mistake::new(why.to_owned()));
    };
    let (whenever, if_at_all) = match whenever.strip_suffix(", if at all") {
        Some(whenever) => (whenever, true),
        None => (whenever, false),
    };
    let whenever = pattern(expect.clone(), whenever)?.whenever();
    let lasting = |state| match pattern(expect.clone(), state)?.happening() {
        Some(what) => {
            let follows = format!("say how soon it follows, as in `{what} within 2 s`");
            Err(Mistake::of_happening(&what, &follows))
        }
        None => Ok(state),
    };
    let sentence = match (ending(then, " for at least ")?, ending(then, " within ")?) {
        ((state, Some(span)), _) => whenever.must_have_been(lasting(state)?).for_at_least(span),
        (_, (what, Some(span))) => {
            whenever.must_follow_what(pattern(expect.clone(), what)?).within(span)
        }
        _ => whenever.must_be(lasting(then)?),
    };
    Ok(if if_at_all { sentence.if_at_all() } else { sentence })
}

/// How often: at least, and at most.
fn count(text: &str) -> Option<(u64, Option<u64>)> {
    let times = |text: &str| match text.trim() {
        "never" => Some(0),
        "once" => Some(1),
        "twice" => Some(2),
        text => text.strip_suffix("times")?.trim_end().parse().ok(),
    };
    let number = |text: &str| times(text).or_else(|| text.trim().parse().ok());
    let text = text.trim();
    if let Some(least) = text.strip_prefix("at least ") {
        return Some((number(least)?, None));
    }
    if let Some(most) = text.strip_prefix("at most ") {
        return Some((0, Some(number(most)?)));
    }
    if let Some((least, most)) = text.split_once(" to ") {
        return Some((least.parse().ok()?, Some(number(most)?)));
    }
    // A number alone is one only where a comma tells it from what is answered.
    times(text).map(|times| (times, Some(times)))
}

/// What is before these words, and the span of time behind them.
fn ending<'a>(text: &'a str, words: &str) -> Result<(&'a str, Option<Duration>), Mistake> {
    let Some((before, span)) = last(text, words) else { return Ok((text, None)) };
    match parse_duration(span.trim()) {
        Ok(span) => Ok((before, Some(span))),
        Err(error) => Err(Mistake::new(match span.split_once(", ") {
            // What limits a stage stands behind how often.
            Some((limit, often)) if parse_duration(limit).is_ok() && count(often).is_some() => {
                let limit = format!("{words}{limit}");
                let early = limit.trim_start_matches(", ");
                format!("`{early}` stands before how often; write `{before}, {often}{limit}`")
            }
            _ => format!("`{}` {error}; write it as in `1.5 s`", span.trim()),
        })),
    }
}

/// A word, or what is between quotation marks, and what follows.
fn word(text: &str) -> Result<(&str, &str), Mistake> {
    let text = text.trim();
    match text.strip_prefix('"') {
        Some(quoted) => match quoted.split_once('"') {
            Some((word, rest)) => Ok((word, rest.trim_start())),
            None => Err(Mistake::new(format!("`{text}` lacks the second quotation mark"))),
        },
        None => {
            let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
            Ok((word, rest.trim_start()))
        }
    }
}

/// A word that nothing follows.
fn only(text: &str) -> Result<&str, Mistake> {
    match word(text)? {
        (word, "") => Ok(word),
        _ => Err(Mistake::new(format!(
            "`{text}` is more than a word; put it between quotation marks"
        ))),
    }
}

/// The pieces between separators that are not between quotation marks.
fn parts<'a>(text: &'a str, separator: &str) -> Vec<&'a str> {
    let (mut parts, mut begin) = (Vec::new(), 0);
    for (place, _) in text.match_indices(separator).filter(|(place, _)| is_outside(text, *place)) {
        parts.push(&text[begin..place]);
        begin = place + separator.len();
    }
    parts.push(&text[begin..]);
    parts
}

/// What is before the last separator that is not between quotation marks, and what is behind it.
fn last<'a>(text: &'a str, separator: &str) -> Option<(&'a str, &'a str)> {
    let mut found = text.rmatch_indices(separator);
    let (place, _) = found.find(|(place, _)| is_outside(text, *place))?;
    Some((&text[..place], &text[place + separator.len()..]))
}

fn is_outside(text: &str, place: usize) -> bool {
    text[..place].matches('"').count().is_multiple_of(2)
}
