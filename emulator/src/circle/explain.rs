//! `vimc4 circle --explain`: where a command ends, and which parameters would end on its circle.

use std::io::{self, Write};

use serde_json::json;
use vimc4_device::Warning;
use vimc4_motion::{AXES, Arc, ArcState, Helix, Path, Turn};
use vimc4_picture::{Axis, Frame};

use super::arguments::{Arguments, MOST, print};
use crate::failure::Failure;
use crate::typed_options::TypedOptions;

/// A command `y` or `w`.
struct ArcCommand {
    /// Everything up to its letter, with it.
    head: String,
    steps: u64,
    speed: i64,
    start: ArcState,
    /// Steps of the third axis, for a helix.
    rise: Option<i64>,
}

pub(super) fn run(arguments: &Arguments, typed: &TypedOptions, text: &str) -> Result<(), Failure> {
    let command = ArcCommand::parse(text).map_err(|wrong| {
        Failure::usage(format!(
            "--explain {text}: {wrong}; @0y400,1500,119,-141,141,-1,-1 is a command"
        ))
    })?;
    let (first, second) = arguments.plane.axes();
    let arc = Arc::new(first, second, command.steps, command.start);
    let [cw, ccw] = [Turn::Clockwise, Turn::Counterclockwise].map(|turn| arc.off_circle(turn));
    typed.refuse_if(cw == ccw, &["cw", "ccw"], "on a command that says its sense of rotation")?;
    let off = if arguments.cw { cw } else { ccw };
    let remedy = off.as_ref().map_or(Some(command.start), |off| off.remedy);
    let (start, end) = (command.start, arc.state_at(command.steps));
    draw(arguments, &command, &arc)?;
    let ends =
        off.map_or_else(|| "ends on the circle".to_owned(), |off| Warning::from(off).to_string());
    let lines: Vec<String> = remedy.iter().map(|start| command.with(*start)).collect();
    if arguments.json {
        return print(&[json!({
            "steps": command.steps,
            "start": [start.x, start.y],
            "end": [end.x, end.y],
            "steps_off": off.map_or(0, |off| off.steps),
            "says": ends,
            "command": lines.first(),
        })
        .to_string()]);
    }
    if !lines.is_empty() {
        print(&lines)?;
    }
    let radius = ((start.x * start.x + start.y * start.y) as f64).sqrt();
    let said = format!(
        "; start         ({}, {}) from the centre, radius {radius:.2}\n\
         ; end           ({}, {}) from the centre, ({}, {}) from the start\n\
         ; {ends}\n",
        start.x,
        start.y,
        end.x,
        end.y,
        end.x - start.x,
        end.y - start.y,
    );
    // A missing reader is not a failure.
    let _ = io::stderr().write_all(said.as_bytes());
    Ok(())
}

/// Draws what the command does, around the centre, if a picture is wanted.
fn draw(arguments: &Arguments, command: &ArcCommand, arc: &Arc) -> Result<(), Failure> {
    let (first, second) = arguments.plane.axes();
    let axes = ["X", "Y", "Z"].map(Axis::in_steps);
    let title = command.with(command.start).trim_start_matches('@').to_owned();
    let Some(drawing) = arguments.pictured.begin(Frame { title, axes: axes.into() })? else {
        return Ok(());
    };
    let path = match command.rise {
        None => Path::Arc(arc.clone()),
        Some(rise) => Path::Helix(Helix::new(arc.clone(), 3 - first - second, rise)),
    };
    let mut origin = [0; AXES];
    (origin[first], origin[second]) = (command.start.x, command.start.y);
    let speed = u32::try_from(command.speed).unwrap_or(1).max(1);
    drawing.seen_from(arguments.plane.view()).finish_alone(origin, path, speed)
}

impl ArcCommand {
    /// Reads a command as it is sent or stored.
    fn parse(text: &str) -> Result<ArcCommand, String> {
        let text: String = text.split_whitespace().collect();
        let Some(at) = text.find(['y', 'w']) else {
            return Err("it is neither a circle, `y`, nor a helix, `w`".to_owned());
        };
        let (head, numbers) = text.split_at(at + 1);
        let is_head = matches!(head.as_bytes(), [b'@', b'0'..=b'9', _] | [_]);
        if !is_head {
            return Err(format!("{head} is no beginning of a command"));
        }
        let read = |number: &str| {
            let read = number.parse::<i64>().ok().filter(|n| n.unsigned_abs() <= MOST);
            read.ok_or_else(|| format!("{number:?} is not a number from -{MOST} to {MOST}"))
        };
        let numbers = numbers.split(',').map(read).collect::<Result<Vec<i64>, String>>()?;
        let (arc, rise) = match (head.as_bytes().last(), numbers.as_slice()) {
            (Some(b'y'), arc) => (arc, None),
            (_, [arc @ .., rise]) => (arc, Some(*rise)),
            (_, []) => (&[][..], None),
        };
        let &[steps, speed, d, x, y, rx, ry] = arc else {
            let right = if rise.is_some() { 8 } else { 7 };
            return Err(format!("it has {} numbers, {right} are right", numbers.len()));
        };
        let steps = u64::try_from(steps).map_err(|_| format!("{steps} steps are not possible"))?;
        let direction = |r: i64| match r {
            1 => Ok(1),
            -1 => Ok(-1),
            _ => Err(format!("Rx and Ry are 1 or -1, not {r}")),
        };
        let start = ArcState { x, y, d, rx: direction(rx)?, ry: direction(ry)? };
        Ok(ArcCommand { head: head.to_owned(), steps, speed, start, rise })
    }

    /// The command with other registers.
    fn with(&self, start: ArcState) -> String {
        let ArcCommand { head, steps, speed, rise, .. } = self;
        let ArcState { x, y, d, rx, ry } = start;
        let rise = rise.map(|rise| format!(",{rise}")).unwrap_or_default();
        format!("{head}{steps},{speed},{d},{x},{y},{rx},{ry}{rise}")
    }
}
