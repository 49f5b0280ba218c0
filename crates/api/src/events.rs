//! What happens, as it happens: the WebSocket.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use tokio::time::{sleep_until, timeout};
use tungstenite::error::ProtocolError;

use crate::acts::{is_kind, unknown_kind};
use crate::call::no_such;
use crate::entry;
use crate::feed::Listener;
use crate::guard::no_token;
use crate::limits::{PATIENCE, POSITIONS};
use crate::problem::{Kind, Problem};
use crate::served::{App, Position};

/// So many entries are in a message.
const BATCH: usize = 256;

/// What a client wants, in its own words.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Wish {
    token: Option<String>,
    controllers: Option<Vec<usize>>,
    kinds: Option<Vec<String>>,
    after: BTreeMap<usize, u64>,
    positions: Option<u32>,
}

/// What it gets.
struct Subscription {
    kinds: Option<Vec<String>>,
    /// How long at least between two positions.
    period: Option<Duration>,
    followed: Vec<Followed>,
}

/// A controller that it follows.
struct Followed {
    /// Its place among the controllers.
    place: usize,
    /// The number of the last entry that was sent, or passed over.
    sent: u64,
    /// What the entries were like when a position was taken last: the last number, and whether
    /// something moved.
    looked: Option<(u64, bool)>,
    /// What moment was looked at when that was told last.
    moment: u64,
    position: Option<Arc<Position>>,
}

/// Why it is over.
enum End {
    Problem(Problem),
    /// The client leaves, and is to be told that this was heard.
    Left,
    /// It has sent something that no WebSocket allows.
    Broken(CloseFrame),
    /// It is not there any more, or does not take what it is sent.
    Gone,
}

impl From<Problem> for End {
    fn from(problem: Problem) -> End {
        End::Problem(problem)
    }
}

/// Talks to a client until it leaves. `has_token` says that it has sent the token already.
pub(crate) async fn talk(mut socket: WebSocket, app: Arc<App>, has_token: bool) {
    let Ok(_room) = app.sockets.clone().try_acquire_owned() else {
        let problem = Problem::new(Kind::TooMany, "too many WebSockets are open", "close some");
        return part(socket, &problem).await;
    };
    let listener = app.bell.listen();
    match serve(&mut socket, &app, has_token, &listener).await {
        Ok(()) | Err(End::Gone) => {}
        Err(End::Left) => hang_up(socket).await,
        Err(End::Broken(frame)) => {
            let _ = timeout(PATIENCE, socket.send(Message::Close(Some(frame)))).await;
            hang_up(socket).await;
        }
        Err(End::Problem(problem)) => part(socket, &problem).await,
    }
}

/// Has what was sent last arrive, and waits until the client hangs up, too.
async fn hang_up(mut socket: WebSocket) {
    let silence = async { while let Some(Ok(_)) = socket.recv().await {} };
    let _ = timeout(PATIENCE, silence).await;
}

/// What a client is told whose messages cannot be read.
fn broken(error: axum::Error) -> End {
    use tungstenite::Error;
    let error = error.into_inner();
    let (code, reason) = match error.downcast_ref::<Error>() {
        Some(Error::Capacity(_)) => (close_code::SIZE, "a message has at most 16 KiB"),
        Some(Error::Utf8(_)) => (close_code::INVALID, "the text is no UTF-8"),
        Some(Error::Protocol(ProtocolError::ResetWithoutClosingHandshake)) => return End::Gone,
        Some(Error::Protocol(_)) => (close_code::PROTOCOL, "this is no frame of a WebSocket"),
        _ => return End::Gone,
    };
    End::Broken(CloseFrame { code, reason: reason.into() })
}

/// Says what is wrong, and leaves.
async fn part(mut socket: WebSocket, problem: &Problem) {
    let mut document = problem.document();
    document["type"] = "problem".into();
    document["kind"] = problem.document()["type"].take();
    let reason = problem.document()["title"].as_str().unwrap_or_default().to_owned();
    let frame = CloseFrame { code: close_code::POLICY, reason: reason.into() };
    let farewell = async {
        socket.send(Message::Text(document.to_string().into())).await?;
        socket.send(Message::Close(Some(frame))).await
    };
    if timeout(PATIENCE, farewell).await.is_ok_and(|sent| sent.is_ok()) {
        hang_up(socket).await;
    }
}

