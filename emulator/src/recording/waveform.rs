//! Waveforms of recordings: one that was made, and the one that a running controller makes.

use std::sync::mpsc::{self, Receiver, SyncSender};
use std::thread::{self, JoinHandle};

use vimc4::{Clock, News, Report, Sink, Wants};
use vimc4_catalogue::{Machine, Model};
use vimc4_device::{Device as _, Names, OwnedInput, Time};
use vimc4_timeline::recording::{
    Entry, Given, Head, LineSort, Player, Recording, StateError, What,
};
use vimc4_wave::Pacing;

use super::controller::{PlayedDevice, Site};
use crate::failure::Failure;
use crate::waves::{Sheets, Waves};
use vimc4_answers::profiles::known;

/// A controller that does again what was recorded, and is drawn.
struct Drawing {
    player: Player<PlayedDevice>,
    site: Site,
    pacing: Pacing,
    names: Names,
    /// What is drawn on, until it begins.
    sheets: Option<Sheets>,
    waves: Option<Waves>,
}

impl Drawing {
    fn new(site: Site, sort: LineSort, sheets: Sheets) -> Result<Drawing, Failure> {
        let player = site.player()?.watching(Waves::KINDS);
        let pacing = if sort == LineSort::Paced { Pacing::Paced } else { Pacing::Ideal };
        let names = Names::of(player.device());
        Ok(Drawing { player, site, pacing, names, sheets: Some(sheets), waves: None })
    }

    fn begin(&mut self) -> Result<(), Failure> {
        if let Some(sheets) = self.sheets.take() {
            let waves = sheets.begin(self.player.device(), &self.site.model, self.pacing)?;
            self.waves = Some(waves);
        }
        Ok(())
    }

    fn take(&mut self, entry: &Entry) -> Result<(), Failure> {
        let begins = !self.player.has_begun() && matches!(entry.what, What::State { .. });
        if !begins {
            self.begin()?;
        }
        let Drawing { player, site, waves, names, .. } = self;
        if let (What::Given { given, .. }, Some(waves)) = (&entry.what, waves.as_mut())
            && let Ok(input) = known(names, given)
        {
            player.run_to_seen(entry.at, &mut |device, outputs| waves.see(device, outputs));
            waves.given(entry.at, input.as_input());
        }
        if let (What::State { by: Some(by), state }, Some(waves)) = (&entry.what, waves.as_mut()) {
            if !player.is_led() {
                player.run_to_seen(entry.at, &mut |device, outputs| waves.see(device, outputs));
            }
            let wrong = |why| Failure::usage(StateError { line: entry.line, why });
            player.restore(site.read(state).map_err(wrong)?);
            waves.restored(player.device(), by);
            return Ok(());
        }
        let played = player.play_seen(entry, &|state| site.read(state), &mut |device, outputs| {
            if let Some(waves) = waves {
                waves.see(device, outputs);
            }
        });
        played.map_err(Failure::usage)?;
        self.begin()
    }

    /// Draws what happens up to then, and ends.
    fn finish(mut self, at: Time) -> Result<(), Failure> {
        self.begin()?;
        let Drawing { player, waves, .. } = &mut self;
        let Some(mut waves) = waves.take() else { return Ok(()) };
        player.run_to_seen(at, &mut |device, outputs| waves.see(device, outputs));
        waves.finish(player.device().now())
    }
}

/// Draws a whole recording, played into a controller.
///
/// # Errors
///
/// If it cannot be played into that, or not everything could be written.
pub(super) fn draw(recording: &Recording, site: &Site, sheets: Sheets) -> Result<(), Failure> {
    let mut drawing = Drawing::new(site.clone(), recording.head.line, sheets.kept())?;
    for entry in &recording.entries {
        drawing.take(entry)?;
    }
    let end = drawing.player.device().now();
    drawing.finish(end)
}

/// How many inputs may wait to be drawn. A controller whose time does not wait is held back by its
/// picture rather than that the picture grows without end.
const WAITING: usize = 4_096;

/// A controller that is drawn while it runs, by another thread, which does again what it does.
pub(crate) struct Live {
    sender: SyncSender<Told>,
    thread: JoinHandle<Result<(), Failure>>,
}

enum Told {
    Entry(Time, What),
    Given(Time, OwnedInput),
    End,
}

impl Live {
    /// Begins to draw a controller whose time passes like this; its sink is to watch from the first
    /// moment.
    ///
    /// # Errors
    ///
    /// If there is no thread to be had.
    pub(crate) fn new(
        model: &Model,
        machine: &Machine,
        clock: Clock,
        sort: LineSort,
        sheets: Sheets,
    ) -> Result<(Live, Watcher), Failure> {
        let head = Head {
            line: sort,
            ..vimc4::recording_head(model, machine, &clock.to_string(), "serve")
        };
        let site = Site::of_head(&head).map_err(Failure::midway)?;
        let (sender, told) = mpsc::sync_channel(WAITING);
        let draw = move || follow(Drawing::new(site, sort, sheets)?, &told);
        let thread = thread::Builder::new().name("waveform".to_owned()).spawn(draw);
        let thread =
            thread.map_err(|error| Failure::usage(format!("cannot start a thread: {error}")))?;
        let watcher = Watcher { sender: sender.clone() };
        Ok((Live { sender, thread }, watcher))
    }

    /// Draws the rest of what was told.
    ///
    /// # Errors
    ///
    /// If not everything could be written.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        // A thread that has failed says why.
        let _ = self.sender.send(Told::End);
        self.thread.join().unwrap_or(Ok(()))
    }
}

fn follow(mut drawing: Drawing, told: &Receiver<Told>) -> Result<(), Failure> {
    let mut last = Time::ZERO;
    while let Ok(told) = told.recv() {
        let (at, what) = match told {
            Told::Entry(at, what) => (at, what),
            Told::Given(at, input) => {
                let given = Given::of(&input, || drawing.names.clone());
                (at, What::Given { by: "".into(), given })
            }
            Told::End => break,
        };
        last = at;
        if !matches!(what, What::News(_)) {
            drawing.take(&Entry::new(at, what))?;
        }
    }
    drawing.finish(last)
}

/// The sink that tells the thread.
pub(crate) struct Watcher {
    sender: SyncSender<Told>,
}

impl Sink for Watcher {
    fn wants(&self) -> Wants {
        Wants::INPUTS
    }

    fn report(&mut self, report: &Report, _explain: &dyn Fn(&[u8]) -> String) {
        use vimc4::What as Reported;
        let told = match &report.what {
            Reported::Input { input, .. } => Told::Given(report.at, input.clone()),
            Reported::State { by, state } => {
                let by = by.as_ref().map(|by| by.to_string().into());
                Told::Entry(report.at, What::State { by, state: state.clone() })
            }
            Reported::Stands { causes } => Told::Entry(report.at, What::Stands(*causes)),
            Reported::Goes => Told::Entry(report.at, What::Goes),
            Reported::News(News::Ends) => {
                Told::Entry(report.at, What::News(serde_json::Value::Null))
            }
            _ => return,
        };
        // A thread that can no longer write has ended.
        let _ = self.sender.send(told);
    }
}
