//! `vimc4 circle`: the parameters of a circle from what people know about it.
//!
//! The commands go to standard output and what is to be said about them to standard error, as
//! comments: what is piped or redirected is a command list that `vimc4 run` accepts.

mod arguments;
mod explain;

use std::io::{self, Write};

use serde_json::json;
use vimc4_motion::{AXES, Arc, ArcState, CircleFit, Helix, Path, Turn};
use vimc4_picture::{Axis, Frame};

pub(crate) use arguments::Arguments;
use arguments::{MOST, print};

use crate::failure::Failure;
use crate::typed_options::TypedOptions;

pub(crate) fn run(arguments: Arguments, typed: &TypedOptions) -> Result<(), Failure> {
    if let Some(command) = &arguments.explain {
        typed.refuse_if(!arguments.pictured.is_meant(), &["plane"], "without --plot")?;
        return explain::run(&arguments, typed, command);
    }
    let wanted = Wanted::new(&arguments)?;
    let circle = wanted.fitted()?;
    if circle.steps == 0 {
        return Err(Failure::usage(
            "the arc is shorter than a step; leave out --to for a whole circle, or choose angles \
             that are further apart",
        ));
    }
    if circle.steps > MOST {
        return Err(Failure::usage(format!(
            "the arc has {} steps, more than the {MOST} a command can have; divide it into \
             several arcs",
            circle.steps
        )));
    }
    let trace = Trace::of(&circle, &wanted);
    draw(&arguments, &circle)?;
    let commands = commands(&arguments, &circle);
    if arguments.json {
        print(&[json(&arguments, &circle, &trace, &commands)])
    } else {
        print(&commands)?;
        // A missing reader is not a failure.
        let _ = io::stderr().write_all(comments(&arguments, &circle, &trace).as_bytes());
        Ok(())
    }
}

/// Draws what the commands do, around the centre, if a picture is wanted.
fn draw(arguments: &Arguments, circle: &Circle) -> Result<(), Failure> {
    let (first, second) = arguments.plane.axes();
    let axes = ["X", "Y", "Z"].map(|name| match arguments.steps_per_mm {
        Some(scale) => {
            Axis { unit: "mm".to_owned(), per_step: 1.0 / scale, ..Axis::in_steps(name) }
        }
        None => Axis::in_steps(name),
    });
    let title = format!("a circle of radius {}", arguments.radius);
    let frame = Frame { title, axes: axes.into() };
    let Some(drawing) = arguments.pictured.begin(frame)? else { return Ok(()) };
    let arc = Arc::new(first, second, circle.steps, circle.start);
    let path = match arguments.rise {
        None => Path::Arc(arc),
        Some(rise) => Path::Helix(Helix::new(arc, 3 - first - second, rise)),
    };
    let mut origin = [0; AXES];
    (origin[first], origin[second]) = (circle.start.x, circle.start.y);
    drawing.seen_from(arguments.plane.view()).finish_alone(origin, path, arguments.speed)
}

/// An arc in the user's terms.
struct Wanted {
    /// In steps, which need not be whole.
    radius: f64,
    turn: Turn,
    /// Where it begins, in degrees.
    from: f64,
    /// How far it goes, in degrees, more than 0.
    sweep: f64,
}

/// What a controller is given for it.
struct Circle {
    steps: u64,
    start: ArcState,
}

impl Wanted {
    fn new(arguments: &Arguments) -> Result<Wanted, Failure> {
        let scale = arguments.steps_per_mm.unwrap_or(1.0);
        if !(scale.is_finite() && scale > 0.0) {
            return Err(Failure::usage(format!(
                "{scale} is not a number of steps per mm; it is the steps of a turn divided by the \
                 lead in mm, as in 400 / 5 = 80"
            )));
        }
        let radius = arguments.radius * scale;
        if !(1.0..=MOST as f64).contains(&radius) {
            let unit = if arguments.steps_per_mm.is_some() { "mm" } else { "steps" };
            return Err(Failure::usage(format!(
                "a radius of {} {unit} is not possible; from 1 to {MOST} steps are, in mm if \
                 --steps-per-mm says how many steps that is",
                arguments.radius
            )));
        }
        let from = arguments.from;
        let to = arguments.to.unwrap_or(if arguments.cw { from - 360.0 } else { from + 360.0 });
        for angle in [from, to] {
            // This also refuses NaN.
            if !(-1e6..=1e6).contains(&angle) {
                return Err(Failure::usage(format!(
                    "{angle} degrees are not possible; up to 1,000,000 are"
                )));
            }
        }
        let ahead = if arguments.cw { from - to } else { to - from };
        if ahead == 0.0 {
            return Err(Failure::usage(format!(
                "the arc ends where it begins, at {to} degrees; leave out --to for a whole circle"
            )));
        }
        let turn = if arguments.cw { Turn::Clockwise } else { Turn::Counterclockwise };
        let sweep = if ahead > 0.0 { ahead } else { 360.0 - (-ahead).rem_euclid(360.0) };
        Ok(Wanted { radius, turn, from, sweep })
    }

