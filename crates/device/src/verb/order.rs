//! A line that people type, read.

use std::error::Error;
use std::fmt;
use std::time::Duration;

use super::deed::Deed;
use super::inputs::{DeedError, is_like};
use super::table::Verb;
use crate::condition::excerpt;
use crate::scenario::{RulePart, RuleTexts, read_rule, read_ruling};
use crate::{Condition, Names, Rule, RuleError, Ruling, Trigger, parse_duration};

/// An order to a controller, or to the program that runs it.
///
/// ```
/// use vimc4_device::{Deed, Names, Order, Signal, SignalId};
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

/// Why a line is not an order: where it goes wrong, and what would be right there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OrderError {
    line: String,
    at: usize,
    right: String,
}

impl OrderError {
    /// From which byte of the line on it is wrong; its length if something is missing at its end.
    #[must_use]
    pub fn at(&self) -> usize {
        self.at
    }

    /// What would be right, for people.
    #[must_use]
    pub fn right(&self) -> &str {
        &self.right
    }
}

impl fmt::Display for OrderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rest = self.line.get(self.at..).unwrap_or_default();
        excerpt(f, &self.line, rest, &self.right)
    }
}

impl Error for OrderError {}

impl Order {
    /// Reads a line, for a device with these names; `None` if it is empty.
    ///
    /// # Errors
    ///
    /// If it is not an order, or none for such a device.
    pub fn read(line: &str, names: &Names) -> Result<Option<Order>, OrderError> {
        let line = Typed(line.trim());
        if line.0.is_empty() {
            return Ok(None);
        }
        if let Some(begun) = line.0.strip_suffix('?') {
            return Ok(Some(Order::Complete(begun.trim_start().to_owned())));
        }
        let words = line.words();
        let order = match Verb::of(&words) {
            Some((verb, length)) => line.order(verb, length, &words, names)?,
            None => line.turn(&words, names)?,
        };
        Ok(Some(order))
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

/// Reads something that a rule does; else where it is none, and what would be right.
fn deed_of(text: &str, names: &Names) -> Result<Deed, (usize, String)> {
    const RIGHT: &str = "something that is done to the controller, such as `press stop`, \
                         `input 0.3 1`, `power off` or `fault cut`";
    match Order::read(text, names) {
        Ok(Some(Order::Do(deed))) => Ok(deed),
        Ok(_) => Err((0, RIGHT.to_owned())),
        // A line that is no order at all is none that a rule could do.
        Err(error) if error.at() == 0 && !error.right().contains("did you mean") => {
            Err((0, RIGHT.to_owned()))
        }
        Err(error) => Err((error.at(), error.right().to_owned())),
    }
}

impl Names {
    /// Reads a rule, as people type it: `when x > 1000: press stop`.
    ///
    /// # Errors
    ///
    /// If it is none, with the place and what would be right there.
    pub fn read_rule(&self, text: &str) -> Result<Rule, RuleError> {
        let ruling = read_ruling(text, self, &|text| deed_of(text, self))?;
        let rules = match ruling {
            Ruling::Begin(_, scenario) => scenario.rules,
            Ruling::End(_) | Ruling::EndAll => Vec::new(),
        };
        let mut rules = rules.into_iter();
        match (rules.next(), rules.next()) {
            (Some(rule), None) => Ok(rule),
            _ => Err(RuleError::new(text, 0, "one rule, as in `when x > 1000: press stop`")),
        }
    }

    /// Reads what is done about scenarios: a rule that begins, `end 3` or `end all`. A scenario of
    /// several rules has them in lines of their own.
    ///
    /// # Errors
    ///
    /// If it is none, with the place and what would be right there.
    pub fn read_ruling(&self, text: &str) -> Result<Ruling, RuleError> {
        read_ruling(text, self, &|text| deed_of(text, self))
    }

    /// Reads a rule that is there in parts, as in a file: its name, how often it acts, what would stand
    /// before its colon, and what would stand behind it.
    ///
    /// # Errors
    ///
    /// If it is none, with the part, the place in it and what would be right there.
    pub fn read_rule_of(
        &self,
        name: Option<&str>,
        times: Option<u64>,
        trigger: &str,
        acts: &str,
    ) -> Result<Rule, (RulePart, RuleError)> {
        let texts = RuleTexts { name, times, trigger, acts };
        read_rule(&texts, self, &|text| deed_of(text, self))
    }
}

/// A line without blanks around it.
#[derive(Clone, Copy)]
struct Typed<'t>(&'t str);

impl<'t> Typed<'t> {
    fn words(self) -> Vec<&'t str> {
        self.0.split_whitespace().collect()
    }

