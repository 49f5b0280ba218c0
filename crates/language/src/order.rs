//! Orders: the lines that people type to a controller.

use std::time::Duration;

use vimc4_device::{
    Condition, Deed, DeedError, Names, Rule, Ruling, Signal, Trigger, is_like, parse_duration,
};

use crate::lexer::Read;
use crate::verb::Verb;
use crate::{Lexer, SyntaxError, condition, fault, panel, rule};

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

/// Reads something that a rule does, which is the whole rest.
pub(crate) fn deed(lexer: Lexer<'_>, names: &Names) -> Read<Deed> {
    let right = || {
        lexer.wrong(
            "something that is done to the controller, such as `press stop`, `input 0.3 1`, \
             `power off` or `fault cut`",
        )
    };
    let mut rest = lexer;
    let verb = Verb::read(&mut rest);
    if verb.is_some_and(Verb::is_of_rules) {
        return Err(right());
    }
    match order(lexer, names) {
        Ok(Order::Do(deed)) => Ok(deed),
        Ok(_) => Err(right()),
        // A line that is no order at all is none that a rule could do.
        Err(error) if error.span.start == lexer.at() && !error.help.contains("did you mean") => {
            Err(right())
        }
        Err(error) => Err(error),
    }
}

/// Reads an order that is the whole rest.
fn order(lexer: Lexer<'_>, names: &Names) -> Read<Order> {
    let mut rest = lexer;
    match Verb::read(&mut rest) {
        Some(verb) => Line { lexer, rest, names }.order(verb),
        None => turn(lexer, names),
    }
}

/// A line whose verb has been read.
struct Line<'t, 'n> {
    lexer: Lexer<'t>,
    rest: Lexer<'t>,
    names: &'n Names,
}

impl Line<'_, '_> {
    fn order(&self, verb: Verb) -> Read<Order> {
        let (rest, names) = (self.rest, self.names);
        let alone = |order| match rest.is_at_end() {
            true => Ok(order),
            false => Err(rest.wrong(format!("{verb} takes no arguments"))),
        };
        match verb {
            Verb::Press => self.button(verb, Deed::Press),
            Verb::Hold => self.button(verb, Deed::Hold),
            Verb::Release => self.button(verb, Deed::Release),
            Verb::Turn | Verb::Complete => Err(unknown(self.lexer, names)),
            Verb::Input => self.input(),
            Verb::Set => self.set(),
            Verb::Power => match rest.rest() {
                "on" => Ok(Order::Do(Deed::Power(true))),
                "off" => Ok(Order::Do(Deed::Power(false))),
                _ => Err(rest.wrong("power on or power off")),
            },
            Verb::Fault => Ok(Order::Do(Deed::Fault(Box::new(fault::faulting(rest, names)?)))),
            Verb::Advance => parse_duration(rest.rest()).map(Order::Advance).map_err(|_| {
                rest.wrong("a number with a unit, as in `advance 250ms` or `advance 2s`")
            }),
            Verb::RunUntil => condition::whole(rest, names).map(Order::RunUntil),
            Verb::When | Verb::While | Verb::At | Verb::Every | Verb::Rule => {
                rule::ruling(self.lexer, names).map(Order::Rule)
            }
            Verb::Reset => alone(Order::Reset),
            Verb::Rules => alone(Order::Rules),
            Verb::Erase => alone(Order::Erase),
            Verb::Cancel => alone(Order::Cancel),
            Verb::Position => alone(Order::Position),
            Verb::Signals => alone(Order::Signals),
            Verb::Faults => alone(Order::Faults),
            Verb::Help => self.help(),
            Verb::Quit => alone(Order::Quit),
        }
    }

    fn help(&self) -> Read<Order> {
        let mut rest = self.rest;
        if rest.is_at_end() {
            return Ok(Order::Help(None));
        }
        match Verb::read(&mut rest) {
            Some(verb) if rest.is_at_end() => Ok(Order::Help(Some(verb))),
            Some(_) => Err(self.rest.wrong("an order, as in `help run until`")),
            None => Err(no_order(self.rest, self.names)),
        }
    }

    fn button(&self, verb: Verb, deed: fn(String) -> Deed) -> Read<Order> {
        if self.rest.is_at_end() {
            return Err(self.rest.wrong(format!("{verb} {}", panel::button_names(self.names))));
        }
        checked(deed(joined(self.rest)), self.rest, self.names)
    }

