//! What a cart is like.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use vimc4_device::MemoryError;
use vimc4_plant::{Machine, profiles};

use super::Controller;

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

profiles! { Model, |_, _| Ok(()), ["cart" = include_str!("cart.toml")] }

impl Model {
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
