//! What is drawn of recordings: of one that was made, and of the one that a running controller makes.

use std::collections::VecDeque;
use std::io::{self, Write as _};
use std::mem;
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::thread::{self, JoinHandle};

use vimc4::{Clock, News, Report, Sink, Wants};
use vimc4_catalogue::{Machine, Model};
use vimc4_device::{Device as _, Kinds, Names, Output, OwnedInput, Time};
use vimc4_timeline::recording::{
    Entry, Given, Head, LineSort, Player, Recording, StateError, What,
};
use vimc4_wave::Pacing;

use super::card::seconds;
use super::controller::{PlayedDevice, Site};
use crate::drawing::Drawing as Picture;
use crate::endings::InOrder;
use crate::failure::Failure;
use crate::waves::{Sheets, Waves};
use vimc4_answers::profiles::known;

/// A controller that does again what was recorded, and is drawn.
struct Drawing<'s> {
    player: Player<PlayedDevice>,
    site: Site,
    pacing: Pacing,
    names: Names,
    /// What waveforms are drawn on, until that begins.
    sheets: Option<Sheets>,
    drawn: Drawn<'s>,
}

/// Says what there is to say when somebody has asked for the end.
type Say<'s> = &'s dyn Fn() -> Result<(), Failure>;

/// What is drawn of it.
#[derive(Default)]
struct Drawn<'s> {
    waves: Option<Waves>,
    picture: Option<Picture>,
    /// Whether somebody asks for the end, if that is heeded, and what else is said then.
    ending: Option<(InOrder, Say<'s>)>,
}

impl Drawn<'_> {
    /// What came out, and the device now. If somebody asks for the end, everything ends here.
    fn see(&mut self, device: &PlayedDevice, outputs: &VecDeque<Output>) {
        if let Some(waves) = &mut self.waves {
            waves.see(device, outputs);
        }
        if let Some(picture) = &mut self.picture {
            for output in outputs {
                if let Output::Event(stamp, event) = output {
                    picture.see(device, stamp.at, event);
                }
            }
        }
        if self.ending.as_ref().is_some_and(|(ending, _)| ending.is_asked())
            && let Err(failure) = mem::take(self).finish(device)
        {
            failure.report();
        }
    }

    /// The device has been put into another state by somebody, at this time of its time before.
    fn restored(&mut self, device: &PlayedDevice, at: Time, by: &str) {
        if let Some(waves) = &mut self.waves {
            waves.restored(device, by);
        }
        if let Some(picture) = &mut self.picture {
            picture.put_back(device, at, format!("by {by}"));
        }
    }

    /// Ends what is drawn, and the program, if somebody has asked for that.
    fn finish(self, device: &PlayedDevice) -> Result<(), Failure> {
        let now = device.now();
        let waves = self.waves.map_or(Ok(()), |waves| waves.finish(now));
        let counters = device.position(now);
        let picture = self.picture.map_or(Ok(()), |picture| picture.finish(now, &counters));
        let written = waves.and(picture);
        let Some((ending, say)) = self.ending else { return written };
        if ending.is_asked() {
            // What shows how far the files are is gone from the terminal by now.
            let text = format!("interrupted: what is drawn ends at {}", seconds(now));
            // Whoever closed standard error does not want to know.
            let _ = writeln!(io::stderr(), "{text}");
            for failed in [written, say()] {
                failed.err().map(Failure::report);
            }
            ending.done();
            return Ok(());
        }
        ending.done();
        written
    }
}

