//! Controllers behind ports, as sessions of editors have them.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use vimc4::{Clock, Control, Emulator};
use vimc4_dap::{Configuration, Live as Behind, Opened, Refusal, Until};
use vimc4_debug::{Debugger, Stop, Unit, uninterrupted};
use vimc4_timeline::Progress;

use crate::failure::Failure;
use crate::live::{self, Live, Ring};
use crate::places::{LISTENS, PTY, counted_up, numbered, of_flash};
use crate::setup::Setup;
use vimc4_answers::profiles::quirky;

/// One controller behind ports. It is this session's alone as long as it lives.
struct Held {
    live: Live,
    _alone: Option<Arc<Alone>>,
}

impl fmt::Debug for Held {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Held")
    }
}

impl Behind for Held {
    fn during(
        &mut self,
        debugger: &mut Debugger,
        goes_forward: bool,
        is_meant: bool,
        progress: &mut Progress<'_>,
        deed: &mut dyn FnMut(&mut Debugger, &mut Progress<'_>),
    ) -> Result<bool, Refusal> {
        let done = self.live.during(debugger, goes_forward, is_meant, progress, deed);
        done.map(|((), arrived)| arrived).map_err(Refusal)
    }

    fn let_go(
        &mut self,
        debugger: &mut Debugger,
        until: Until,
        progress: &mut Progress<'_>,
    ) -> Result<Option<Stop>, Refusal> {
        let until = match until {
            Until::Paused => live::Until::Paused,
            Until::Command => live::Until::Command,
            Until::Time(at) => live::Until::Time(at),
        };
        self.live.let_go(debugger, until, progress).map_err(Refusal)
    }

    fn look(&mut self, debugger: &mut Debugger) -> Result<Option<Stop>, Refusal> {
        self.live.look(debugger).map_err(Refusal)
    }

    fn pause(&mut self) {
        self.live.pause();
    }

    fn heed(&mut self, debugger: &Debugger) -> Result<(), Refusal> {
        self.live.heed(debugger).map_err(Refusal)
    }

    fn take(&mut self, debugger: &mut Debugger) -> Result<String, Refusal> {
        self.live.take(debugger, &mut uninterrupted).map_err(Refusal)
    }

    fn order(&mut self, line: &str) -> Result<(), Refusal> {
        self.live.order(line).map_err(Refusal)
    }

    fn elsewhere(&self, debugger: &Debugger) -> Option<String> {
        self.live.elsewhere(debugger)
    }

    fn is_ahead(&self, debugger: &Debugger) -> bool {
        self.live.is_ahead(debugger)
    }
}

fn opened(
    name: String,
    (live, debugger): (Live, Debugger),
    alone: Option<Arc<Alone>>,
    said: String,
) -> Opened {
    Opened {
        name,
        debugger,
        stored: Vec::new(),
        is_file: false,
        statement: Unit::Command,
        live: Some(Box::new(Held { live, _alone: alone })),
        said,
    }
}

// --- those that a session starts ---

/// Starts a controller behind ports; of several, the one of this number.
pub(super) fn start(
    configuration: &Configuration,
    number: Option<u16>,
    ring: &Ring,
) -> Result<Opened, Refusal> {
    let refused = |failure: Failure| Refusal::new(failure.text());
    let setup = Setup::said(configuration.model.clone(), configuration.machine.clone());
    let mut model = vimc4::model(setup.model()).map_err(Refusal::new)?;
    for (name, value) in &configuration.quirks {
        model = quirky(&model, name, value).map_err(Refusal)?;
    }
    let machine = vimc4::machine(setup.machine()).map_err(Refusal::new)?;
    let called = match number {
        Some(number) => number.to_string(),
        None => format!("{} on {}", model.name(), machine.name),
    };
    let clock = match configuration.time.as_deref() {
        None => Clock::Real,
        Some(text) => text.parse().map_err(Refusal::new)?,
    };
    if clock == Clock::Manual {
        return Err(Refusal::new(
            "time that is moved by hand has nothing to be paused; choose real, instant or 8x",
        ));
    }
    let in_folder = |name: &str| -> PathBuf {
        match &configuration.cwd {
            Some(folder) => Path::new(folder).join(name),
            None => PathBuf::from(name),
        }
    };
    let mut builder = Emulator::builder()
        .with_model(model)
        .with_machine(machine)
        .time(clock)
        .record(false)
        // It is looked at before anybody can have reached it.
        .paused(true);
    let link = configuration.pty.as_deref().or_else(|| cfg!(unix).then_some(PTY));
    if let Some(link) = link.filter(|link| *link != "none") {
        builder = builder.pty(numbered(&in_folder(link), number));
    }
    let address = configuration.tcp.as_deref().unwrap_or(LISTENS);
    if address != "none" {
        let more = number.map_or(0, |number| number - 1);
        builder = builder.tcp(counted_up(address, more).map_err(refused)?);
    }
    if let Some(device) = &configuration.serial {
        builder = builder.serial(device);
    }
    if let Some(file) = &configuration.flash {
        builder = builder.flash(of_flash(&in_folder(file), number).map_err(refused)?);
    }
    let emulator = builder.start().map_err(Failure::from).map_err(refused)?;
    let places = [
        emulator.port().map(|path| format!("pty {}", path.display())),
        emulator.tcp_addr().map(|address| format!("tcp {address}")),
        emulator.serial().map(|device| format!("serial {device}")),
    ];
    let places: Vec<String> = places.into_iter().flatten().collect();
    let followed = Live::of(emulator, Some(Arc::clone(ring))).map_err(Refusal)?;
    Ok(opened(called, followed, None, places.join("\n")))
}

// --- those that run already ---

/// Controllers that run in this program for others, to which one session at a time attaches.
#[derive(Clone)]
pub(crate) struct Served {
    pub(crate) controls: Vec<(String, Control)>,
    is_taken: Arc<AtomicBool>,
}

/// Its holder has them.
struct Alone(Arc<AtomicBool>);

impl Drop for Alone {
    fn drop(&mut self) {
        self.0.store(false, Ordering::SeqCst);
    }
}

impl Served {
    pub(crate) fn new(emulators: &[Emulator]) -> Served {
        let controls = emulators.iter().map(Emulator::control);
        let named = (1..)
            .zip(controls)
            .map(|(number, control): (u16, _)| (number.to_string(), control.clone()));
        Served { controls: named.collect(), is_taken: Arc::default() }
    }

