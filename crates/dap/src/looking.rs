//! Looking at controllers that stand still.

use serde_json::{Value, json};
use vimc4_debug::{FrameKind, Variable};
use vimc4_device::show_nanos;

use crate::arguments::{Disassemble, OfFrame, SourceText, StackTrace, Variables};
use crate::held::Placed;
use crate::message::Refusal;
use crate::state::{Answered, Session, answer};

/// The groups that have a scope of their own; the rest share one.
const SCOPES: [(&str, &str, bool); 5] = [
    ("Axes", "axes", false),
    ("Signals", "signals", false),
    ("Ports", "ports", false),
    ("Controller", "", false),
    ("State", "state", true),
];

/// The most lines that are disassembled at once.
const MOST_INSTRUCTIONS: i64 = 10_000;

/// The distance between the programs of two controllers in the addresses that editors see.
const APART: i64 = 0x100_0000;

impl Session {
    pub(crate) fn threads(&mut self) -> Answered {
        let threads = self.held.iter().enumerate().filter(|(_, held)| !held.is_over);
        let threads: Vec<Value> = threads
            .map(|(number, held)| json!({ "id": number + 1, "name": held.opened.name }))
            .collect();
        answer(json!({ "threads": threads }))
    }

    pub(crate) fn stack_trace(&mut self, about: StackTrace) -> Answered {
        let held = self.resting(about.thread_id)?;
        let all = held.frames();
        let now = held.debugger().now();
        let total = all.len();
        let thread = self.thread(about.thread_id)?;
        let levels = if about.levels == 0 { usize::MAX } else { about.levels };
        let mut frames = Vec::new();
        for (place, placed) in all.into_iter().enumerate().skip(about.start_frame).take(levels) {
            let Placed { frame, line } = placed;
            let name = match frame.kind {
                FrameKind::Loop { left } => {
                    // As the editor counts, if the line is in the file.
                    let number = line.map_or(0, |(_, line)| line);
                    format!("loop of line {number}, {left} more: {}", frame.name)
                }
                FrameKind::Idle => format!("idle at {}", show_nanos(now.as_nanos())),
                FrameKind::Line | FrameKind::Command(_) | FrameKind::Waits => frame.name,
            };
            let mut told = json!({
                "id": self.frames.number(thread, place),
                "name": name,
                "line": line.map_or(0, |(_, line)| self.line_out(line)),
                "column": 1,
                "canRestart": line.is_some() && frame.kind != FrameKind::Waits,
            });
            match line {
                Some((text, _)) => told["source"] = self.source(thread, text),
                None => told["presentationHint"] = "subtle".into(),
            }
            if let (FrameKind::Line | FrameKind::Loop { .. }, Some(line)) = (frame.kind, frame.line)
            {
                told["instructionPointerReference"] = address(thread, i64::from(line) - 1).into();
            }
            frames.push(told);
        }
        answer(json!({ "stackFrames": frames, "totalFrames": total }))
    }

    pub(crate) fn scopes(&mut self, OfFrame { frame_id }: OfFrame) -> Answered {
        let thread = self.of_frame(frame_id)?;
        self.resting(thread as i64 + 1)?;
        let mut scopes = Vec::new();
        for (name, path, expensive) in SCOPES {
            let reference = self.values.number(thread, path.to_owned());
            let hint = if path == "axes" { "locals" } else { "registers" };
            scopes.push(json!({
                "name": name, "variablesReference": reference, "expensive": expensive,
                "presentationHint": hint,
            }));
        }
        answer(json!({ "scopes": scopes }))
    }

    pub(crate) fn variables(&mut self, about: Variables) -> Answered {
        let reference = about.variables_reference;
        let (thread, path) = self.values.get(reference).cloned().ok_or_else(|| {
            Refusal(format!("value {reference} no longer exists; scopes has the present ones"))
        })?;
        let held = self.resting(thread as i64 + 1)?;
        let whole = held.debugger().variable(&path).map_err(Refusal::new)?;
        // Nothing that is listed has both named and indexed parts.
        let is_list = whole.value.is_array();
        let is_left_out = match about.filter.as_str() {
            "indexed" => !is_list,
            "named" => is_list,
            _ => false,
        };
        let shown = |part: &Variable| {
            let is_elsewhere =
                path.is_empty() && SCOPES.iter().any(|(_, own, _)| *own == part.path);
            !is_left_out && !is_elsewhere
        };
        let parts = whole.children().into_iter().filter(shown).skip(about.start);
        let count = if about.count == 0 { usize::MAX } else { about.count };
        let parts: Vec<Value> =
            parts.take(count).map(|part| self.told_value(thread, &part)).collect();
        answer(json!({ "variables": parts }))
    }

