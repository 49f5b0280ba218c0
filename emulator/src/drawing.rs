//! `--plot`: a picture of what a controller does.

use std::io::{self, Write};
use std::path::{self, PathBuf};
use std::process::{Command, Stdio};

use clap::{ArgAction, ValueEnum};
use vimc4::{Machine, Model};
use vimc4_catalogue::Controller;
use vimc4_device::{Activity, Device, Event, Kinds, Motion, Point, Time};
use vimc4_motion::{Path, Profile, Segment};
use vimc4_picture::{Axis, Back, Colouring, Frame, Picture, Plot, Purpose, View, dxf, gcode};

use crate::failure::Failure;
use crate::output::Destination;
use crate::text;

/// What is written of what is done, besides its answers.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Shown {
    #[command(flatten)]
    pictured: Pictured,
    /// Write the path that was really gone into a file: gcode or dxf
    #[arg(long = "as", num_args = 2, value_names = ["FORMAT", "OUT"], action = ArgAction::Append)]
    formats: Vec<String>,
}

impl Shown {
    /// The files that are named.
    pub(crate) fn files(&self) -> impl Iterator<Item = &path::Path> {
        let exported = self.formats.iter().skip(1).step_by(2).map(path::Path::new);
        self.pictured.files().chain(exported)
    }

    /// Begins what is wanted. What cannot be written is known before anything is done, and what stands there
    /// stays until the end.
    pub(crate) fn begin(&self, frame: Frame) -> Result<Option<Drawing>, Failure> {
        let mut drawing = self.pictured.begin(frame.clone())?;
        for pair in self.formats.chunks_exact(2) {
            let [format, path] = pair else { continue };
            let write: Export = match format.as_str() {
                "gcode" => gcode,
                "dxf" => dxf,
                _ => {
                    return Err(Failure::usage(format!(
                        "--as {format}: this is not a format; use gcode or dxf"
                    )));
                }
            };
            let destination = Destination::claim(path::Path::new(path))?;
            let drawing = drawing.get_or_insert_with(|| Drawing::new(frame.clone()));
            drawing.exports.push((write, destination));
        }
        Ok(drawing)
    }
}

/// The picture that is wanted.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Pictured {
    /// Draw what was done into a file, as OUT says by its end: .svg or .png
    #[arg(long, value_name = "OUT")]
    plot: Option<PathBuf>,
    /// What to draw: one or several, separated by commas; by default the path from above, and isometric
    /// too if Z moves
    #[arg(long, value_name = "VIEW", value_enum, value_delimiter = ',', requires = "plot")]
    plot_view: Vec<ViewName>,
    /// What the colours of the path mean
    #[arg(long, value_name = "WHAT", value_enum, default_value = "kind", requires = "plot")]
    plot_colour: ColourName,
    /// Show the picture in the program that the desktop has for it
    #[arg(long, requires = "plot")]
    open: bool,
}

/// What to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ViewName {
    /// The path from above: X and Y
    Top,
    /// The path from the front: X and Z
    Front,
    /// The path from the right: Y and Z
    Side,
    /// The path from above, front and right at once
    Iso,
    /// Position, speed and acceleration of each axis over time
    Time,
}

/// What colours mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ColourName {
    /// Rapid, feed, arc, reference run
    Kind,
    /// How fast it goes
    Speed,
}

/// What a picture is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Svg,
    Png,
}

impl Pictured {
    /// Whether a picture is wanted.
    pub(crate) fn is_meant(&self) -> bool {
        self.plot.is_some()
    }

    /// The file that is named.
    pub(crate) fn files(&self) -> impl Iterator<Item = &path::Path> {
        self.plot.iter().map(PathBuf::as_path)
    }

