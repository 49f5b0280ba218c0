//! Requests of a page, and what happens at its controllers.

use std::str;

use serde_json::json;
use vimc4_answers::fields::{Content, body, image, no_such, place_of, query, right_body};
use vimc4_answers::limits::{BODY, IMAGE, POSITIONS};
use vimc4_answers::news::{Messages, Subscription, Wish};
use vimc4_answers::problem::{Kind, Problem};
use vimc4_answers::seen::Position;
use vimc4_answers::table::{ROUTES, find};

use crate::acts::RUNS;
use crate::call::{Answer, Call, Outcome};
use crate::deeds;
use crate::desk::Desk;
use crate::opened;
use crate::own;
use crate::profiles;
use crate::served::Served;
use crate::work;

/// A page hears of everything but what only coverage wants,
const ALL: &[&str] = &[
    "command",
    "ignored",
    "line",
    "answer",
    "cut-short",
    "motion",
    "switch",
    "signal",
    "port",
    "flash",
    "baud",
    "fault",
    "rule",
    "warning",
    "news",
    "missed",
];

/// and where the axes are, so many times a second.
const OFTEN: u32 = 20;

/// A recording or another file has so many bytes at most.
const FILE: usize = 64 * 1024 * 1024;

/// What a request is answered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reply {
    /// As HTTP has it.
    pub status: u16,
    /// What `body` is: JSON or text.
    pub is_json: bool,
    /// The answer, or a problem document.
    pub body: String,
}

impl Default for Desk {
    fn default() -> Desk {
        Desk::new()
    }
}