impl<'s> Drawing<'s> {
    fn new(site: Site, sort: LineSort, sheets: Option<Sheets>) -> Result<Drawing<'s>, Failure> {
        let player = site.player()?;
        let pacing = if sort == LineSort::Paced { Pacing::Paced } else { Pacing::Ideal };
        let names = Names::of(player.device());
        let drawing = Drawing { player, site, pacing, names, sheets, drawn: Drawn::default() };
        Ok(drawing.watching())
    }

    /// Is drawn as a picture, too.
    fn pictured(mut self, picture: Option<Picture>) -> Drawing<'s> {
        self.drawn.picture = picture;
        self.watching()
    }

    /// Watches what is drawn.
    fn watching(self) -> Drawing<'s> {
        let waves = self.sheets.as_ref().map_or(Kinds::NONE, |_| Waves::KINDS);
        let picture = self.drawn.picture.as_ref().map_or(Kinds::NONE, |_| Picture::KINDS);
        Drawing { player: self.player.watching(waves.and(picture)), ..self }
    }

    fn begin(&mut self) -> Result<(), Failure> {
        if let Some(sheets) = self.sheets.take() {
            let waves = sheets.begin(self.player.device(), &self.site.model, self.pacing)?;
            self.drawn.waves = Some(waves);
        }
        Ok(())
    }

    fn take(
        &mut self,
        entry: &Entry,
        unplayable: &dyn Fn(StateError) -> Failure,
    ) -> Result<(), Failure> {
        let begins = !self.player.has_begun() && matches!(entry.what, What::State { .. });
        if !begins {
            self.begin()?;
        }
        let Drawing { player, site, drawn, names, .. } = self;
        match &entry.what {
            What::Given { given, .. } => {
                if let Ok(input) = known(names, given) {
                    player.run_to_seen(entry.at, &mut |device, outputs| drawn.see(device, outputs));
                    if let Some(waves) = &mut drawn.waves {
                        waves.given(entry.at, input.as_input());
                    }
                }
            }
            What::State { by: Some(by), state } if !begins => {
                if !player.is_led() {
                    player.run_to_seen(entry.at, &mut |device, outputs| drawn.see(device, outputs));
                }
                let at = player.device().now();
                let wrong = |why| unplayable(StateError { line: entry.line, why });
                player.restore(site.read(state).map_err(wrong)?);
                drawn.restored(player.device(), at, by);
                return Ok(());
            }
            _ => {}
        }
        let played = player.play_seen(entry, &|state| site.read(state), &mut |device, outputs| {
            drawn.see(device, outputs);
        });
        played.map_err(unplayable)?;
        self.begin()
    }

    /// Draws what happens up to then, and ends.
    fn finish(mut self, at: Time) -> Result<(), Failure> {
        self.begin()?;
        let Drawing { mut player, mut drawn, .. } = self;
        player.run_to_seen(at, &mut |device, outputs| drawn.see(device, outputs));
        drawn.finish(player.device())
    }
}

/// Draws a whole recording, played into a controller, as waveforms and as a picture. If somebody asks for the
/// end, both end there, `interrupted` says what else there is to say, and the program ends.
///
/// # Errors
///
/// If it cannot be played into that, or not everything could be written.
pub(super) fn draw(
    recording: &Recording,
    site: &Site,
    sheets: Option<Sheets>,
    picture: Option<Picture>,
    unplayable: &dyn Fn(StateError) -> Failure,
    interrupted: Say<'_>,
) -> Result<(), Failure> {
    if sheets.is_none() && picture.is_none() {
        return Ok(());
    }
    let mut drawing = Drawing::new(site.clone(), recording.head.line, sheets)?.pictured(picture);
    drawing.drawn.ending = Some((InOrder::begin(), interrupted));
    for entry in &recording.entries {
        drawing.take(entry, unplayable)?;
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
        let draw = move || follow(Drawing::new(site, sort, Some(sheets))?, &told);
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
    fn finish(self) -> Result<(), Failure> {
        // A thread that has failed says why.
        let _ = self.sender.send(Told::End);
        self.thread.join().unwrap_or(Ok(()))
    }

    /// Draws the rest of each of them, whatever becomes of the others.
    ///
    /// # Errors
    ///
    /// As [`finish`](Live::finish).
    pub(crate) fn finish_all(all: Vec<Live>) -> Result<(), Failure> {
        all.into_iter().map(Live::finish).fold(Ok(()), Result::and)
    }
}

fn follow(mut drawing: Drawing<'_>, told: &Receiver<Told>) -> Result<(), Failure> {
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
            drawing.take(&Entry::new(at, what), &|error| Failure::usage(error))?;
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