    /// Begins a picture, if one is wanted. What cannot be written is known before anything is done,
    /// and what stands there stays until the end.
    pub(crate) fn begin(&self, frame: Frame) -> Result<Option<Drawing>, Failure> {
        let Some(path) = &self.plot else { return Ok(None) };
        let end = path.extension().and_then(|end| end.to_str()).unwrap_or_default();
        let format = match end.to_ascii_lowercase().as_str() {
            "svg" => Format::Svg,
            "png" => Format::Png,
            _ => {
                return Err(Failure::usage(format!(
                    "--plot {}: the end of the name says what is drawn; use .svg or .png",
                    path.display()
                )));
            }
        };
        let destination = Destination::claim(path)?;
        let views = self.plot_view.iter().map(|view| match view {
            ViewName::Top => View::Top,
            ViewName::Front => View::Front,
            ViewName::Side => View::Side,
            ViewName::Iso => View::Isometric,
            ViewName::Time => View::Time,
        });
        Ok(Some(Drawing {
            picture: Some((format, destination)),
            views: views.collect(),
            colouring: match self.plot_colour {
                ColourName::Kind => Colouring::Kind,
                ColourName::Speed => Colouring::Speed,
            },
            is_opened: self.open,
            ..Drawing::new(frame)
        }))
    }
}

/// What writes a path for other programs.
type Export = fn(&Plot, &Frame) -> String;

/// A picture that is being made.
pub(crate) struct Drawing {
    pub(crate) plot: Plot,
    frame: Frame,
    /// Where the carriages stood when the counters were 0 for the first motion.
    stood: Option<Vec<i64>>,
    picture: Option<(Format, Destination)>,
    exports: Vec<(Export, Destination)>,
    views: Vec<View>,
    colouring: Colouring,
    is_opened: bool,
    /// Whether what moves is on its way only.
    pub(crate) is_rapid: bool,
}

impl Drawing {
    pub(crate) const KINDS: Kinds = Plot::KINDS;

    fn new(frame: Frame) -> Drawing {
        Drawing {
            plot: Plot::new(),
            frame,
            stood: None,
            picture: None,
            exports: Vec::new(),
            views: Vec::new(),
            colouring: Colouring::default(),
            is_opened: false,
            is_rapid: false,
        }
    }

    /// Something has happened in a controller that does this now.
    pub(crate) fn see<D>(&mut self, device: &D, at: Time, event: &Event)
    where
        D: Device<Details = <Controller as Device>::Details>,
    {
        if matches!(event, Event::Motion(Motion::Begins { .. })) {
            self.stood.get_or_insert_with(|| shifts(device, at));
            self.plot.purpose(self.purpose(device));
        }
        self.plot.see(at, event);
    }

    /// At this time a controller was put into the state in which it is now.
    pub(crate) fn put_back<D>(&mut self, device: &D, at: Time, text: String)
    where
        D: Device<Details = <Controller as Device>::Details>,
    {
        let now = device.now();
        let shifts = shifts(device, now);
        let stood = self.stood.as_deref().unwrap_or(&shifts);
        let mut shift = Point::default();
        for (shift, (now, stood)) in shift.iter_mut().zip(shifts.iter().zip(stood)) {
            *shift = now - stood;
        }
        let running = device.running().map(|running| (running.began, running.segment));
        let back = Back { now, counters: device.position(now), shift, running, text };
        self.plot.put_back(at, back);
        self.plot.purpose(self.purpose(device));
    }

    fn purpose<D>(&self, device: &D) -> Purpose
    where
        D: Device<Details = <Controller as Device>::Details>,
    {
        let head = || device.details().is_head_down();
        match device.activity() {
            Activity::ReferenceTowardsSwitch
            | Activity::ReferenceOutOfSwitch
            | Activity::ReferenceFreeSteps => Purpose::Reference,
            _ if self.is_rapid || head() == Some(false) => Purpose::Rapid,
            _ => Purpose::Work,
        }
    }

    /// Is a picture from there, if nothing else was said.
    pub(crate) fn seen_from(mut self, view: View) -> Drawing {
        if self.views.is_empty() && view != View::Top {
            self.views = vec![view, View::Isometric];
        }
        self
    }

