//! Faults of the machine.
//!
//! ```text
//! KIND = "switch" AXIS ("-" | "+") ("pressed" | "released" | "missing" | "late" STEPS)
//!      | "switch" AXIS "swapped" | "backlash" AXIS STEPS | "load" AXIS HZ_PER_MS | "jam" AXIS
//!      | "push" AXIS STEPS | "hold" SIGNAL [VALUE] | "bounce" SIGNAL TIMES TIME | "power-off"
//! ```

use std::str::FromStr;
use std::time::Duration;

use vimc4_device::{Mishap, Names, SignalId, SwitchSays};

use crate::Lexer;
use crate::lexer::Read;

/// The kinds, as they are typed, and what each does.
pub(crate) const KINDS: [(&str, &str); 8] = [
    (
        "switch",
        "a limit switch fails: `switch x- pressed|released|missing`, `switch x- late 30`, `switch x swapped`",
    ),
    ("backlash", "an axis has play, in steps, as in `backlash x 12`"),
    ("load", "an axis has more to pull, in Hz/ms, as in `load z 50`"),
    ("jam", "the motor of an axis cannot turn, as in `jam x`"),
    ("push", "a carriage is moved by hand, as in `push x -40`"),
    (
        "hold",
        "a signal has a value, whatever it is set to, as in `hold overtemperature` or `hold power-ok 0`",
    ),
    ("bounce", "a contact goes back so many times, so long apart, as in `bounce limit x- 5 2ms`"),
    ("power-off", "the mains are off"),
];

/// What a kind and the words behind it do to the machine; `None` if there is no such kind.
pub(crate) fn mishap(kind: &str, lexer: &mut Lexer<'_>, names: &Names) -> Option<Read<Mishap>> {
    Some(match kind {
        "switch" => switch(lexer, names),
        "backlash" => axis_and(lexer, names, "steps, as in `backlash x 12`")
            .map(|(axis, steps)| Mishap::Backlash { axis, steps }),
        "load" => axis_and(lexer, names, "an acceleration in Hz/ms, as in `load z 50`")
            .map(|(axis, pull)| Mishap::Load { axis, pull }),
        "jam" => axis(lexer, names).map(Mishap::Jam),
        "push" => axis_and(lexer, names, "steps of the machine, as in `push x -40`")
            .map(|(axis, steps)| Mishap::Push { axis, steps }),
        "brown-out" => match names.signals().iter().find(|signal| signal.name == "power-ok") {
            Some(signal) => Ok(Mishap::Hold { signal: signal.id, value: 0 }),
            None => Err(lexer.wrong("another kind: nothing here tells of the motor supply")),
        },
        "hold" => hold(lexer, names),
        "bounce" => bounce(lexer, names),
        "power-off" => Ok(Mishap::Power),
        _ => return None,
    })
}

fn hold(lexer: &mut Lexer<'_>, names: &Names) -> Read<Mishap> {
    let signal = signal(lexer, names)?;
    let value = match names.signal_named(signal) {
        Some(known) => {
            let value = lexer.word_as(|word| known.value_of(word));
            if value.is_none() && lexer.peek().parse::<i64>().is_ok() {
                return Err(lexer.wrong(known.values_in_words()));
            }
            value
        }
        None => lexer.value(),
    };
    Ok(Mishap::Hold { signal, value: value.unwrap_or(1) })
}

fn switch(lexer: &mut Lexer<'_>, names: &Names) -> Read<Mishap> {
    if let Some(axis) = lexer.word_as(|word| names.axis(word)) {
        return match lexer.keyword("swapped") {
            true => Ok(Mishap::Swapped(axis)),
            false => Err(lexer.wrong("swapped, or a + or - behind the axis")),
        };
    }
    let expected = "a limit switch or an axis, as in `switch x- pressed` or `switch x swapped`";
    let (axis, positive) = lexer.expect(expected, |word| {
        let axis = names.axis(word.strip_suffix(['+', '-'])?)?;
        Some((axis, word.ends_with('+')))
    })?;
    let says = if lexer.keyword("pressed") || lexer.keyword("closed") {
        SwitchSays::Pressed
    } else if lexer.keyword("released") || lexer.keyword("open") {
        SwitchSays::Released
    } else if lexer.keyword("missing") {
        SwitchSays::Nothing
    } else if lexer.keyword("late") {
        SwitchSays::Late(number(lexer, "steps, as in `switch x- late 30`")?)
    } else {
        return Err(lexer.wrong("pressed, released, missing or late"));
    };
    Ok(Mishap::Switch { axis, positive, says })
}

fn bounce(lexer: &mut Lexer<'_>, names: &Names) -> Read<Mishap> {
    let signal = signal(lexer, names)?;
    let here = *lexer;
    let expected = "how many times, up to 255, and how long apart, as in `bounce limit x- 5 2ms`";
    let times = lexer.expect(expected, |word| word.parse().ok().filter(|times| *times > 0))?;
    let period = lexer.span("bounce limit x- 5 2ms")?;
    if period == Duration::ZERO {
        return Err(here.wrong("a time apart, as in `bounce limit x- 5 2ms`"));
    }
    Ok(Mishap::Bounce { signal, times, period })
}

fn axis(lexer: &mut Lexer<'_>, names: &Names) -> Read<u8> {
    let expected = match names.shown_axes().as_slice() {
        [] => "an axis".to_owned(),
        axes => format!("an axis: {}", axes.join(", ")),
    };
    lexer.expect(&expected, |word| names.axis(word))
}

fn axis_and<T: FromStr>(lexer: &mut Lexer<'_>, names: &Names, expected: &str) -> Read<(u8, T)> {
    Ok((axis(lexer, names)?, number(lexer, expected)?))
}

fn number<T: FromStr>(lexer: &mut Lexer<'_>, expected: &str) -> Read<T> {
    lexer.expect(expected, |word| word.parse().ok())
}

fn signal(lexer: &mut Lexer<'_>, names: &Names) -> Read<SignalId> {
    if let Some(signal) = lexer.signal(names) {
        return Ok(signal.id);
    }
    number(lexer, "the name of a signal, as in `hold estop`").map(SignalId)
}
