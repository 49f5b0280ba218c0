//! What a cart is like.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use vimc4_device::MemoryError;
use vimc4_plant::{Builtins, Machine, ProfileError, parse_profile};

use super::Controller;

static BUILTIN: Builtins<Model, 1> = Builtins::new([("cart", include_str!("cart.toml"))]);

/// A model of cart.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Model {
    pub(crate) name: String,
    pub(crate) title: String,
    pub(crate) command_set: CommandSet,
    pub(crate) baud: u32,
    pub(crate) quirks: Quirks,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum CommandSet {
    Rails,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Quirks {
    pub(crate) squeaks: bool,
}

impl Model {
    pub(crate) fn names() -> Vec<&'static str> {
        BUILTIN.names()
    }

    pub(crate) fn builtin(name: &str) -> Option<Arc<Model>> {
        BUILTIN.get(name, Model::from_toml)
    }

    pub(crate) fn builtin_toml(name: &str) -> Option<&'static str> {
        BUILTIN.text(name)
    }

    pub(crate) fn from_toml(text: &str) -> Result<Model, ProfileError> {
        parse_profile(text)
    }

    pub(crate) fn switched_on(
        self: &Arc<Self>,
        _machine: Arc<Machine>,
        image: &[u8],
    ) -> Result<Controller, MemoryError> {
        match image.is_empty() {
            true => Ok(Controller::default()),
            false => Err(MemoryError::NoMemory),
        }
    }
}
