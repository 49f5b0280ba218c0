//! The controllers that sessions are played on.

use std::sync::Arc;

use toml::Table;
use vimc4_catalogue::{Controller, Machine, Model};

use crate::format::{Session, merge};

/// What a session needs of the profiles, read once for all its controllers.
#[derive(Clone, Debug)]
pub struct Workshop {
    model: Model,
    machine: Arc<Machine>,
}

impl Workshop {
    /// The profiles of a built-in model and a machine, with the session's own values.
    ///
    /// # Errors
    ///
    /// If there is no such model or machine, or a value cannot be.
    pub fn new(session: &Session, model: &str) -> Result<Workshop, String> {
        let text = vimc4_catalogue::model_profile(model).map_err(|error| error.to_string())?;
        let mut profile: Table = toml::from_str(text).map_err(|error| error.to_string())?;
        merge(&mut profile, session.profile.clone());
        Ok(Workshop { model: self::model(&profile)?, machine: machine(session)? })
    }

    /// A controller of this model on the machine without ends.
    ///
    /// # Errors
    ///
    /// If there is no such machine.
    pub fn bench(model: &Model) -> Result<Workshop, String> {
        let machine = vimc4_catalogue::machine("bench").map_err(|error| error.to_string())?;
        Ok(Workshop { model: model.clone(), machine })
    }

    /// The model of its controllers.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The machine that they drive.
    #[must_use]
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// A controller that has just been switched on with this image in its flash memory.
    ///
    /// # Errors
    ///
    /// If the image is not valid.
    pub fn build(&self, flash: &[u8]) -> Result<Controller, String> {
        vimc4_catalogue::bare(&self.model, &self.machine, flash).map_err(|error| error.to_string())
    }
}

/// The model with this profile.
///
/// # Errors
///
/// If a value is not possible.
pub fn model(profile: &Table) -> Result<Model, String> {
    let text = toml::to_string(profile).map_err(|error| error.to_string())?;
    Model::from_toml(&text).map_err(|error| error.to_string())
}

/// The profile of a model.
///
/// # Errors
///
/// None for a model that was read from a profile.
pub fn profile(model: &Model) -> Result<Table, String> {
    Table::try_from(model).map_err(|error| error.to_string())
}

fn machine(session: &Session) -> Result<Arc<Machine>, String> {
    let choice = &session.machine;
    let text = vimc4_catalogue::machine_profile(&choice.name).map_err(|error| error.to_string())?;
    let mut profile: Table = toml::from_str(text).map_err(|error| error.to_string())?;
    merge(&mut profile, choice.differs.clone());
    let text = toml::to_string(&profile).map_err(|error| error.to_string())?;
    Machine::from_toml(&text).map(Arc::new).map_err(|error| error.to_string())
}
