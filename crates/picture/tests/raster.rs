//! An independent program sees the same picture: `rsvg-convert` makes dots of the SVG, and they are where
//! those of the PNG are.
//!
//! Without that program the trial is shown as ignored, with the reason in its name. With
//! `VIMC4_REQUIRE_TOOLS=1` it fails instead.

#![expect(clippy::unwrap_used, reason = "a picture that cannot be read has failed")]

use std::io::Write;
use std::process::{Command, Stdio};

use libtest_mimic::{Arguments, Failed, Trial};
use vimc4_device::{Event, Motion};
use vimc4_motion::{AXES, Arc, CircleFit, Path, Profile, Segment, StraightLine, Time, Turn};
use vimc4_picture::{Axis, Colouring, Frame, Picture, Plot, Purpose, View};

mod reader;

use reader::{Dots, png};

const TOOL: &str = "rsvg-convert";

fn main() {
    let arguments = Arguments::from_args();
    let version = Command::new(TOOL).arg("--version").stdout(Stdio::null()).status();
    let there = version.is_ok_and(|status| status.success());
    let required = std::env::var_os("VIMC4_REQUIRE_TOOLS").is_some_and(|value| value == "1");
    let name = "an independent program sees the same picture";
    let name = if there { name.to_owned() } else { format!("{name} (needs {TOOL})") };
    let trial = Trial::test(name, compare).with_ignored_flag(!there && !required);
    libtest_mimic::run(&arguments, vec![trial]).exit();
}

/// Lines, arcs, a reference run, a rapid, and an end before its time.
fn plot() -> Plot {
    let mut plot = Plot::new();
    let (mut at, mut origin) = (Time::ZERO, [0; AXES]);
    let line = |x, y, z| Path::Line(StraightLine::new([x, y, z, 0, 0, 0]));
    let fit = CircleFit::new(-700, 0, 490_000, Turn::Clockwise).unwrap();
    let arc = Path::Arc(Arc::new(0, 1, fit.steps_per_turn() * 3 / 4, fit.start()));
    for (purpose, path, missing) in [
        (Purpose::Reference, line(-200, -300, 0), 0),
        (Purpose::Rapid, line(1_500, 900, 100), 0),
        (Purpose::Work, line(700, 0, -100), 0),
        (Purpose::Work, arc, 0),
        (Purpose::Work, line(-400, 700, 0), 100),
    ] {
        let steps = path.length() - missing;
        let profile = Profile::constant(path.length(), 1_000);
        let (moved, end) = (path.at(steps), at.after_nanos(profile.time_of(steps)));
        let segment = Box::new(Segment { path, profile });
        plot.purpose(purpose);
        plot.see(at, &Event::Motion(Motion::Begins { origin, segment }));
        plot.see(end, &Event::Motion(Motion::Ends { steps }));
        origin = std::array::from_fn(|axis| origin[axis] + moved[axis]);
        at = end;
    }
    plot
}

fn compare() -> Result<(), Failed> {
    let axes = ["X", "Y", "Z"].map(|name| Axis {
        name: name.to_owned(),
        unit: "mm".to_owned(),
        per_step: 0.01,
        travel: (Some(0), Some(2_500)),
    });
    let frame = Frame { title: "a test".to_owned(), axes: axes.into() };
    let views = [View::Top, View::Isometric, View::Front, View::Side];
    let picture = Picture::of(&plot(), &frame, &views, Colouring::Kind);
    let mut tool = Command::new(TOOL);
    tool.args(["--zoom", "2"]).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = tool.spawn().unwrap();
    child.stdin.take().unwrap().write_all(picture.svg().as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", output.status);
    let (theirs, ours) = (png(&output.stdout), png(&picture.png().unwrap()));
    assert_eq!((theirs.width, theirs.pixels.len()), (ours.width, ours.pixels.len()));
    // Feed, arc, rapid, stop and start. Texts are drawn with other letters, but not in these colours.
    for colour in [[29, 78, 216], [4, 120, 87], [217, 119, 6], [220, 38, 38], [22, 163, 74]] {
        let [here, there] = [&ours, &theirs].map(|dots| places(dots, colour));
        assert!(here.len() > 100, "{colour:?} is not there");
        for (from, to, dots) in [(&here, colour, &theirs), (&there, colour, &ours)] {
            let lost: Vec<_> = from.iter().filter(|place| !is_near(dots, **place, to)).collect();
            // Dashes may begin and end a dot later.
            assert!(lost.len() * 100 <= from.len(), "{colour:?} is not at {lost:?}");
        }
    }
    Ok(())
}

fn is_alike(one: [u8; 3], other: [u8; 3]) -> bool {
    one.iter().zip(other).all(|(one, other)| one.abs_diff(other) < 40)
}

/// Where a colour is.
fn places(dots: &Dots, colour: [u8; 3]) -> Vec<(usize, usize)> {
    let numbered = dots.pixels.iter().enumerate();
    let places = numbered.filter(|(_, pixel)| is_alike(**pixel, colour));
    places.map(|(at, _)| (at % dots.width, at / dots.width)).collect()
}

/// Whether a colour is there within one and a half dots, as far as smoothing leaves it.
fn is_near(dots: &Dots, (x, y): (usize, usize), colour: [u8; 3]) -> bool {
    let height = dots.pixels.len() / dots.width;
    (y.saturating_sub(1)..(y + 2).min(height)).any(|y| {
        (x.saturating_sub(1)..(x + 2).min(dots.width)).any(|x| {
            let pixel = dots.pixels[y * dots.width + x];
            pixel.iter().zip(colour).all(|(one, other)| one.abs_diff(other) < 110)
        })
    })
}
