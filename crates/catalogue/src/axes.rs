//! The names of axes.

use crate::{Model, models};

/// The number of the axis of that name, 0 for X, in capital or small letters. What isel calls Z
/// and A is Z0 and Z1 to LPKF, and Z on an SMCU, which has no other.
///
/// ```
/// assert_eq!(["x", "Z", "Z0", "a", "z3", "b"].map(vimc4_catalogue::axis), [
///     Some(0), Some(2), Some(2), Some(3), Some(5), None
/// ]);
/// ```
#[must_use]
pub fn axis(name: &str) -> Option<u8> {
    let place =
        |model: Model| model.axis_names().iter().position(|axis| axis.eq_ignore_ascii_case(name));
    let place = models().into_iter().filter_map(Model::builtin).find_map(place)?;
    u8::try_from(place).ok()
}
