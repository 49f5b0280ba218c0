//! When faults strike.
//!
//! ```text
//! when = "once" | "always" | NUMBER "times" | "every" NTH | NTH "byte" | NUMBER "%" | "for" TIME
//!      | "seed" NUMBER | "after" [NTH] CONDITION { "then" [NTH] CONDITION } | "while" CONDITION
//! ```
//!
//! `after` comes last, because a condition has words of its own, and `while` follows it.

use vimc4_device::{Awaited, Chance, Condition, Names, Nth, When};

use crate::lexer::Read;
use crate::{Lexer, condition};

/// The forms of a fault of the line.
pub(crate) const WHEN: &str = "once, `3 times`, always, `every 10th`, `3rd byte`, `5%`, `for 200ms`, \
                               `seed 7`, or `after` or `while` and a condition";

/// The forms of a fault of the machine.
pub(crate) const OF_MACHINE: &str =
    "or nothing: `for 200ms`, or `after` or `while` and a condition";

/// Reads the whole rest: when a fault strikes. It strikes so `often` if nothing else is said.
pub(crate) fn read_when(
    often: Option<u64>,
    forms: &str,
    mut lexer: Lexer<'_>,
    names: &Names,
) -> Read<When> {
    let mut when = When::ALWAYS;
    // Naming which of many, or for how long, means more than the first one.
    let (mut times, mut first, mut is_many) = (None, None, false);
    while !lexer.is_at_end() {
        let here = lexer;
        if lexer.keyword("after") || lexer.keyword("when") {
            when.after = awaited(&mut lexer, names)?;
        } else if lexer.keyword("while") {
            when.during = Some(Box::new(lasting(lexer, names)?));
            break;
        } else if let Some(often) = how_often(&mut lexer)? {
            if times.is_some() {
                return Err(here.wrong("something else: how often is said already"));
            }
            times = Some(often);
        } else if lexer.keyword("every") {
            let plain = |word: &str| word.parse().ok().filter(|number| *number > 0);
            let nth = |word: &_| Nth::read(word).or_else(|| plain(word));
            when.every = lexer.expect("which of them, as in `every 10th`", nth)?;
            is_many = true;
        } else if lexer.keyword("for") {
            when.lasts = Some(lexer.span("for 200ms")?);
            is_many = true;
        } else if lexer.keyword("seed") {
            when.seed = lexer.expect("a number, as in `seed 7`", |word| word.parse().ok())?;
        } else if let Some(chance) = lexer.word_as(chance) {
            when.chance = chance;
            is_many = true;
        } else if let Some(nth) = lexer.ordinal().filter(|_| lexer.keyword("byte")) {
            first = Some(nth);
        } else {
            return Err(here.wrong(amiss(here.peek()).as_deref().unwrap_or(forms)));
        }
    }
    // Every tenth are the tenth, the twentieth and so on.
    when.first = first.unwrap_or(when.every);
    when.times = times.unwrap_or(if is_many { None } else { often });
    Ok(when)
}

/// A state that is the whole rest.
pub(crate) fn lasting(lexer: Lexer<'_>, names: &Names) -> Read<Condition> {
    let condition = condition::awaited(lexer, names)?;
    if condition.has_happenings() {
        return Err(lexer.wrong("a state, which lasts, as in `while x > 1000`"));
    }
    Ok(condition)
}

fn awaited(lexer: &mut Lexer<'_>, names: &Names) -> Read<Vec<Awaited>> {
    let mut awaited = Vec::new();
    loop {
        let times = lexer.ordinal().map_or(1, |nth| u32::try_from(nth).unwrap_or(u32::MAX));
        let rest = lexer.before_keyword(&["then", "while"]);
        let (part, rest) = rest.unwrap_or((*lexer, lexer.at_end()));
        awaited.push(Awaited { condition: condition::awaited(part, names)?, times });
        *lexer = rest;
        if !lexer.keyword("then") {
            return Ok(awaited);
        }
    }
}

/// How often a fault strikes, where that is said: `once`, `3 times`, or `always`, which is no number.
fn how_often(lexer: &mut Lexer<'_>) -> Read<Option<Option<u64>>> {
    if lexer.keyword("once") {
        return Ok(Some(Some(1)));
    }
    if lexer.keyword("always") {
        return Ok(Some(None));
    }
    Ok(counted(lexer, &["times"], "at least once")?.map(Some))
}

/// A number from 1 on with one of these words behind it, if there is one; `least` is expected instead
/// of 0.
pub(crate) fn counted(lexer: &mut Lexer<'_>, units: &[&str], least: &str) -> Read<Option<u64>> {
    let here = *lexer;
    let is_number = |word: &&str| word.bytes().all(|byte| byte.is_ascii_digit());
    let number = lexer.word().filter(is_number);
    let Some(number) = number.filter(|_| units.iter().any(|unit| lexer.keyword(unit))) else {
        *lexer = here;
        return Ok(None);
    };
    match number.parse() {
        Ok(0) => Err(here.wrong(least)),
        Ok(number) => Ok(Some(number)),
        Err(_) => Err(here.wrong("a smaller number, up to 18446744073709551615")),
    }
}

/// `5%`, `0.5%`.
fn chance(word: &str) -> Option<Chance> {
    let number = word.strip_suffix('%')?;
    let (whole, places) = number.split_once('.').unwrap_or((number, ""));
    let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || places.len() > 4 || !is_number(whole) || !is_number(places) {
        return None;
    }
    let places = format!("{places:0<4}").parse().ok()?;
    let millionths = whole.parse::<u32>().ok()?.checked_mul(10_000)?.checked_add(places)?;
    (millionths <= 1_000_000).then(|| Chance::millionths(millionths))
}

/// What is expected instead of a word that was meant for a probability or for one of many bytes.
fn amiss(word: &str) -> Option<String> {
    let digits = word.bytes().take_while(u8::is_ascii_digit).count();
    let (number, end) = word.split_at_checked(digits).filter(|(number, _)| !number.is_empty())?;
    if let Some(percent) = word.strip_suffix('%') {
        let is_over = percent.parse::<f64>().is_ok_and(|percent| percent > 100.0);
        return Some(match is_over {
            true => "no more than 100%".to_owned(),
            false => "a probability with at most four places, as in `5%` or `0.5%`".to_owned(),
        });
    }
    let nth = number.parse().unwrap_or(1).max(1);
    let is_nth = ["st", "nd", "rd", "th"].contains(&end);
    is_nth.then(|| format!("which byte, as in `{} byte`", Nth(nth)))
}
