//! What happens at controllers, as it happens.

use std::io::{self, Write};

use futures_util::{SinkExt, StreamExt};
use serde_json::{Map, Value, json};
use tokio::net::TcpStream;
use tokio::runtime;
use tokio::time::timeout;
use tokio_websockets::{ClientBuilder, Error, Message, WebSocketStream};

use super::client::{Client, PATIENCE, Trouble, part};
use crate::failure::Failure;
use crate::output;
use crate::text;

/// What of it is wanted.
pub(crate) struct Wanted<'a> {
    /// The number of the only controller.
    pub(crate) controller: Option<usize>,
    pub(crate) kinds: &'a [String],
    /// Begin behind the entry of this number, and not now.
    pub(crate) after: Option<u64>,
    /// End after so many entries.
    pub(crate) count: Option<u64>,
    pub(crate) is_json: bool,
}

/// Prints it until there are enough of them, or the server ends.
pub(crate) fn watch(client: &Client, wanted: &Wanted<'_>) -> Result<(), Trouble> {
    let numbers: Vec<usize> = match wanted.controller {
        Some(number) => vec![number],
        None => {
            let all = client.get("/controllers", &[])?;
            let all = all.as_array().into_iter().flatten();
            all.filter_map(|one| usize::try_from(one["number"].as_u64()?).ok()).collect()
        }
    };
    let mut wish = json!({ "controllers": numbers });
    if !wanted.kinds.is_empty() {
        wish["kinds"] = wanted.kinds.into();
    }
    if let Some(after) = wanted.after {
        let after = numbers.iter().map(|number| (number.to_string(), after.into()));
        wish["after"] = Value::Object(after.collect::<Map<_, _>>());
    }
    if let Some(token) = client.token() {
        wish["token"] = token.into();
    }
    let runtime = runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(|error| client.lost(&error))?;
    let lost = |error: Error| Failure::midway(client.lost(&error).text());
    let mut socket = runtime.block_on(connect(client))?;
    runtime.block_on(socket.send(Message::text(wish.to_string()))).map_err(lost)?;
    let mut left = wanted.count;
    loop {
        let message = match runtime.block_on(socket.next()) {
            Some(Ok(message)) => message,
            // The program that serves them has ended, and with it what happens there.
            None | Some(Err(Error::AlreadyClosed | Error::Protocol(_) | Error::Io(_))) => {
                return Ok(());
            }
            Some(Err(error)) => return Err(lost(error).into()),
        };
        let Some(message) = message.as_text() else { continue };
        let message: Value = serde_json::from_str(message).unwrap_or_default();
        let several = numbers.len() > 1;
        match part(&message, "type") {
            "problem" => {
                let mut problem = message;
                // What a kind of problem is called goes by another name here.
                let kind = problem.as_object_mut().and_then(|problem| problem.remove("kind"));
                problem["type"] = kind.unwrap_or_default();
                return Err(Trouble::Refused(problem));
            }
            "gap" => {
                let (from, to) = (&message["from"], &message["to"]);
                let printed = match wanted.is_json {
                    true => format!("{message}\n"),
                    false => format!("entries {from} to {to} are no longer kept\n"),
                };
                if !is_read(&printed)? {
                    return Ok(());
                }
            }
            "events" => {
                let number = message["controller"].as_u64().unwrap_or_default();
                for entry in message["entries"].as_array().into_iter().flatten() {
                    let printed = match wanted.is_json {
                        true => Some(with_controller(entry, number)),
                        false => line(entry, several.then_some(number), !wanted.kinds.is_empty()),
                    };
                    let Some(printed) = printed else { continue };
                    left = left.map(|left| left.saturating_sub(1));
                    if !is_read(&printed)? || left == Some(0) {
                        return Ok(());
                    }
                }
            }
            _ => {}
        }
    }
}

/// Prints it. Returns whether somebody still reads.
fn is_read(text: &str) -> Result<bool, Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        written => output::written(written).map(|()| true),
    }
}

async fn connect(client: &Client) -> Result<WebSocketStream<TcpStream>, Trouble> {
    let there = client.authority();
    let there = if there.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok()) {
        there.to_owned()
    } else {
        format!("{there}:80")
    };
    let stream = timeout(PATIENCE, TcpStream::connect(there)).await;
    let stream =
        stream.unwrap_or_else(|late| Err(late.into())).map_err(|error| client.lost(&error))?;
    let url = format!("ws://{}/v1/events", client.authority());
    let builder = ClientBuilder::new().uri(&url).map_err(|error| client.lost(&error))?;
    let connected = builder.connect_on(stream).await;
    connected.map(|(socket, _)| socket).map_err(|error| client.lost(&error))
}

/// An entry as a line of JSON, which says where it happened.
fn with_controller(entry: &Value, number: u64) -> String {
    let mut entry = entry.clone();
    entry["controller"] = number.into();
    format!("{entry}\n")
}

/// An entry as the log has it. What the log leaves out is shown if it was asked for by its kind.
fn line(entry: &Value, controller: Option<u64>, is_asked_for: bool) -> Option<String> {
    /// What every entry has.
    const KNOWN: [&str; 5] = ["number", "at", "kind", "text", "command"];
    let at = entry["at"].as_u64().unwrap_or_default();
    let text = match entry["text"].as_str() {
        Some(text) => text.to_owned(),
        None if is_asked_for => {
            let fields = entry.as_object().into_iter().flatten();
            let fields = fields.filter(|(name, _)| !KNOWN.contains(&name.as_str()));
            let fields: String = fields.map(|(name, value)| format!(" {name} {value}")).collect();
            format!("{}{fields}", part(entry, "kind"))
        }
        None => return None,
    };
    let place = controller.map_or(String::new(), |number| format!("{number}: "));
    let (seconds, rest) = (at / 1_000_000_000, at % 1_000_000_000 / 1_000);
    Some(format!("{place}{seconds:>6}.{rest:06} s  {}\n", text::shown(&text)))
}
