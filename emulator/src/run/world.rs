//! What happens around a run in virtual time.

use std::iter;
use std::path::{Path, PathBuf};
use std::time::Duration;

use vimc4::RecordingFile;
use vimc4_catalogue::{Controller, Machine, Model};
use vimc4_device::{Device, Names, OwnedInput, Scenario, SignalId};
use vimc4_language::{Order, Verb};

use super::driver::Driver;
use super::meter::Meter;
use super::tape::Tape;
use super::trace::Trace;
use crate::completions;
use crate::coverage::Covering;
use crate::drawing::{self, Shown};
use crate::endings::InOrder;
use crate::failure::Failure;
use crate::identity::none_twice;
use crate::setup::Setup;
use crate::values::duration;
use crate::waves::Drawn;

/// How long a button is kept pressed.
pub(super) const PRESS: Duration = Duration::from_millis(100);

/// What happens around a run in virtual time, and what observes it.
#[derive(clap::Args)]
pub(crate) struct World {
    /// Set a bit of an input port, or anything else by the name that `signals` of `vimc4 serve`
    /// lists, at a time or from the beginning
    #[arg(long, value_name = "PORT.BIT|NAME=VALUE[@TIME]", value_parser = timed_input, add = completions::inputs())]
    pub(super) input: Vec<(String, Duration)>,
    /// Press a button at a time, and release it 0.1 s later; the emergency stop stays pressed
    #[arg(long, value_name = "BUTTON[@TIME]", value_parser = timed, add = completions::buttons())]
    pub(super) press: Vec<(String, Duration)>,
    /// Let happen what the rules of this file say, as docs/scenarios.md shows
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Write every step with its time into a file: seconds,X,Y,Z,A
    #[arg(long, value_name = "FILE")]
    trace: Option<PathBuf>,
    /// Record everything that goes in and comes out into a new file, which `vimc4 replay` plays; .gz
    /// and .zst are compressed when it ends
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Add what of the controller's commands, answers, states and stops was met to this file, which
    /// `vimc4 coverage` shows
    #[arg(long, value_name = "FILE")]
    coverage: Option<PathBuf>,
    #[command(flatten)]
    shown: Shown,
    #[command(flatten)]
    drawn: Drawn,
}

/// What the world around the controller does.
pub(crate) struct Outside {
    pub(crate) signals: Vec<Scheduled>,
    /// Whether that includes pressing START.
    pub(crate) starts: bool,
    /// What happens when something else does.
    pub(crate) scenario: Scenario,
    /// How much time there is.
    pub(crate) time: Duration,
}

impl Outside {
    /// Lets all of it happen, counted from now on.
    pub(crate) fn schedule(&self, driver: &mut Driver) {
        let now = driver.now();
        driver.stop_at(now + self.time);
        for &Scheduled { after, signal, value } in &self.signals {
            driver.schedule(now + after, signal, value);
        }
        driver.begin(&self.scenario);
    }
}

/// A signal that takes a value some time after the beginning.
pub(crate) struct Scheduled {
    pub(super) after: Duration,
    pub(super) signal: SignalId,
    pub(super) value: i32,
}

impl World {
    /// Refuses files that would replace each other, or what is read.
    pub(crate) fn none_twice(&self, run: &Path, setup: &Setup) -> Result<(), Failure> {
        let own = [&self.trace, &self.record, &self.coverage].into_iter().flatten();
        let outputs = own.map(PathBuf::as_path).chain(self.shown.files()).chain(self.drawn.files());
        let inputs = iter::once(run).chain(self.scenario.as_deref()).chain(setup.files());
        none_twice(inputs, outputs)
    }

    /// What runs this controller and writes what is wanted of that, for a picture of this file.
    ///
    /// # Errors
    ///
    /// If something cannot be written. What can be known of that before is known before anything is replaced.
    pub(crate) fn driver(
        &self,
        controller: Controller,
        model: &Model,
        machine: &Machine,
        file: &Path,
        most_rounds: Option<u64>,
    ) -> Result<Driver, Failure> {
        if let Some(path) = &self.record {
            RecordingFile::try_out(path).map_err(Failure::usage)?;
        }
        let drawing = self.shown.begin(drawing::frame(file, model, machine))?;
        let covering =
            self.coverage.as_deref().map(|path| Covering::new(path, model)).transpose()?;
        let mut meter = Meter::new(machine);
        meter.trace = Trace::wanted(self.trace.as_deref(), model.axis_names())?;
        let sheets = self.drawn.open(None)?;
        // Up to here it may wait for somebody who reads a pipe. What begins now has an end.
        let ending = InOrder::begin();
        let tape =
            self.record.as_deref().map(|path| Tape::new(path, model, machine)).transpose()?;
        let driver = Driver::new(controller, meter, most_rounds).heeding(ending);
        driver.recording(tape).covering(covering).drawing(drawing).waving(sheets, model)
    }

    /// What will happen when something else does; nothing without a file.
    pub(crate) fn scenario(
        &self,
        model: &Model,
        device: &impl Device,
    ) -> Result<Scenario, Failure> {
        match &self.scenario {
            Some(file) => Ok(vimc4::scenario_file(file, &model.names(device.signals()))?),
            None => Ok(Scenario::new()),
        }
    }

    /// What the outside world will do.
    pub(crate) fn signals(&self, device: &impl Device) -> Result<Vec<Scheduled>, Failure> {
        let mut scheduled = Vec::new();
        for (text, after) in &self.input {
            scheduled.extend(ordered(device, &order(text), *after)?);
        }
        for (button, after) in &self.press {
            scheduled.extend(press(device, button, *after)?);
        }
        Ok(scheduled)
    }
}

/// `0.3=1` or `cover=open` as an order.
fn order(text: &str) -> String {
    let (name, value) = text.rsplit_once('=').unwrap_or((text, ""));
    let is_bit = name.starts_with(|first: char| first.is_ascii_digit());
    format!("{} {name} {value}", if is_bit { Verb::Input } else { Verb::Set })
}

/// A button goes down, and up again if it does not latch.
pub(super) fn press(
    device: &impl Device,
    name: &str,
    after: Duration,
) -> Result<Vec<Scheduled>, Failure> {
    ordered(device, &format!("{} {name}", Verb::Press), after)
}

/// What an order does to signals, the second thing as much later as people take to let go of a
/// button.
fn ordered(device: &impl Device, order: &str, after: Duration) -> Result<Vec<Scheduled>, Failure> {
    let names = Names::new([], device.signals());
    let deed = match Order::read(order, &names).map_err(Failure::usage)? {
        Some(Order::Do(deed)) => deed,
        _ => return Ok(Vec::new()),
    };
    let inputs = deed.inputs(names.signals()).map_err(Failure::usage)?.into_iter();
    let times = (0..).map(|number| after + PRESS * number);
    let scheduled = inputs.zip(times).filter_map(|(input, after)| match input {
        OwnedInput::Signal(signal, value) => Some(Scheduled { after, signal, value }),
        _ => None,
    });
    Ok(scheduled.collect())
}

/// `WHAT@TIME`, or `WHAT` for the beginning.
fn timed(text: &str) -> Result<(String, Duration), String> {
    match text.rsplit_once('@') {
        Some((what, time)) => Ok((what.to_owned(), duration(time)?)),
        None => Ok((text.to_owned(), Duration::ZERO)),
    }
}

fn timed_input(text: &str) -> Result<(String, Duration), String> {
    let (what, time) = timed(text)?;
    match what.contains('=') {
        true => Ok((what, time)),
        false => Err("an input, its value and the time are needed, as in 0.3=1@2s".to_owned()),
    }
}
