//! Pictures: where things are in them, and that they are the same every time.

#![expect(clippy::unwrap_used, reason = "a picture that cannot be read has failed")]

use std::borrow::Cow;

use vimc4_device::{Event, Loss, Motion, Warning};
use vimc4_motion::{AXES, Path, Point, Profile, Ramp, Segment, StraightLine, Time};
use vimc4_picture::{Axis, Back, Colouring, Frame, MarkKind, Picture, Plot, Purpose, View, gcode};

mod reader;

use reader::{Dots, png};

const VIEWS: [View; 5] = [View::Top, View::Front, View::Side, View::Isometric, View::Time];

/// 100 steps a mm, 40 x 30 x 10 mm.
fn frame() -> Frame {
    let axis = |name: &str, most: i64| Axis {
        name: name.to_owned(),
        unit: "mm".to_owned(),
        per_step: 0.01,
        travel: (Some(0), Some(most)),
    };
    let axes = vec![axis("X", 4_000), axis("Y", 3_000), axis("Z", 1_000)];
    Frame { title: "a <test> & more".to_owned(), axes }
}

/// A run of lines.
struct Run {
    plot: Plot,
    now: Time,
    counters: Point,
}

impl Run {
    fn new() -> Run {
        Run { plot: Plot::new(), now: Time::ZERO, counters: [0; AXES] }
    }

    fn go(&mut self, way: [i64; 3], made: Option<u64>) {
        let [x, y, z] = way;
        let path = Path::Line(StraightLine::new([x, y, z, 0, 0, 0]));
        let steps = made.unwrap_or(path.length());
        let profile = Profile::constant(path.length(), 1_000);
        let moved = path.at(steps);
        let end = self.now.after_nanos(profile.time_of(steps.max(1)));
        let segment = Box::new(Segment { path, profile });
        let origin = self.counters;
        self.plot.see(self.now, &Event::Motion(Motion::Begins { origin, segment }));
        self.plot.see(end, &Event::Motion(Motion::Ends { steps }));
        self.now = end;
        self.counters = std::array::from_fn(|axis| origin[axis] + moved[axis]);
    }

    fn answers(&mut self, why: &str) {
        let answer = Event::Answer {
            mnemonic: Cow::Borrowed("@A"),
            bytes: b"F"[..].into(),
            why: Some(why.into()),
        };
        self.plot.see(self.now, &answer);
    }
}

/// A square with an end before its time.
fn square() -> Plot {
    let mut run = Run::new();
    for way in [[4_000, 0, 0], [0, 3_000, 0], [-4_000, 0, 500], [0, -3_000, 0]] {
        let is_last = way == [0, -3_000, 0];
        run.go(way, is_last.then_some(1_000));
    }
    run.answers("stopped by a <person>");
    run.plot
}

/// The places of signs of a class in an SVG.
fn signs(svg: &str, class: &str) -> Vec<(f64, f64)> {
    let marker = format!("class=\"{class}\"");
    let found = svg.lines().filter(|line| line.contains(&marker));
    found
        .map(|line| {
            let outline =
                line.split(" d=\"").nth(1).and_then(|rest| rest.split('z').next()).unwrap();
            let points = points(outline);
            let xs = points.iter().map(|point| point.0);
            let ys = points.iter().map(|point| point.1);
            let middle = |values: Vec<f64>| {
                let low = values.iter().copied().fold(f64::MAX, f64::min);
                let high = values.iter().copied().fold(f64::MIN, f64::max);
                (low + high) / 2.0
            };
            (middle(xs.collect()), middle(ys.collect()))
        })
        .collect()
}

/// The points of a path of SVG with `M` and `l`, added up.
fn points(d: &str) -> Vec<(f64, f64)> {
    let mut numbers: Vec<f64> = Vec::new();
    let mut word = String::new();
    for letter in d.chars().chain([' ']) {
        let ends = letter == '-' || letter == ' ' || letter.is_ascii_alphabetic();
        if ends && !word.is_empty() {
            numbers.push(word.parse().unwrap());
            word.clear();
        }
        if !ends || letter == '-' {
            word.push(letter);
        }
    }
    let mut points: Vec<(f64, f64)> = Vec::new();
    for pair in numbers.chunks(2) {
        let last = points.last().copied().unwrap_or((0.0, 0.0));
        points.push((last.0 + pair[0], last.1 + pair[1]));
    }
    points
}

