//! A trace for Perfetto and Chrome: what was done, and how long it took.

use vimc4_device::Time;

use crate::scene::{Id, Kind, Scene, Signal, Span, Track, Value};
use crate::sheet::{Ink, Paper, Sheet, put_decimal};

/// A trace in the JSON of Chrome's trace events, which `ui.perfetto.dev` opens: a track for the state,
/// the commands, the answers, the motions and the lines of a program, and one for each signal that is
/// not drawn step by step.
pub struct Trace<P> {
    ink: Ink<P>,
    /// The beginning of an event of each signal; empty for those that are left out.
    counters: Vec<String>,
    is_first: bool,
}

impl<P: Paper> Trace<P> {
    /// A trace that is written there.
    pub fn new(paper: P) -> Trace<P> {
        Trace { ink: Ink::new(paper), counters: Vec::new(), is_first: true }
    }

    fn event(&mut self, text: &str, at: Time) {
        // What is collected ends with a whole event here.
        if self.ink.is_full() {
            self.flush();
        }
        let start: &[u8] = if self.is_first { b"\n" } else { b",\n" };
        self.is_first = false;
        self.ink.put(start);
        self.ink.put(text.as_bytes());
        put_micros(&mut self.ink.text, at.as_nanos());
    }
}

/// What closes the trace. It stands behind the last event from the beginning, and the next event
/// overwrites it: the file of a program that was killed is a whole trace, too.
const END: &[u8] = b"\n]}\n";

impl<P: Paper> Sheet for Trace<P> {
    fn begin(&mut self, scene: &Scene, at: Time) {
        self.ink.put(b"{\"displayTimeUnit\":\"ns\",\"traceEvents\":[");
        let name = quoted(&scene.name);
        let process =
            format!(r#"{{"ph":"M","pid":1,"name":"process_name","args":{{"name":{name}}},"ts":"#);
        self.event(&process, at);
        self.ink.put(b"}");
        for (number, track) in (1..).zip(Track::ALL) {
            let name = quoted(track.name());
            let thread = format!(
                r#"{{"ph":"M","pid":1,"tid":{number},"name":"thread_name","args":{{"name":{name}}},"ts":"#
            );
            self.event(&thread, at);
            self.ink.put(b"}");
        }
        let counter = |signal: &Signal| {
            // Positions change with every step: a motion says how many it makes.
            let is_left_out =
                !signal.in_tables || signal.kind == Kind::Text || signal.name == "position";
            let path = scene.path(signal);
            let path = path.strip_prefix(&scene.name).unwrap_or(&path).trim_start_matches('.');
            match is_left_out {
                true => String::new(),
                false => format!(r#"{{"ph":"C","pid":1,"name":{},"ts":"#, quoted(path)),
            }
        };
        self.counters = scene.signals.iter().map(counter).collect();
    }

    fn set(&mut self, at: Time, signal: Id, value: Value<'_>) {
        let value = match value {
            Value::Bit(bit) => i64::from(bit),
            Value::Byte(byte) => i64::from(byte),
            Value::Number(number) => number,
            Value::Text(_) => return,
        };
        let Some(counter) = self.counters.get(signal).filter(|name| !name.is_empty()) else {
            return;
        };
        let counter = counter.clone();
        self.event(&counter, at);
        self.ink.put(format!(r#","args":{{"value":{value}}}}}"#).as_bytes());
    }

    fn span(&mut self, span: &Span<'_>) {
        let number = Track::ALL.iter().position(|track| *track == span.track).unwrap_or(0) + 1;
        let is_moment = matches!(span.track, Track::Answer | Track::Note);
        let kind = if is_moment { r#""i","s":"t""# } else { r#""X""# };
        let name = quoted(span.name);
        let text = format!(r#"{{"ph":{kind},"pid":1,"tid":{number},"name":{name},"ts":"#);
        self.event(&text, span.from);
        if !is_moment {
            self.ink.put(br#","dur":"#);
            put_micros(&mut self.ink.text, span.to.nanos_since(span.from));
        }
        if let Some(steps) = span.steps {
            self.ink.put(format!(r#","args":{{"steps":{steps}}}"#).as_bytes());
        }
        self.ink.put(b"}");
    }

    fn flush(&mut self) {
        if !self.ink.text.is_empty() {
            self.ink.dry();
            self.ink.put_at(self.ink.written(), END);
        }
    }

    fn end(&mut self, _at: Time) {
        self.ink.put(END);
        self.ink.dry();
    }
}

/// Adds nanoseconds as microseconds with three places, which is the unit of these traces.
fn put_micros(text: &mut Vec<u8>, nanos: u64) {
    put_decimal(text, nanos / 1_000);
    text.push(b'.');
    for place in [100, 10, 1] {
        text.push(b'0' + (nanos / place % 10) as u8);
    }
}

/// A text as JSON has it.
fn quoted(text: &str) -> String {
    let mut quoted = String::from('"');
    for letter in text.chars() {
        match letter {
            '"' | '\\' => quoted.extend(['\\', letter]),
            letter if letter.is_control() => {
                quoted.push_str(&format!("\\u{:04x}", u32::from(letter)));
            }
            letter => quoted.push(letter),
        }
    }
    quoted.push('"');
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_those_of_json() {
        for text in ["", "@0A 5\\r", "a \"b\" \u{1}\n", "ö"] {
            assert_eq!(serde_json::from_str::<String>(&quoted(text)).unwrap(), text);
        }
    }
}
