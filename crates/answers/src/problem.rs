//! What can go wrong, as problem documents.

use std::fmt::Display;

use serde_json::json;
use vimc4_device::{DeedError, MemoryError};
use vimc4_journal::expect::Mistake;
use vimc4_language::SyntaxError;
use vimc4_session::{ClockError, ControlError};

/// A kind of problem, which a program can tell from others by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// There is nothing of that name.
    NoSuchThing,
    /// The address takes another method.
    WrongMethod,
    /// A field is missing, unknown or of the wrong type.
    WrongRequest,
    /// The body is no JSON.
    WrongType,
    /// The body is too large.
    TooLarge,
    /// The request was not whole in time.
    TooSlow,
    /// Words, a name or a value mean nothing.
    NotUnderstood,
    /// It cannot be done, or not now.
    NotNow,
    /// What was expected is not met.
    Unmet,
    /// A limit is reached.
    TooMany,
    /// There is no right token.
    NoToken,
    /// A page of elsewhere asks.
    Foreign,
    /// The controller has ended.
    Ended,
}

/// Every kind, with its name, its status and what it means.
pub const KINDS: [(Kind, &str, u16, &str); 13] = [
    (Kind::NoSuchThing, "no-such-thing", 404, "There is nothing at this address or of this name"),
    (Kind::WrongMethod, "wrong-method", 405, "This address takes another method"),
    (
        Kind::WrongRequest,
        "wrong-request",
        400,
        "A field of the request is missing, unknown or of the wrong type",
    ),
    (Kind::WrongType, "wrong-type", 415, "The body is not said to be JSON"),
    (Kind::TooLarge, "too-large", 413, "The body is too large"),
    (Kind::TooSlow, "too-slow", 408, "The request did not arrive in time"),
    (
        Kind::NotUnderstood,
        "not-understood",
        422,
        "The words, the name or the value mean nothing to this controller",
    ),
    (Kind::NotNow, "not-now", 409, "This controller cannot do that, or not now"),
    (Kind::Unmet, "unmet", 409, "What was expected is not met"),
    (Kind::TooMany, "too-many", 429, "A limit is reached"),
    (Kind::NoToken, "no-token", 401, "The token is missing or wrong"),
    (Kind::Foreign, "foreign", 403, "The request comes from a page of elsewhere"),
    (Kind::Ended, "ended", 503, "The controller has ended"),
];

pub use vimc4_device::parted;

/// What went wrong with a request: a problem document of RFC 9457, with the remedy.
#[derive(Clone, Debug)]
pub struct Problem {
    /// What kind of problem it is.
    pub kind: Kind,
    detail: String,
    remedy: String,
    /// What else programs want to know of it.
    more: Option<(&'static str, serde_json::Value)>,
}

impl Problem {
    /// What was wrong, and what would be right.
    #[must_use]
    pub fn new(kind: Kind, detail: impl Display, remedy: impl Display) -> Problem {
        Problem { kind, detail: detail.to_string(), remedy: remedy.to_string(), more: None }
    }

    /// With a field for programs.
    #[must_use]
    pub fn with(self, field: &'static str, value: serde_json::Value) -> Problem {
        Problem { more: Some((field, value)), ..self }
    }

    /// An error of the library, with its remedy.
    #[must_use]
    pub fn of(kind: Kind, error: &impl Display) -> Problem {
        Problem::said(kind, &error.to_string(), "")
    }

    /// What is wrong in a text, and what would be right; `otherwise` if that does not say it.
    #[must_use]
    pub fn said(kind: Kind, text: &str, otherwise: &str) -> Problem {
        match parted(text) {
            Some((detail, remedy)) => Problem::new(kind, detail, remedy),
            None => Problem::new(kind, text, otherwise),
        }
    }

    /// Why time could not be let go on.
    #[must_use]
    pub fn of_going_on(error: ControlError) -> Problem {
        match error {
            ControlError::NotPaused => Problem::new(
                Kind::NotNow,
                "time is not paused",
                "there is nothing to resume; POST to clock/pause before it, if time is to stand still",
            ),
            error => error.into(),
        }
    }

    /// With this remedy, if it has none of its own and that may be what was wrong.
    #[must_use]
    pub fn or_remedy(mut self, remedy: impl FnOnce() -> String) -> Problem {
        if self.remedy.is_empty() && self.kind == Kind::NotUnderstood {
            self.remedy = remedy();
        }
        self
    }

    fn row(&self) -> (&'static str, u16, &'static str) {
        let row = KINDS.iter().find(|row| row.0 == self.kind).unwrap_or(&KINDS[0]);
        (row.1, row.2, row.3)
    }

    /// The status that HTTP has for it.
    #[must_use]
    pub fn status(&self) -> u16 {
        self.row().1
    }

    /// The document.
    #[must_use]
    pub fn document(&self) -> serde_json::Value {
        let (name, status, title) = self.row();
        let mut document = json!({
            "type": format!("/v1/docs#{name}"),
            "title": title,
            "status": status,
            "detail": self.detail,
        });
        if !self.remedy.is_empty() {
            document["remedy"] = self.remedy.clone().into();
        }
        if let Some((field, value)) = &self.more {
            document[field] = value.clone();
        }
        document
    }
}

impl From<ControlError> for Problem {
    fn from(error: ControlError) -> Problem {
        let kind = match &error {
            ControlError::Ended => Kind::Ended,
            ControlError::Deed(DeedError::NoSignal { .. }) => Kind::NoSuchThing,
            ControlError::Deed(_) => Kind::NotUnderstood,
            _ => Kind::NotNow,
        };
        match error {
            ControlError::Paused => Problem::new(
                kind,
                "time is paused",
                "POST to clock/resume, or to clock/step for the next thing only",
            ),
            ControlError::NotPaused => {
                Problem::new(kind, "time is not paused", "POST to clock/pause before it")
            }
            ControlError::Cancelled { at } => Problem::new(
                kind,
                format!("given up at {at}: what would have happened later has not"),
                "ask again, which goes on from there",
            ),
            error => Problem::of(kind, &error),
        }
    }
}

impl From<SyntaxError> for Problem {
    fn from(error: SyntaxError) -> Problem {
        let (problem, remedy) = error.problem_and_remedy();
        // A client cannot type `help`.
        let remedy = remedy.replace("type help for the list", "GET the orders, which lists them");
        Problem::new(Kind::NotUnderstood, problem, remedy)
    }
}

impl From<Mistake> for Problem {
    fn from(error: Mistake) -> Problem {
        let (problem, remedy) = error.problem_and_remedy();
        Problem::new(Kind::NotUnderstood, problem, remedy)
    }
}

macro_rules! not_understood {
    ($($error:ty),+) => {
        $(impl From<$error> for Problem {
            fn from(error: $error) -> Problem {
                Problem::of(Kind::NotUnderstood, &error)
            }
        })+
    };
}

not_understood!(MemoryError, ClockError);

#[cfg(test)]
mod tests {
    use vimc4_device::Time;

    use super::*;

    #[test]
    fn who_asked_for_what_cannot_be_now_is_told_what_to_do() {
        let at = Time::from_nanos(5_000_000_000);
        for (error, remedy) in [
            (ControlError::Cancelled { at }, "ask again"),
            (ControlError::Paused, "POST to clock/resume"),
            (ControlError::NotPaused, "POST to clock/pause"),
        ] {
            let document = Problem::from(error).document();
            let told = document["remedy"].as_str();
            assert!(told.is_some_and(|told| told.starts_with(remedy)), "{document}");
        }
    }
}
