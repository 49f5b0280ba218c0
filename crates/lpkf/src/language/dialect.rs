//! The languages that controllers speak.

use serde::{Deserialize, Serialize};

/// The two command sets of the LPKF controllers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Dialect {
    /// The SMCU: X, Y and a head that is lowered and lifted.
    Smcu,
    /// The MotionSystem: up to six axes.
    #[serde(rename = "motionsystem")]
    MotionSystem,
}

impl Dialect {
    /// Both of them.
    pub const ALL: [Self; 2] = [Self::Smcu, Self::MotionSystem];
}
