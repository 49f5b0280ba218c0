//! G-code and DXF, read back by readers that share nothing with what has written them.

#![expect(clippy::unwrap_used, reason = "a file that cannot be read has failed")]

use std::f64::consts::TAU;

use proptest::prelude::*;
use vimc4_device::{Event, Motion};
use vimc4_motion::{
    AXES, Arc, ArcState, CircleFit, Helix, Path, Point, Profile, Segment, StraightLine, Sweep,
    Time, Turn,
};
use vimc4_picture::{Axis, Frame, Plot, Purpose, dxf, gcode};

/// Steps a mm.
const PER_MM: f64 = 80.0;

fn frame() -> Frame {
    let axis = |name: &str| Axis {
        name: name.to_owned(),
        unit: "mm".to_owned(),
        per_step: 1.0 / PER_MM,
        travel: (None, None),
    };
    Frame { title: "a (test)".to_owned(), axes: ["X", "Y", "Z"].map(axis).into() }
}

/// Paths one after the other, each at 1,600 Hz.
fn plot(paths: &[Path]) -> Plot {
    let mut plot = Plot::new();
    let (mut at, mut origin) = (Time::ZERO, [0; AXES]);
    for path in paths {
        let steps = path.length();
        let end: Point = path.at(steps);
        let profile = Profile::constant(steps, 1_600);
        let after = at.after_nanos(profile.duration());
        let segment = Box::new(Segment { path: path.clone(), profile });
        plot.see(at, &Event::Motion(Motion::Begins { origin, segment }));
        plot.see(after, &Event::Motion(Motion::Ends { steps }));
        origin = std::array::from_fn(|axis| origin[axis] + end[axis]);
        at = after;
    }
    plot
}

/// A way that was read: places close together, in mm, and how many arcs it had.
#[derive(Default)]
struct Way {
    places: Vec<[f64; 3]>,
    arcs: usize,
    feeds: Vec<f64>,
    rapids: usize,
}

impl Way {
    fn line(&mut self, from: [f64; 3], to: [f64; 3]) {
        let length: f64 = (0..3).map(|axis| (to[axis] - from[axis]).powi(2)).sum::<f64>().sqrt();
        let pieces = (length / 0.01).ceil().max(1.0) as u32;
        for piece in 0..=pieces {
            let share = f64::from(piece) / f64::from(pieces);
            self.places
                .push(std::array::from_fn(|axis| from[axis] + share * (to[axis] - from[axis])));
        }
    }

    /// An arc in a plane around a centre, with the sense of rotation from the first axis to the second.
    fn arc(
        &mut self,
        from: [f64; 3],
        to: [f64; 3],
        plane: [usize; 2],
        centre: [f64; 2],
        left: bool,
    ) {
        let angle =
            |place: &[f64; 3]| (place[plane[1]] - centre[1]).atan2(place[plane[0]] - centre[0]);
        let radius =
            |place: &[f64; 3]| (place[plane[0]] - centre[0]).hypot(place[plane[1]] - centre[1]);
        assert!((radius(&from) - radius(&to)).abs() < 1e-3, "the ends are on no circle");
        let sweep = match left {
            true => (angle(&to) - angle(&from)).rem_euclid(TAU),
            false => -(angle(&from) - angle(&to)).rem_euclid(TAU),
        };
        assert!(sweep.abs() < TAU * 0.501, "half a turn at the most: {sweep}");
        let pieces = (sweep.abs() * radius(&from) / 0.01).ceil().max(1.0) as u32;
        for piece in 0..=pieces {
            let share = f64::from(piece) / f64::from(pieces);
            let mut place =
                std::array::from_fn(|axis| from[axis] + share * (to[axis] - from[axis]));
            let (sin, cos) = (angle(&from) + share * sweep).sin_cos();
            place[plane[0]] = centre[0] + radius(&from) * cos;
            place[plane[1]] = centre[1] + radius(&from) * sin;
            self.places.push(place);
        }
        self.arcs += 1;
    }

    /// How far a place of the motion is from the way that was read.
    fn beside(&self, steps: &Point) -> f64 {
        let place: [f64; 3] = std::array::from_fn(|axis| steps[axis] as f64 / PER_MM);
        let square = |other: &[f64; 3]| -> f64 {
            (0..3).map(|axis| (place[axis] - other[axis]).powi(2)).sum()
        };
        self.places.iter().map(square).fold(f64::MAX, f64::min).sqrt()
    }
}

