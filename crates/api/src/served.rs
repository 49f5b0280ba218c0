//! The controllers that are served.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde_json::{Value, json};
use tokio::sync::{Mutex as Turn, Notify, Semaphore, watch};
use tokio_websockets::Payload;
use vimc4::{Control, Emulator, Error, Names, Snapshot, Time};
use vimc4_answers::feed::Feed;
use vimc4_answers::news::Messages;
use vimc4_answers::problem::{Kind, Problem};
use vimc4_answers::seen::{self, Position};

use crate::bell::Bell;
use crate::debugger::{Desk, Open};
use crate::expectations::Expectations;
use crate::guard::Token;
use crate::limits::{JOURNEYS, Rate, SOCKETS};
use crate::past::Memory;
use crate::recordings::Recordings;

/// Everything that requests are about.
#[derive(Debug)]
pub(crate) struct App {
    pub(crate) controllers: Vec<Served>,
    /// Those of all controllers, which are of one model.
    pub(crate) names: Names,
    pub(crate) token: Option<Token>,
    pub(crate) rate: Rate,
    pub(crate) sockets: Arc<Semaphore>,
    pub(crate) journeys: Semaphore,
    pub(crate) bell: Arc<Bell>,
    /// Opens a debugger, if there is one to be had.
    pub(crate) debugger: Option<Debug>,
    /// Changes a moment after something has happened.
    pub(crate) news: watch::Sender<()>,
    /// By what a client knows that it is the same server that it has seen before.
    pub(crate) instance: String,
    /// Somebody wants the program to end.
    pub(crate) quit: Arc<Notify>,
}

/// How a debugger is opened.
pub(crate) struct Debug(pub(crate) Open);

impl fmt::Debug for Debug {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Debug")
    }
}

/// One controller, as requests have it.
#[derive(Debug)]
pub(crate) struct Served {
    pub(crate) control: Control,
    pub(crate) feed: Arc<Feed>,
    /// What those who watch were told last.
    messages: Mutex<Messages<Payload>>,
    /// What does not change.
    pub(crate) about: Value,
    pub(crate) snapshots: Snapshots,
    pub(crate) desk: Desk,
    /// Its past, if it can be looked at.
    pub(crate) memory: Memory,
    pub(crate) expectations: Expectations,
    pub(crate) recordings: Recordings,
    position: Turn<Option<(Instant, Arc<Position>)>>,
}

/// The states that somebody wanted to go back to.
#[derive(Debug, Default)]
pub(crate) struct Snapshots {
    kept: Mutex<BTreeMap<u64, Kept>>,
    last: AtomicU64,
}

/// One of them.
#[derive(Clone, Debug)]
pub(crate) struct Kept {
    pub(crate) name: String,
    pub(crate) at: Time,
    pub(crate) snapshot: Snapshot,
}

impl Snapshots {
    pub(crate) fn kept(&self) -> MutexGuard<'_, BTreeMap<u64, Kept>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn keep(&self, kept: Kept) -> u64 {
        let id = self.last.fetch_add(1, Ordering::Relaxed) + 1;
        self.kept().insert(id, kept);
        id
    }
}

/// No other server of this computer has been begun by the same process at the same time.
fn instance() -> String {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    format!("{:x}-{:x}", now.as_nanos(), std::process::id())
}

impl App {
    /// Lets all controllers be watched from now on.
    pub(crate) async fn of(
        emulators: &[Emulator],
        token: Option<Token>,
        debugger: Option<Open>,
        quit: Arc<Notify>,
    ) -> Result<App, Error> {
        let bell = Arc::new(Bell::default());
        let mut controllers = Vec::new();
        let mut names = Names::default();
        for (number, emulator) in (1..).zip(emulators) {
            let control = emulator.control().by("the API");
            if number == 1 {
                names = control.names().await?;
            }
            let feed = Feed::new(bell.ringer());
            feed.begin(control.watch_from_here(feed.sink()).await?);
            let memory = Memory::default();
            if debugger.is_some() {
                control.watch(memory.clone()).await?;
            }
            let about = about(number, emulator, &control, &names);
            let (messages, snapshots, desk, expectations, position) = Default::default();
            let recordings = Recordings::beside(emulator.recording());
            controllers.push(Served {
                control,
                feed,
                messages,
                about,
                snapshots,
                desk,
                memory,
                expectations,
                recordings,
                position,
            });
        }
        Ok(App {
            controllers,
            names,
            token,
            rate: Rate::new(),
            sockets: Arc::new(Semaphore::new(SOCKETS)),
            journeys: Semaphore::new(JOURNEYS),
            bell,
            debugger: debugger.map(Debug),
            news: watch::Sender::new(()),
            instance: instance(),
            quit,
        })
    }

    /// Room for one more who waits for time to pass.
    pub(crate) fn journey(&self) -> Result<tokio::sync::SemaphorePermit<'_>, Problem> {
        self.journeys.try_acquire().map_err(|_| {
            Problem::new(
                Kind::TooMany,
                format!("{JOURNEYS} requests wait for time to pass already"),
                "POST to clock/cancel, which gives them up",
            )
        })
    }
}

impl Served {
    /// What those who watch were told last. It is whole at any time, so a panic elsewhere is no reason to stop.
    pub(crate) fn messages(&self) -> MutexGuard<'_, Messages<Payload>> {
        self.messages.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Where the axes are, no longer than this ago: however many ask, the controller is asked once.
    pub(crate) async fn position(&self, age: Duration) -> Result<Arc<Position>, Problem> {
        let mut last = self.position.lock().await;
        if let Some((taken, position)) = &*last
            && taken.elapsed() < age
        {
            return Ok(Arc::clone(position));
        }
        let position = Arc::new(Position::of(&self.control.view().await?));
        *last = Some((Instant::now(), Arc::clone(&position)));
        Ok(position)
    }
}

fn about(number: usize, emulator: &Emulator, control: &Control, names: &Names) -> Value {
    let mut about = seen::profile(number, control.model(), control.machine(), names);
    about["pty"] = json!(emulator.port().map(|path| path.display().to_string()));
    about["tcp"] = json!(emulator.tcp_addr().map(|address| address.to_string()));
    about["rfc2217"] = json!(emulator.rfc2217_addr().map(|address| address.to_string()));
    about["serial"] = json!(emulator.serial());
    about["recorded"] = json!(emulator.recording().is_some());
    about
}
