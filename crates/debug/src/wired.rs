//! What is debugged.

use vimc4_catalogue::Controller;
use vimc4_device::Line;

/// A controller at its line: what goes wrong there, and what scenarios do, is debugged along.
pub type Wired = Line<Controller>;