#[test]
fn marks_are_where_they_happened() {
    let plot = square();
    let marks = plot.marks();
    let kinds: Vec<MarkKind> = marks.iter().map(|mark| mark.kind).collect();
    assert_eq!(kinds, [MarkKind::Start, MarkKind::Stop, MarkKind::End]);
    assert_eq!(marks[1].place[..3], [0, 2_000, 500]);
    assert_eq!(marks[1].text, "F: stopped by a <person>");

    let svg = Picture::of(&plot, &frame(), &[View::Top], Colouring::Kind).svg();
    let (start, stop) = (signs(&svg, "mark start")[0], signs(&svg, "mark stop")[0]);
    // Where a path ends as it began, both are seen: the end is smaller, and in front.
    assert!(svg.find("mark start") < svg.find("mark end"));
    // The envelope is as wide as the path: 40 mm of it give the scale.
    let envelope = svg.lines().find(|line| line.contains("class=\"envelope\"")).unwrap();
    let corner = points(envelope.split(" d=\"").nth(1).unwrap().split('"').next().unwrap());
    let (left, bottom) = corner[0];
    assert!((start.0 - left).abs() < 0.2 && (start.1 - bottom).abs() < 0.2, "{start:?} {corner:?}");
    let feed = svg.lines().find(|line| line.contains("class=\"feed\"")).unwrap();
    let feed = points(feed.split(" d=\"").nth(1).unwrap().split('"').next().unwrap());
    let scale = (feed[1].0 - feed[0].0) / 40.0;
    assert!((stop.0 - start.0).abs() < 0.2, "{stop:?}");
    assert!((start.1 - stop.1 - 20.0 * scale).abs() < 0.2, "{stop:?} with {scale} a mm");
    assert!(
        svg.contains("stopped by a &lt;person&gt;") && svg.contains("a &lt;test&gt; &amp; more")
    );
}

/// On paper without colours, and for people who tell few of them apart.
#[test]
fn lines_are_told_apart_without_their_colours_too() {
    let mut run = Run::new();
    run.plot.purpose(Purpose::Reference);
    run.go([-2_000, 0, 0], None);
    run.plot.purpose(Purpose::Rapid);
    run.go([4_000, 2_500, 0], None);
    run.plot.purpose(Purpose::Work);
    run.go([0, -2_000, 0], None);
    let svg = Picture::of(&run.plot, &frame(), &[View::Top], Colouring::Kind).svg();
    let dashes = |line: &str| {
        line.split_once("stroke-dasharray=\"")
            .map_or("", |(_, rest)| rest.split('"').next().unwrap())
            .to_owned()
    };
    let of = |class: &str| -> Vec<String> {
        let class = format!("class=\"{class}\"");
        svg.lines()
            .filter(|line| line.contains(&class) && line.contains("fill=\"none\""))
            .map(dashes)
            .collect()
    };
    let drawn = ["reference", "rapid", "feed", "envelope"].map(|class| of(class).concat());
    let mut different = drawn.to_vec();
    different.sort_unstable();
    different.dedup();
    assert_eq!(different.len(), drawn.len(), "{drawn:?}");
    assert_eq!(of("legend"), drawn, "the legend shows them as they are");
}

#[test]
fn a_reference_run_ends_at_zero_and_the_path_before_it_is_where_it_was() {
    let mut run = Run::new();
    run.plot.purpose(Purpose::Reference);
    run.go([-700, 0, 0], None);
    run.go([20, 0, 0], None);
    run.go([0, -300, 0], None);
    run.counters = [0; AXES];
    run.plot.purpose(Purpose::Work);
    run.go([500, 400, 0], None);
    let (plot, origin) = (&run.plot, run.plot.origin());
    assert_eq!(origin[..3], [-680, -300, 0]);
    let place = |place: Point| [place[0] - origin[0], place[1] - origin[1]];
    assert_eq!(place(plot.legs()[0].from), [680, 300]);
    assert_eq!(place(plot.legs()[3].from), [0, 0]);
    assert_eq!(place(plot.legs()[3].to()), [500, 400]);
    // The same if nothing moves after it.
    let mut alone = Run::new();
    alone.plot.purpose(Purpose::Reference);
    alone.go([-700, 0, 0], None);
    alone.plot.stop(alone.now, &[0; AXES]);
    assert_eq!(alone.plot.origin()[0], -700);
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    for colouring in [Colouring::Kind, Colouring::Speed] {
        let [one, other] = [(); 2].map(|()| Picture::of(&square(), &frame(), &VIEWS, colouring));
        assert_eq!(one.svg(), other.svg());
        assert_eq!(one.png(), other.png());
    }
}

