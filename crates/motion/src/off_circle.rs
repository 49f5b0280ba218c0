//! Whether the registers of an arc are those of a circle, and which would be.

use crate::{Arc, ArcState, CircleFit, Turn};

/// The circle engine stays within three steps of the radius on which it starts, if its registers are
/// those of a circle: the start is a rounded point of the circle, and the engine is never two steps
/// beside it.
const NEAR: f64 = 3.0;

/// An arc that ends beside its circle, the one through its start around the centre; or one that has
/// the length of whole turns and does not end at its start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OffCircle {
    /// From its end to the circle, or to its start, in steps, rounded.
    pub steps: u64,
    /// How many whole turns long it is, if it should end at its start.
    pub turns: Option<u64>,
    /// The registers with which the engine stays on the circle, and comes back to its start after whole
    /// turns. `None` if the arc starts at its centre.
    pub remedy: Option<ArcState>,
    /// Whether the directions are those of the quadrant that ends where the arc starts. Routines that
    /// look at the signs of an unrounded start give them for a start within half a step of an axis.
    pub quadrant_before: bool,
}

impl Arc {
    /// Whether it ends beside its circle, or after whole turns beside its start. `turn` is the sense of rotation that is meant where its
    /// directions are those of neither.
    ///
    /// ```
    /// use vimc4_motion::{Arc, ArcState, Turn};
    ///
    /// let start = ArcState { x: -141, y: 141, d: 119, rx: -1, ry: 1 };
    /// let off = Arc::new(0, 1, 400, start).off_circle(Turn::Counterclockwise).expect("Ry is wrong");
    /// assert_eq!(off.remedy, Some(ArcState { ry: -1, ..start }));
    /// ```
    #[must_use]
    pub fn off_circle(&self, turn: Turn) -> Option<OffCircle> {
        let (start, end) = (self.state_at(0), self.state_at(u64::MAX));
        let turn = start.turn().unwrap_or(turn);
        let turns = start.whole_turns(self.length(), turn);
        let radius = |x: i64, y: i64| ((x * x + y * y) as f64).sqrt();
        let beside = match turns {
            Some(_) => radius(end.x - start.x, end.y - start.y),
            None => (radius(end.x, end.y) - radius(start.x, start.y)).abs(),
        };
        if beside <= NEAR {
            return None;
        }
        let comes_back = |remedy: &ArcState| {
            let end = Arc::new(0, 1, self.length(), *remedy).state_at(u64::MAX);
            (end.x, end.y) == (start.x, start.y)
        };
        let remedy = start.on_circle(turn).filter(|remedy| turns.is_none() || comes_back(remedy));
        Some(OffCircle {
            steps: beside.round() as u64,
            turns: turns.map(|(turns, _)| turns),
            remedy: remedy.or(turns.map(|(_, closed)| closed)),
            quadrant_before: start.runs_off_its_axis(),
        })
    }
}

impl OffCircle {
    /// Which parameters would end on the circle, for people.
    #[must_use]
    pub fn remedy_in_words(&self) -> String {
        let Some(ArcState { d, rx, ry, .. }) = self.remedy else {
            return "it starts at its centre, where no circle does".to_owned();
        };
        let place = if self.turns.is_some() { "there" } else { "on it" };
        let remedy = format!("D {d}, Rx {rx}, Ry {ry} would end {place}");
        if self.quadrant_before {
            return format!(
                "{remedy}; the C routine of the manual (A2) takes the wrong quadrant for a start \
                 within half a step of an axis"
            );
        }
        remedy
    }
}

impl ArcState {
    /// The sense of rotation that the directions have: where the place is on an axis of coordinates,
    /// that of the step across it.
    fn turn(&self) -> Option<Turn> {
        [Turn::Clockwise, Turn::Counterclockwise].into_iter().find(|turn| {
            turn.directions(self.x, self.y).is_some_and(|(rx, ry)| {
                (self.y == 0 || rx == self.rx) && (self.x == 0 || ry == self.ry)
            })
        })
    }

    /// Whether it is on an axis of coordinates and runs outwards along it.
    fn runs_off_its_axis(&self) -> bool {
        let outwards = |place: i64, direction: i8| place * i64::from(direction) > 0;
        match (self.x, self.y) {
            (0, y) => outwards(y, self.ry),
            (x, 0) => outwards(x, self.rx),
            _ => false,
        }
    }

