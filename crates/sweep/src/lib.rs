//! Every fault that can strike a session: counted, numbered, tried, and what came of each.
//!
//! A session is a device in its first state and the inputs that it gets. Played once without a
//! fault, its [`Account`] says how many bytes went each way, which commands were executed and what
//! moved. From that follows the [`Plan`]: a list of all points at which something can go wrong, each
//! with a number, so that dividing the work among processes and resuming it are arithmetic. One point
//! is one run with its faults; the [`Outcome`] says what was different, in a form that is equal for
//! equal behaviour, and [`Results`] collects outcomes in any order and from anywhere.
//!
//! A recorded session is swept by [`Session`], from snapshots. Where the host is a program, somebody
//! else runs it, and [`Session`] plays what it has done to find out what came of it. Where it would hear what
//! it has heard before, [`Habits`] knows what it will do.
#![forbid(unsafe_code)]

mod account;
mod habits;
mod key;
mod outcome;
mod plan;
mod results;
mod session;
mod subject;

pub use account::{Account, AxisEnd, CommandPlace, End, Exchange, MotionPlace};
pub use habits::{Foretold, Habits, Moment};
pub use outcome::{Cue, Exit, Heard, MachineEnd, Outcome, Then, Verdict};
pub use plan::{Choice, Harm, Mode, Place, Plan, Point, Shard, ShardError};
pub use results::{Case, Group, Results, ResultsError, Row};
pub use session::{Found, Session};
pub use subject::{Profile, Subject};
