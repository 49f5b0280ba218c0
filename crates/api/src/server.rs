//! The server: it listens, lets in who may, and answers.

use std::io;
use std::net::{SocketAddr, TcpListener as Bound};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::extract::{FromRequestParts, Query, RawPathParams, Request, State};
use axum::http::{self, HeaderMap, HeaderValue, Method, Response, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::routing::{MethodFilter, get, on};
use axum::serve::Listener;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper::upgrade::OnUpgrade;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use thiserror::Error;
use tokio::net::TcpListener;
use tokio::runtime;
use tokio::sync::{Notify, Semaphore};
use tokio::time::timeout;
use vimc4::Emulator;
use vimc4_answers::fields::{Content, body, image, query, right_body};
use vimc4_answers::limits::{BODY, IMAGE};
use vimc4_answers::problem::{Kind, Problem};
use vimc4_answers::table::{ROUTES, Route, find};

use crate::call::{Answer, Call, Coming};
use crate::debugger::Open;
use crate::document;
use crate::events;
use crate::files::FILES;
use crate::guard::{Token, has_token, is_from_here};
use crate::limits::{CONNECTIONS, PATIENCE};
use crate::refusal::refuse;
use crate::served::App;
use crate::table::RUNS;

/// How long things that happen are collected before those who watch are told.
const ROUND: Duration = Duration::from_millis(20);

/// A server that answers until the program ends.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    quit: Arc<Notify>,
}

/// Why there is no server.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServerError {
    /// Others could drive the machines.
    #[error(
        "{0} is open to everybody who reaches this computer; set VIMC4_HTTP_TOKEN or give a file \
         with --http-token, or listen at 127.0.0.1"
    )]
    Open(SocketAddr),
    /// The address is taken, or is not of this computer.
    #[error("cannot listen at {address}: {source}; choose another port, or 0 for a free one")]
    Listen {
        /// The address.
        address: String,
        /// What the operating system says.
        source: io::Error,
    },
    /// The system provides no thread or no event queue.
    #[error("cannot start the API: {0}; the limit of threads or open files may be too low")]
    Start(io::Error),
    /// A controller has ended.
    #[error(transparent)]
    Controller(#[from] vimc4::Error),
}

/// An address at which the server will listen.
#[derive(Debug)]
pub struct Place {
    listener: Bound,
    address: SocketAddr,
    token: Option<Token>,
}

impl Place {
    /// Takes an address, such as `127.0.0.1:8080`; port 0 is a free one.
    ///
    /// # Errors
    ///
    /// If it is not to be had, or other computers reach it and there is no token.
    pub fn take(address: &str, token: Option<Token>) -> Result<Place, ServerError> {
        let failed = |source| ServerError::Listen { address: address.to_owned(), source };
        let listener = Bound::bind(address).map_err(failed)?;
        let taken = listener.local_addr().map_err(failed)?;
        if token.is_none() && !taken.ip().to_canonical().is_loopback() {
            return Err(ServerError::Open(taken));
        }
        listener.set_nonblocking(true).map_err(failed)?;
        Ok(Place { listener, address: taken, token })
    }
}

impl Server {
    /// Serves these controllers, in a thread of its own. `debugger` opens one on any of them.
    ///
    /// # Errors
    ///
    /// If there is no thread to be had, or a controller has ended.
    pub async fn start(
        place: Place,
        emulators: &[Emulator],
        debugger: Option<Open>,
    ) -> Result<Server, ServerError> {
        let Place { listener, address, token } = place;
        let quit = Arc::new(Notify::new());
        let app = Arc::new(App::of(emulators, token, debugger, Arc::clone(&quit)).await?);
        let runtime = runtime::Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(ServerError::Start)?;
        let serve = move || {
            runtime.block_on(async {
                let Ok(listener) = TcpListener::from_std(listener) else { return };
                tokio::spawn(tell(Arc::clone(&app)));
                receive(listener, router(app)).await;
            });
        };
        let thread = thread::Builder::new().name("api".to_owned()).spawn(serve);
        thread.map_err(ServerError::Start)?;
        Ok(Server { address, quit })
    }

    /// Where it listens, with the port that was picked.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Where people look at it.
    #[must_use]
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Resolves when somebody has ordered the end.
    pub async fn told_to_quit(&self) {
        self.quit.notified().await;
    }
}

/// Tells those who watch that something has happened, not for each single thing.
async fn tell(app: Arc<App>) {
    loop {
        app.bell.rung().await;
        app.news.send_replace(());
        tokio::time::sleep(ROUND).await;
    }
}

// --- connections ---