/// Reads G-code of a machine in mm, as the standard has it.
fn read_gcode(text: &str) -> Way {
    let mut way = Way::default();
    let (mut place, mut plane) = ([0.0; 3], 17);
    for line in text.lines().filter(|line| !line.starts_with('(')) {
        let words: Vec<(char, f64)> = line
            .split_whitespace()
            .map(|word| (word.chars().next().unwrap(), word[1..].parse().unwrap()))
            .collect();
        let word = |letter: char| words.iter().find(|word| word.0 == letter).map(|word| word.1);
        let codes: Vec<i32> =
            words.iter().filter(|word| word.0 == 'G').map(|word| word.1 as i32).collect();
        for code in &codes {
            if (17..=19).contains(code) {
                plane = *code;
            }
        }
        way.feeds.extend(word('F'));
        let to: [f64; 3] =
            std::array::from_fn(|axis| word(['X', 'Y', 'Z'][axis]).unwrap_or(place[axis]));
        match codes.first() {
            Some(0) => {
                way.rapids += 1;
                way.line(place, to);
            }
            Some(1) => way.line(place, to),
            Some(code @ (2 | 3)) => {
                let axes = match plane {
                    17 => [0, 1],
                    18 => [2, 0],
                    _ => [1, 2],
                };
                let centre =
                    axes.map(|axis| place[axis] + word(['I', 'J', 'K'][axis]).unwrap_or(0.0));
                way.arc(place, to, axes, centre, *code == 3);
            }
            _ => continue,
        }
        place = to;
    }
    way
}

/// Reads the entities of a DXF, each with its own begin and end.
fn read_dxf(text: &str) -> Way {
    let mut lines = text.lines();
    let mut groups = Vec::new();
    while let (Some(code), Some(value)) = (lines.next(), lines.next()) {
        groups.push((code.trim().parse::<u16>().unwrap(), value));
    }
    assert_eq!(groups.last(), Some(&(0, "EOF")));
    let mut way = Way::default();
    let begins: Vec<usize> = (0..groups.len()).filter(|at| groups[*at].0 == 0).collect();
    for pair in begins.windows(2) {
        let entity = &groups[pair[0]..pair[1]];
        let value = |code: u16| -> f64 {
            entity.iter().find(|group| group.0 == code).unwrap().1.parse().unwrap()
        };
        match entity[0].1 {
            "LINE" => way.line([10, 20, 30].map(value), [11, 21, 31].map(value)),
            "ARC" => {
                let [x, y, z, radius] = [10, 20, 30, 40].map(value);
                let at = |degrees: f64| {
                    let (sin, cos) = degrees.to_radians().sin_cos();
                    [x + radius * cos, y + radius * sin, z]
                };
                way.arc(at(value(50)), at(value(51)), [0, 1], [x, y], true);
            }
            _ => {}
        }
    }
    way
}

fn line(x: i64, y: i64, z: i64) -> Path {
    Path::Line(StraightLine::new([x, y, z, 0, 0, 0]))
}

fn arc(plane: (usize, usize), start: (i64, i64), turn: Turn, quarters: f64) -> Arc {
    let (x, y) = start;
    let fit = CircleFit::new(x, y, x * x + y * y, turn).unwrap();
    let steps = (fit.steps_per_turn() as f64 * quarters / 4.0) as u64;
    Arc::new(plane.0, plane.1, steps, fit.start())
}

fn paths() -> impl Strategy<Value = Path> {
    let lines = [-300_i64..300, -300..300, -300..300].prop_map(|[x, y, z]| line(x, y, z));
    let turns = prop_oneof![Just(Turn::Clockwise), Just(Turn::Counterclockwise)];
    let planes = prop_oneof![Just((0, 1)), Just((0, 2)), Just((1, 2)), Just((1, 0))];
    let starts = (-300_i64..300, -300_i64..300).prop_filter("a circle", |start| *start != (0, 0));
    let arcs = (planes, starts, turns, 0.05_f64..6.0)
        .prop_map(|(plane, start, turn, quarters)| arc(plane, start, turn, quarters));
    let helices = (arcs.clone(), -900_i64..900).prop_map(|(arc, rise)| {
        let plane = Path::Arc(arc.clone()).circle_at(0).map_or((0, 1), |(plane, _)| plane);
        Path::Helix(Helix::new(arc, 3 - plane.0 - plane.1, rise))
    });
    prop_oneof![lines, arcs.prop_map(Path::Arc), helices]
}

/// Where all steps are.
fn steps(paths: &[Path]) -> Vec<Point> {
    let mut origin = [0; AXES];
    let mut all = Vec::new();
    for path in paths {
        all.extend(path.steps().map(|by| std::array::from_fn(|axis| origin[axis] + by[axis])));
        origin = all.last().copied().unwrap_or(origin);
    }
    all
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Two steps are as far as an arc that stands for steps may be from them, with what a step is
    /// beside the ideal line itself.
    #[test]
    fn what_is_read_is_what_was_gone(paths in proptest::collection::vec(paths(), 1..4)) {
        let paths: Vec<Path> = paths.into_iter().filter(|path| path.length() > 0).collect();
        let plot = plot(&paths);
        let steps = steps(&paths);
        for (name, way) in
            [("gcode", read_gcode(&gcode(&plot, &frame()))), ("dxf", read_dxf(&dxf(&plot, &frame())))]
        {
            for place in steps.iter().step_by(11).chain(steps.last()) {
                let off = way.beside(place) * PER_MM;
                prop_assert!(off < 3.0, "{name}: {off} steps beside at {place:?}");
            }
            // And nothing is drawn where nothing was: the ways are as long as each other.
            let mut nearest = way.places.iter().step_by(97).map(|place| {
                let square = |step: &Point| -> f64 {
                    (0..3).map(|axis| (step[axis] as f64 / PER_MM - place[axis]).powi(2)).sum()
                };
                steps.iter().chain([&[0; AXES]]).map(square).fold(f64::MAX, f64::min).sqrt()
            });
            prop_assert!(nearest.all(|off| off * PER_MM < 3.0), "{name}: {paths:?}");
        }
        if let (Some(last), Some(end)) =
            (steps.last(), read_gcode(&gcode(&plot, &frame())).places.last())
        {
            for axis in 0..3 {
                prop_assert!((end[axis] - last[axis] as f64 / PER_MM).abs() < 1e-5);
            }
        }
    }
}

