//! What can go wrong, as problem documents.

use std::fmt::Display;

use axum::body::Body;
use axum::http::{HeaderValue, Response, StatusCode, header};
use axum::response::IntoResponse;
use serde_json::json;
use vimc4::{ConditionError, ControlError, FaultError, OrderError, RuleError};

/// A kind of problem, which a program can tell from others by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    NoSuchThing,
    WrongMethod,
    WrongRequest,
    WrongType,
    TooLarge,
    NotUnderstood,
    NotNow,
    Unmet,
    TooMany,
    NoToken,
    Foreign,
    Ended,
}

/// Every kind, with its name, its status and what it means.
pub(crate) const KINDS: [(Kind, &str, StatusCode, &str); 12] = [
    (Kind::NoSuchThing, "no-such-thing", StatusCode::NOT_FOUND, "There is nothing at this address"),
    (
        Kind::WrongMethod,
        "wrong-method",
        StatusCode::METHOD_NOT_ALLOWED,
        "This address takes another method",
    ),
    (
        Kind::WrongRequest,
        "wrong-request",
        StatusCode::BAD_REQUEST,
        "A field of the request is missing, unknown or of the wrong type",
    ),
    (
        Kind::WrongType,
        "wrong-type",
        StatusCode::UNSUPPORTED_MEDIA_TYPE,
        "The body is not said to be JSON",
    ),
    (Kind::TooLarge, "too-large", StatusCode::PAYLOAD_TOO_LARGE, "The body is too large"),
    (
        Kind::NotUnderstood,
        "not-understood",
        StatusCode::UNPROCESSABLE_ENTITY,
        "The words, the name or the value mean nothing to this controller",
    ),
    (Kind::NotNow, "not-now", StatusCode::CONFLICT, "This controller cannot do that, or not now"),
    (Kind::Unmet, "unmet", StatusCode::CONFLICT, "What was expected is not met"),
    (Kind::TooMany, "too-many", StatusCode::TOO_MANY_REQUESTS, "A limit is reached"),
    (Kind::NoToken, "no-token", StatusCode::UNAUTHORIZED, "The token is missing or wrong"),
    (Kind::Foreign, "foreign", StatusCode::FORBIDDEN, "The request comes from a page of elsewhere"),
    (Kind::Ended, "ended", StatusCode::SERVICE_UNAVAILABLE, "The controller has ended"),
];

/// What went wrong with a request: a problem document of RFC 9457, with the remedy.
#[derive(Clone, Debug)]
pub(crate) struct Problem {
    pub(crate) kind: Kind,
    detail: String,
    remedy: String,
    /// What else programs want to know of it.
    more: Option<(&'static str, serde_json::Value)>,
}

impl Problem {
    pub(crate) fn new(kind: Kind, detail: impl Display, remedy: impl Display) -> Problem {
        Problem { kind, detail: detail.to_string(), remedy: remedy.to_string(), more: None }
    }

    /// With a field for programs.
    pub(crate) fn with(self, field: &'static str, value: serde_json::Value) -> Problem {
        Problem { more: Some((field, value)), ..self }
    }

    /// The errors of the library have the form `what is wrong; what would be right`.
    fn of(kind: Kind, error: &impl Display) -> Problem {
        let text = error.to_string();
        let (detail, remedy) = text.split_once("; ").unwrap_or((&text, ""));
        Problem::new(kind, detail, remedy)
    }

    /// With this remedy, if it has none of its own. What is not met was asked for in the right way.
    pub(crate) fn or_remedy(mut self, remedy: impl FnOnce() -> String) -> Problem {
        if self.remedy.is_empty() && self.kind != Kind::Unmet {
            self.remedy = remedy();
        }
        self
    }

    fn row(&self) -> (&'static str, StatusCode, &'static str) {
        let row = KINDS.iter().find(|row| row.0 == self.kind).unwrap_or(&KINDS[0]);
        (row.1, row.2, row.3)
    }

    pub(crate) fn status(&self) -> StatusCode {
        self.row().1
    }

    /// The document.
    pub(crate) fn document(&self) -> serde_json::Value {
        let (name, status, title) = self.row();
        let mut document = json!({
            "type": format!("/v1/docs#{name}"),
            "title": title,
            "status": status.as_u16(),
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

impl IntoResponse for Problem {
    fn into_response(self) -> Response<Body> {
        let mut response = Response::new(Body::from(self.document().to_string()));
        *response.status_mut() = self.status();
        let kind = HeaderValue::from_static("application/problem+json");
        response.headers_mut().insert(header::CONTENT_TYPE, kind);
        if self.kind == Kind::NoToken {
            let bearer = HeaderValue::from_static("Bearer");
            response.headers_mut().insert(header::WWW_AUTHENTICATE, bearer);
        }
        response
    }
}

impl From<ControlError> for Problem {
    fn from(error: ControlError) -> Problem {
        let kind = match &error {
            ControlError::Ended => Kind::Ended,
            ControlError::Deed(_) => Kind::NotUnderstood,
            _ => Kind::NotNow,
        };
        Problem::of(kind, &error)
    }
}

impl From<vimc4::Error> for Problem {
    fn from(error: vimc4::Error) -> Problem {
        match error {
            vimc4::Error::Control(error) => error.into(),
            error @ vimc4::Error::Unknown { .. } => Problem::of(Kind::NoSuchThing, &error),
            error => Problem::of(Kind::NotNow, &error),
        }
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

not_understood!(
    OrderError,
    ConditionError,
    FaultError,
    RuleError,
    vimc4::Mistake,
    vimc4::MemoryError,
    vimc4::ClockError
);
