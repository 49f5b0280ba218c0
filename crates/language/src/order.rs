//! Orders: the lines that people type to a controller.

use std::time::Duration;

use vimc4_device::{Condition, Deed, Names, Rule, Ruling, Trigger, parse_duration};

use crate::lexer::Read;
use crate::verb::Verb;
use crate::{Lexer, SyntaxError, condition, deed, rule};

/// An order to a controller, or to the program that runs it.
///
/// ```
/// use vimc4_device::{Deed, Names, Signal, SignalId};
/// use vimc4_language::Order;
///
/// let cover = Signal::switch(SignalId(6), "cover", ["open", "closed"], "cover");
/// let names = Names::new([(0, "X".to_owned())], vec![cover]);
/// let order = Order::read("cover open", &names);
/// let turn = Deed::Turn("cover".to_owned(), "open".to_owned());
/// assert_eq!(order, Ok(Some(Order::Do(turn))));
///
/// let wrong = Order::read("cover shut", &names).unwrap_err();
/// assert_eq!(
///     wrong.to_string(),
///     "`cover shut` is wrong at `shut`: `cover` cannot be `shut`; it can be open or closed",
/// );
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Order {
    /// Do something to the device.
    Do(Deed),
    /// Begin or end rules.
    Rule(Ruling),
    /// End all rules and all faults.
    Reset,
    /// Erase the stored program at the panel. What that takes depends on the model and on how the
    /// panel stands.
    Erase,
    /// Move time forward.
    Advance(Duration),
    /// Let time pass until a condition holds.
    RunUntil(Condition),
    /// Give up pending advances of time.
    Cancel,
    /// Say where the axes are.
    Position,
    /// Say what can be set.
    Signals,
    /// List the faults.
    Faults,
    /// Say which rules there are.
    Rules,
    /// List the orders; or give the full help of one verb.
    Help(Option<Verb>),
    /// Say what can follow this.
    Complete(String),
    /// End.
    Quit,
}

impl Order {
    /// Reads a line, for a device with these names; `None` if it is empty.
    ///
    /// # Errors
    ///
    /// If it is not an order, or none for such a device.
    pub fn read(line: &str, names: &Names) -> Result<Option<Order>, SyntaxError> {
        let lexer = Lexer::new(line);
        if lexer.is_at_end() {
            return Ok(None);
        }
        if let Some(begun) = lexer.rest().strip_suffix('?') {
            return Ok(Some(Order::Complete(begun.to_owned())));
        }
        order(lexer, names).map(Some)
    }

    /// The verb that it is.
    #[must_use]
    pub fn verb(&self) -> Verb {
        match self {
            Order::Do(Deed::Press(_)) => Verb::Press,
            Order::Do(Deed::Hold(_)) => Verb::Hold,
            Order::Do(Deed::Release(_)) => Verb::Release,
            Order::Do(Deed::Turn(..)) => Verb::Turn,
            Order::Do(Deed::Input { .. }) => Verb::Input,
            Order::Do(Deed::Power(_)) => Verb::Power,
            Order::Do(Deed::Fault(_)) => Verb::Fault,
            // What is not an order of a person can be told by signals, if at all.
            Order::Do(Deed::Set(..) | Deed::Several { .. } | Deed::Byte(_) | Deed::Restore) => {
                Verb::Set
            }
            Order::Rule(Ruling::Begin(_, scenario)) => match scenario.rules.as_slice() {
                [Rule { name: None, times: None, trigger, .. }] => match trigger {
                    Trigger::Every { first, span } if first == span => Verb::Every,
                    Trigger::At(_) | Trigger::Every { .. } => Verb::At,
                    Trigger::When(_) => Verb::When,
                    Trigger::While(_) => Verb::While,
                },
                _ => Verb::Rule,
            },
            Order::Rule(_) => Verb::Rule,
            Order::Reset => Verb::Reset,
            Order::Rules => Verb::Rules,
            Order::Erase => Verb::Erase,
            Order::Advance(_) => Verb::Advance,
            Order::RunUntil(_) => Verb::RunUntil,
            Order::Cancel => Verb::Cancel,
            Order::Position => Verb::Position,
            Order::Signals => Verb::Signals,
            Order::Faults => Verb::Faults,
            Order::Help(_) => Verb::Help,
            Order::Complete(_) => Verb::Complete,
            Order::Quit => Verb::Quit,
        }
    }
}

/// Reads an order that is the whole rest.
fn order(lexer: Lexer<'_>, names: &Names) -> Read<Order> {
    let mut rest = lexer;
    let Some(verb) = Verb::read(&mut rest) else {
        return deed::turn(lexer, names).map(Order::Do);
    };
    if let Some(deed) = deed::of_verb(verb, rest, names) {
        return deed.map(Order::Do);
    }
    let alone = |order| match rest.is_at_end() {
        true => Ok(order),
        false => Err(rest.wrong(format!("{verb} takes no arguments"))),
    };
    match verb {
        Verb::Advance => parse_duration(rest.rest())
            .map(Order::Advance)
            .map_err(|_| rest.wrong("a number with a unit, as in `advance 250ms` or `advance 2s`")),
        Verb::RunUntil => condition::whole(rest, names).map(Order::RunUntil),
        Verb::Reset => alone(Order::Reset),
        Verb::Rules => alone(Order::Rules),
        Verb::Erase => alone(Order::Erase),
        Verb::Cancel => alone(Order::Cancel),
        Verb::Position => alone(Order::Position),
        Verb::Signals => alone(Order::Signals),
        Verb::Faults => alone(Order::Faults),
        Verb::Quit => alone(Order::Quit),
        Verb::Help => help(rest, names),
        verb if verb.is_of_rules() => rule::ruling(lexer, names).map(Order::Rule),
        _ => Err(deed::unknown(lexer, names)),
    }
}

fn help(here: Lexer<'_>, names: &Names) -> Read<Order> {
    let mut rest = here;
    match Verb::read(&mut rest) {
        None if here.is_at_end() => Ok(Order::Help(None)),
        None => Err(deed::unknown(here, names)),
        Some(verb) if rest.is_at_end() => Ok(Order::Help(Some(verb))),
        Some(_) => Err(here.wrong("an order, as in `help run until`")),
    }
}
