//! Why a group does not do what it is told.

use thiserror::Error;
use vimc4_catalogue::MemoryError;
use vimc4_device::{DeedError, Time};

/// Why a group does not do what it is told.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum GroupError {
    /// A controller cannot be made.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The controller has no such signal, or it does not take this value.
    #[error(transparent)]
    Deed(#[from] DeedError),
    /// The controller has no such output.
    #[error(
        "the {model} has no output port {port} with a bit {bit}; its output ports are {known}, with the bits 0 to 7"
    )]
    NoOutput {
        /// The model.
        model: String,
        /// The port.
        port: u16,
        /// The bit.
        bit: u8,
        /// The ports that there are.
        known: String,
    },
    /// More happens at one instant than ever ends, as when two wires drive each other.
    #[error(
        "at {at} one thing leads to another without end; look for wires that lead back to where they begin"
    )]
    Endless {
        /// The instant.
        at: Time,
    },
    /// The simulation is due at the same instant for ever.
    #[error(
        "at {at} the simulation acts again and again; after it has acted, it has to be due later, or not at all"
    )]
    Insistent {
        /// The instant.
        at: Time,
    },
    /// The simulation [cannot go on](super::World::fail).
    #[error("at {at} the simulation has failed: {why}")]
    Failed {
        /// The instant.
        at: Time,
        /// What it says.
        why: String,
    },
    /// It does not come to rest.
    #[error(
        "the group has come to {at} and is not at rest; run it to a time or to a condition instead"
    )]
    Restless {
        /// How far its time has come.
        at: Time,
    },
    /// The state is one of other controllers.
    #[error("this is the state of {found}, and here is {own}: restore it where it was taken")]
    OtherGroup {
        /// The controllers that it is of.
        found: String,
        /// Those that there are here.
        own: String,
    },
}