async fn serve(
    socket: &mut WebSocket,
    app: &App,
    has_token: bool,
    _listener: &Listener,
) -> Result<(), End> {
    let mut news = app.news.subscribe();
    let wish = timeout(PATIENCE, hear(socket)).await.map_err(|_| {
        Problem::new(
            Kind::WrongRequest,
            "nothing was asked for in time",
            "send a message such as {\"kinds\":[\"command\",\"answer\"]}, or {} for everything",
        )
    })??;
    let said = wish.token.as_deref();
    if let Some(token) = &app.token
        && !has_token
        && !said.is_some_and(|said| token.is(said))
    {
        return Err(no_token().into());
    }
    let mut subscription = subscribe(app, wish)?;
    say(socket, hello(app, &subscription)).await?;
    let mut due = Instant::now();
    loop {
        // Whatever happens from here on is looked at in the next round.
        news.mark_unchanged();
        while subscription.send_entries(socket, app).await? {}
        subscription.send_moments(socket, app).await?;
        let restless = match subscription.period {
            Some(period) if Instant::now() >= due => {
                due = Instant::now() + period;
                subscription.send_positions(socket, app).await?
            }
            Some(_) => subscription.wants_positions(app),
            None => false,
        };
        tokio::select! {
            wish = hear(socket) => {
                subscription = subscribe(app, wish?)?;
                say(socket, hello(app, &subscription)).await?;
            }
            _ = news.changed() => {}
            () = sleep_until(due.into()), if restless => {}
        }
    }
}

/// The next wish of a client.
async fn hear(socket: &mut WebSocket) -> Result<Wish, End> {
    loop {
        let text = match socket.recv().await {
            Some(Ok(Message::Text(text))) => text,
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => continue,
            Some(Ok(Message::Binary(_))) => {
                let problem = Problem::new(
                    Kind::WrongRequest,
                    "the message is no text",
                    "send JSON as text, such as {}",
                );
                return Err(problem.into());
            }
            Some(Ok(Message::Close(_))) => return Err(End::Left),
            Some(Err(error)) => return Err(broken(error)),
            None => return Err(End::Gone),
        };
        let object = serde_json::from_str::<Map<String, Value>>(&text);
        let wish = object.and_then(|object| serde_json::from_value(object.into()));
        return wish.map_err(|error| {
            Problem::new(
                Kind::WrongRequest,
                format!("the message is not understood: {error}"),
                "send an object with any of token, controllers, kinds, after and positions, such \
                 as {\"after\":{\"1\":0}}",
            )
            .into()
        });
    }
}

/// A client that does not take what it is sent is gone.
async fn say(socket: &mut WebSocket, text: String) -> Result<(), End> {
    let sent = timeout(PATIENCE, socket.send(Message::Text(text.into()))).await;
    sent.map_err(|_| End::Gone)?.map_err(|_| End::Gone)
}

fn hello(app: &App, subscription: &Subscription) -> String {
    let controllers = subscription.followed.iter().map(|followed| {
        let part = app.controllers[followed.place].feed.after(u64::MAX - 1, 0);
        json!({ "number": followed.place + 1, "first": part.first, "last": part.last })
    });
    let controllers = controllers.collect::<Vec<_>>();
    json!({ "type": "hello", "instance": app.instance, "controllers": controllers }).to_string()
}