#[test]
fn many_motions_make_no_larger_picture() {
    let sizes = [5_000, 40_000].map(|motions| {
        let mut run = Run::new();
        let mut random = 1_u64;
        for _ in 0..motions {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            // Two steps are a fiftieth of a mm, and the whole is 400 mm wide.
            let way = |bits: u64| (random >> bits & 1) as i64 * 4 - 2;
            let ahead = if run.counters[0] > 2_000 { -1 } else { 1 };
            run.go([ahead * way(40).abs(), way(50), 0], None);
        }
        run.go([40_000 - run.counters[0], 0, 0], None);
        assert_eq!(run.plot.motions(), motions + 1);
        Picture::of(&run.plot, &frame(), &[View::Top], Colouring::Kind).svg().len()
    });
    assert!(sizes[1] < 2 * sizes[0] + 20_000, "{sizes:?}");
}

#[test]
fn nothing_at_all_is_a_picture_too() {
    for plot in [Plot::new(), {
        let mut run = Run::new();
        run.go([0, 0, 0], None);
        run.plot
    }] {
        for frame in [frame(), Frame::default()] {
            let picture = Picture::of(&plot, &frame, &VIEWS, Colouring::Speed);
            assert!(picture.svg().ends_with("</svg>\n"));
            assert!(!picture.svg().contains("NaN") && !picture.svg().contains("inf"));
            assert!(picture.png().is_some());
        }
    }
}

#[test]
fn the_dots_are_where_the_lines_are() {
    let picture = Picture::of(&square(), &frame(), &[View::Top, View::Isometric], Colouring::Kind);
    let Dots { width, pixels } = png(&picture.png().unwrap());
    let at = |(x, y): (f64, f64)| pixels[(y * 2.0) as usize * width + (x * 2.0) as usize];
    let svg = picture.svg();
    for (class, colour) in
        [("mark start", [22, 163, 74]), ("mark stop", [220, 38, 38]), ("mark end", [34, 34, 34])]
    {
        let signs = signs(&svg, class);
        assert_eq!(signs.len(), 2, "one in each view");
        for sign in signs {
            // Where the stop is, the end is hidden.
            let seen = if class == "mark end" { [220, 38, 38] } else { colour };
            assert_eq!(at(sign), seen, "{class} at {sign:?}");
        }
    }
    let lines = svg.lines().filter(|line| line.contains("class=\"feed\"") && line.contains("d=\""));
    for line in lines {
        let path = points(line.split(" d=\"").nth(1).unwrap().split('"').next().unwrap());
        let middle =
            |one: (f64, f64), other: (f64, f64)| ((one.0 + other.0) / 2.0, (one.1 + other.1) / 2.0);
        assert_eq!(at(middle(path[0], path[1])), [29, 78, 216]);
    }
}

/// However long a motion is, its ramps are as steep as they are.
#[test]
fn the_ramps_of_a_long_motion_are_seen() {
    let path = Path::Line(StraightLine::new([20_000_000, 0, 0, 0, 0, 0]));
    let ramp = Ramp { start_stop: 300, acceleration: 50 };
    let profile = Profile::new(path.length(), 10_000, ramp);
    let (steps, end) = (path.length(), Time::ZERO.after_nanos(profile.duration()));
    let segment = Box::new(Segment { path, profile });
    let mut plot = Plot::new();
    plot.see(Time::ZERO, &Event::Motion(Motion::Begins { origin: [0; AXES], segment }));
    plot.see(end, &Event::Motion(Motion::Ends { steps }));
    let svg = Picture::of(&plot, &frame(), &[View::Time], Colouring::Kind).svg();
    // 50 Hz/ms are 500 mm/s², up at the beginning and down at the end.
    let labels = |text: &str| svg.matches(&format!(">{text}</text>")).count();
    assert_eq!((labels("-500"), labels("500")), (1, 3 + 1), "three times are 500 s, too");
    let curve = svg.lines().rfind(|line| line.contains("class=\"curve\"")).unwrap();
    assert!(curve.contains("M80 557l0-67") && curve.ends_with("0 36.5 .1 0 0-67\"/>"), "{curve}");
    assert!(svg.contains(">speed, mm/s<") && svg.contains(">acceleration, mm/s²<"), "{svg}");
    let nothing = Picture::of(&Plot::new(), &frame(), &[View::Time], Colouring::Kind).svg();
    assert!(nothing.contains(">speed<") && nothing.contains(">position<"), "{nothing}");
}

