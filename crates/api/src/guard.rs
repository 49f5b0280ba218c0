//! Who may ask: no page of another origin, and nobody without the token where there is one.
//!
//! A browser sends whatever any page wants to any address, this computer's own included. It says
//! where the page is from (`Origin`, `Sec-Fetch-Site`) and which name it has looked up (`Host`).
//! A page whose name is made to mean 127.0.0.1 after it was loaded (DNS rebinding) has that name in
//! `Host`; so without a token only names that nobody else can give away are accepted.

use std::net::IpAddr;

use axum::http::{HeaderMap, Uri, header};
use vimc4_answers::problem::{Kind, Problem};

/// The word that a client proves with that it may drive the machines.
#[derive(Clone)]
pub struct Token(String);

impl std::fmt::Debug for Token {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token")
    }
}

/// The least length of a token.
const SHORTEST: usize = 16;

impl Token {
    /// The token of this text, without the white space around it.
    ///
    /// # Errors
    ///
    /// If it is easily guessed, or cannot be sent in a header: what would be right.
    pub fn new(text: &str) -> Result<Token, String> {
        let text = text.trim();
        if text.len() < SHORTEST || !text.bytes().all(|byte| byte.is_ascii_graphic()) {
            return Err(format!(
                "a token has at least {SHORTEST} letters, digits or signs in one line, without blanks; \
                 `openssl rand -hex 16` makes one"
            ));
        }
        Ok(Token(text.to_owned()))
    }

    /// Whether it is this, in a time that does not tell how much of it was right.
    pub(crate) fn is(&self, other: &str) -> bool {
        let (own, other) = (self.0.as_bytes(), other.as_bytes());
        let differing = own.iter().zip(other).fold(0, |differing, (a, b)| differing | (a ^ b));
        own.len() == other.len() && differing == 0
    }
}

/// Refuses what comes from a page of elsewhere.
pub(crate) fn is_from_here(headers: &HeaderMap, uri: &Uri, has_token: bool) -> Result<(), Problem> {
    let text = |name: header::HeaderName| {
        let mut values = headers.get_all(name).iter();
        match (values.next(), values.next()) {
            (None, _) => Ok(None),
            (Some(value), None) => value.to_str().map(Some).map_err(|_| ()),
            (Some(_), Some(_)) => Err(()),
        }
    };
    let foreign = |detail: String, remedy: &str| Problem::new(Kind::Foreign, detail, remedy);
    let Ok(Some(host)) = text(header::HOST) else {
        return Err(foreign("there is no one Host".to_owned(), "send the header Host, once"));
    };
    // What an absolute address of the request says has to be the same.
    let named = uri.authority().map_or(host, |authority| authority.as_str());
    if named != host || !(has_token && is_name(host) || is_own(host)) {
        return Err(foreign(
            format!("`{named}` is no name that this server answers to"),
            "use its address in numbers, or localhost; or give the server a token",
        ));
    }
    let own = format!("http://{host}");
    match text(header::ORIGIN) {
        Ok(None) => {}
        Ok(Some(origin)) if origin.eq_ignore_ascii_case(&own) => {}
        _ => {
            return Err(foreign(
                "the request comes from a page of another origin".to_owned(),
                "no other page may drive the machines: use the panel of this server, or a program",
            ));
        }
    }
    let site = headers.get("sec-fetch-site").map(|site| site.as_bytes());
    let is_page = headers.get("sec-fetch-mode").is_some_and(|mode| mode == "navigate");
    match site {
        None | Some(b"same-origin" | b"none") => Ok(()),
        // A link leads here from anywhere: that shows a page, which does nothing by itself.
        Some(_) if is_page && !uri.path().starts_with("/v1") => Ok(()),
        Some(_) => Err(foreign(
            "the request comes from a page of another site".to_owned(),
            "no other page may drive the machines: use the panel of this server, or a program",
        )),
    }
}

/// Whether it means this server whatever a name server says: an address, or `localhost`.
fn is_own(host: &str) -> bool {
    let Some(name) = without_port(host) else { return false };
    let address = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
    name.eq_ignore_ascii_case("localhost") || address.parse::<IpAddr>().is_ok()
}

/// Whether it may be a name at all.
fn is_name(host: &str) -> bool {
    let is_letter = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
    without_port(host).is_some_and(|name| !name.is_empty() && name.chars().all(is_letter))
}