/// Serves whoever comes, so many at a time. A client that is silent before its request is whole makes room
/// for others.
async fn receive(mut listener: TcpListener, service: Router) {
    let room = Arc::new(Semaphore::new(CONNECTIONS));
    loop {
        // It is never closed.
        let Ok(place) = Arc::clone(&room).acquire_owned().await else { return };
        let (stream, _) = Listener::accept(&mut listener).await;
        // Small answers are not to wait for more.
        let _ = stream.set_nodelay(true);
        let service = TowerToHyperService::new(service.clone());
        let service = service_fn(move |request| service.call(without_double_slash(request)));
        tokio::spawn(async move {
            let _place = place;
            let mut connection = http1::Builder::new();
            connection.timer(TokioTimer::new()).header_read_timeout(PATIENCE);
            let connection = connection.serve_connection(TokioIo::new(stream), service);
            // A client that leaves in the middle is no mistake of ours.
            let _ = connection.with_upgrades().await;
        });
    }
}

/// Reads `//v1` as `/v1`: a client that joins the printed address and a path writes it.
fn without_double_slash<B>(mut request: http::Request<B>) -> http::Request<B> {
    let uri = request.uri();
    let target = uri.path_and_query().map(http::uri::PathAndQuery::as_str).unwrap_or_default();
    if target.starts_with("//") {
        let mut parts = uri.clone().into_parts();
        parts.path_and_query = format!("/{}", target.trim_start_matches('/')).parse().ok();
        if let Ok(uri) = http::Uri::from_parts(parts) {
            *request.uri_mut() = uri;
        }
    }
    request
}

// --- requests ---

fn router(app: Arc<App>) -> Router {
    let mut router = Router::new();
    for (route, run) in ROUTES.iter().zip(RUNS) {
        let method = route.method.parse::<Method>().map(MethodFilter::try_from);
        let Ok(Ok(filter)) = method else { continue };
        let answer =
            move |State(app): State<Arc<App>>, request: Request| answer(app, route, *run, request);
        router = router.route(route.path, on(filter, answer));
    }
    let openapi = document::openapi().to_string();
    let page = document::page();
    let html = "text/html; charset=utf-8";
    router = router
        .route("/v1/openapi.json", get(async || fixed("application/json", openapi)))
        .route("/v1/docs", get(async || fixed(html, page)))
        .route("/v1/events", get(watch));
    for (path, kind, bytes) in FILES {
        router = router.route(path, get(async || fixed(kind, *bytes)));
    }
    router
        .method_not_allowed_fallback(wrong_method)
        .fallback(nothing)
        .layer(from_fn_with_state(Arc::clone(&app), let_in))
        .with_state(app)
}

/// What anybody may read.
fn is_public(path: &str) -> bool {
    !path.starts_with("/v1") || path == "/v1/docs" || path == "/v1/openapi.json"
}