    /// How many whole turns so many steps are, on a circle with a radius of whole steps that the place
    /// belongs to, and the registers that come back to it.
    fn whole_turns(&self, steps: u64, turn: Turn) -> Option<(u64, ArcState)> {
        let least = (self.x * self.x + self.y * self.y).isqrt();
        [least, least + 1].into_iter().find_map(|radius| {
            let fit = CircleFit::new(self.x, self.y, radius * radius, turn)?;
            let turns = steps / fit.steps_per_turn();
            let is_whole = turns > 0 && steps.is_multiple_of(fit.steps_per_turn());
            (is_whole && fit.steps_per_turn() == 8 * radius as u64).then(|| (turns, fit.start()))
        })
    }

    /// The same place with the registers of a circle, as many as possible as they are.
    fn on_circle(&self, turn: Turn) -> Option<ArcState> {
        let (x, y) = (self.x, self.y);
        let fit = CircleFit::new(x, y, x * x + y * y, turn)?.start();
        let settled = -x.abs() < self.d && self.d <= y.abs();
        Some(ArcState { d: if settled { self.d } else { fit.d }, ..fit })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const TURNS: [Turn; 2] = [Turn::Clockwise, Turn::Counterclockwise];

    fn off(steps: u64, start: ArcState, turn: Turn) -> Option<OffCircle> {
        Arc::new(0, 1, steps, start).off_circle(turn)
    }

    #[test]
    fn the_quadrant_before_an_axis_is_told_from_the_one_behind_it() {
        // Counterclockwise from the positive second axis, in the first quadrant instead of the second.
        let start = ArcState { x: 0, y: 400, d: 199, rx: -1, ry: 1 };
        let found = off(800, start, Turn::Clockwise).unwrap();
        assert!(found.quadrant_before);
        let remedy = found.remedy.unwrap();
        assert_eq!(remedy, ArcState { ry: -1, ..start });
        assert_eq!(off(800, remedy, Turn::Clockwise), None);
    }

    #[test]
    fn a_centre_is_on_no_circle() {
        let start = ArcState { x: 0, y: 0, d: 0, rx: 1, ry: 1 };
        let found = off(10, start, Turn::Clockwise).unwrap();
        assert_eq!((found.steps, found.remedy), (7, None));
    }

    #[test]
    fn whole_turns_end_at_their_start() {
        // Ten turns of radius 800; and one of radius 200 from 135 degrees, where the circle of these
        // registers is one step narrower.
        for (steps, d, place, right) in
            [(64_000, -800, (800, 0), -400), (1_600, -100, (-141, 141), 119)]
        {
            let (x, y) = place;
            let (rx, ry) = Turn::Counterclockwise.directions(x, y).unwrap();
            let start = ArcState { x, y, d, rx, ry };
            let found = off(steps, start, Turn::Counterclockwise).unwrap();
            assert_eq!(found.turns, Some(steps / (8 * if x == 800 { 800 } else { 200 })));
            let remedy = found.remedy.unwrap();
            assert_eq!(remedy, ArcState { d: right, ..start });
            assert_eq!(off(steps, remedy, Turn::Counterclockwise), None);
            assert_eq!(off(steps - 40, start, Turn::Counterclockwise), None);
        }
    }

    proptest! {
        /// The registers of a circle end on it, after any number of steps.
        #[test]
        fn a_circle_is_never_off(
            radius in 1.0..3_000.0_f64, angle in 0.0..360.0_f64, steps in 0..40_000_u64, turn in 0..2_usize,
        ) {
            let (sin, cos) = angle.to_radians().sin_cos();
            let (x, y) = ((radius * cos).round() as i64, (radius * sin).round() as i64);
            let square = (radius * radius).round() as i64;
            if let Some(fit) = CircleFit::new(x, y, square, TURNS[turn]) {
                // The place may belong to a circle of another radius too, whose whole turns these are.
                let beside = off(steps, fit.start(), TURNS[turn]).filter(|off| off.turns.is_none());
                prop_assert_eq!(beside, None);
            }
        }

        /// Whatever the registers are, those of the remedy end on the circle.
        #[test]
        fn a_remedy_ends_on_the_circle(
            x in -3_000..3_000_i64, y in -3_000..3_000_i64, d in -9_000..9_000_i64,
            steps in 1..30_000_u64, signs in 0..8_usize,
        ) {
            let sign = |bit: usize| if signs & bit == 0 { 1 } else { -1 };
            let start = ArcState { x, y, d, rx: sign(1), ry: sign(2) };
            let turn = TURNS[signs >> 2];
            if let Some(OffCircle { remedy: Some(remedy), .. }) = off(steps, start, turn) {
                prop_assert_eq!((remedy.x, remedy.y), (x, y));
                prop_assert_eq!(off(steps, remedy, turn), None);
            }
        }
    }
}
