//! Problems as HTTP has them.

use axum::body::Body;
use axum::http::{HeaderValue, Response, StatusCode, header};
use vimc4_answers::problem::{Kind, Problem};

/// The answer to a request that was not granted.
pub(crate) fn refuse(problem: &Problem) -> Response<Body> {
    let mut response = Response::new(Body::from(problem.document().to_string()));
    *response.status_mut() =
        StatusCode::from_u16(problem.status()).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
    let kind = HeaderValue::from_static("application/problem+json");
    response.headers_mut().insert(header::CONTENT_TYPE, kind);
    if problem.kind == Kind::NoToken {
        let bearer = HeaderValue::from_static("Bearer");
        response.headers_mut().insert(header::WWW_AUTHENTICATE, bearer);
    }
    response
}

/// What the library says, as a problem.
pub(crate) fn problem(error: vimc4::Error) -> Problem {
    match error {
        vimc4::Error::Control(error) => error.into(),
        error @ vimc4::Error::Unknown { .. } => Problem::of(Kind::NoSuchThing, &error),
        error => Problem::of(Kind::NotNow, &error),
    }
}