    /// Where a word of it begins; its length if there is no such word.
    fn place(self, word: usize) -> usize {
        let nth = self.0.split_whitespace().nth(word);
        nth.map_or(self.0.len(), |word| word.as_ptr() as usize - self.0.as_ptr() as usize)
    }

    fn wrong(self, at: usize, right: impl Into<String>) -> OrderError {
        OrderError { line: self.0.to_owned(), at, right: right.into() }
    }

    /// A deed, if such a device can have it done to it. What is wrong is wrong at a word.
    fn deed(self, deed: Deed, word: usize, names: &Names) -> Result<Order, OrderError> {
        match deed.inputs(names.signals()) {
            Ok(_) => Ok(Order::Do(deed)),
            Err(DeedError::NoInput { .. }) if names.has_any_bit() => Ok(Order::Do(deed)),
            // A list of all signals would be long.
            Err(DeedError::NoSignal { wanted: "signal", name, like, .. }) if like.is_empty() => {
                let right = format!("there is no signal `{name}`; `signals` lists those there are");
                Err(self.wrong(self.place(word), right))
            }
            Err(error) => Err(self.wrong(self.place(word), error.to_string())),
        }
    }

    /// An order with a verb that takes up the first `from` words.
    fn order(
        self,
        verb: Verb,
        from: usize,
        words: &[&str],
        names: &Names,
    ) -> Result<Order, OrderError> {
        let arguments = &words[from..];
        let place = self.place(from);
        let button = |deed: fn(String) -> Deed| match arguments {
            [] => Err(self.wrong(place, format!("{verb} {}", names.button_names()))),
            name => self.deed(deed(name.join(" ")), from, names),
        };
        let alone = |order: Order| match arguments {
            [] => Ok(order),
            _ => Err(self.wrong(place, format!("{verb} takes no arguments"))),
        };
        match verb {
            Verb::Press => button(Deed::Press),
            Verb::Hold => button(Deed::Hold),
            Verb::Release => button(Deed::Release),
            Verb::Turn | Verb::Complete => Err(self.unknown(words, names)),
            Verb::Input => self.input(arguments, from, names),
            Verb::Set => self.set(arguments, from, names),
            Verb::Power => match arguments {
                ["on"] => Ok(Order::Do(Deed::Power(true))),
                ["off"] => Ok(Order::Do(Deed::Power(false))),
                _ => Err(self.wrong(place, "power on or power off")),
            },
            Verb::Fault => {
                let faulting = names.read_faulting(self.0.get(place..).unwrap_or_default());
                faulting
                    .map(|faulting| Order::Do(Deed::Fault(faulting.into())))
                    .map_err(|error| self.wrong(self.0.len() - error.rest().len(), error.right()))
            }
            Verb::Advance => {
                parse_duration(&arguments.concat()).map(Order::Advance).map_err(|_| {
                    self.wrong(place, "a number with a unit, as in `advance 250ms` or `advance 2s`")
                })
            }
            Verb::RunUntil => self.run_until(arguments, place, names),
            Verb::When | Verb::While | Verb::At | Verb::Every | Verb::Rule => {
                let read = |text: &str| deed_of(text, names);
                let ruling = read_ruling(self.0, names, &read);
                ruling.map(Order::Rule).map_err(|error| self.wrong(error.at(), error.right()))
            }
            Verb::Reset => alone(Order::Reset),
            Verb::Rules => alone(Order::Rules),
            Verb::Erase => alone(Order::Erase),
            Verb::Cancel => alone(Order::Cancel),
            Verb::Position => alone(Order::Position),
            Verb::Signals => alone(Order::Signals),
            Verb::Faults => alone(Order::Faults),
            Verb::Help => match (arguments, Verb::of(arguments)) {
                ([], _) => Ok(Order::Help(None)),
                (words, Some((verb, length))) if words.len() == length => {
                    Ok(Order::Help(Some(verb)))
                }
                (words, None) => Err(self.no_order(place, words, names)),
                _ => Err(self.wrong(place, "an order, as in `help run until`")),
            },
            Verb::Quit => alone(Order::Quit),
        }
    }

