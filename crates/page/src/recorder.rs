//! A recording that is being made, as `vimc4 replay` plays it.

use serde_json::Value;
use vimc4_catalogue::{Machine, Model};
use vimc4_device::{Names, OwnedInput, Time};
use vimc4_session::{Clock, LineEvent, Report, ReportKind};
use vimc4_timeline::recording::{Entry, Given, Head, LineSort, VERSION, What};

use crate::kept::Kept;

/// So many bytes are recorded at most.
const MOST: usize = 64 * 1024 * 1024;

/// What has been recorded so far.
#[derive(Debug)]
pub(crate) struct Recorder {
    head: Head,
    lines: Vec<u8>,
    names: Names,
    /// News that came after what was told last.
    news: Vec<(Time, Value)>,
}

impl Recorder {
    pub(crate) fn begin(model: &Model, machine: &Machine, line: &Kept, names: Names) -> Recorder {
        let is_paced = line.line().is_paced();
        // Profiles can always be written.
        let head = Head {
            recording: VERSION,
            program: concat!("vimc4 ", env!("CARGO_PKG_VERSION")).to_owned(),
            family: model.family().name().to_owned(),
            model: serde_json::to_value(model).unwrap_or_default(),
            machine: serde_json::to_value(machine).unwrap_or_default(),
            clock: String::new(),
            line: if is_paced { LineSort::Paced } else { LineSort::Ideal },
            seed: None,
            from: "the page".to_owned(),
            controller: String::new(),
            part: 1,
            began: None,
        };
        Recorder { head, lines: Vec::new(), names, news: Vec::new() }
    }

    fn put(&mut self, at: Time, what: What) {
        Entry::new(at, what).put(&mut self.lines);
    }

    /// News that came since are of no later time.
    fn put_news(&mut self, until: Time) {
        for (at, news) in std::mem::take(&mut self.news) {
            self.put(at.min(until), What::News(news));
        }
    }

    pub(crate) fn report(&mut self, report: &Report) {
        let at = report.at;
        if self.lines.len() > MOST {
            return;
        }
        if !matches!(report.what, ReportKind::News(_) | ReportKind::Event { .. }) {
            self.put_news(at);
        }
        match &report.what {
            ReportKind::Input { by, input: OwnedInput::Bytes(bytes) } => {
                Entry::put_given_bytes(&mut self.lines, at, bytes, &by.to_string());
            }
            ReportKind::Input { by, input } => {
                let given = Given::of(input, || self.names.clone());
                self.put(at, What::Given { by: by.to_string().into(), given });
            }
            ReportKind::Sent { bytes } => Entry::put_sent(&mut self.lines, at, bytes),
            ReportKind::State { by, state } => {
                let by = by.as_ref().map(|by| by.to_string().into());
                self.put(at, What::State { by, state: state.clone() });
            }
            ReportKind::Stands { causes } => self.put(at, What::Stands(*causes)),
            ReportKind::Goes => self.put(at, What::Goes),
            // What was done follows, with who has done it.
            ReportKind::News(LineEvent::Deed { .. } | LineEvent::NoEffect { .. }) => {}
            ReportKind::News(news) => {
                // News can always be written.
                self.news.push((at, serde_json::to_value(news).unwrap_or_default()));
            }
            _ => {}
        }
    }

    /// All of it up to now, with an end. Its clock is the one that it goes by at last.
    pub(crate) fn text(&self, now: Time, clock: Clock) -> String {
        let head = Head { clock: clock.to_string(), ..self.head.clone() };
        let mut lines = Vec::with_capacity(self.lines.len());
        head.put(&mut lines);
        lines.extend_from_slice(&self.lines);
        let news = self.news.clone();
        let mut whole = Recorder { head, lines, names: Names::default(), news };
        whole.put_news(now);
        whole.put(now, What::End("it was saved".to_owned()));
        String::from_utf8_lossy(&whole.lines).into_owned()
    }
}
