//! Which sessions are played, and what they may do.

use vimc4_conform::choice::{Allowed, Chooser, Plan, Reason};
use vimc4_conform::format::Session;
use vimc4_device::AXES;

use super::arguments::{Allow, Arguments, Envelope};
use crate::failure::Failure;
use crate::port;

/// A session, and how it is played or why not.
pub(super) struct Choice<'s> {
    pub(super) session: &'s Session,
    pub(super) plan: Result<Plan, Reason>,
}

/// Which sessions are played, those that are asked for and are about the model at all.
pub(super) fn choose<'s>(
    arguments: &Arguments,
    sessions: &'s [Session],
    chooser: &Chooser,
    allowed: &Allowed,
) -> Result<Vec<Choice<'s>>, Failure> {
    let mut filters: Vec<&str> = arguments.filters.iter().map(String::as_str).collect();
    if arguments.list {
        // No port is needed then. The argument in its place is a filter unless it is a port.
        let is_filter = |name: &&str| {
            sessions.iter().any(|session| session.id.contains(name)) || !port::looks_like_one(name)
        };
        filters.extend(arguments.port.as_deref().filter(is_filter));
    }
    let named = |session: &&Session| {
        filters.is_empty() || filters.iter().any(|filter| session.id.contains(filter))
    };
    let choices: Vec<Choice> = sessions
        .iter()
        .filter(named)
        .map(|session| Choice { session, plan: chooser.plan(session, allowed) })
        .filter(|choice| choice.plan != Err(Reason::Model))
        .collect();
    if choices.is_empty() {
        return Err(Failure::usage(format!(
            "no session of this model has {} in its name; `vimc4 conform --list` names them",
            if filters.is_empty() { "anything".to_owned() } else { filters.join(" or ") }
        )));
    }
    Ok(choices)
}

pub(super) fn allowed(arguments: &Arguments) -> Result<Allowed, Failure> {
    let has = |what| arguments.allow.contains(&what);
    if has(Allow::Moves) && arguments.envelope.is_none() {
        return Err(Failure::usage(
            "moves need to know how far they may go; add --envelope X,Y,Z in steps",
        ));
    }
    if has(Allow::Reference) && !has(Allow::Moves) {
        return Err(Failure::usage(
            "reference runs are motions too; write --allow moves,reference --envelope X,Y,Z",
        ));
    }
    Ok(Allowed {
        moves: has(Allow::Moves),
        reference: has(Allow::Reference),
        outputs: has(Allow::Outputs),
        flash: has(Allow::Flash),
        envelope: arguments.envelope.map_or([(0, 0); AXES], |Envelope(ways)| ways),
        longest: arguments.longest,
    })
}