    fn input(&self) -> Read<Order> {
        let (mut rest, names) = (self.rest, self.names);
        let example = panel::input_example(names).unwrap_or_else(|| "0.3".to_owned());
        let expected = |what: &str| format!("{what}, as in `input {example} 1`");
        let Some(bit) = rest.chunk() else {
            return Err(rest.wrong(expected("a port, a bit and a level")));
        };
        let place = bit.split_once('.');
        let place = place.and_then(|(port, bit)| Some((port.parse().ok()?, bit.parse().ok()?)));
        let Some((port, bit)) = place.filter(|(_, bit)| *bit < 8) else {
            // A terminal has the name of the bit that shows it.
            let wired = Deed::Set(bit.to_owned(), 1).inputs(names.signals());
            return Err(self.rest.wrong(match wired {
                Err(error @ DeedError::Terminal { .. }) => error.to_string(),
                _ => expected("PORT.BIT, with a bit from 0 to 7"),
            }));
        };
        let level = match rest.rest() {
            "0" => false,
            "1" => true,
            _ => return Err(rest.wrong(expected("a level, 0 or 1"))),
        };
        checked(Deed::Input { port, bit, level }, self.rest, names)
    }

    /// A signal by its whole name, and a number or the name of a position.
    fn set(&self) -> Read<Order> {
        let named = |name: &str| self.names.signals().iter().find(|signal| signal.name == name);
        let Some((name, last)) = self.rest.last_word() else {
            return Err(self.rest.wrong("a signal and a value, as in `set probe 1`"));
        };
        let whole = joined(self.rest);
        if let Some(signal) = named(&whole) {
            return Err(self.rest.missing(signal.values_in_words()));
        }
        let name = if name.is_at_end() { whole } else { joined(name) };
        let value = last.rest();
        let Some(signal) = named(&name) else {
            return checked(Deed::Set(name, 0), self.rest, self.names);
        };
        match signal.value_of(value) {
            Some(_) if signal.position(value).is_some() => {
                checked(Deed::Turn(name, value.to_owned()), last, self.names)
            }
            Some(value) => checked(Deed::Set(name, value), last, self.names),
            None => Err(last.wrong(format!("{name} can be {}", signal.values_in_words()))),
        }
    }
}

/// A switch and its position.
fn turn(lexer: Lexer<'_>, names: &Names) -> Read<Order> {
    let switches = names.signals().iter().filter(|signal| signal.positions.is_some());
    let named = |switch: &Signal| {
        let mut rest = lexer;
        switch.name.split(' ').all(|word| rest.chunk() == Some(word)).then_some(rest)
    };
    let Some((switch, rest)) = switches.into_iter().find_map(|one| Some((one, named(one)?))) else {
        return Err(unknown(lexer, names));
    };
    if rest.is_at_end() {
        return Err(rest.wrong(switch.values_in_words()));
    }
    checked(Deed::Turn(switch.name.clone(), joined(rest)), rest, names)
}

/// The words of the rest, with one blank between them.
fn joined(lexer: Lexer<'_>) -> String {
    lexer.rest().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A deed, if such a device can have it done to it; else this place is wrong.
fn checked(deed: Deed, here: Lexer<'_>, names: &Names) -> Read<Order> {
    match deed.inputs(names.signals()) {
        Ok(_) => Ok(Order::Do(deed)),
        Err(DeedError::NoInput { .. }) if names.has_any_bit() => Ok(Order::Do(deed)),
        // A list of all signals would be long.
        Err(DeedError::NoSignal { wanted: "signal", name, like, .. }) if like.is_empty() => {
            Err(here.wrong(format!("there is no signal `{name}`; `signals` lists those there are")))
        }
        Err(error) => Err(here.wrong(error.to_string())),
    }
}

/// It begins with nothing known.
fn unknown(mut lexer: Lexer<'_>, names: &Names) -> SyntaxError {
    let here = lexer;
    match lexer.keyword("run") {
        true => lexer.wrong("run until idle, run until x 2500 or run until CONDITION"),
        false => no_order(here, names),
    }
}

/// What is here is no order.
fn no_order<'n>(here: Lexer<'_>, names: &'n Names) -> SyntaxError {
    let first = here.rest().split_whitespace().next().unwrap_or_default();
    let verbs = Verb::all().filter(|verb| verb.is_named() && verb.is_of(names));
    let verbs = verbs.map(|verb| -> &'n str { verb.name() });
    let switches = names.signals().iter().filter(|signal| signal.positions.is_some());
    let known = verbs.chain(switches.map(|switch| switch.name.as_str()));
    let like: Vec<_> = known.filter(|name| is_like(first, name)).collect();
    here.wrong(match like.as_slice() {
        [] => "not an order; type help for the list".to_owned(),
        like => {
            format!("not an order; did you mean {}? type help for the list", like.join(" or "))
        }
    })
}