    /// The angle at which it ends.
    fn to(&self) -> f64 {
        self.from + self.turn.sign() as f64 * self.sweep
    }

    /// The point of the circle at an angle in degrees.
    fn point(&self, angle: f64) -> (f64, f64) {
        let (sin, cos) = angle.to_radians().sin_cos();
        (self.radius * cos, self.radius * sin)
    }

    /// The best there is: the difference register of the place that the start is rounded to, and
    /// the number of steps after which the controller is nearest to the end.
    fn fitted(&self) -> Result<Circle, Failure> {
        let (x, y) = rounded(self.point(self.from));
        let square = self.radius.powi(2).round() as i64;
        let fit = CircleFit::new(x, y, square, self.turn).ok_or_else(|| {
            Failure::usage(format!("({x}, {y}) is not on a circle of radius {}", self.radius))
        })?;
        let end = self.point(self.to());
        let turns = (self.sweep / 360.0).floor();
        let mut near = fit.steps_near(rounded(end), turns as u32);
        // An end close behind the start can be rounded to the start itself; the turn is not over
        // before it has begun, though.
        let half_way = (turns + 0.5) * fit.steps_per_turn() as f64;
        if self.sweep % 360.0 > 270.0 && (*near.end() as f64) < half_way {
            near = fit.steps_near(rounded(end), turns as u32 + 1);
        }
        let off = |steps: &u64| {
            let ArcState { x, y, .. } = fit.after(*steps);
            distance((x as f64, y as f64), end)
        };
        let steps = near.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0);
        Ok(Circle { steps, start: fit.start() })
    }
}

/// To the nearest whole number, a half away from zero.
fn rounded((x, y): (f64, f64)) -> (i64, i64) {
    (x.round() as i64, y.round() as i64)
}

fn distance(a: (f64, f64), b: (f64, f64)) -> f64 {
    (a.0 - b.0).hypot(a.1 - b.1)
}

/// What the controller makes of it.
struct Trace {
    wanted_start: (f64, f64),
    /// Relative to the centre, as all places are.
    end: (i64, i64),
    wanted_end: (f64, f64),
    /// The greatest distance from the circle on the way, in steps.
    deviation: f64,
}

impl Trace {
    fn of(circle: &Circle, wanted: &Wanted) -> Trace {
        let square = |state: &ArcState| state.x * state.x + state.y * state.y;
        let mut state = circle.start;
        let (mut inner, mut outer) = (square(&state), square(&state));
        for _ in 0..circle.steps {
            state.step();
            inner = inner.min(square(&state));
            outer = outer.max(square(&state));
        }
        let beside = |square: i64| ((square as f64).sqrt() - wanted.radius).abs();
        Trace {
            wanted_start: wanted.point(wanted.from),
            end: (state.x, state.y),
            wanted_end: wanted.point(wanted.to()),
            deviation: beside(inner).max(beside(outer)),
        }
    }

    /// From the end to the wanted end, in steps.
    fn end_error(&self) -> f64 {
        distance((self.end.0 as f64, self.end.1 as f64), self.wanted_end)
    }
}

fn commands(arguments: &Arguments, circle: &Circle) -> Vec<String> {
    let &Circle { steps, start: ArcState { x, y, d, rx, ry } } = circle;
    let &Arguments { device, speed, plane, cw, rise, .. } = arguments;
    let direction = if cw { 0 } else { -1 };
    let arc = format!("{steps},{speed},{d},{x},{y},{rx},{ry}");
    vec![
        format!("@{device}e{}", plane as u8),
        format!("@{device}f{direction}"),
        match rise {
            None => format!("@{device}y{arc}"),
            Some(rise) => format!("@{device}w{arc},{rise}"),
        },
    ]
}

