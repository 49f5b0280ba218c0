//! How a client handles a controller besides sending it commands, and what can be asked about its
//! language without speaking it.

use std::ops::Deref;

use vimc4_device::{Heard, Identity, Model as _, Piece, Point, Question, Turn};

use crate::list::{Family, Model, of};

/// What a client of a controller knows of its model. It reads as the
/// [`Handling`](vimc4_device::Handling) of the model: what to send when a controller must stop,
/// reset, erase or be found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Handling {
    model: Model,
    of: vimc4_device::Handling,
}

impl Deref for Handling {
    type Target = vimc4_device::Handling;

    fn deref(&self) -> &vimc4_device::Handling {
        &self.of
    }
}

impl Handling {
    /// How this model is handled.
    #[must_use]
    pub fn of(model: &Model) -> Handling {
        Handling { model: model.clone(), of: of!(Model, model, model => model.handling()) }
    }

    /// The model that is handled so.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The positions in an answer to [`position`](vimc4_device::Handling::position), X first;
    /// `None` if it is not such an answer. A model that reports configured axes only gives fewer
    /// positions, or none, and does not say which axes they belong to.
    #[must_use]
    pub fn read_position(&self, answer: &[u8]) -> Option<Vec<i64>> {
        of!(Model, &self.model, model => model.read_position(answer))
    }

    /// Whether this many positions show which axes they belong to.
    #[must_use]
    pub fn names_axes(&self, places: usize) -> bool {
        of!(Model, &self.model, model => model.names_axes(places))
    }

    /// How complete the answer to a command is that was sent with its end, given that every command
    /// is answered; with nothing sent, the answer to something that was caused otherwise.
    #[must_use]
    pub fn hear(&self, sent: &[u8], answer: &[u8]) -> Heard {
        of!(Model, &self.model, model => model.hear(sent, answer))
    }

    /// The lines, each to be answered [`done`](vimc4_device::Handling::done), that make a freshly
    /// reset controller move its axes by this many steps, the fastest of them at `speed` Hz.
    #[must_use]
    pub fn moving(&self, by: Point, speed: u64) -> Vec<String> {
        of!(Model, &self.model, model => model.moving(by, speed))
    }

    /// When a command is carried out that has others waiting before it.
    #[must_use]
    pub fn turn(&self, command: &[u8]) -> Turn {
        of!(Model, &self.model, model => model.turn(command))
    }

    /// The profile value with which a controller would know a command that this one does not know.
    #[must_use]
    pub fn known_with(&self, command: &[u8]) -> Option<&'static str> {
        of!(Model, &self.model, model => model.known_with(command))
    }

    /// What is wrong with a command, if the answer to it is an error.
    #[must_use]
    pub fn refusal(&self, command: &[u8], answer: &[u8]) -> Option<String> {
        of!(Model, &self.model, model => model.refusal_of(command, answer))
    }

    /// Whether a command switches the spindle on or off, which STOP at the panel switches off; `None`
    /// if it does neither.
    #[must_use]
    pub fn spindle_after(&self, command: &[u8]) -> Option<bool> {
        of!(Model, &self.model, model => model.spindle_after(command))
    }

    /// The input port, and the bit of it, that show the spindle.
    #[must_use]
    pub fn spindle_shown(&self) -> Option<(u16, u8)> {
        of!(Model, &self.model, model => model.spindle_shown())
    }

    /// The pieces of a file, in order, if it is a stream of commands and not a list of lines.
    #[must_use]
    pub fn stream(&self, file: &[u8]) -> Option<Vec<Piece>> {
        self.takes_stream.then(|| of!(Model, &self.model, model => model.stream(file)))
    }

    /// Identifies a controller. That moves nothing, and ends as soon as the controller is known to
    /// be of another family.
    ///
    /// # Errors
    ///
    /// If `ask` fails, with its error.
    pub fn identify<E>(
        &self,
        mut ask: impl FnMut(Question) -> Result<Vec<u8>, E>,
    ) -> Result<Identity, E> {
        let others = Family::ALL.into_iter().filter(|family| *family != self.model.family());
        let mut ask = |question| {
            let answer = ask(question).map_err(Ended::Failed)?;
            match others.clone().find(|family| family.is_own_answer(&answer)) {
                Some(family) => Err(Ended::Foreign(family, vimc4_device::said(&answer))),
                None => Ok(answer),
            }
        };
        match of!(Model, &self.model, model => model.identify(&mut ask)) {
            Ok(identity) => Ok(identity),
            Err(Ended::Foreign(family, said)) => {
                Ok(Identity::Foreign { what: format!("an {family} controller"), said })
            }
            Err(Ended::Failed(error)) => Err(error),
        }
    }
}

/// Why no more questions are asked.
enum Ended<E> {
    /// Asking fails.
    Failed(E),
    /// It is of another family; with its answer.
    Foreign(Family, String),
}
