//! Expressions, values that are set, and the console.

use serde_json::{Value, json};
use vimc4_debug::{Answer, DebugError, Debugger, Directive, Reason, Variable, Way, uninterrupted};
use vimc4_device::{Device, Input, parse_duration};
use vimc4_timeline::Progress;

use crate::arguments::{Completions, Evaluate, SetExpression, SetVariable};
use crate::held::Walk;
use crate::message::Refusal;
use crate::state::{Answered, DONE, Session, answer};

impl Session {
    pub(crate) fn evaluate(&mut self, about: Evaluate, progress: &mut Progress<'_>) -> Answered {
        let text = about.expression.trim();
        if about.context == "repl"
            && let Some(answered) = self.told_to_one_that_runs(text, about.frame_id)
        {
            return answered;
        }
        let thread = self.of_frame(about.frame_id)?;
        if about.context == "repl"
            && let Some(answered) = self.asked_of_one_that_runs_by_itself(text, thread)?
        {
            return Ok(answered);
        }
        if about.context != "repl" {
            let value = value(self.resting(thread as i64 + 1)?.debugger(), text);
            let value = value.map_err(Refusal::new)?;
            return Ok(self.result(thread, &value));
        }
        let directive = Directive::named(text.split_whitespace().next().unwrap_or_default());
        let goes_forward = directive.is_some_and(Directive::goes_forward);
        // A hover or a watch only looks at what would come.
        let is_meant = directive.is_none_or(|directive| directive.name != "what");
        let held = self.resting(thread as i64 + 1)?;
        let place = held.debugger().place();
        let mut answered = None;
        let arrived =
            held.during(goes_forward, is_meant, progress, &mut |debugger, progress| {
                // An axis may be called like the short word for a command.
                answered = Some(match is_axis(debugger, text) {
                    true => value(debugger, text).map(Answer::Value),
                    false => debugger.execute(text, progress),
                });
            })?;
        let has_moved = held.debugger().place() != place;
        let Some(answered) = answered.filter(|_| arrived) else {
            self.has_moved(thread, Answer::Done);
            return Err(Refusal::cancelled());
        };
        let told = answered.map_err(Refusal::new)?;
        if let Answer::Stopped(stop, _) = &told
            && stop.why == Reason::Cancelled
        {
            return Err(Refusal::cancelled());
        }
        let result = match &told {
            Answer::Value(value) => self.result(thread, &value.clone()),
            Answer::Quit => {
                return Err(Refusal::new("the session ends with its editor: Stop or Disconnect"));
            }
            told => json!({ "result": told.to_string(), "variablesReference": 0 }),
        };
        if has_moved {
            self.has_moved(thread, told);
        }
        Ok(result)
    }

    /// Carries out what is typed while a controller runs by itself, in the words of the panel.
    /// `None` if none runs, or if a controller that stands still is meant.
    fn told_to_one_that_runs(&mut self, text: &str, frame: i64) -> Option<Answered> {
        let is_of_frame = frame != 0 || (0..self.held.len()).any(|it| !self.is_on_its_way(it));
        let run = self.away.first().filter(|_| !is_of_frame)?;
        let (_, live) = self.held.get_mut(run.thread)?.live()?;
        let done = live.order(text);
        Some(done.map(|()| json!({ "result": "", "variablesReference": 0 })))
    }

    /// The commands that exist only for a live controller, which stands still now.
    fn asked_of_one_that_runs_by_itself(
        &mut self,
        text: &str,
        thread: usize,
    ) -> Result<Option<Value>, Refusal> {
        let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let held = self.resting(thread as i64 + 1)?;
        let now = held.debugger().now();
        let Some((debugger, live)) = held.live() else { return Ok(None) };
        if text == "take" {
            let said = live.take(debugger)?;
            self.has_moved(thread, Answer::Done);
            return Ok(Some(json!({ "result": said, "variablesReference": 0 })));
        }
        if Directive::named(word).is_none_or(|directive| directive.name != "continue") {
            return Ok(None);
        }
        let walk = match rest.trim() {
            "" => Walk::Go(Way::Forward),
            span => Walk::Until(now + parse_duration(span).map_err(Refusal::new)?),
        };
        self.begin(thread, walk);
        let body = json!({ "threadId": thread + 1, "allThreadsContinued": false });
        self.tell("continued", body);
        Ok(Some(json!({ "result": "", "variablesReference": 0 })))
    }

    /// A command of the console has led somewhere else.
    fn has_moved(&mut self, thread: usize, told: Answer) {
        let Some(held) = self.held.get_mut(thread) else { return };
        let stop = match told {
            Answer::Stopped(stop, _) => Some(stop),
            _ => Some(held.debugger().here()),
        };
        self.frames.forget(thread);
        self.values.forget(thread);
        if let Some(stop) = stop {
            // The user asked for it, so it ends nothing.
            self.stopped(thread, &Walk::Go(vimc4_debug::Way::Back), stop);
        }
    }

