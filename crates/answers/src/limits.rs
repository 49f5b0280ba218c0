//! How much anybody may ask for, wherever the controllers are.

/// The largest body of a request, bytes.
pub const BODY: usize = 64 * 1024;

/// The largest body of a request with the image of a memory, bytes.
pub const IMAGE: usize = 4 * 1024 * 1024;

/// So many entries of what happened are kept for each controller.
pub const HISTORY: usize = 10_000;

/// So many entries are sent at once.
pub const PAGE: usize = 1_000;

/// So many characters say who has a debugger.
pub const LONGEST_NAME: usize = 100;

/// So many snapshots are kept for each controller.
pub const SNAPSHOTS: usize = 100;

/// So many things may be expected of each controller at a time.
pub const EXPECTATIONS: usize = 100;

/// So many breakpoints can be set.
pub const BREAKPOINTS: usize = 1_000;

/// So many positions a second may be asked for.
pub const POSITIONS: u32 = 60;
