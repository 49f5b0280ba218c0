//! What happens, as it happens: the WebSocket.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::http::{HeaderMap, header};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use futures_util::{SinkExt, StreamExt};
use hyper::upgrade::Upgraded;
use hyper_util::rt::TokioIo;
use serde_json::json;
use sha1_smol::Sha1;
use tokio::io::{AsyncWriteExt, copy, sink};
use tokio::time::{sleep_until, timeout};
use tokio_websockets::{
    CloseCode, Error, Limits, Message, Payload, ServerBuilder, WebSocketStream,
};

use vimc4_answers::feed::Feed;
use vimc4_answers::limits::POSITIONS;
use vimc4_answers::news::{Followed, Subscription, Wish};
use vimc4_answers::problem::{Kind, Problem};

use crate::bell::Listener;
use crate::guard::no_token;
use crate::limits::{MESSAGE, PATIENCE};
use crate::served::App;

/// A connection with a client.
type WebSocket = WebSocketStream<TokioIo<Upgraded>>;

/// What the key of a client is hashed with (RFC 6455, 1.3).
const KEY_SUFFIX: &[u8] = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11";

/// The reply to the key of a client that asks for a WebSocket; `None` if it does not.
pub(crate) fn accepted_key(headers: &HeaderMap) -> Option<String> {
    let has = |name, wanted: &str| {
        let values = headers.get(name)?.to_str().ok()?;
        values.split(',').find(|value| value.trim().eq_ignore_ascii_case(wanted))
    };
    has(header::CONNECTION, "upgrade")?;
    has(header::UPGRADE, "websocket")?;
    has(header::SEC_WEBSOCKET_VERSION, "13")?;
    let mut hash = Sha1::from(headers.get(header::SEC_WEBSOCKET_KEY)?.as_bytes());
    hash.update(KEY_SUFFIX);
    Some(STANDARD.encode(hash.digest().bytes()))
}

/// What a client gets, and how long at least passes between two positions.
struct Served {
    subscription: Subscription,
    period: Option<Duration>,
    /// What moment was looked at when that was told last, of each controller that it follows.
    moments: Vec<u64>,
}

/// Why it is over.
enum End {
    Problem(Problem),
    /// The client leaves, and is to be told that this was heard.
    Left,
    /// It has sent something that no WebSocket allows, or too much.
    Broken,
    /// It is not there any more, or does not take what it is sent.
    Gone,
}

impl From<Problem> for End {
    fn from(problem: Problem) -> End {
        End::Problem(problem)
    }
}

/// Talks to a client until it leaves. `has_token` says that it has sent the token already.
pub(crate) async fn talk(connection: Upgraded, app: Arc<App>, has_token: bool) {
    let limits = Limits::default().max_payload_len(Some(MESSAGE));
    let mut socket = ServerBuilder::new().limits(limits).serve(TokioIo::new(connection));
    let room = app.sockets.clone().try_acquire_owned();
    let listener = app.bell.listen();
    let end = match &room {
        Ok(_) => serve(&mut socket, &app, has_token, &listener).await.err(),
        Err(_) => {
            let problem = Problem::new(Kind::TooMany, "too many WebSockets are open", "close some");
            Some(problem.into())
        }
    };
    // Who only has to leave keeps nobody out.
    drop(room);
    let heard = match end {
        None | Some(End::Gone) => false,
        Some(End::Left) => true,
        Some(End::Broken) => {
            let why = "a message has at most 16 KiB";
            part(&mut socket, None, CloseCode::MESSAGE_TOO_BIG, why).await
        }
        Some(End::Problem(problem)) => {
            let mut document = problem.document();
            document["type"] = "problem".into();
            document["kind"] = problem.document()["type"].take();
            let reason = document["title"].as_str().unwrap_or_default();
            let text = Some(document.to_string());
            part(&mut socket, text, CloseCode::POLICY_VIOLATION, reason).await
        }
    };
    if heard {
        hang_up(socket).await;
    }
}

/// Says why it is over, if that is said, and that it is. Returns whether the client has taken it.
async fn part(socket: &mut WebSocket, why: Option<String>, code: CloseCode, reason: &str) -> bool {
    let farewell = async {
        if let Some(why) = why {
            socket.send(Message::text(why)).await?;
        }
        match socket.send(Message::close(Some(code), reason)).await {
            // A client that breaks the protocol already has its close frame.
            Err(Error::AlreadyClosed) => socket.flush().await,
            sent => sent,
        }
    };
    timeout(PATIENCE, farewell).await.is_ok_and(|sent| sent.is_ok())
}

