//! The routes to what is expected: sentences in the words in which a failure names them.

use serde_json::json;
use vimc4::{Effect, Expectation, Failure, Trial, Unmet, Watched};
use vimc4_answers::fields::no_such;
use vimc4_answers::limits::EXPECTATIONS;
use vimc4_answers::problem::{Kind, Problem};

use crate::acts::done;
use crate::call::{Answer, Call, Outcome};
use crate::expectations::{Expected, as_json};
use crate::served::Served;

fn unmet(failure: &Failure) -> Problem {
    Problem::new(Kind::Unmet, failure, "").with("failure", as_json(failure))
}

fn read(call: &Call) -> Result<Expectation, Problem> {
    Ok(Expectation::read(call.text("expect"), &call.app.names)?)
}

fn met(words: &str) -> Outcome {
    Answer::json(&json!({ "expected": words, "state": "met" }))
}

pub(crate) async fn expectations(call: Call) -> Outcome {
    let served = call.controller()?;
    // What was sent before has come.
    served.control.now().await?;
    let kept = served.expectations.kept();
    Answer::json(&kept.iter().map(|(id, expected)| expected.json(*id)).collect::<Vec<_>>())
}

pub(crate) async fn expectation(call: Call) -> Outcome {
    call.controller()?.control.now().await?;
    look(&call)
}

fn look(call: &Call) -> Outcome {
    answer(call.controller()?, call.number("id", "expectation")?)
}

fn answer(served: &Served, id: u64) -> Outcome {
    let kept = served.expectations.kept();
    let expected = kept.get(&id).ok_or_else(|| no_such("expectation", &id.to_string()))?;
    Answer::json(&expected.json(id))
}

pub(crate) async fn watch(call: Call) -> Outcome {
    let served = call.controller()?;
    let (expected, names) = (read(&call)?, &call.app.names);
    let words = expected.in_words(names);
    if served.expectations.kept().len() >= EXPECTATIONS {
        let detail = format!("{EXPECTATIONS} things are expected already");
        return Err(Problem::new(Kind::TooMany, detail, "check or delete some of them"));
    }
    let watched = Some(served.control.watch_for(expected, names).await??);
    let id = served.expectations.keep(Expected { words, watched });
    answer(served, id)
}

pub(crate) async fn wait_until_met(call: Call) -> Outcome {
    let served = call.controller()?;
    let id: u64 = call.number("id", "expectation")?;
    let _room = call.app.journey()?;
    let gone = || no_such("expectation", &id.to_string());
    let known = served
        .expectations
        .kept()
        .get(&id)
        .and_then(|expected| expected.watched.as_ref().map(Watched::until_met));
    let outcome = known.ok_or_else(gone)?.await;
    // One that was deleted meanwhile is not waited for any more either.
    let answer = look(&call)?;
    outcome?;
    Ok(answer)
}

pub(crate) async fn check(call: Call) -> Outcome {
    let mut expected = take(&call)?;
    match expected.watched.take() {
        None => {}
        Some(watched) => {
            if let Some(failure) = watched.checked().await? {
                return Err(unmet(&failure));
            }
        }
    }
    met(&expected.words)
}

pub(crate) async fn give_up(call: Call) -> Outcome {
    let mut expected = take(&call)?;
    if let Some(watched) = expected.watched.take() {
        watched.checked().await?;
    }
    done(&Effect::Something)
}

fn take(call: &Call) -> Result<Expected, Problem> {
    let id: u64 = call.number("id", "expectation")?;
    let expected = call.controller()?.expectations.kept().remove(&id);
    expected.ok_or_else(|| no_such("expectation", &id.to_string()))
}

pub(crate) async fn so_far(call: Call) -> Outcome {
    let served = call.controller()?;
    let (expected, names) = (read(&call)?, &call.app.names);
    let words = expected.in_words(names);
    let now = served.control.now().await?;
    let (journal, dropped) = served.feed.journal(now);
    match Trial::of(expected, &journal, names) {
        Err(Unmet::Mistake(mistake)) => Err(mistake.into()),
        Err(Unmet::Failure(failure)) => Err(unmet(&failure)),
        // What is not kept any more could have been anything.
        Ok(()) if dropped > 0 => Err(Problem::new(
            Kind::Unmet,
            format!("nobody knows: the first {dropped} entries are not kept any more"),
            "expect it before it happens, with POST to expectations",
        )),
        Ok(()) => met(&words),
    }
}
