//! A controller with what clients have of it.

use serde_json::{Value, json};
use vimc4_answers::past::Lived;
use vimc4_answers::seen;
use vimc4_catalogue::Details;
use vimc4_device::{Device, Time, View};

use crate::live::Live;
use crate::looks::Looks;
use crate::snapshots::Snapshots;

/// One controller, and what clients have of it.
pub(crate) struct Served {
    pub(crate) live: Live,
    pub(crate) snapshots: Snapshots,
    /// Somebody looks at its past.
    pub(crate) looks: Option<Looks>,
    /// How far it has been on each branch that it has left.
    pub(crate) lived: Lived,
}

impl Served {
    pub(crate) fn new(live: Live) -> Served {
        Served { live, snapshots: Snapshots::default(), looks: None, lived: Lived::default() }
    }

    /// Lets its time pass up to a moment of the page, unless somebody looks at its past.
    pub(crate) fn catch_up(&mut self, moment: u64) {
        if self.looks.is_none() {
            self.live.catch_up(moment);
        }
    }

    pub(crate) fn about(&self, number: usize) -> Value {
        let live = &self.live;
        let mut about = seen::profile(number, &live.model, &live.machine, &live.names);
        for way in ["pty", "tcp", "rfc2217", "serial"] {
            about[way] = Value::Null;
        }
        about["recorded"] = self.live.recorder().is_some().into();
        about
    }

    /// What is answered when time has passed up to this instant.
    pub(crate) fn arrived(&self, at: Time) -> Value {
        match self.live.session.paused() {
            Some(pause) => json!({ "now": at, "paused": seen::pause(pause) }),
            None => json!({ "now": at }),
        }
    }

    /// What is visible of the controller itself, wherever somebody looks.
    pub(crate) fn view(&self) -> View<Details> {
        self.live.line().view(self.live.now())
    }
}