/// Lets in who may, and tells browsers what the answer may be used for.
async fn let_in(State(app): State<Arc<App>>, request: Request, next: Next) -> Response<Body> {
    let mut response = match refusal(&app, &request) {
        Some(problem) => refuse(&problem),
        None => next.run(request).await,
    };
    for (name, value) in [
        ("x-content-type-options", "nosniff"),
        ("referrer-policy", "no-referrer"),
        ("cross-origin-resource-policy", "same-origin"),
        ("cross-origin-opener-policy", "same-origin"),
        (
            "content-security-policy",
            "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; \
             connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        ),
        ("cache-control", "no-store"),
    ] {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

fn refusal(app: &App, request: &Request) -> Option<Problem> {
    let (headers, uri) = (request.headers(), request.uri());
    if !app.rate.passes(Instant::now()) {
        let remedy = "wait a moment; for what happens as it happens there is /v1/events";
        return Some(Problem::new(Kind::TooMany, "too many requests in a second", remedy));
    }
    if let Err(problem) = is_from_here(headers, uri, app.token.is_some()) {
        return Some(problem);
    }
    match &app.token {
        // A browser cannot send the header with a WebSocket: the first message has it.
        Some(token) if !is_public(uri.path()) && uri.path() != "/v1/events" => {
            has_token(headers, token).err()
        }
        _ => None,
    }
}

/// What answers a route.
type Run = fn(Call) -> Coming;

async fn answer(
    app: Arc<App>,
    route: &'static Route,
    run: Run,
    request: Request,
) -> Response<Body> {
    match take(app, route, run, request).await {
        Ok(Answer::Json(text)) => fixed("application/json", text),
        Ok(Answer::Text(text)) => fixed("text/plain; charset=utf-8", text),
        Ok(Answer::Recording(reading)) => fixed("application/x-ndjson", Body::new(reading)),
        Ok(Answer::Holding(holding)) => fixed("text/plain; charset=utf-8", Body::new(holding)),
        Err(problem) => refuse(&problem),
    }
}

async fn take(
    app: Arc<App>,
    route: &'static Route,
    run: Run,
    request: Request,
) -> Result<Answer, Problem> {
    let (mut parts, content) = request.into_parts();
    let path = RawPathParams::from_request_parts(&mut parts, &()).await.map_err(|_| {
        Problem::new(Kind::WrongRequest, "the address is no UTF-8", "write it as %XX of UTF-8")
    })?;
    let path = path.iter().map(|(name, value)| (name.to_owned(), value.to_owned())).collect();
    let Query(pairs) = Query::try_from_uri(&parts.uri).map_err(|_| {
        let remedy = "write NAME=VALUE, several with & between them";
        Problem::new(
            Kind::WrongRequest,
            "what is behind the question mark is not understood",
            remedy,
        )
    })?;
    let query = query(route.query, pairs)?;
    let most = if image(route.body).is_some() { IMAGE } else { BODY };
    let too_large = || {
        Problem::new(Kind::TooLarge, format!("the body has more than {most} bytes"), "send less")
    };
    let says = parts.headers.get(header::CONTENT_LENGTH).and_then(|length| length.to_str().ok());
    if says.and_then(|length| length.parse::<u64>().ok()).is_some_and(|it| it > most as u64) {
        return Err(too_large());
    }
    let bytes = match timeout(PATIENCE, to_bytes(content, most)).await {
        Ok(Ok(bytes)) => bytes,
        // That is all that tells one from the other.
        Ok(Err(error)) if error.to_string().contains("length limit") => return Err(too_large()),
        Ok(Err(_)) => {
            let remedy = "send it whole, with its length or in chunks";
            return Err(Problem::new(Kind::WrongRequest, "the body has broken off", remedy));
        }
        Err(_) => {
            let detail = format!("the body was not whole within {} s", PATIENCE.as_secs());
            let remedy = "send it at once, and as many bytes as Content-Length says";
            return Err(Problem::new(Kind::TooSlow, detail, remedy));
        }
    };
    let body = body(route.body, content_of(&parts.headers), &bytes)?;
    let outcome = run(Call { app, path, query, body }).await;
    outcome.map_err(|problem| problem.or_remedy(|| right_body(route.body)))
}

fn content_of(headers: &HeaderMap) -> Content {
    let said = headers.get(header::CONTENT_TYPE).and_then(|said| said.to_str().ok());
    let kind = said.map(|said| said.split(';').next().unwrap_or_default().trim());
    let is = |name: &str| kind.is_some_and(|kind| kind.eq_ignore_ascii_case(name));
    match () {
        () if is("application/json") => Content::Json,
        () if is("application/octet-stream") => Content::Bytes,
        () => Content::Other,
    }
}

fn fixed(kind: &'static str, body: impl Into<Body>) -> Response<Body> {
    let mut response = Response::new(body.into());
    response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(kind));
    response
}

async fn watch(State(app): State<Arc<App>>, mut request: Request) -> Response<Body> {
    let upgrade = request.extensions_mut().remove::<OnUpgrade>();
    let key = events::accepted_key(request.headers());
    let key = key.and_then(|key| HeaderValue::from_str(&key).ok());
    let (Some(upgrade), Some(key)) = (upgrade, key) else {
        let remedy = "connect with a WebSocket, as in new WebSocket(\"ws://…/v1/events\")";
        let problem = Problem::new(Kind::WrongRequest, "this is a WebSocket", remedy);
        return refuse(&problem);
    };
    let has_token =
        app.token.as_ref().is_none_or(|token| has_token(request.headers(), token).is_ok());
    tokio::spawn(async move {
        if let Ok(connection) = upgrade.await {
            events::talk(connection, app, has_token).await;
        }
    });
    let mut response = Response::new(Body::empty());
    *response.status_mut() = StatusCode::SWITCHING_PROTOCOLS;
    let headers = response.headers_mut();
    headers.insert(header::CONNECTION, HeaderValue::from_static("upgrade"));
    headers.insert(header::UPGRADE, HeaderValue::from_static("websocket"));
    headers.insert(header::SEC_WEBSOCKET_ACCEPT, key);
    response
}

async fn nothing(request: Request) -> Response<Body> {
    let detail = format!("there is nothing at {}", request.uri().path());
    refuse(&Problem::new(Kind::NoSuchThing, detail, "/v1/docs lists all that there is"))
}

async fn wrong_method(request: Request) -> Response<Body> {
    let (method, path) = (request.method(), request.uri().path());
    let known = find("", path).err().unwrap_or_default();
    let known = if known.is_empty() { "GET".to_owned() } else { known.join(", ") };
    let remedy = format!("it takes {known}");
    let detail = format!("{path} takes no {method}");
    let mut response = refuse(&Problem::new(Kind::WrongMethod, detail, remedy));
    debug_assert_eq!(response.status(), StatusCode::METHOD_NOT_ALLOWED);
    if let Ok(allow) = HeaderValue::from_str(&known) {
        response.headers_mut().insert(header::ALLOW, allow);
    }
    response
}
