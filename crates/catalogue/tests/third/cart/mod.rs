//! A family with one model, a cart on a rail. What is here a module is a crate elsewhere: it has a
//! `Model`, a `Controller`, a `State` and `Details`.

#[path = "../../../../device/tests/cart/mod.rs"]
mod controller;
mod knowledge;
mod model;

pub(crate) use controller::{Cart as Controller, State};
pub(crate) use model::Model;

impl State {
    pub(crate) fn profile_names(&self) -> (&str, &str) {
        ("cart", "rail")
    }

    /// A cart keeps no profile in its state.
    pub(crate) fn with_profiles_of(&self, _: &State) -> State {
        self.clone()
    }

    pub(crate) fn with_memory_of(&self, _: &State) -> State {
        self.clone()
    }
}

/// A cart shows nothing that others do not.
pub(crate) type Details = ();