/// A description of it for people.
fn comments(arguments: &Arguments, circle: &Circle, trace: &Trace) -> String {
    let (start, (x, y)) = (circle.start, trace.end);
    let (wanted_x, wanted_y) = trace.wanted_end;
    let length = |steps: f64| match arguments.steps_per_mm {
        Some(scale) => format!("{steps:.2} steps, {:.4} mm", steps / scale),
        None => format!("{steps:.2} steps"),
    };
    let mut lines = vec![
        format!(
            "end           ({x}, {y}) from the centre, ({}, {}) from the start",
            x - start.x,
            y - start.y
        ),
        format!("wanted end    ({:.2}, {:.2}) from the centre", plain(wanted_x), plain(wanted_y)),
        format!("end error     {}", length(trace.end_error())),
        format!("circle error  {} at most", length(trace.deviation)),
    ];
    if let Some(rise) = arguments.rise {
        lines.push("a helix is for the models imc-m, imc-mp and imc-s8 only".to_owned());
        if rise.unsigned_abs() > circle.steps {
            lines.push("the speed is that of the third axis, which has more steps".to_owned());
        }
    }
    if let Some((rx, ry)) = manual_directions(circle, arguments, trace.wanted_start) {
        lines.push(format!(
            "the C routine of the manual (A2) takes the wrong quadrant here, Rx {rx}, Ry {ry}: it does not \
             round the start"
        ));
    }
    if arguments.speed > 20_000 {
        lines.push("the speed is too high for the models imc4 and imc4-m".to_owned());
    }
    lines.into_iter().map(|line| format!("; {line}\n")).collect()
}

/// The directions of the C routine of the manual of 1999 (A2), where they are not those of the circle:
/// it takes the quadrant of the start before it is rounded.
fn manual_directions(
    circle: &Circle,
    arguments: &Arguments,
    (x, y): (f64, f64),
) -> Option<(i8, i8)> {
    let turn = if arguments.cw { Turn::Clockwise } else { Turn::Counterclockwise };
    let sign = |value: f64| if value == 0.0 { 0 } else { value.signum() as i64 };
    let directions = turn.directions(sign(x), sign(y))?;
    (directions != (circle.start.rx, circle.start.ry)).then_some(directions)
}

/// Without a sign where rounding leaves nothing of the number.
fn plain(value: f64) -> f64 {
    if value.abs() < 0.005 { 0.0 } else { value }
}

fn json(arguments: &Arguments, circle: &Circle, trace: &Trace, commands: &[String]) -> String {
    let ArcState { x, y, d, rx, ry } = circle.start;
    json!({
        "commands": commands,
        "steps": circle.steps,
        "speed": arguments.speed,
        "d": d,
        "start": [x, y],
        "directions": [rx, ry],
        "rise": arguments.rise,
        "end": trace.end,
        "wanted_end": trace.wanted_end,
        "end_error": trace.end_error(),
        "circle_error": trace.deviation,
    })
    .to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wanted(radius: f64, from: f64, to: f64) -> Wanted {
        let turn = if to > from { Turn::Counterclockwise } else { Turn::Clockwise };
        Wanted { radius, turn, from, sweep: (to - from).abs() }
    }

    /// Random numbers from 0 to 1, the same everywhere (splitmix64).
    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    #[test]
    fn the_end_is_the_nearest_and_the_difference_register_is_settled() {
        let mut random = Random(1);
        for case in 0..2_000 {
            let radius = 1.0 + random.next() * if case % 2 == 0 { 40.0 } else { 700.0 };
            let radius = if case % 3 == 0 { radius.round() } else { radius };
            let from = 720.0 * (random.next() - 0.5);
            let sweep = (1_000.0 * random.next()).max(120.0 / radius);
            let to = if random.next() < 0.5 { from + sweep } else { from - sweep };
            let wanted = wanted(radius, from, to);
            let Circle { steps, start } = wanted.fitted().unwrap();
            assert!(-start.x.abs() < start.d && start.d <= start.y.abs(), "{start:?}");

            // By walking, an eighth of a turn around where the end should be.
            let expected = radius * sweep / 45.0;
            let end = wanted.point(to);
            let mut state = start;
            let (mut best, mut found) = (f64::MAX, f64::MAX);
            for k in 0..=(expected + radius) as u64 + 12 {
                let off = distance((state.x as f64, state.y as f64), end);
                if (k as f64 - expected).abs() <= radius + 12.0 {
                    best = best.min(off);
                }
                if k == steps {
                    found = off;
                }
                state.step();
            }
            assert!(found <= best + 1e-9, "{found} {best}: radius {radius} from {from} to {to}");
            assert!(found < 1.5, "{found}: radius {radius} from {from} to {to}");
        }
    }

    #[test]
    fn whole_circles_close() {
        for radius in (1..80).chain([200, 12_345, 100_000]) {
            for from in [0.0, 45.0, 90.0, 180.0, 270.0, 123.4] {
                for to in [from + 360.0, from - 360.0] {
                    let circle = wanted(f64::from(radius), from, to).fitted().unwrap();
                    let radius = i64::from(radius);
                    assert_eq!(circle.steps, 8 * radius as u64, "radius {radius} from {from}");
                    let mut state = circle.start;
                    (0..circle.steps).for_each(|_| state.step());
                    assert_eq!(state, circle.start, "radius {radius} from {from}");
                }
            }
        }
    }
}
