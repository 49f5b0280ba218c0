//! What is expected of a controller.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::{Value, json};
use vimc4::{Failure, Watched};

/// What is expected of a controller, by numbers.
#[derive(Debug, Default)]
pub(crate) struct Expectations {
    kept: Mutex<BTreeMap<u64, Expected>>,
    last: AtomicU64,
}

/// One of these.
#[derive(Debug)]
pub(crate) struct Expected {
    pub(crate) words: String,
    /// Until it is checked.
    pub(crate) watched: Option<Watched>,
}

impl Drop for Expected {
    /// Nobody looks any more, which is no mistake here.
    fn drop(&mut self) {
        if let Some(watched) = self.watched.take() {
            watched.give_up();
        }
    }
}

impl Expected {
    pub(crate) fn json(&self, id: u64) -> Value {
        // In this order: what is met may fail between the two looks, what has failed is never met again.
        let is_met = self.watched.as_ref().is_some_and(Watched::is_met);
        let failure = self.watched.as_ref().and_then(Watched::failure);
        let state = match (&failure, is_met) {
            (Some(_), _) => "failed",
            (None, true) => "met",
            (None, false) => "open",
        };
        let failure = failure.as_deref().map(as_json);
        json!({ "id": id, "expected": self.words, "state": state, "failure": failure })
    }
}

impl Expectations {
    /// Keeps one. Returns its number.
    pub(crate) fn keep(&self, expected: Expected) -> u64 {
        let id = self.last.fetch_add(1, Ordering::Relaxed) + 1;
        self.kept().insert(id, expected);
        id
    }

    pub(crate) fn kept(&self) -> MutexGuard<'_, BTreeMap<u64, Expected>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The near miss, for programs, and as a text for people. The numbers of its entries are those of
/// another journal, and left out.
pub(crate) fn as_json(failure: &Failure) -> Value {
    let mut fields = serde_json::to_value(failure).unwrap_or_default();
    if let Value::Object(fields) = &mut fields {
        fields.remove("entry");
        fields.entry("closest").or_insert_with(|| json!([]));
        fields.insert("text".to_owned(), failure.to_string().into());
    }
    fields
}
