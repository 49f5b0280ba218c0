//! What is known of where the axes of a controller are: from what it has answered, and from its
//! counters before and now.

use vimc4_catalogue::Family;
use vimc4_device::Travel;

/// Why the counters of a controller do not tell where the axes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Doubt {
    /// A reference run was stopped, so that no place counts.
    FalseReference,
    /// An emergency stop or a loss of power may have set them to 0.
    Reset,
    /// At a limit switch axes halt without a ramp, and one that was there before has no reference.
    LimitSwitch,
}

/// What counters say of those before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Seen {
    /// As much as counters can.
    Enough,
    /// They are what they were, and a controller that was just switched on counts so too.
    LikeNew,
}

/// What is known of where the axes are.
pub(super) struct Whereabouts {
    family: Family,
    /// The counters before the first motion.
    began: Option<Vec<i64>>,
    /// The counters since the axes rest, if it was asked for them.
    rest: Option<Vec<i64>>,
    /// Whether something has moved.
    moved: bool,
    doubt: Option<Doubt>,
}

impl Whereabouts {
    /// Nothing was asked yet.
    pub(super) fn of(family: Family) -> Whereabouts {
        Whereabouts { family, began: None, rest: None, moved: false, doubt: None }
    }

    /// Why the counters are not believed, if they are not.
    pub(super) fn doubt(&self) -> Option<Doubt> {
        self.doubt
    }

    /// They are not believed any more. What is known of the reference is worse than anything else.
    pub(super) fn distrust(&mut self, why: Doubt) {
        match why {
            Doubt::FalseReference => self.doubt = Some(why),
            _ => drop(self.doubt.get_or_insert(why)),
        }
    }

    /// The counters before the first motion, if the controller has told.
    pub(super) fn began(&self) -> Option<&[i64]> {
        self.began.as_deref()
    }

    /// The first motion is about to begin where these are the counters.
    pub(super) fn begin(&mut self, places: Vec<i64>) {
        self.began = Some(places);
    }

    /// From here on the counters may be others.
    pub(super) fn go(&mut self) {
        self.rest = None;
    }

    /// What was answered to something that does this.
    pub(super) fn hear(&mut self, travel: Travel, answer: &[u8]) {
        let family = self.family;
        if family.resets_counters(answer) || self.moved && family.has_forgotten(answer) {
            self.distrust(Doubt::Reset);
        } else if family.distrusts_counters(answer) {
            self.distrust(Doubt::LimitSwitch);
        }
        // What is refused has moved nothing, unless an axis has met its limit switch.
        let is_motion = !matches!(travel, Travel::Question | Travel::None);
        self.moved |= is_motion && matches!(answer.first(), Some(b'0' | b'F' | b'2'));
    }

    /// The controller does not answer where its axes are.
    pub(super) fn hear_nothing(&mut self) {
        if self.moved {
            self.distrust(Doubt::Reset);
        }
    }

    /// The axes rest, and these are the counters. A controller that has lost its power, or met an
    /// emergency stop, counts anew, and tells of fewer axes.
    pub(super) fn see(&mut self, places: &[i64]) -> Seen {
        let stayed = self.rest.as_ref().is_none_or(|rest| rest == places);
        let told = self.began.as_ref().is_none_or(|began| places.len() >= began.len());
        if !(stayed && told) {
            self.distrust(Doubt::Reset);
        }
        let is_new = self.rest.is_some() && places.iter().all(|place| *place == 0);
        let seen = match stayed && told && is_new {
            true => Seen::LikeNew,
            false => Seen::Enough,
        };
        self.rest = Some(places.to_vec());
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved() -> Whereabouts {
        let family = vimc4::model("imc4").expect("a built-in model").family();
        let mut axes = Whereabouts::of(family);
        axes.begin(vec![0, 0, 0]);
        axes.hear(Travel::Relative, b"F");
        axes
    }

    #[test]
    fn counters_are_believed_as_long_as_they_stay() {
        let mut axes = moved();
        assert_eq!(axes.see(&[5, 0, 0]), Seen::Enough);
        assert_eq!(axes.see(&[5, 0, 0]), Seen::Enough);
        assert_eq!(axes.doubt(), None);
        // What goes on has other ones, and comes by 0.
        axes.go();
        assert_eq!(axes.see(&[0, 0, 0]), Seen::Enough);
        assert_eq!(axes.see(&[0, 0, 0]), Seen::LikeNew);
        assert_eq!(axes.doubt(), None);
        axes.see(&[0, 0, 1]);
        assert_eq!(axes.doubt(), Some(Doubt::Reset));
        let mut axes = moved();
        axes.see(&[0, 0]);
        assert_eq!(axes.doubt(), Some(Doubt::Reset), "an axis is missing");
    }

    #[test]
    fn answers_say_what_is_not_known_any_more() {
        for (answer, doubt) in [
            (b"0", None),
            (b"D", None),
            (b"2", Some(Doubt::LimitSwitch)),
            (b"9", Some(Doubt::Reset)),
            (b"4", Some(Doubt::Reset)),
            (b"R", Some(Doubt::Reset)),
        ] {
            let mut axes = moved();
            axes.hear(Travel::Relative, answer);
            assert_eq!(axes.doubt(), doubt, "{}", answer.escape_ascii());
            // The first reason stays, but for a reference that is none.
            axes.distrust(Doubt::LimitSwitch);
            assert_eq!(axes.doubt(), doubt.or(Some(Doubt::LimitSwitch)));
            axes.distrust(Doubt::FalseReference);
            assert_eq!(axes.doubt(), Some(Doubt::FalseReference));
        }
        // Nothing has moved yet that could have been forgotten.
        let mut axes = Whereabouts::of(moved().family);
        axes.hear(Travel::Relative, b"4");
        axes.hear_nothing();
        assert_eq!(axes.doubt(), None);
    }
}