    /// Those of these names; all if none are said.
    pub(super) fn attach(
        &self,
        configuration: &Configuration,
        ring: &Ring,
    ) -> Result<Vec<Opened>, Refusal> {
        let names = configuration.controllers.iter().filter_map(|own| own.name.as_deref());
        let names: Vec<&str> = names.collect();
        let is_known = |name: &&str| self.controls.iter().any(|(own, _)| own == name);
        if let Some(unknown) = names.iter().find(|name| !is_known(name)) {
            let count = self.controls.len();
            return Err(Refusal(format!(
                "there is no controller {unknown}; their names are 1 to {count}"
            )));
        }
        if self.is_taken.swap(true, Ordering::SeqCst) {
            return Err(Refusal::new(
                "another editor has attached to these controllers; it disconnects first",
            ));
        }
        let alone = Arc::new(Alone(Arc::clone(&self.is_taken)));
        let meant = self
            .controls
            .iter()
            .filter(|(name, _)| names.is_empty() || names.contains(&name.as_str()));
        let attached = meant.map(|(name, control)| {
            let followed = Live::with(control, "the debugger", Some(Arc::clone(ring)), |_| None);
            let followed = followed.map_err(Refusal)?;
            let name = match self.controls.len() {
                1 => control.model().name().to_owned(),
                _ => name.clone(),
            };
            Ok(opened(name, followed, Some(Arc::clone(&alone)), String::new()))
        });
        attached.collect()
    }
}