/// The third axis makes seven steps for each of the others, and a circle of three steps.
#[test]
fn a_steep_helix_and_a_small_circle_stay_what_they_are() {
    let turn = ArcState { x: -175, y: 123, d: -26, rx: 1, ry: 1 };
    let helix = Path::Helix(Helix::new(Arc::new(0, 1, 93, turn), 2, 649));
    let small = Path::Arc(Arc::new(0, 1, 27, ArcState { x: 2, y: -2, d: 0, rx: -1, ry: -1 }));
    for path in [helix, small] {
        let way = read_gcode(&gcode(&plot(std::slice::from_ref(&path)), &frame()));
        for place in path.steps() {
            assert!(way.beside(&place) * PER_MM < 3.0, "{place:?}");
        }
    }
}

#[test]
fn circles_are_arcs_and_speeds_are_real() {
    let circle = Path::Arc(arc((0, 1), (800, 0), Turn::Counterclockwise, 4.0));
    let plot = plot(&[line(400, 0, 0), circle]);
    let text = gcode(&plot, &frame());
    let way = read_gcode(&text);
    assert_eq!(way.arcs, 2, "{text}");
    assert!(text.starts_with("(a [test])\nG21 G90"), "{text}");
    // 1,600 Hz with 80 steps a mm are 20 mm/s; on a circle a step is shorter by π/4 on average.
    assert!((way.feeds[0] - 1_200.0).abs() < 0.1, "{:?}", way.feeds);
    assert!((way.feeds[1] - 1_200.0 * TAU / 8.0).abs() < 5.0, "{:?}", way.feeds);
    assert_eq!(read_dxf(&dxf(&plot, &frame())).arcs, 2);
}

#[test]
fn the_feed_of_an_arc_is_the_speed_along_it() {
    // 40 mm/s² up to 20 mm/s, round a radius of 50 mm.
    let scale = [12_500_000; AXES];
    for degrees in [45, 90, 137, 180, 360] {
        let sweep = Sweep::by_angle((0, 1), (-4_000, 0), degrees * 1_000_000_000).unwrap();
        let profile = Profile::trapezoid(sweep.stretches(&scale), 20_000_000, 40_000_000);
        let (steps, end) = (sweep.path().length(), Time::from_nanos(profile.duration()));
        let segment = Box::new(Segment { path: sweep.path(), profile });
        // One that a switch ends, too.
        for made in [steps, steps * 2 / 3] {
            let mut plot = Plot::new();
            let segment = segment.clone();
            plot.see(Time::ZERO, &Event::Motion(Motion::Begins { origin: [0; AXES], segment }));
            plot.see(end, &Event::Motion(Motion::Ends { steps: made }));
            let way = read_gcode(&gcode(&plot, &frame()));
            assert!((way.feeds[0] - 1_200.0).abs() < 1.0, "{degrees}, {made}: {:?}", way.feeds);
        }
    }
}

#[test]
fn what_is_no_circle_is_lines() {
    // Steps of different lengths make an ellipse.
    let mut frame = frame();
    frame.axes[1].per_step = 1.0 / 40.0;
    let plot = plot(&[Path::Arc(arc((0, 1), (400, 0), Turn::Clockwise, 4.0))]);
    let way = read_gcode(&gcode(&plot, &frame));
    assert_eq!(way.arcs, 0);
    let far = way.places.iter().map(|place| place[1]).fold(f64::MIN, f64::max);
    assert!((far - 10.0).abs() < 0.05, "{far}");
}

#[test]
fn reference_runs_are_rapids_on_a_layer_of_their_own() {
    let mut plot = Plot::new();
    plot.purpose(Purpose::Reference);
    let path = line(-800, 0, 0);
    let profile = Profile::constant(800, 1_600);
    let end = Time::from_nanos(profile.duration());
    let segment = Box::new(Segment { path, profile });
    plot.see(Time::ZERO, &Event::Motion(Motion::Begins { origin: [0; AXES], segment }));
    plot.see(end, &Event::Motion(Motion::Ends { steps: 800 }));
    plot.stop(end, &[0; AXES]);
    let text = gcode(&plot, &frame());
    assert!(text.contains("G0 X10 Y0 Z0\nG0 X0\n"), "{text}");
    let text = dxf(&plot, &frame());
    assert!(text.contains("LINE\n  8\nREFERENCE\n 10\n10\n"), "{text}");
}
