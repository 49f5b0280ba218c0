//! Draws a controller that plays a recording: waveforms and pictures.

use std::collections::VecDeque;
use std::io::{self, Write as _};
use std::mem;

use vimc4_device::{Device as _, Kinds, Names, Output, OwnedInput, Time};
use vimc4_timeline::recording::{Entry, Given, LineSort, Player, Recording, StateError, What};
use vimc4_wave::Pacing;

use super::card::seconds;
use super::controller::{PlayedDevice, Site};
use crate::drawing::Drawing as Picture;
use crate::endings::InOrder;
use crate::failure::Failure;
use crate::waves::{Sheets, Waves};
use vimc4_answers::profiles::known;

/// A controller that does again what was recorded, and is drawn.
pub(super) struct Drawing<'s> {
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
            // Standard error may be closed.
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
    pub(super) fn new(
        site: Site,
        sort: LineSort,
        sheets: Option<Sheets>,
    ) -> Result<Drawing<'s>, Failure> {
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

    /// The time up to which it is drawn.
    pub(super) fn now(&self) -> Time {
        self.player.device().now()
    }

    /// An input that was given then, as recordings have it.
    pub(super) fn given(&self, at: Time, input: &OwnedInput) -> Entry {
        let given = Given::of(input, || self.names.clone());
        Entry::new(at, What::Given { by: "".into(), given })
    }

    /// Draws what happens up to a time, unless the controller was led cause by cause: then only the
    /// recording says what happens.
    pub(super) fn pass(&mut self, at: Time) {
        if self.player.has_begun() && !self.player.is_led() {
            let Drawing { player, drawn, .. } = self;
            player.run_to_seen(at, &mut |device, outputs| drawn.see(device, outputs));
            player.said().clear();
        }
    }

    /// Writes everything that has been drawn of the waveforms; see [`Waves::flush`].
    pub(super) fn flush(&mut self, say: &mut dyn FnMut(&str)) -> bool {
        self.drawn.waves.as_mut().is_some_and(|waves| waves.flush(say))
    }

    /// Draws what happens up to the next entry of the recording, and that.
    pub(super) fn take(
        &mut self,
        entry: &Entry,
        unplayable: &dyn Fn(StateError) -> Failure,
    ) -> Result<(), Failure> {
        // Nobody compares what comes out.
        self.player.said().clear();
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
    pub(super) fn finish(mut self, at: Time) -> Result<(), Failure> {
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
