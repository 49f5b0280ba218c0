//! A recording in the panel: one page that has everything in it, and asks for nothing.

use std::io::{self, Write};
use std::sync::Arc;

use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::{Map, Value, json};
use vimc4::device::{Controller, Device};
use vimc4::{Machine, Model, Names, Report, Sink, Time, View};
use vimc4_answers::entry::list;
use vimc4_answers::feed::Feed;
use vimc4_answers::seen;

use crate::files::FILES;
use crate::limits::{FILM_ENTRIES, FILM_VIEWS};

/// What happened to a controller, to be shown by a page without a server.
#[derive(Debug)]
pub struct Film {
    title: String,
    about: Value,
    profiles: [Value; 2],
    signals: Value,
    names: Names,
    feed: Arc<Feed>,
    first: Time,
    views: Vec<(Time, View)>,
    /// Only every so many views are kept, and so many came since the last one.
    every: usize,
    since: usize,
    /// What is seen after what was told last.
    latest: Option<(Time, View)>,
    parts: Vec<Value>,
    /// How often somebody has gone back.
    back: usize,
    /// Where the emulation differs from the recording.
    differences: Value,
    /// Whether the recording has its end.
    has_end: bool,
}

impl Film {
    /// Begins with a controller as it is now.
    #[must_use]
    pub fn new(title: &str, model: &Model, machine: &Machine, controller: &Controller) -> Film {
        let names = model.names(controller.signals()).with_scales(machine.scales());
        let now = controller.now();
        let mut film = Film {
            title: title.to_owned(),
            about: seen::profile(1, model, machine, &names),
            profiles: [
                serde_json::to_value(model).unwrap_or_default(),
                serde_json::to_value(machine).unwrap_or_default(),
            ],
            signals: serde_json::to_value(controller.signals()).unwrap_or_default(),
            names,
            feed: Feed::keeping(Arc::new(|| {}), FILM_ENTRIES),
            first: now,
            views: Vec::new(),
            every: 1,
            since: 0,
            latest: None,
            parts: Vec::new(),
            back: 0,
            differences: Value::Null,
            has_end: true,
        };
        film.part(0, now);
        film.see(controller);
        film
    }

    /// So often somebody has gone back, and what had happened after that moment is not told.
    pub fn went_back(&mut self, times: usize) {
        self.back = times;
    }

    /// Here the emulation differs from the recording, as
    /// [`differences`](vimc4_answers::past::differences) tells it.
    pub fn differs(&mut self, differences: Value) {
        self.differences = differences;
    }

    /// Whether the recording has its end, or was cut off.
    pub fn has_end(&mut self, has_end: bool) {
        self.has_end = has_end;
    }

    /// Another branch begins at this time.
    pub fn part(&mut self, branch: u32, first: Time) {
        let from = self.feed.state().0;
        self.parts.push(json!({ "branch": branch, "from": from, "first": first }));
    }

    /// Something happened.
    pub fn tell(&mut self, report: &Report, controller: &Controller) {
        self.feed.sink().report(report, &|line| controller.explain(line));
    }

    /// What is seen now, after what was told last.
    pub fn see(&mut self, controller: &Controller) {
        let now = controller.now();
        if let Some((at, view)) = self.latest.take_if(|(at, _)| *at != now) {
            self.keep(at, view);
        }
        self.latest = Some((now, controller.view(now)));
    }

    /// Where there are too many, every second one goes.
    fn keep(&mut self, at: Time, view: View) {
        self.since += 1;
        if self.since >= self.every || self.views.is_empty() {
            self.since = 0;
            self.views.push((at, view));
        }
        if self.views.len() >= FILM_VIEWS {
            let mut place = 0;
            self.views.retain(|_| {
                place += 1;
                place % 2 == 1
            });
            self.every *= 2;
        }
    }

