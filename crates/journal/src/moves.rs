//! Motions, from their beginning to their end.

use serde::{Deserialize, Serialize};
use vimc4_device::{CommandNumber, Event, Motion, Point, Time};

use crate::Entry;
use crate::picture::Course;

/// A motion: where it led, and the box that it stayed in.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Move {
    /// The command that it belongs to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<CommandNumber>,
    /// When it began.
    pub began: Time,
    /// When it ended; `None` if it has not yet: the rest is then as it will be.
    pub ended: Option<Time>,
    /// Where the counters were at its beginning, steps.
    pub from: Point,
    /// Where they were at its end.
    pub to: Point,
    /// The smallest that each was.
    pub low: Point,
    /// The largest that each was.
    pub high: Point,
    /// How many steps of the step clock it had.
    pub steps: u64,
}

impl Move {
    pub(crate) fn new(
        command: Option<CommandNumber>,
        course: &Course,
        ended: Option<(Time, u64)>,
    ) -> Move {
        let Course { began, origin, segment } = course;
        let steps = ended.map_or_else(|| segment.profile.steps(), |(_, steps)| steps);
        let (low, high) = segment.path.extent(steps);
        let from = |offset: Point| std::array::from_fn(|axis| origin[axis] + offset[axis]);
        Move {
            command,
            began: *began,
            ended: ended.map(|(at, _)| at),
            from: *origin,
            to: from(segment.path.at(steps)),
            low: from(low),
            high: from(high),
            steps,
        }
    }
}

/// The motions in a row of entries.
pub(crate) fn moves<'a>(
    running: Option<&Course>,
    entries: impl Iterator<Item = &'a Entry>,
) -> Vec<Move> {
    let mut moves = Vec::new();
    let mut under_way = running.map(|course| (None, course.clone()));
    for entry in entries {
        match entry.event() {
            Some(Event::Motion(Motion::Begins { origin, segment })) => {
                let (origin, segment) = (*origin, segment.clone());
                under_way = Some((entry.command, Course { began: entry.at, origin, segment }));
            }
            Some(Event::Motion(Motion::Changes { segment })) => {
                if let Some((_, course)) = &mut under_way {
                    course.segment.clone_from(segment);
                }
            }
            Some(Event::Motion(Motion::Ends { steps })) => {
                if let Some((command, course)) = under_way.take() {
                    moves.push(Move::new(command, &course, Some((entry.at, *steps))));
                }
            }
            _ => {}
        }
    }
    moves.extend(under_way.map(|(command, course)| Move::new(command, &course, None)));
    moves
}
