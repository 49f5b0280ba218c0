//! Drilling cycles.

use crate::language::Value;

/// What DRILLDEF has set: heights in thousandths of a µm, up positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Definition {
    /// Which cycle.
    pub(super) cycle: Cycle,
    /// The height of the reference plane above the work-piece zero.
    pub(super) plane: Value,
    /// The depth below the reference plane.
    pub(super) depth: Value,
    /// How long the drill stays at the bottom, in µs.
    pub(super) dwell: Value,
    /// The speed of drilling.
    pub(super) speed: Value,
    /// How deep the first step is.
    pub(super) first: Value,
    /// How deep the second is.
    pub(super) other: Value,
    /// How much shallower each following one is than the one before.
    pub(super) decrease: Value,
    /// How far the drill is lifted, or how far above the last depth it slows down.
    pub(super) retreat: Value,
    /// The height it is lifted to between steps, above the reference plane.
    pub(super) lift: Value,
    /// The height it goes to before and after, above the reference plane.
    pub(super) safety: Value,
}

/// Which drilling cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cycle {
    /// C1: down at once.
    Simple,
    /// C2: out of the hole after each step.
    Peck,
    /// C3: back a little after each step.
    ChipBreak,
}

impl Default for Definition {
    /// What holds before the first DRILLDEF (manual, table of DRILLDEF).
    fn default() -> Definition {
        Definition {
            cycle: Cycle::Simple,
            plane: Value::ZERO,
            depth: Value::ZERO,
            dwell: Value::ZERO,
            speed: Value::whole(1_000),
            first: Value::ZERO,
            other: Value::ZERO,
            decrease: Value::ZERO,
            retreat: Value::ZERO,
            lift: Value::ZERO,
            safety: Value::ZERO,
        }
    }
}

/// A part of drilling a hole. Heights count from the reference plane, up positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Leg {
    /// To a height at the rapid speed.
    Rapid(Value),
    /// To where the hole is, at the rapid speed.
    Across,
    /// To a height at the speed of drilling.
    Feed(Value),
    /// Stay there, µs.
    Dwell(Value),
}

/// The legs of one hole, one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Legs {
    definition: Definition,
    /// The least depth of a step, in thousandths of a µm like everything here.
    least: i64,
    /// How deep the hole is by now.
    depth: i64,
    /// How deep the next step is.
    step: i64,
    /// How deep the one after it is.
    after: i64,
    next: Next,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Next {
    Safety,
    Across,
    Lift,
    Feed,
    Back,
    Down,
    Dwell,
    Out,
    Nothing,
}

impl Definition {
    /// Whether it is made in steps.
    fn has_steps(&self) -> bool {
        self.cycle != Cycle::Simple && (self.first > Value::ZERO || self.other > Value::ZERO)
    }

    /// Whether the cycle makes steps, and nothing says how deep they are.
    pub(super) fn lacks_steps(&self) -> bool {
        self.cycle != Cycle::Simple && !self.has_steps()
    }

    /// Whether there are steps behind the first, and nothing says how deep they are.
    pub(super) fn lacks_other_steps(&self) -> bool {
        self.has_steps() && self.other <= Value::ZERO && self.first < self.depth
    }

    /// Whether L, down to which the drill goes at the rapid speed, is inside the work-piece.
    pub(super) fn lifts_into_work(&self) -> bool {
        let bottom = Value::thousandths(-self.depth.in_thousandths());
        self.lift < bottom.max(Value::ZERO)
    }

    /// How deep the first step is.
    fn first_step(&self) -> i64 {
        match (self.has_steps(), self.first > Value::ZERO) {
            (false, _) => self.depth.in_thousandths(),
            (true, true) => self.first.in_thousandths(),
            (true, false) => self.other.in_thousandths(),
        }
    }

    /// The legs of a hole that is begun at a height. No step is less deep than `least`, a step of
    /// the axis.
    pub(super) fn legs(&self, least: Value, from: Value) -> Legs {
        let other = self.other.in_thousandths();
        // Without F the first step is O already, and the second one is shallower.
        let after =
            if self.first > Value::ZERO { other } else { other - self.decrease.in_thousandths() };
        Legs {
            definition: *self,
            least: least.in_thousandths().max(1),
            depth: 0,
            step: self.first_step(),
            after,
            // S is the height after a hole; before one it only keeps the drill clear of the
            // work-piece.
            next: if from < self.safety { Next::Safety } else { Next::Across },
        }
    }

    /// The lowest and the highest height that the drill comes to.
    pub(super) fn extent(&self) -> (Value, Value) {
        let bottom = -self.depth.in_thousandths();
        let mut heights =
            [bottom, self.lift.in_thousandths(), self.safety.in_thousandths(), bottom];
        if self.cycle == Cycle::ChipBreak && self.has_steps() {
            heights[3] = self.retreat.in_thousandths() - self.first_step();
        }
        let lowest = heights.into_iter().min().unwrap_or_default();
        let highest = heights.into_iter().max().unwrap_or_default();
        (Value::thousandths(lowest), Value::thousandths(highest))
    }
}

impl Iterator for Legs {
    type Item = Leg;

