//! Orders that do something to a device.

use vimc4_device::{Deed, DeedError, Names, Signal, is_like};

use crate::lexer::Read;
use crate::verb::Verb;
use crate::{Lexer, SyntaxError, fault, panel};

/// Reads something that a rule does, which is the whole rest.
pub(crate) fn deed(lexer: Lexer<'_>, names: &Names) -> Read<Deed> {
    let other = || {
        lexer.wrong(
            "something that is done to the controller, such as `press stop`, `input 0.3 1`, \
             `power off` or `fault cut`",
        )
    };
    let mut rest = lexer;
    let read = match Verb::read(&mut rest) {
        Some(verb) => of_verb(verb, rest, names).unwrap_or_else(|| Err(other())),
        None => turn(lexer, names),
    };
    // A line that is no order at all is none that a rule could do.
    read.map_err(|error| {
        let is_unknown = error.span.start == lexer.at() && !error.help.contains("did you mean");
        if is_unknown { other() } else { error }
    })
}

/// Reads what is done by a verb, which has been read; `None` if the verb does nothing to the device.
pub(crate) fn of_verb(verb: Verb, rest: Lexer<'_>, names: &Names) -> Option<Read<Deed>> {
    Some(match verb {
        Verb::Press => button(verb, Deed::Press, rest, names),
        Verb::Hold => button(verb, Deed::Hold, rest, names),
        Verb::Release => button(verb, Deed::Release, rest, names),
        Verb::Input => input(rest, names),
        Verb::Set => set(rest, names),
        Verb::Power => match rest.rest() {
            "on" => Ok(Deed::Power(true)),
            "off" => Ok(Deed::Power(false)),
            _ => Err(rest.wrong("power on or power off")),
        },
        Verb::Fault => fault::faulting(rest, names).map(|faulting| Deed::Fault(faulting.into())),
        _ => return None,
    })
}

fn button(verb: Verb, deed: fn(String) -> Deed, rest: Lexer<'_>, names: &Names) -> Read<Deed> {
    if rest.is_at_end() {
        return Err(rest.wrong(format!("{verb} {}", panel::button_names(names))));
    }
    checked(deed(joined(rest)), rest, names)
}

fn input(here: Lexer<'_>, names: &Names) -> Read<Deed> {
    let mut rest = here;
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
        return Err(here.wrong(match wired {
            Err(error @ DeedError::Terminal { .. }) => error.to_string(),
            _ => expected("PORT.BIT, with a bit from 0 to 7"),
        }));
    };
    let level = match rest.rest() {
        "0" => false,
        "1" => true,
        _ => return Err(rest.wrong(expected("a level, 0 or 1"))),
    };
    checked(Deed::Input { port, bit, level }, here, names)
}

/// A signal by its whole name, and a number or the name of a position.
fn set(rest: Lexer<'_>, names: &Names) -> Read<Deed> {
    let named = |name: &str| names.signals().iter().find(|signal| signal.name == name);
    let Some((name, last)) = rest.last_word() else {
        return Err(rest.wrong("a signal and a value, as in `set probe 1`"));
    };
    let whole = joined(rest);
    if let Some(signal) = named(&whole) {
        return Err(rest.missing(signal.values_in_words()));
    }
    let name = if name.is_at_end() { whole } else { joined(name) };
    let value = last.rest();
    let Some(signal) = named(&name) else {
        return checked(Deed::Set(name, 0), rest, names);
    };
    match signal.value_of(value) {
        Some(_) if signal.position(value).is_some() => {
            checked(Deed::Turn(name, value.to_owned()), last, names)
        }
        Some(value) => checked(Deed::Set(name, value), last, names),
        None => Err(last.wrong(format!("{name} can be {}", signal.values_in_words()))),
    }
}

/// A switch and its position.
pub(crate) fn turn(lexer: Lexer<'_>, names: &Names) -> Read<Deed> {
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
fn checked(deed: Deed, here: Lexer<'_>, names: &Names) -> Read<Deed> {
    match deed.inputs(names.signals()) {
        Ok(_) => Ok(deed),
        Err(DeedError::NoInput { .. }) if names.has_any_bit() => Ok(deed),
        // A list of all signals would be long.
        Err(DeedError::NoSignal { wanted: "signal", name, like, .. }) if like.is_empty() => {
            Err(here.wrong(format!("there is no signal `{name}`; `signals` lists those there are")))
        }
        Err(error) => Err(here.wrong(error.to_string())),
    }
}

/// It begins with nothing known.
pub(crate) fn unknown(mut lexer: Lexer<'_>, names: &Names) -> SyntaxError {
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