    /// The page.
    ///
    /// # Errors
    ///
    /// If it cannot be compressed, for want of memory.
    pub fn page(mut self) -> io::Result<String> {
        if let Some((at, view)) = self.latest.take() {
            self.views.push((at, view));
        }
        let part = self.feed.after(0, usize::MAX);
        let mut packed = GzEncoder::new(Vec::new(), Compression::default());
        let end = self.views.last().map_or(self.first, |(at, _)| *at);
        let head = json!({
            "title": self.title,
            "about": self.about,
            "model": self.profiles[0],
            "machine": self.profiles[1],
            "signals": self.signals,
            "first": self.first,
            "end": end,
            "left_out": part.first - 1,
            "every": self.every,
            "back": self.back,
            "parts": self.parts,
            "differences": self.differences,
            "has_end": self.has_end,
        });
        let entries = list(&part.items, &self.names);
        write!(packed, "{{\"head\":{head},\"entries\":[{entries}],\"views\":[")?;
        let mut before = Value::Null;
        for (place, (at, view)) in self.views.into_iter().enumerate() {
            let comma = if place > 0 { "," } else { "" };
            let view = serde_json::to_value(view)?;
            let change = change(&before, &view).unwrap_or_default();
            write!(packed, "{comma}[{at},{change}]", at = at.as_nanos())?;
            before = view;
        }
        write!(packed, "]}}")?;
        Ok(page(&self.title, &base64(&packed.finish()?)))
    }
}

/// What makes one value another: `[new]`, or the changes by key or index; `None` if nothing does.
fn change(before: &Value, after: &Value) -> Option<Value> {
    if before == after {
        return None;
    }
    let changes: Map<String, Value> = match (before, after) {
        (Value::Object(old), Value::Object(new)) if old.keys().eq(new.keys()) => {
            let changed =
                |(key, new): (&String, &Value)| Some((key.clone(), change(&old[key], new)?));
            new.iter().filter_map(changed).collect()
        }
        (Value::Array(old), Value::Array(new)) if old.len() == new.len() => {
            let pairs = old.iter().zip(new).enumerate();
            pairs.filter_map(|(i, (old, new))| Some((i.to_string(), change(old, new)?))).collect()
        }
        _ => return Some(json!([after])),
    };
    Some(Value::Object(changes))
}

fn base64(bytes: &[u8]) -> String {
    const SIGNS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |place: usize| u32::from(chunk.get(place).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for place in 0..4 {
            let sign = SIGNS[(bits >> (18 - 6 * place)) as usize & 63];
            text.push(if place <= chunk.len() { char::from(sign) } else { '=' });
        }
    }
    text
}

/// The page around it, which may run nothing else and ask nobody.
fn page(title: &str, data: &str) -> String {
    let file = |name: &str| {
        let found = FILES.iter().find(|(path, ..)| *path == name);
        found.map_or(String::new(), |(.., bytes)| String::from_utf8_lossy(bytes).into_owned())
    };
    // No end of a script may stand in a script, wherever it comes from.
    let script = file("/panel.js").replace("</script", "<\\/script");
    let title = title.replace('&', "&amp;").replace('<', "&lt;");
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
         script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n\
         <link rel=\"icon\" href=\"data:,\">\n<style>{}</style>\n</head>\n\
         <body><noscript>This recording needs JavaScript.</noscript>\n\
         <script type=\"text/plain\" id=\"film\">{data}</script>\n\
         <script type=\"module\">{script}</script>\n\
         <!--\n{}-->\n</body>\n</html>\n",
        file("/panel.css"),
        file("/licences.txt").replace("--", "- -"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_written_as_the_standard_has_it() {
        for (bytes, text) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
        assert_eq!(base64(&[0xfb, 0xff]), "+/8=");
    }

    #[test]
    fn a_change_is_as_small_as_what_differs() {
        let before = json!({ "at": 1, "axes": [{ "x": 1, "y": [1] }, { "x": 2, "y": [] }] });
        let after = json!({ "at": 2, "axes": [{ "x": 1, "y": [1] }, { "x": 3, "y": [5] }] });
        let expected = json!({ "at": [2], "axes": { "1": { "x": [3], "y": [[5]] } } });
        assert_eq!(change(&before, &after), Some(expected));
        assert_eq!(change(&before, &before), None);
        assert_eq!(change(&json!({ "a": 1 }), &json!({ "b": 1 })), Some(json!([{ "b": 1 }])));
    }
}