impl Desk {
    /// A desk with one controller: an IMC4 on a bench, in real time.
    #[must_use]
    pub fn new() -> Desk {
        let mut desk = Desk {
            controllers: Vec::new(),
            instance: 0,
            subscription: None,
            period: None,
            told: f64::NEG_INFINITY,
            heard: 0,
        };
        // It is built in.
        let _ = desk.answer("PUT", "/v1/controllers", r#"{"model": "imc4"}"#, 0.0);
        desk
    }

    /// Answers a request: a method of HTTP, a path with what is behind the question mark, and a body of JSON
    /// or none, at this moment.
    pub fn ask(&mut self, method: &str, path: &str, body: &str, now: f64) -> Reply {
        match self.answer(method, path, body, now) {
            Ok(Answer::Json(body)) => Reply { status: 200, is_json: true, body },
            Ok(Answer::Text(body)) => Reply { status: 200, is_json: false, body },
            Err(problem) => Reply {
                status: problem.status(),
                is_json: true,
                body: problem.document().to_string(),
            },
        }
    }

    fn answer(&mut self, method: &str, path: &str, content: &str, now: f64) -> Outcome {
        let (path, behind) = path.split_once('?').unwrap_or((path, ""));
        match (method, path) {
            ("PUT", "/v1/controllers") => {
                is_within(content, IMAGE)?;
                return self.put(own::controllers(content)?);
            }
            ("PUT", "/v1/recording") => {
                is_within(content, FILE)?;
                let (served, missing) = opened::recorded(content)?;
                self.put(vec![served])?;
                return Answer::json(&missing);
            }
            ("PUT", "/v1/events") => return self.subscribe(content),
            _ => {}
        }
        if let Some((number, what)) =
            path.strip_prefix("/v1/controllers/").and_then(|rest| rest.split_once('/'))
            && matches!(
                (method, what),
                ("GET", "deeds" | "meaning" | "quirks" | "rest") | ("POST", "work")
            )
        {
            let moment = self.heard.max(nanos(now));
            let place = place_of(number, self.controllers.len())?;
            let served = self.controllers.get_mut(place);
            let served = served.ok_or_else(|| no_such("controller", number))?;
            return match what {
                "work" => {
                    is_within(content, FILE)?;
                    work::pieces(served, content)
                }
                "rest" => work::rest(served),
                "quirks" => profiles::quirks(&served.live.model),
                "deeds" => {
                    served.catch_up(moment);
                    deeds::deeds(served)
                }
                _ => own::meaning(
                    served,
                    &decoded(behind.strip_prefix("line=").unwrap_or_default())?,
                ),
            };
        }
        let (place, names) =
            find(method, path).map_err(|others| not_there(method, path, &others))?;
        let (Some(route), Some(run)) = (ROUTES.get(place), RUNS.get(place)) else {
            return Err(not_there(method, path, &[]));
        };
        let path = names.iter().map(|(name, value)| Ok((*name, decoded(value)?)));
        let path = path.collect::<Result<Vec<_>, Problem>>()?;
        let pairs = behind.split('&').filter(|pair| !pair.is_empty()).map(|pair| {
            let (name, value) = pair.split_once('=').unwrap_or((pair, ""));
            Ok((decoded(&name.replace('+', " "))?, decoded(&value.replace('+', " "))?))
        });
        let query = query(route.query, pairs.collect::<Result<Vec<_>, Problem>>()?)?;
        is_within(content, if image(route.body).is_some() { IMAGE } else { BODY })?;
        let fields = body(route.body, Content::Json, content.as_bytes())?;
        let call = Call { moment: self.heard.max(nanos(now)), path, query, body: fields };
        let outcome = run(self, &call);
        for served in &mut self.controllers {
            served.back();
        }
        outcome.map_err(|problem| problem.or_remedy(|| right_body(route.body)))
    }

    /// Other controllers take the place of those that there are, and are followed from their beginning.
    fn put(&mut self, controllers: Vec<Served>) -> Outcome {
        self.controllers = controllers;
        self.instance += 1;
        self.follow(Wish::from_the_beginning(self.controllers.len(), ALL, OFTEN))?;
        Answer::json(&self.about())
    }

    // --- what happens ---

    /// A client listens from now on, as it says in the words of the WebSocket's first message.
    fn subscribe(&mut self, content: &str) -> Outcome {
        is_within(content, BODY)?;
        self.follow(Wish::read(if content.is_empty() { "{}" } else { content })?)
    }

    fn follow(&mut self, wish: Wish) -> Outcome {
        let feeds: Vec<_> = self.controllers.iter().map(|served| &*served.live.feed).collect();
        let often = wish.positions.filter(|often| *often > 0);
        self.period = often.map(|often| 1_000.0 / f64::from(often.min(POSITIONS)));
        let subscription = Subscription::new(wish, &feeds)?;
        let hello = subscription.hello(&self.instance(), &feeds);
        (self.subscription, self.told) = (Some(subscription), f64::NEG_INFINITY);
        Answer::json(&hello)
    }

    /// Lets time pass up to this moment, and says what has happened since it was asked last: the messages of
    /// the WebSocket as a list of JSON. What the controllers have sent is among them, each character a
    /// byte.
    pub fn hear(&mut self, now: f64) -> String {
        let mut messages = Vec::new();
        self.heard = self.heard.max(nanos(now));
        for (number, served) in (1..).zip(&mut self.controllers) {
            served.live.begin(self.heard);
            served.catch_up(self.heard);
            for (at, bytes) in served.live.sent.drain(..) {
                let text: String = bytes.iter().map(|byte| char::from(*byte)).collect();
                let sent = json!({ "type": "sent", "controller": number, "at": at, "send": text });
                messages.push(sent.to_string());
            }
        }
        if let Some(subscription) = &mut self.subscription {
            let is_due = self.period.is_some_and(|period| now - self.told >= period * 0.9);
            if is_due {
                self.told = now;
            }
            let (kinds, followed) = subscription.parts();
            for followed in followed {
                let Some(served) = self.controllers.get(followed.place) else { continue };
                let feed = &served.live.feed;
                loop {
                    let (news, is_more) =
                        followed.entries(kinds, feed, &served.live.names, &mut Messages::default());
                    messages.extend::<Vec<String>>(news);
                    if !is_more {
                        break;
                    }
                }
                if is_due
                    && served.looks.is_none()
                    && let Some(stand) = followed.looks(feed)
                {
                    let position = Position::of(&served.view());
                    messages.extend(followed.position(stand, position));
                }
            }
        }
        format!("[{}]", messages.join(","))
    }
}

fn is_within(content: &str, most: usize) -> Result<(), Problem> {
    match content.len() <= most {
        true => Ok(()),
        false => {
            let detail = format!("the body has more than {most} bytes");
            Err(Problem::new(Kind::TooLarge, detail, "send less"))
        }
    }
}

fn not_there(method: &str, path: &str, others: &[&str]) -> Problem {
    if others.is_empty() {
        let detail = format!("there is nothing at {path}");
        return Problem::new(Kind::NoSuchThing, detail, "/v1/docs lists all that there is");
    }
    let remedy = format!("it takes {}", others.join(", "));
    Problem::new(Kind::WrongMethod, format!("{path} takes no {method}"), remedy)
}

/// A part of an address, where `%41` is a byte.
fn decoded(text: &str) -> Result<String, Problem> {
    let wrong = || {
        let remedy = "write it as %XX of UTF-8";
        Problem::new(Kind::WrongRequest, "the address is no UTF-8", remedy)
    };
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let Some((first, after)) = rest.split_first() {
        rest = after;
        if *first != b'%' {
            bytes.push(*first);
            continue;
        }
        let digits = after.get(..2).and_then(|digits| std::str::from_utf8(digits).ok());
        let byte = digits.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        bytes.push(byte.ok_or_else(wrong)?);
        rest = after.get(2..).unwrap_or_default();
    }
    String::from_utf8(bytes).map_err(|_| wrong())
}

/// A moment of the page in nanoseconds; what is no moment is the beginning.
fn nanos(ms: f64) -> u64 {
    // What is too large or no number is cut to what there is.
    (ms * 1e6).round() as u64
}