    fn input(self, arguments: &[&str], from: usize, names: &Names) -> Result<Order, OrderError> {
        let example = names.input_example().unwrap_or_else(|| "0.3".to_owned());
        let right = |what: &str| format!("{what}, as in `input {example} 1`");
        let [bit, rest @ ..] = arguments else {
            return Err(self.wrong(self.0.len(), right("a port, a bit and a level")));
        };
        let place = bit.split_once('.');
        let place = place.and_then(|(port, bit)| Some((port.parse().ok()?, bit.parse().ok()?)));
        let Some((port, bit)) = place.filter(|(_, bit)| *bit < 8) else {
            // A terminal has the name of the bit that shows it.
            let wired = Deed::Set((*bit).to_owned(), 1).inputs(names.signals());
            let right = match wired {
                Err(error @ DeedError::Terminal { .. }) => error.to_string(),
                _ => right("PORT.BIT, with a bit from 0 to 7"),
            };
            return Err(self.wrong(self.place(from), right));
        };
        let level = match rest {
            ["0"] => false,
            ["1"] => true,
            _ => return Err(self.wrong(self.place(from + 1), right("a level, 0 or 1"))),
        };
        self.deed(Deed::Input { port, bit, level }, from, names)
    }

    /// A signal by its whole name, and a number or the name of a position.
    fn set(self, arguments: &[&str], from: usize, names: &Names) -> Result<Order, OrderError> {
        let named = |name: &str| names.signals().iter().find(|signal| signal.name == name);
        let Some((value, name)) = arguments.split_last() else {
            return Err(self.wrong(self.0.len(), "a signal and a value, as in `set probe 1`"));
        };
        let whole = arguments.join(" ");
        if let Some(signal) = named(&whole) {
            return Err(self.wrong(self.0.len(), signal.values_in_words()));
        }
        let name = if name.is_empty() { whole } else { name.join(" ") };
        let last = from + arguments.len() - 1;
        let Some(signal) = named(&name) else {
            return self.deed(Deed::Set(name, 0), from, names);
        };
        match signal.value_of(value) {
            Some(_) if signal.position(value).is_some() => {
                self.deed(Deed::Turn(name, (*value).to_owned()), last, names)
            }
            Some(value) => self.deed(Deed::Set(name, value), last, names),
            None => {
                let right = format!("{name} can be {}", signal.values_in_words());
                Err(self.wrong(self.place(last), right))
            }
        }
    }

    fn run_until(
        self,
        arguments: &[&str],
        place: usize,
        names: &Names,
    ) -> Result<Order, OrderError> {
        // An axis and a position say it, too.
        if let [axis, position] = arguments
            && let (Some(axis), Ok(position)) = (names.axis(axis), position.parse())
        {
            return Ok(Order::RunUntil(Condition::AxisAt { axis, position }));
        }
        let condition = names.read(self.0.get(place..).unwrap_or_default());
        condition
            .map(Order::RunUntil)
            .map_err(|error| self.wrong(self.0.len() - error.rest().len(), error.right()))
    }

    /// A switch and its position.
    fn turn(self, words: &[&str], names: &Names) -> Result<Order, OrderError> {
        let switches = names.signals().iter().filter(|signal| signal.positions.is_some());
        let named = switches.into_iter().find_map(|switch| {
            let name: Vec<_> = switch.name.split(' ').collect();
            words.starts_with(&name).then_some((switch, name.len()))
        });
        let Some((switch, length)) = named else { return Err(self.unknown(words, names)) };
        match &words[length..] {
            [] => Err(self.wrong(self.0.len(), switch.values_in_words())),
            position => {
                let turn = Deed::Turn(switch.name.clone(), position.join(" "));
                self.deed(turn, length, names)
            }
        }
    }

    /// It begins with nothing known.
    fn unknown(self, words: &[&str], names: &Names) -> OrderError {
        let first = words.first().copied().unwrap_or_default();
        if first == "run" {
            return self
                .wrong(self.place(1), "run until idle, run until x 2500 or run until CONDITION");
        }
        self.no_order(0, words, names)
    }

    /// These words at this place are no order.
    fn no_order(self, place: usize, words: &[&str], names: &Names) -> OrderError {
        let first = words.first().copied().unwrap_or_default();
        let verbs = Verb::all().filter(|verb| verb.is_named() && names.has(*verb));
        let verbs = verbs.map(|verb| verb.name().to_owned());
        let switches = names.signals().iter().filter(|signal| signal.positions.is_some());
        let known: Vec<_> = verbs.chain(switches.map(|switch| switch.name.clone())).collect();
        let like: Vec<_> = known.into_iter().filter(|name| is_like(first, name)).collect();
        let right = match like.as_slice() {
            [] => "not an order; type help for the list".to_owned(),
            like => {
                format!("not an order; did you mean {}? type help for the list", like.join(" or "))
            }
        };
        self.wrong(place, right)
    }
}
