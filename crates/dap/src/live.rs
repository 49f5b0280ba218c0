//! Controllers that run by themselves.

use std::fmt;

use vimc4_debug::{Debugger, Stop};
use vimc4_device::Time;
use vimc4_timeline::Progress;

use crate::message::Refusal;

/// A controller that runs by itself, for others than the client: behind ports, in its own time. The
/// history of a debugger follows it.
///
/// While somebody looks at it its time is paused. Where the debugger goes forward from it, it is led
/// there; where that goes back, it stays.
///
/// What goes wrong with it is a refusal.
pub trait Live: fmt::Debug {
    /// Does something with the debugger, and leads the controller to where that has gone forward.
    /// `goes_forward` says whether it is meant to, `is_meant` whether a branch that begins there is
    /// meant for the controller. Says whether the controller has come there: if not, because `progress`
    /// says that it is enough, the debugger stands where the controller is by then.
    ///
    /// # Errors
    ///
    /// If the controller is no more.
    fn during(
        &mut self,
        debugger: &mut Debugger,
        goes_forward: bool,
        is_meant: bool,
        progress: &mut Progress<'_>,
        deed: &mut dyn FnMut(&mut Debugger, &mut Progress<'_>),
    ) -> Result<bool, Refusal>;

    /// Goes through what is recorded to where the controller is, and lets that go on, without waiting for
    /// it. If the debugger has stopped before that, or goes nowhere near it, nothing runs, and where that
    /// was is returned.
    ///
    /// # Errors
    ///
    /// If the controller is no more.
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
    /// If the controller is no more.
    fn look(&mut self, debugger: &mut Debugger) -> Result<Option<Stop>, Refusal>;

    /// Has the running controller paused. That is seen when it is [looked](Live::look) at.
    fn pause(&mut self);

    /// The debugger has other breakpoints now, which the running controller is to heed.
    ///
    /// # Errors
    ///
    /// If the controller is no more.
    fn heed(&mut self, debugger: &Debugger) -> Result<(), Refusal>;

    /// Takes the controller itself to where the debugger stands, and says what came of it.
    ///
    /// # Errors
    ///
    /// If the controller is no more.
    fn take(&mut self, debugger: &mut Debugger) -> Result<String, Refusal>;

    /// Does something to the running controller, in the words of the panel.
    ///
    /// # Errors
    ///
    /// What is wrong with the words.
    fn order(&mut self, line: &str) -> Result<(), Refusal>;

    /// Where the controller itself is, in a sentence, if the debugger does not stand there.
    fn elsewhere(&self, debugger: &Debugger) -> Option<String>;

    /// Whether the debugger stands on the way to the controller, or there.
    fn is_ahead(&self, debugger: &Debugger) -> bool;
}

/// Until when a controller runs by itself, at the latest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Until {
    /// A breakpoint pauses it, or somebody does.
    Paused,
    /// A command begins.
    Command,
    /// A time has come.
    Time(Time),
}