    /// Draws a single motion at a constant speed.
    pub(crate) fn finish_alone(
        mut self,
        origin: Point,
        path: Path,
        speed: u32,
    ) -> Result<(), Failure> {
        let steps = path.length();
        let end: Point = path.at(steps);
        let profile = Profile::constant(steps, speed);
        let now = Time::from_nanos(profile.duration());
        let segment = Box::new(Segment { path, profile });
        self.plot.see(Time::ZERO, &Event::Motion(Motion::Begins { origin, segment }));
        self.plot.see(now, &Event::Motion(Motion::Ends { steps }));
        self.finish(now, &std::array::from_fn(|axis| origin[axis] + end[axis]))
    }

    /// Draws what was done up to now, with the counters as they are.
    pub(crate) fn finish(mut self, now: Time, counters: &Point) -> Result<(), Failure> {
        self.plot.stop(now, counters);
        // Places that count from anywhere have the ends of the machine elsewhere.
        for (index, (axis, stood)) in
            self.frame.axes.iter_mut().zip(self.stood.iter().flatten()).enumerate()
        {
            if !self.plot.is_referenced(index) {
                let (low, high) = axis.travel;
                axis.travel = (low.map(|low| low - stood), high.map(|high| high - stood));
            }
        }
        // Each of them, whatever becomes of the others.
        let exported = std::mem::take(&mut self.exports).into_iter();
        let exported = exported.map(|(write, destination)| {
            destination.write(write(&self.plot, &self.frame).as_bytes())
        });
        exported.fold(Ok(()), Result::and).and(self.picture())
    }

    fn picture(&mut self) -> Result<(), Failure> {
        let Some((format, destination)) = self.picture.take() else { return Ok(()) };
        let views = match self.views.as_slice() {
            [] => Picture::best_views(&self.plot),
            views => views,
        };
        let picture = Picture::of(&self.plot, &self.frame, views, self.colouring);
        let bytes = match format {
            Format::Svg => picture.svg().into_bytes(),
            Format::Png => picture.png().ok_or_else(|| {
                Failure::midway("there is no memory for the dots of the picture; use .svg")
            })?,
        };
        let path = destination.path().to_owned();
        destination.write(&bytes)?;
        if self.is_opened {
            show(&path);
        }
        Ok(())
    }
}

/// Carriage minus counter of each axis.
pub(crate) fn shifts<D: Device>(device: &D, at: Time) -> Vec<i64> {
    let axes = device.view(at).axes;
    axes.iter().map(|axis| axis.carriage - axis.position).collect()
}

/// Shows a file in the program that the desktop has for it. If there is none, that is said: the file is
/// there nevertheless.
fn show(path: &path::Path) {
    let (program, first): (&str, &[&str]) = match () {
        // Unlike `start` of a shell it takes every name for a name.
        () if cfg!(windows) => ("rundll32", &["url.dll,FileProtocolHandler"]),
        () if cfg!(target_os = "macos") => ("open", &[]),
        () => ("xdg-open", &[]),
    };
    let mut command = Command::new(program);
    command.args(first).arg(path).stdin(Stdio::null()).stdout(Stdio::null());
    if let Err(error) = command.spawn() {
        let file = path.display();
        let text = format!(
            "cannot show {file}, because {program} does not start: {error}; it is written, so open it \
             with any browser"
        );
        // Whoever closed standard error does not want to know.
        let _ = writeln!(io::stderr(), "{text}");
    }
}

/// The axes of a model on a machine, for a picture of what a file did.
pub(crate) fn frame(file: &path::Path, model: &Model, machine: &Machine) -> Frame {
    let measures = machine.measures();
    let what = match file.file_name() {
        Some(name) if file != path::Path::new("-") => text::name(path::Path::new(name)),
        _ => text::name(file),
    };
    let names = model.axis_names();
    let fitted = (0..names.len()).rev().find(|axis| machine.fits(*axis)).map_or(0, |last| last + 1);
    let axes = names.iter().take(fitted).enumerate().map(|(axis, name)| Axis {
        name: (*name).to_owned(),
        unit: measures[axis].name.to_owned(),
        per_step: measures[axis].per_step,
        travel: machine.axis(axis).travel(),
    });
    let title = format!("{what} · {} · {}", model.name(), machine.name);
    Frame { title, axes: axes.collect() }
}
