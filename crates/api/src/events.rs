//! What happens, as it happens: the WebSocket.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket, close_code};
use futures_util::SinkExt;
use serde_json::json;
use tokio::time::{sleep, sleep_until, timeout};
use tungstenite::error::ProtocolError;

use vimc4_answers::feed::Feed;
use vimc4_answers::limits::POSITIONS;
use vimc4_answers::news::{Followed, Subscription, Wish};
use vimc4_answers::problem::{Kind, Problem};

use crate::bell::Listener;
use crate::guard::no_token;
use crate::limits::{LINGER, PATIENCE};
use crate::served::App;

/// So many bytes a frame that closes has room for.
const REASON: usize = 123;

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
    let is_long = matches!(&end, Some(End::Broken(frame)) if frame.code == close_code::SIZE);
    let heard = match end {
        None | Some(End::Gone) => false,
        Some(End::Left) => true,
        Some(End::Broken(frame)) => part(&mut socket, None, frame).await,
        Some(End::Problem(problem)) => {
            let mut document = problem.document();
            document["type"] = "problem".into();
            document["kind"] = problem.document()["type"].take();
            let reason = problem.document()["title"].as_str().unwrap_or_default().to_owned();
            let frame = CloseFrame { code: close_code::POLICY, reason: reason.into() };
            part(&mut socket, Some(document.to_string()), frame).await
        }
    };
    if is_long {
        // The rest of it is not read, and closing at once would take the frame back.
        sleep(LINGER).await;
    }
    if heard {
        hang_up(socket).await;
    }
}

/// Says why it is over, if that is said, and that it is. Returns whether the client has taken it.
async fn part(socket: &mut WebSocket, why: Option<String>, frame: CloseFrame) -> bool {
    let farewell = async {
        if let Some(why) = why {
            socket.send(Message::Text(why.into())).await?;
        }
        socket.send(Message::Close(Some(frame))).await
    };
    timeout(PATIENCE, farewell).await.is_ok_and(|sent| sent.is_ok())
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
    let (code, mut reason) = match error.downcast_ref::<Error>() {
        Some(Error::Capacity(_)) => (close_code::SIZE, "a message has at most 16 KiB".to_owned()),
        Some(Error::Utf8(_)) => (close_code::INVALID, "the text is no UTF-8".to_owned()),
        Some(Error::Protocol(ProtocolError::ResetWithoutClosingHandshake)) => return End::Gone,
        Some(Error::Protocol(why)) => {
            (close_code::PROTOCOL, format!("this is no frame of a WebSocket: {why}"))
        }
        _ => return End::Gone,
    };
    while reason.len() > REASON {
        reason.pop();
    }
    End::Broken(CloseFrame { code, reason: reason.into() })
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
        return Ok(Wish::read(&text)?);
    }
}

async fn say(socket: &mut WebSocket, text: impl Into<Utf8Bytes>) -> Result<(), End> {
    within_patience(socket.send(Message::Text(text.into()))).await
}

/// A client that does not take what it is sent is gone.
async fn within_patience(taken: impl Future<Output = Result<(), axum::Error>>) -> Result<(), End> {
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
