//! Where the machine is, in steps.

/// How many axes a path can move. Isel's are X, Y, Z, A, LPKF's X, Y, Z0 to Z3, in this order.
pub const AXES: usize = 6;

/// One number of steps per axis.
pub type Point = [i64; AXES];