fn subscribe(app: &App, wish: Wish) -> Result<Subscription, Problem> {
    let count = app.controllers.len();
    let numbers = wish.controllers.unwrap_or_else(|| (1..=count).collect());
    let known = |number: &usize| (1..=count).contains(number);
    let wrong = numbers.iter().chain(wish.after.keys()).find(|number| !known(number));
    if let Some(wrong) = wrong {
        return Err(no_such("controller", &wrong.to_string()));
    }
    if let Some(wrong) = wish.kinds.iter().flatten().find(|kind| !is_kind(kind)) {
        return Err(unknown_kind(wrong));
    }
    let mut places: Vec<usize> = numbers.iter().map(|number| number - 1).collect();
    places.sort_unstable();
    places.dedup();
    let followed = places.into_iter().map(|place| {
        let (last, _) = app.controllers[place].feed.state();
        // What is to come cannot have been seen.
        let sent = wish.after.get(&(place + 1)).map_or(last, |after| last.min(*after));
        Followed {
            place,
            sent,
            looked: None,
            moment: app.controllers[place].desk.edition(),
            position: None,
        }
    });
    let often = wish.positions.filter(|often| *often > 0).map(|often| often.min(POSITIONS));
    Ok(Subscription {
        kinds: wish.kinds,
        period: often.map(|often| Duration::from_secs(1) / often),
        followed: followed.collect(),
    })
}

impl Subscription {
    /// Sends what has happened, a batch of each controller. Returns whether there is more.
    async fn send_entries(&mut self, socket: &mut WebSocket, app: &App) -> Result<bool, End> {
        let mut more = false;
        for followed in &mut self.followed {
            let number = followed.place + 1;
            let part = app.controllers[followed.place].feed.after(followed.sent, BATCH);
            if followed.sent + 1 < part.first {
                let (from, to) = (followed.sent + 1, part.first - 1);
                let gap = json!({ "type": "gap", "controller": number, "from": from, "to": to });
                say(socket, gap.to_string()).await?;
                followed.sent = to;
            }
            let Some(last) = part.items.last() else { continue };
            followed.sent = last.number;
            more |= last.number < part.last;
            let wanted = part.items.iter().filter(|item| {
                let kind = entry::kind(&item.report);
                self.kinds.as_ref().is_none_or(|kinds| kinds.iter().any(|own| own == kind))
            });
            let entries: Vec<&str> = wanted.map(|item| item.json(&app.names)).collect();
            if !entries.is_empty() {
                let entries = entries.join(",");
                let text =
                    format!(r#"{{"type":"events","controller":{number},"entries":[{entries}]}}"#);
                say(socket, text).await?;
            }
        }
        Ok(more)
    }

    /// Says that another moment of the past may be looked at, or none any more.
    async fn send_moments(&mut self, socket: &mut WebSocket, app: &App) -> Result<(), End> {
        for followed in &mut self.followed {
            let edition = app.controllers[followed.place].desk.edition();
            if std::mem::replace(&mut followed.moment, edition) != edition {
                let news = json!({ "type": "history", "controller": followed.place + 1 });
                say(socket, news.to_string()).await?;
            }
        }
        Ok(())
    }

    /// Sends where the axes are now, if that is news: the latest only, however slow the client is.
    /// Returns whether something still moves.
    async fn send_positions(&mut self, socket: &mut WebSocket, app: &App) -> Result<bool, End> {
        let period = self.period.unwrap_or_default();
        for followed in &mut self.followed {
            let served = &app.controllers[followed.place];
            let state = served.feed.state();
            if followed.looked == Some(state) && !state.1 {
                continue;
            }
            // While it moves all share one look; where it has come to rest is looked at anew.
            let age = if state.1 { period.mul_f64(0.9) } else { Duration::ZERO };
            let position = served.position(age).await?;
            followed.looked = Some(state);
            if followed.position.as_ref().is_some_and(|last| !position.differs(last)) {
                continue;
            }
            let mut text = serde_json::to_value(&*position).unwrap_or_default();
            text["type"] = "position".into();
            text["controller"] = (followed.place + 1).into();
            text["moving"] = state.1.into();
            followed.position = Some(position);
            say(socket, text.to_string()).await?;
        }
        Ok(self.wants_positions(app))
    }

    /// Whether there may be another position than was sent last.
    fn wants_positions(&self, app: &App) -> bool {
        self.followed.iter().any(|followed| {
            let state = app.controllers[followed.place].feed.state();
            state.1 || followed.looked != Some(state)
        })
    }
}
