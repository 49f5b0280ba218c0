//! What was swept: results that do not agree in it do not belong together.

use serde::{Deserialize, Serialize};

use crate::key::key;
use crate::plan::{Harm, Mode};

/// What was swept. Parts of one sweep are equal in all of it, wherever they were done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Subject {
    /// The command line of a host, the name of a recording or of a function.
    pub of: String,
    /// The model of the controller.
    pub model: Profile,
    /// The machine that it drives.
    pub machine: Profile,
    /// What goes wrong, in the order of [`Harm::ALL`].
    pub harms: Vec<Harm>,
    /// How, in the order of [`Mode::ALL`].
    pub modes: Vec<Mode>,
    /// Equal for runs in which the same happens without a fault.
    pub fingerprint: String,
    /// How many points there are.
    pub points: u64,
}

/// A profile as it was.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Profile {
    /// Its name.
    pub name: String,
    /// Equal for profiles that say the same.
    pub key: String,
}

impl Profile {
    /// The profile of this name.
    pub fn new(name: &str, profile: &impl Serialize) -> Profile {
        // A profile can always be written down.
        let written = serde_json::to_vec(profile).unwrap_or_default();
        Profile { name: name.to_owned(), key: key(&written) }
    }
}

impl Subject {
    /// In what other results, which are there, are of something else than these here; in words.
    #[must_use]
    pub fn difference(&self, there: &Subject) -> Option<String> {
        let harms = |of: &Subject| names(&Harm::ALL, &of.harms);
        let modes = |of: &Subject| names(&Mode::ALL, &of.modes);
        let named = [
            ("what is swept is", self.of.clone(), there.of.clone()),
            ("the model is", self.model.name.clone(), there.model.name.clone()),
            ("the machine is", self.machine.name.clone(), there.machine.name.clone()),
            ("the harms are", harms(self), harms(there)),
            ("the modes are", modes(self), modes(there)),
        ];
        let mut differences: Vec<String> = named
            .into_iter()
            .filter(|(_, here, there)| here != there)
            .map(|(what, here, there)| format!("{what} `{there}` there and `{here}` here"))
            .collect();
        let profiles = [
            ("the model", &self.model, &there.model),
            ("the machine", &self.machine, &there.machine),
        ];
        for (what, here, there) in profiles {
            if here.name == there.name && here.key != there.key {
                differences.push(format!("{what} `{}` has another profile there", there.name));
            }
        }
        let happens = |of: &Subject| (of.fingerprint.clone(), of.points);
        if differences.is_empty() && happens(self) != happens(there) {
            differences.push("without a fault something else happens there".to_owned());
        }
        (!differences.is_empty()).then(|| differences.join("; "))
    }
}

/// What was chosen of all there is, without repetition.
pub(crate) fn in_order<T: Copy + PartialEq>(all: &[(T, &str)], chosen: &[T]) -> Vec<T> {
    all.iter().map(|(one, _)| *one).filter(|one| chosen.contains(one)).collect()
}

fn names<T: PartialEq>(all: &[(T, &str)], chosen: &[T]) -> String {
    let names = all.iter().filter(|(one, _)| chosen.contains(one)).map(|(_, name)| *name);
    names.collect::<Vec<_>>().join(",")
}
