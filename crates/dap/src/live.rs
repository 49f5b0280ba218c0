//! Controllers that run by themselves.

use std::fmt;

use vimc4_debug::{Debugger, Stop};
use vimc4_device::Time;
use vimc4_timeline::Progress;

use crate::message::Refusal;

/// A controller that runs by itself, behind ports and in its own time, for programs other than the
/// DAP client. The history of a debugger follows it.
///
/// While it is inspected its time is paused. Where the debugger goes forward from it, the
/// controller is led there; where the debugger goes back, the controller stays.
///
/// What goes wrong with it is a refusal.
pub trait Live: fmt::Debug {
    /// Does something with the debugger, and leads the controller along where the debugger went
    /// forward. `goes_forward` says whether the controller is to follow, `is_meant` whether a
    /// branch that begins there applies to the controller. Returns whether the controller got
    /// there; if `progress` stopped it before, the debugger stands where the controller is by then.
    ///
    /// # Errors
    ///
    /// If the controller has ended.
    fn during(
        &mut self,
        debugger: &mut Debugger,
        goes_forward: bool,
        is_meant: bool,
        progress: &mut Progress<'_>,
        deed: &mut dyn FnMut(&mut Debugger, &mut Progress<'_>),
    ) -> Result<bool, Refusal>;

    /// Goes through the history up to the controller and lets the controller run, without waiting
    /// for it. If the debugger stops before that, or its way does not lead there, nothing runs, and
    /// the stop is returned.
    ///
    /// # Errors
    ///
    /// If the controller has ended.
    fn let_go(
        &mut self,
        debugger: &mut Debugger,
        until: Until,
        progress: &mut Progress<'_>,
    ) -> Result<Option<Stop>, Refusal>;

    /// Follows the running controller as far as it has come, and says where it has stopped, if it has.
    ///
    /// # Errors
    ///
    /// If the controller has ended.
    fn look(&mut self, debugger: &mut Debugger) -> Result<Option<Stop>, Refusal>;

    /// Asks the running controller to pause. The next [look](Live::look) shows it.
    fn pause(&mut self);

    /// Gives the running controller the debugger's present breakpoints.
    ///
    /// # Errors
    ///
    /// If the controller has ended.
    fn heed(&mut self, debugger: &Debugger) -> Result<(), Refusal>;

    /// Moves the controller itself to where the debugger stands, and says what came of it.
    ///
    /// # Errors
    ///
    /// If the controller has ended.
    fn take(&mut self, debugger: &mut Debugger) -> Result<String, Refusal>;

    /// Does something to the running controller, in the words of the panel.
    ///
    /// # Errors
    ///
    /// What is wrong with the words.
    fn order(&mut self, line: &str) -> Result<(), Refusal>;

    /// Where the controller itself is, in a sentence, if the debugger does not stand there.
    fn elsewhere(&self, debugger: &Debugger) -> Option<String>;

    /// Whether the debugger stands on the way to the controller, or at it.
    fn is_ahead(&self, debugger: &Debugger) -> bool;
}

/// Until when a controller runs by itself, at the latest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Until {
    /// Until a breakpoint or a user pauses it.
    Paused,
    /// Until a command begins.
    Command,
    /// Until this time.
    Time(Time),
}