#[test]
fn each_axis_has_its_unit_by_the_second() {
    let mut run = Run::new();
    run.go([800, 400, 400], None);
    let mut frame = frame();
    frame.axes[2].unit = "°".to_owned();
    let svg = Picture::of(&run.plot, &frame, &[View::Time], Colouring::Kind).svg();
    for title in ["position, mm, °", "speed, mm/s, °/s", "acceleration, mm/s², °/s²"] {
        assert!(svg.contains(&format!(">{title}<")), "{title}: {svg}");
    }
}

#[test]
fn a_carriage_that_runs_on_is_drawn_to_where_it_comes_to_rest() {
    let mut run = Run::new();
    let path = Path::Line(StraightLine::new([800, 0, 0, 0, 0, 0]));
    let segment = Box::new(Segment { profile: Profile::constant(800, 1_000), path });
    let end = Time::from_millis(500);
    let (axis, name, steps, um, how) = (0, "X".into(), 79, None, Loss::Overran);
    let lost = Warning::StepsLost { axis, name, steps, um, how };
    run.plot.see(run.now, &Event::Motion(Motion::Begins { origin: run.counters, segment }));
    run.plot.see(end, &Event::Warning(lost));
    run.plot.see(end, &Event::Motion(Motion::Ends { steps: 500 }));
    (run.now, run.counters) = (end, [500, 0, 0, 0, 0, 0]);
    assert_eq!(run.plot.motions(), 1);
    let last = |plot: &Plot| plot.marks().last().map(|mark| (mark.kind, mark.place[0]));
    assert_eq!(last(&run.plot), Some((MarkKind::End, 579)));
    let code = gcode(&run.plot, &frame());
    let moves: Vec<&str> = code.lines().filter(|line| line.contains(" X5")).collect();
    assert_eq!(moves, ["G1 X5 F600", "G0 X5.79"], "{code}");
    let svg = Picture::of(&run.plot, &frame(), &[View::Top, View::Time], Colouring::Speed).svg();
    assert!(svg.contains(">10.0 mm/s<"), "it has no speed: {svg}");
    // The next motion begins there.
    run.go([100, 0, 0], None);
    assert_eq!(last(&run.plot), Some((MarkKind::End, 679)));
}

#[test]
fn the_end_of_an_answer_is_not_shown() {
    let mut run = Run::new();
    run.go([800, 0, 0], None);
    let (mnemonic, bytes, why) = (Cow::Borrowed("PA"), b"E113\r"[..].into(), "why".into());
    run.plot.see(run.now, &Event::Answer { mnemonic, bytes, why: Some(why) });
    let texts: Vec<String> = run.plot.marks().into_iter().map(|mark| mark.text).collect();
    assert!(texts.contains(&"E113: why".to_owned()), "{texts:?}");
}

#[test]
fn who_goes_back_into_a_motion_makes_the_rest_of_it_again() {
    let ms = Time::from_millis;
    let path = Path::Line(StraightLine::new([800, 0, 0, 0, 0, 0]));
    let line = Segment { path, profile: Profile::constant(800, 1_000) };
    let mut plot = Plot::new();
    let (origin, segment) = ([0; AXES], Box::new(line.clone()));
    plot.see(ms(0), &Event::Motion(Motion::Begins { origin, segment }));
    let (counters, shift, text) = (line.path.at(300), [0; AXES], "by a test".to_owned());
    let running = Some((ms(0), &line));
    plot.put_back(ms(600), Back { now: ms(300), counters, shift, running, text });
    plot.see(ms(800), &Event::Motion(Motion::Ends { steps: 800 }));
    plot.stop(ms(900), &line.path.at(800));
    let [first, rest] = plot.legs() else { panic!("{:?}", plot.legs()) };
    assert_eq!((first.began, first.ends, first.to()[0]), (ms(0), ms(600), 600));
    // In the order in which it was lived: from 300 on, after it had been at 600.
    assert_eq!((rest.began, rest.ends), (ms(600), ms(1_100)));
    assert_eq!((rest.from[0], rest.to()[0], rest.made), (300, 800, 500));
    let back: Vec<_> =
        plot.marks().into_iter().filter(|mark| mark.kind == MarkKind::Back).collect();
    assert_eq!((back[0].at, back[0].place[0], &*back[0].text), (ms(600), 300, "by a test"));
    let svg = Picture::of(&plot, &frame(), &[View::Top, View::Time], Colouring::Speed).svg();
    assert!(svg.contains("<title>put back at 0.600 s"), "{svg}");
}