    fn next(&mut self) -> Option<Leg> {
        let definition = &self.definition;
        let (leg, next) = match self.next {
            Next::Safety => (Leg::Rapid(definition.safety), Next::Across),
            Next::Across => (Leg::Across, Next::Lift),
            Next::Lift => (Leg::Rapid(definition.lift), Next::Feed),
            Next::Feed => self.feed(),
            Next::Back if definition.cycle == Cycle::Peck => {
                (Leg::Rapid(definition.lift), Next::Down)
            }
            Next::Back => (Leg::Rapid(self.retreated()), Next::Feed),
            // It slows down above the last depth, but not above where it starts from.
            Next::Down => (Leg::Rapid(self.retreated().min(definition.lift)), Next::Feed),
            Next::Dwell => (Leg::Dwell(definition.dwell), Next::Out),
            Next::Out => (Leg::Rapid(definition.safety), Next::Nothing),
            Next::Nothing => return None,
        };
        self.next = next;
        Some(leg)
    }
}

impl Legs {
    /// One step deeper, and what comes after it.
    fn feed(&mut self) -> (Leg, Next) {
        let bottom = self.definition.depth.in_thousandths();
        self.depth = (self.depth + self.step.max(self.least)).min(bottom);
        self.step = self.after;
        self.after = self.after.saturating_sub(self.definition.decrease.in_thousandths());
        let next = match (self.depth < bottom, self.definition.dwell > Value::ZERO) {
            (true, _) => Next::Back,
            (false, true) => Next::Dwell,
            (false, false) => Next::Out,
        };
        (Leg::Feed(Value::thousandths(-self.depth)), next)
    }

    /// The height above the last depth at which the next step begins.
    fn retreated(&self) -> Value {
        Value::thousandths(self.definition.retreat.in_thousandths() - self.depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Below everything.
    const LOW: Value = Value::whole(-1_000_000);

    /// The legs as text: `r` and `f` with heights in µm, `x` across, `t` with ms.
    fn legs(definition: Definition) -> String {
        let height = |way: &str, value: Value| format!("{way}{value}");
        let text = definition.legs(Value::whole(10), LOW).map(|leg| match leg {
            Leg::Rapid(to) => height("r", to),
            Leg::Feed(to) => height("f", to),
            Leg::Dwell(time) => height("t", time),
            Leg::Across => "x".to_owned(),
        });
        text.collect::<Vec<_>>().join(" ")
    }

    /// The example of the manual.
    fn example(cycle: Cycle) -> Definition {
        Definition {
            cycle,
            depth: Value::whole(20_000),
            dwell: Value::whole(1_000),
            first: Value::whole(7_000),
            other: Value::whole(5_000),
            decrease: Value::whole(1_000),
            retreat: Value::whole(1_000),
            lift: Value::whole(1_000),
            safety: Value::whole(3_000),
            ..Definition::default()
        }
    }

    #[test]
    fn the_cycles_of_the_manual() {
        assert_eq!(legs(example(Cycle::Simple)), "r3000 x r1000 f-20000 t1000 r3000");
        assert_eq!(
            legs(example(Cycle::Peck)),
            "r3000 x r1000 f-7000 r1000 r-6000 f-12000 r1000 r-11000 f-16000 r1000 r-15000 f-19000 \
             r1000 r-18000 f-20000 t1000 r3000"
        );
        assert_eq!(
            legs(example(Cycle::ChipBreak)),
            "r3000 x r1000 f-7000 r-6000 f-12000 r-11000 f-16000 r-15000 f-19000 r-18000 f-20000 \
             t1000 r3000"
        );
    }

    #[test]
    fn steps_never_end_before_the_bottom() {
        let shrinking = Definition {
            depth: Value::whole(100),
            first: Value::whole(30),
            other: Value::whole(20),
            decrease: Value::whole(15),
            ..example(Cycle::ChipBreak)
        };
        // 30, 20, then no less than a step of 10.
        let depths: Vec<_> = shrinking
            .legs(Value::whole(10), LOW)
            .filter_map(|leg| if let Leg::Feed(to) = leg { Some(to) } else { None })
            .collect();
        assert_eq!(depths, [-30, -50, -60, -70, -80, -90, -100].map(Value::whole));
    }

    #[test]
    fn without_f_the_steps_begin_with_o() {
        let definition = Definition { first: Value::ZERO, ..example(Cycle::ChipBreak) };
        assert!(legs(definition).contains("f-5000 r-4000 f-9000"));
        let at_once = Definition { other: Value::ZERO, ..definition };
        assert!(at_once.lacks_steps());
        assert_eq!(legs(at_once), "r3000 x r1000 f-20000 t1000 r3000");
        assert!(!Definition::default().lacks_steps());
    }

    #[test]
    fn no_leg_leaves_the_extent() {
        for cycle in [Cycle::Simple, Cycle::Peck, Cycle::ChipBreak] {
            for (retreat, lift) in [(1_000, 1_000), (9_000, 1_000), (0, -500), (50_000, 2_000)] {
                let definition = Definition {
                    retreat: Value::whole(retreat),
                    lift: Value::whole(lift),
                    ..example(cycle)
                };
                let (lowest, highest) = definition.extent();
                let mut heights =
                    definition.legs(Value::whole(10), LOW).filter_map(|leg| match leg {
                        Leg::Rapid(to) | Leg::Feed(to) => Some(to),
                        _ => None,
                    });
                assert!(
                    heights.all(|height| (lowest..=highest).contains(&height)),
                    "{definition:?}"
                );
            }
        }
    }
}