    fn result(&mut self, thread: usize, value: &Variable) -> Value {
        let mut told = self.told_value(thread, value);
        told["result"] = told["value"].take();
        if let Value::Object(parts) = &mut told {
            parts.remove("value");
            parts.remove("name");
            parts.remove("evaluateName");
        }
        told
    }

    pub(crate) fn set_variable(&mut self, set: SetVariable) -> Answered {
        let (thread, path) = self.part(set.variables_reference, &set.name)?;
        self.put(thread, &path, &set.value)
    }

    pub(crate) fn set_expression(&mut self, set: SetExpression) -> Answered {
        let thread = self.of_frame(set.frame_id)?;
        self.put(thread, set.expression.trim(), &set.value)
    }

    /// Sets a switch, or puts another value into the state.
    fn put(&mut self, thread: usize, path: &str, text: &str) -> Answered {
        let held = self.resting(thread as i64 + 1)?;
        let mut done = DONE;
        // It takes only a moment, so it cannot be cancelled.
        held.during(false, true, &mut uninterrupted, &mut |debugger, _| {
            done = set(debugger, path, text.trim());
        })?;
        done?;
        let value = held.debugger().variable(path).map_err(Refusal::new)?;
        self.tell_of_elsewhere(thread);
        if self.client.is_told_what_is_old {
            let body = json!({ "areas": ["all"], "threadId": thread + 1 });
            self.tell("invalidated", body);
        }
        let told = self.told_value(thread, &value);
        answer(json!({
            "value": told["value"], "type": told["type"],
            "variablesReference": told["variablesReference"],
        }))
    }

    pub(crate) fn completions(&mut self, about: Completions) -> Answered {
        let thread = self.of_frame(about.frame_id)?;
        let first = self.client.first_line;
        let row = about.line.map_or(0, |line| line.saturating_sub(first));
        let row = usize::try_from(row).unwrap_or(0);
        let text = about.text.split('\n').nth(row).unwrap_or_default().to_owned();
        let units = usize::try_from(about.column.saturating_sub(first)).unwrap_or(0);
        let debugger = self.resting(thread as i64 + 1)?.debugger();
        let cursor = byte_of(&text, units);
        let completion = debugger.complete(&text, cursor);
        let start = text.get(..completion.from).unwrap_or_default().encode_utf16().count();
        let length = units.saturating_sub(start);
        let targets: Vec<Value> = completion
            .candidates
            .into_iter()
            .map(|candidate| {
                json!({
                    "label": candidate.text, "detail": candidate.about,
                    "start": start, "length": length,
                })
            })
            .collect();
        answer(json!({ "targets": targets }))
    }
}

/// Sets a switch, or puts another value into the state.
fn set(debugger: &mut Debugger, path: &str, text: &str) -> Answered {
    let Some(name) = path.strip_prefix("signals.").map(|name| name.trim_matches('"')) else {
        let value = serde_json::from_str(text).unwrap_or_else(|_| text.into());
        debugger.set_variable(path, value).map_err(Refusal::new)?;
        return DONE;
    };
    let signals = debugger.device().signals();
    let signal = signals.iter().find(|own| own.name.eq_ignore_ascii_case(name));
    let signal = signal.ok_or_else(|| Refusal(format!("there is no signal {name}")))?;
    let value = signal.value_of(text).ok_or_else(|| {
        let values = signal.values();
        let there = if text.is_empty() { "nothing" } else { text };
        Refusal(format!("{name} is {} to {}, and not {there}", values.start(), values.end()))
    })?;
    debugger.give(Input::Signal(signal.id, value));
    DONE
}

/// Whether it is the name of an axis, and nothing else.
fn is_axis(debugger: &Debugger, text: &str) -> bool {
    text.chars().all(char::is_alphanumeric) && debugger.variable(&format!("axes.{text}")).is_ok()
}

/// A field with its parts, or the value of an expression.
fn value(debugger: &Debugger, text: &str) -> Result<Variable, DebugError> {
    if let Ok(found) = debugger.variable(text)
        && !text.is_empty()
    {
        return Ok(found);
    }
    let value = debugger.evaluate(text)?;
    Ok(Variable { name: text.to_owned(), path: String::new(), value })
}

/// The byte offset of a position in UTF-16 units.
fn byte_of(text: &str, units: usize) -> usize {
    let mut before = 0;
    let found = text.char_indices().find(|(_, c)| {
        before += c.len_utf16();
        before > units
    });
    found.map_or(text.len(), |(at, _)| at)
}
