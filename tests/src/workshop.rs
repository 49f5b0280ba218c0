//! Where the sessions come from, and the controllers they are played on.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use toml::Table;
use vimc4_isel::{Controller, Model};
use vimc4_plant::Machine;

use crate::format::{self, FormatError, Session, merge};

/// The folder of the session files.
#[must_use]
pub fn sessions_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/sessions")
}

/// Reads every session there is.
///
/// # Errors
///
/// The first mistake in a file, with its place.
pub fn sessions() -> Result<Vec<Session>, FormatError> {
    format::read_all(&sessions_folder())
}

/// What a session needs of the profiles, read once for all its controllers.
#[derive(Clone, Debug)]
pub struct Workshop {
    model: Arc<Model>,
    machine: Arc<Machine>,
}

impl Workshop {
    /// The profiles of a model and a machine, with what the session says differs.
    ///
    /// # Errors
    ///
    /// If there is no such model or machine, or a value cannot be.
    pub fn new(session: &Session, model: &str) -> Result<Workshop, String> {
        let text = Model::builtin_toml(model).ok_or_else(|| format!("no model {model}"))?;
        let text = differing(text, &session.profile)?;
        let model = Model::from_toml(&text).map_err(|error| error.to_string())?;
        let name = &session.machine.name;
        let text = Machine::builtin_toml(name).ok_or_else(|| format!("no machine {name}"))?;
        let text = differing(text, &session.machine.differs)?;
        let machine = Machine::from_toml(&text).map_err(|error| error.to_string())?;
        Ok(Workshop { model: Arc::new(model), machine: Arc::new(machine) })
    }

    /// A controller that has just been switched on with this image in its flash memory.
    ///
    /// # Errors
    ///
    /// If the image is none.
    pub fn build(&self, flash: &[u8]) -> Result<Controller, String> {
        Controller::new(self.model.clone(), self.machine.clone(), flash)
            .map_err(|error| error.to_string())
    }
}

fn differing(text: &str, differs: &Table) -> Result<String, String> {
    let mut profile: Table = toml::from_str(text).map_err(|error| error.to_string())?;
    merge(&mut profile, differs.clone());
    toml::to_string(&profile).map_err(|error| error.to_string())
}