fn without_port(host: &str) -> Option<&str> {
    let colon = match host.rfind(']') {
        Some(end) => host[end..].find(':').map(|at| end + at),
        None => host.find(':'),
    };
    let Some(colon) = colon else { return Some(host) };
    host[colon + 1..].parse::<u16>().ok().map(|_| &host[..colon])
}

/// Refuses a request without the right token.
pub(crate) fn has_token(headers: &HeaderMap, token: &Token) -> Result<(), Problem> {
    let said = headers.get(header::AUTHORIZATION).and_then(|value| value.to_str().ok());
    let said = said.and_then(|value| value.split_once(' '));
    match said {
        Some((scheme, said)) if scheme.eq_ignore_ascii_case("bearer") && token.is(said.trim()) => {
            Ok(())
        }
        _ => Err(no_token()),
    }
}

pub(crate) fn no_token() -> Problem {
    Problem::new(
        Kind::NoToken,
        "the token is missing or wrong",
        "send the header `Authorization: Bearer TOKEN`, or on a WebSocket `token` in the first \
         message; it is the one that `serve` was given",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(headers: &[(&'static str, &str)], uri: &str, has_token: bool) -> bool {
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.append(*name, value.parse().unwrap());
        }
        is_from_here(&map, &uri.parse().unwrap(), has_token).is_ok()
    }

    #[test]
    fn only_names_that_cannot_be_given_away_are_answered_to() {
        for (host, is_ok) in [
            ("127.0.0.1:8080", true),
            ("127.0.0.1", true),
            ("localhost:1", true),
            ("LOCALHOST", true),
            ("[::1]:80", true),
            ("192.168.1.5:80", true),
            ("rebind.example:8080", false),
            ("127.0.0.1.example", false),
            ("localhost.", false),
            ("127.0.0.1:x", false),
            ("localhost:80:80", false),
            ("", false),
        ] {
            assert_eq!(asked(&[("host", host)], "/v1", false), is_ok, "{host}");
        }
        assert!(asked(&[("host", "lab.example:80")], "/v1", true));
        assert!(!asked(&[("host", "a/b")], "/v1", true));
        assert!(!asked(&[], "/v1", true));
        assert!(!asked(&[("host", "localhost"), ("host", "localhost")], "/v1", false));
        assert!(!asked(&[("host", "localhost")], "http://rebind.example/v1", false));
    }

    #[test]
    fn no_other_page_gets_through() {
        let host = ("host", "localhost:80");
        for (origin, is_ok) in [
            ("http://localhost:80", true),
            ("http://localhost:81", false),
            ("http://127.0.0.1:80", false),
            ("https://localhost:80", false),
            ("null", false),
            ("http://localhost:80.example", false),
        ] {
            assert_eq!(asked(&[host, ("origin", origin)], "/v1", false), is_ok, "{origin}");
        }
        for (site, mode, path, is_ok) in [
            ("same-origin", "cors", "/v1", true),
            ("none", "navigate", "/v1", true),
            ("cross-site", "no-cors", "/v1", false),
            ("same-site", "no-cors", "/v1", false),
            ("cross-site", "navigate", "/v1", false),
            ("cross-site", "navigate", "/", true),
            ("cross-site", "no-cors", "/", false),
        ] {
            let headers = [host, ("sec-fetch-site", site), ("sec-fetch-mode", mode)];
            assert_eq!(asked(&headers, path, false), is_ok, "{site} {mode} {path}");
        }
    }

    #[test]
    fn a_token_is_that_and_nothing_near_it() {
        assert!(Token::new("short").is_err() && Token::new("with a blank in it all").is_err());
        let token = Token::new(" 0123456789abcdef\n").unwrap();
        assert_eq!(format!("{token:?}"), "Token");
        for (value, is_ok) in [
            ("Bearer 0123456789abcdef", true),
            ("bearer 0123456789abcdef", true),
            ("Bearer 0123456789abcde", false),
            ("Bearer 0123456789abcdef0", false),
            ("Basic 0123456789abcdef", false),
            ("0123456789abcdef", false),
            ("", false),
        ] {
            let headers = HeaderMap::from_iter([(header::AUTHORIZATION, value.parse().unwrap())]);
            assert_eq!(has_token(&headers, &token).is_ok(), is_ok, "{value}");
        }
    }
}
