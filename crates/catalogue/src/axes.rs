//! The names of axes.

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
    Some(match name.to_ascii_lowercase().as_str() {
        "x" => 0,
        "y" => 1,
        "z" | "z0" => 2,
        "a" | "z1" => 3,
        "z2" => 4,
        "z3" => 5,
        _ => return None,
    })
}
