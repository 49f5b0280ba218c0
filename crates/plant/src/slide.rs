//! What happens between a motor and a switch: play, the ends of the mechanics, contacts with
//! hysteresis.
//!
//! A [`Slide`] is an axis at an instant, a [`Gear`] holds its constant properties. Along a
//! [run](vimc4_motion::Run), in which the motor keeps its direction, everything that follows it is
//! monotone, so one addition takes an axis from the beginning of a run to its end.

use std::borrow::Cow;

use vimc4_device::Point;
use vimc4_motion::Path;

use crate::End;

/// An axis at an instant: where its carriage is, and what remains of its way there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Slide {
    pub(crate) place: i64,
    /// How much of the backlash is below: the steps that the motor makes downwards before the
    /// carriage follows.
    pub(crate) play: i64,
    /// Which switches are still held by their hysteresis: the negative one, the positive one.
    pub(crate) kept: [bool; 2],
}

impl Slide {
    /// Where the carriage is, steps of the machine.
    #[must_use]
    pub fn place(&self) -> i64 {
        self.place
    }
}

/// The mechanics of an axis as far as motions are concerned, including its faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Gear {
    pub(crate) backlash: i64,
    /// By how much further back the negative and the positive switch release.
    pub(crate) hysteresis: [i64; 2],
    pub(crate) lowest: Option<i64>,
    pub(crate) highest: Option<i64>,
    /// Where the negative and the positive switch are pressed.
    pub(crate) switches: [Option<i64>; 2],
}

/// The place of an end in an array.
pub(crate) fn index(end: End) -> usize {
    usize::from(end == End::Positive)
}

impl Gear {
    /// The motor makes a way in one direction.
    pub(crate) fn drive(&self, slide: &mut Slide, way: i64) {
        let wanted = slide.play.min(self.backlash) + way;
        let push = if wanted < 0 { wanted } else { (wanted - self.backlash).max(0) };
        slide.play = wanted - push;
        self.carry(slide, push);
    }

    /// The carriage goes a way in one direction, as far as the mechanics let it.
    pub(crate) fn carry(&self, slide: &mut Slide, way: i64) {
        let at = slide.place;
        slide.place = match way {
            1.. => (at + way).min(self.highest.map_or(i64::MAX, |highest| highest.max(at))),
            _ => (at + way).max(self.lowest.map_or(i64::MIN, |lowest| lowest.min(at))),
        };
        for end in [End::Negative, End::Positive] {
            // A switch that was just pressed stays pressed up to the end of its hysteresis.
            let was = slide.kept[index(end)] || self.is_on(end, at);
            slide.kept[index(end)] =
                was && !self.is_on(end, slide.place) && self.keeps(end, slide.place);
        }
    }

    /// Whether the carriage is where it presses the switch of an end.
    fn is_on(&self, end: End, place: i64) -> bool {
        match (end, self.switches[index(end)]) {
            (End::Negative, Some(at)) => place <= at,
            (End::Positive, Some(at)) => place >= at,
            (_, None) => false,
        }
    }

    /// Whether a switch that was pressed is still pressed here.
    fn keeps(&self, end: End, place: i64) -> bool {
        match end {
            End::Negative => self.is_on(end, place - self.hysteresis[0]),
            End::Positive => self.is_on(end, place + self.hysteresis[1]),
        }
    }

    /// Whether the carriage presses the switch of an end.
    pub(crate) fn presses(&self, end: End, slide: &Slide) -> bool {
        self.is_on(end, slide.place) || slide.kept[index(end)] && self.keeps(end, slide.place)
    }

    /// The places at which a switch can change: where each is pressed, and where it releases.
    pub(crate) fn edges(&self) -> impl Iterator<Item = i64> + Clone + use<> {
        let [below, above] = self.switches;
        let [further_up, further_down] = self.hysteresis;
        let below = below.map(|at| [at, at + further_up + 1]);
        let above = above.map(|at| [at - further_down - 1, at]);
        [below, above].into_iter().flatten().flatten()
    }

    /// How far the motor has to go, in one direction, for the carriage to reach another place.
    pub(crate) fn way_to(&self, slide: &Slide, place: i64) -> i64 {
        let play = slide.play.min(self.backlash);
        match place - slide.place {
            0 => 0,
            up @ 1.. => up + self.backlash - play,
            down => down - play,
        }
    }

    /// Whether the mechanics let the carriage reach a place.
    pub(crate) fn reaches(&self, place: i64) -> bool {
        self.lowest.is_none_or(|lowest| place >= lowest)
            && self.highest.is_none_or(|highest| place <= highest)
    }

    /// Whether the mechanics end anywhere.
    pub(crate) fn is_bounded(&self) -> bool {
        self.lowest.is_some() || self.highest.is_some()
    }

    /// Whether the carriage moves exactly as the motor on a way that leads this far.
    pub(crate) fn follows(&self, slide: &Slide, low: i64, high: i64) -> bool {
        let (low, high) = (slide.place + low, slide.place + high);
        self.backlash == 0
            && slide.play == 0
            && self.hysteresis == [0; 2]
            && self.reaches(low)
            && self.reaches(high)
    }
}

/// A path of the counters, and the direction in which each axis follows its counter.
#[derive(Clone, Copy, Debug)]
pub struct Way<'a> {
    /// The path.
    pub path: &'a Path,
    /// +1 or -1 for each axis: the direction of the carriage for a positive step of the counter.
    pub signs: &'a Point,
}

/// The part of a way between two steps.
pub(crate) struct Rest<'a> {
    pub(crate) path: Cow<'a, Path>,
    pub(crate) steps: u64,
}

impl<'a> Way<'a> {
    /// What is left after `walked` clock steps, up to step `steps`.
    pub(crate) fn rest(&self, walked: u64, steps: u64) -> Rest<'a> {
        let path = match walked {
            0 => Cow::Borrowed(self.path),
            walked => Cow::Owned(self.path.after(walked)),
        };
        Rest { path, steps: steps.saturating_sub(walked) }
    }

    /// The lowest and the highest offset of a carriage, from those of the counters.
    pub(crate) fn between(&self, axis: usize, (low, high): (Point, Point)) -> (i64, i64) {
        let (a, b) = (self.signs[axis] * low[axis], self.signs[axis] * high[axis]);
        (a.min(b), a.max(b))
    }
}