/// Has what was sent last arrive, and waits until the client hangs up, too.
async fn hang_up(mut socket: WebSocket) {
    let silence = async {
        while let Some(Ok(_)) = socket.next().await {}
        // Closing with unread bytes would discard the last message.
        let mut connection = socket.into_inner();
        connection.shutdown().await?;
        copy(&mut connection, &mut sink()).await
    };
    let _ = timeout(PATIENCE, silence).await;
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
    let mut served = subscribe(app, wish)?;
    say(socket, served.hello(app)).await?;
    let mut due = Instant::now();
    loop {
        // Whatever happens from here on is looked at in the next round.
        news.mark_unchanged();
        while served.send_entries(socket, app).await? {}
        served.send_moments(socket, app).await?;
        let restless = match served.period {
            Some(period) if Instant::now() >= due => {
                due = Instant::now() + period;
                served.send_positions(socket, app).await?
            }
            Some(_) => served.wants_positions(app),
            None => false,
        };
        tokio::select! {
            wish = hear(socket) => {
                served = subscribe(app, wish?)?;
                say(socket, served.hello(app)).await?;
            }
            _ = news.changed() => {}
            () = sleep_until(due.into()), if restless => {}
        }
    }
}

/// The next wish of a client.
async fn hear(socket: &mut WebSocket) -> Result<Wish, End> {
    loop {
        // Who asks whether somebody is there, and takes no answers, is not heard: they would pile up.
        within_patience(socket.flush()).await?;
        let message = match socket.next().await {
            Some(Ok(message)) => message,
            Some(Err(Error::Protocol(_) | Error::PayloadTooLong { .. })) => {
                return Err(End::Broken);
            }
            Some(Err(_)) | None => return Err(End::Gone),
        };
        if message.is_close() {
            return Err(End::Left);
        } else if message.is_binary() {
            let problem = Problem::new(
                Kind::WrongRequest,
                "the message is no text",
                "send JSON as text, such as {}",
            );
            return Err(problem.into());
        } else if let Some(text) = message.as_text() {
            return Ok(Wish::read(text)?);
        }
    }
}

async fn say(socket: &mut WebSocket, text: impl Into<Payload>) -> Result<(), End> {
    within_patience(socket.send(Message::text(text))).await
}

/// A client that does not take what it is sent is gone.
async fn within_patience(taken: impl Future<Output = Result<(), Error>>) -> Result<(), End> {
    timeout(PATIENCE, taken).await.map_err(|_| End::Gone)?.map_err(|_| End::Gone)
}

fn feeds(app: &App) -> Vec<&Feed> {
    app.controllers.iter().map(|served| &*served.feed).collect()
}

fn subscribe(app: &App, wish: Wish) -> Result<Served, Problem> {
    let often = wish.positions.filter(|often| *often > 0).map(|often| often.min(POSITIONS));
    let subscription = Subscription::new(wish, &feeds(app))?;
    let edition = |followed: &Followed| app.controllers[followed.place].desk.edition();
    let moments = subscription.followed.iter().map(edition).collect();
    let period = often.map(|often| Duration::from_secs(1) / often);
    Ok(Served { subscription, period, moments })
}

impl Served {
    fn hello(&self, app: &App) -> String {
        self.subscription.hello(&app.instance, &feeds(app)).to_string()
    }

    /// Sends what has happened, a batch of each controller. Returns whether there is more.
    async fn send_entries(&mut self, socket: &mut WebSocket, app: &App) -> Result<bool, End> {
        let mut more = false;
        let (kinds, followed) = self.subscription.parts();
        for followed in followed {
            let served = &app.controllers[followed.place];
            let (texts, is_more) =
                followed.entries(kinds, &served.feed, &app.names, &mut served.messages());
            more |= is_more;
            for text in texts {
                say(socket, text).await?;
            }
        }
        Ok(more)
    }

    /// Says that another moment of the past may be looked at, or none any more.
    async fn send_moments(&mut self, socket: &mut WebSocket, app: &App) -> Result<(), End> {
        for (followed, moment) in self.subscription.followed.iter().zip(&mut self.moments) {
            let edition = app.controllers[followed.place].desk.edition();
            if std::mem::replace(moment, edition) != edition {
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
        for followed in self.subscription.parts().1 {
            let served = &app.controllers[followed.place];
            let Some(stand) = followed.looks(&served.feed) else { continue };
            // While it moves all share one look; where it has come to rest is looked at anew.
            let age = if stand.moves() { period.mul_f64(0.9) } else { Duration::ZERO };
            let position = served.position(age).await?;
            if let Some(message) = followed.position(stand, (*position).clone()) {
                say(socket, message).await?;
            }
        }
        Ok(self.wants_positions(app))
    }

    /// Whether there may be another position than was sent last.
    fn wants_positions(&self, app: &App) -> bool {
        let looks = |followed: &Followed| followed.looks(&app.controllers[followed.place].feed);
        self.subscription.followed.iter().any(|followed| looks(followed).is_some())
    }
}