    /// A value as a client is told of it.
    pub(crate) fn told_value(&mut self, thread: usize, value: &Variable) -> Value {
        let parts = value.parts();
        let reference = match parts {
            0 => 0,
            _ => self.values.number(thread, value.path.clone()),
        };
        // An axis is shown by its position.
        let text = match value.value.get("position").and_then(Value::as_i64) {
            Some(position) => position.to_string(),
            None => value.text(),
        };
        let mut told = json!({
            "name": value.name,
            "value": text,
            "type": kind(&value.value),
            "evaluateName": value.path,
            "variablesReference": reference,
        });
        let counted = if value.value.is_array() { "indexedVariables" } else { "namedVariables" };
        if parts > 0 {
            told[counted] = parts.into();
        }
        told
    }

    pub(crate) fn source_text(&mut self, about: SourceText) -> Answered {
        let reference = match (&about.source, about.source_reference) {
            (Some(source), 0) => source.reference,
            (_, reference) => reference,
        };
        let text = self.text(reference)?;
        answer(json!({ "content": text, "mimeType": "text/plain" }))
    }

    pub(crate) fn loaded_sources(&mut self) -> Answered {
        use crate::held::Text;
        let mut sources: Vec<Value> = Vec::new();
        for thread in 0..self.held.len() {
            let debugger = &self.held[thread].opened.debugger;
            let (has_source, has_program) = (debugger.source().is_some(), debugger.program());
            let has_program = has_program.is_some_and(|listing| !listing.lines.is_empty());
            let is_there = [(Text::Source, has_source), (Text::Program, has_program)];
            for (text, _) in is_there.into_iter().filter(|(_, is_there)| *is_there) {
                let source = self.source(thread, text);
                if !sources.contains(&source) {
                    sources.push(source);
                }
            }
        }
        answer(json!({ "sources": sources }))
    }

    /// Lines of the stored program, as if they were instructions a byte long.
    pub(crate) fn disassemble(&mut self, about: Disassemble) -> Answered {
        let count = about.instruction_count;
        if !(0..=MOST_INSTRUCTIONS).contains(&count) {
            return Err(Refusal(format!(
                "instructionCount is from 0 to {MOST_INSTRUCTIONS}, and here it is {count}"
            )));
        }
        let wrong = || Refusal(format!("{} is not a place in a program", about.memory_reference));
        let (thread, at) = at_address(&about.memory_reference).ok_or_else(wrong)?;
        let first = at.saturating_add(about.offset).saturating_add(about.instruction_offset);
        let held = self.resting(thread as i64 + 1)?;
        let listing = held.debugger().program();
        let stored = held.opened.stored.clone();
        let lines = listing.map(|listing| listing.lines).unwrap_or_default();
        let mut told = Vec::new();
        for place in (0..count).map(|place| first.saturating_add(place)) {
            let found = usize::try_from(place).ok().and_then(|place| lines.get(place));
            let Some(line) = found else {
                told.push(json!({
                    "address": address(thread, place), "instruction": "", "presentationHint": "invalid",
                }));
                continue;
            };
            let meaning = match line.meaning.as_str() {
                "" => String::new(),
                meaning => format!("   ; {meaning}"),
            };
            let mut instruction = json!({
                "address": address(thread, place),
                "instruction": format!("{}{meaning}", line.text),
                "symbol": format!("line {}", place + 1),
            });
            let of_file = usize::try_from(place).ok().and_then(|place| stored.get(place));
            if let Some(of_file) = of_file {
                instruction["location"] = self.source(thread, crate::held::Text::Source);
                instruction["line"] = self.line_out(*of_file).into();
            }
            told.push(instruction);
        }
        answer(json!({ "instructions": told }))
    }
}

/// The address by which editors know a line of a controller's program, from 0.
fn address(thread: usize, line: i64) -> String {
    let program = APART.saturating_mul(thread as i64 + 1);
    format!("{:#x}", program.saturating_add(line).max(0))
}

/// The controller and the line of its program at such an address.
fn at_address(text: &str) -> Option<(usize, i64)> {
    let at = i64::from_str_radix(text.trim().strip_prefix("0x")?, 16).ok()?;
    Some((usize::try_from(at / APART).ok()?.checked_sub(1)?, at % APART))
}

/// What a value is, for people.
fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "none",
        Value::Bool(_) => "yes or no",
        Value::Number(_) => "number",
        Value::String(_) => "text",
        Value::Array(_) => "list",
        Value::Object(_) => "group",
    }
}
