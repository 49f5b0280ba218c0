//! Orders that people type while a controller runs.

use std::future::Future;
use std::pin::Pin;
use std::time::Duration;

use thiserror::Error;
use vimc4_catalogue::{Model, axis};
use vimc4_device::{Condition, Names, Signal, SignalKind, parse_duration};
use vimc4_host::{ControlError, Effect};

use crate::control::Control;
use crate::control::View;
use crate::error::Error;

/// What can be ordered of a controller, a line each, as `help` prints it: what its model has not
/// is not in it.
#[must_use]
pub fn help(model: &Model, signals: &[Signal]) -> String {
    let buttons: Vec<_> =
        signals.iter().filter(|s| s.kind == SignalKind::Button).map(|s| s.name.as_str()).collect();
    let latches = buttons.contains(&"estop");
    let only = |there: bool, text: &'static str| if there { text } else { "" };
    let mut lines = Vec::new();
    let mut line = |order: &str, about: &str| lines.push(format!("{order:<22}{about}"));
    if !buttons.is_empty() {
        let latching = only(latches, "; estop stays pressed until released");
        let buttons = buttons.join(", ");
        line("press BUTTON", &format!("press and release at once: {buttons}{latching}"));
        line("hold BUTTON", "press and keep pressed");
        line("release BUTTON", &format!("release what is held{}", only(latches, ", or the estop")));
    }
    for switch in signals {
        if let Some([first, second]) = &switch.positions {
            line(&format!("{} {first}|{second}", switch.name), &format!("the {}", switch.about));
        }
    }
    let input = signals.iter().find_map(|signal| signal.name.strip_prefix("input "));
    if let Some((place, (port, bit))) =
        input.and_then(|place| Some((place, place.split_once('.')?)))
    {
        line(&format!("input {place} 1"), &format!("set bit {bit} of input port {port}"));
    }
    line("set SIGNAL VALUE", "set any signal; `signals` lists them");
    if model.refuses_to_erase().is_none() {
        line(
            "erase",
            "erase the stored program at the panel: emergency stop, then STOP and ON, all released",
        );
    }
    line("power off|on", "the mains switch");
    line("advance 250ms", "move time forward (manual or instant clock)");
    line("run until idle", "let time pass until nothing moves");
    line("run until x 2500", "let time pass until the axis is there");
    line(
        "run until CONDITION",
        "such as z < -5000, port 2 bit 0 on, limit x+, command @A, answer error 2, line 12; and, or",
    );
    line("position", "where the axes are");
    line("signals", "what can be pressed, turned and set");
    line("help", "this list");
    line("quit", "end, when everything ordered before is answered; a second one ends at once");
    lines.join("\n")
}

/// Something a person tells a running emulator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Order {
    /// Press and release a button; the emergency stop stays pressed.
    Press(String),
    /// Press a button and keep it pressed.
    Hold(String),
    /// Release a button.
    Release(String),
    /// Put a switch into a position.
    Turn(String, String),
    /// Set a bit of an input port.
    Input {
        /// The port.
        port: u16,
        /// The bit.
        bit: u8,
        /// The level.
        level: bool,
    },
    /// Set any signal to a number.
    Set(String, i32),
    /// Erase the stored program at the panel.
    Erase,
    /// The mains switch.
    Power(bool),
    /// Move time forward.
    Advance(Duration),
    /// Let time pass until the controller is idle.
    RunUntilIdle,
    /// Let time pass until a condition holds.
    RunUntil(Condition),
    /// Say where the axes are.
    Position,
    /// Say what can be set.
    Signals,
    /// Say what can be ordered.
    Help,
    /// End.
    Quit,
}

/// Why a line is no order, with what would be one.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct OrderError(String);

impl Order {
    /// Whether it may take its time to be done, while others are: where time passes by itself
    /// what is ordered next is not held up by it.
    #[must_use]
    pub fn lasts(&self) -> bool {
        matches!(self, Order::Advance(_) | Order::RunUntilIdle | Order::RunUntil(_))
    }

    /// Reads a line, with the names of the axes in their order and the signals that can be set;
    /// `None` if it is empty.
    ///
    /// ```
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// use vimc4::{Emulator, Order};
    ///
    /// let emu = Emulator::builder().start()?;
    /// let (axes, signals) = (emu.model().axis_names(), emu.signals()?);
    /// assert_eq!(Order::parse("power off", axes, &signals)?, Some(Order::Power(false)));
    /// let wrong = Order::parse("cover shut", axes, &signals).unwrap_err();
    /// assert_eq!(wrong.to_string(), "`cover shut` is wrong: cover open or cover closed");
    /// # Ok(())
    /// # }
    /// ```
    pub fn parse(
        line: &str,
        axes: &[&str],
        signals: &[Signal],
    ) -> Result<Option<Order>, OrderError> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let wrong = |right: &str| Err(OrderError(format!("`{}` is wrong: {right}", line.trim())));
        let button = |name: &str, verb: &str, order: fn(String) -> Order| {
            let buttons: Vec<_> = signals
                .iter()
                .filter(|signal| signal.kind == SignalKind::Button)
                .map(|signal| signal.name.as_str())
                .collect();
            if buttons.contains(&name) {
                Ok(Some(order(name.to_owned())))
            } else {
                wrong(&format!("{verb} {}", buttons.join(", ")))
            }
        };
        match words.as_slice() {
            [] => Ok(None),
            ["press", rest @ ..] => button(&rest.join(" "), "press", Order::Press),
            ["hold", rest @ ..] => button(&rest.join(" "), "hold", Order::Hold),
            ["release", rest @ ..] => button(&rest.join(" "), "release", Order::Release),
            ["input", rest @ ..] => match parse_input(rest) {
                Some(order) => Ok(Some(order)),
                None => {
                    let name = rest.first().and_then(|name| by_number(name, signals));
                    wrong(&name.unwrap_or("input PORT.BIT LEVEL, as in `input 0.3 1`".to_owned()))
                }
            },
            ["set", rest @ ..] => match parse_set(rest, signals) {
                Ok(order) => Ok(Some(order)),
                Err(right) => wrong(&right),
            },
            ["erase"] => Ok(Some(Order::Erase)),
            ["power", "on"] => Ok(Some(Order::Power(true))),
            ["power", "off"] => Ok(Some(Order::Power(false))),
            ["power", ..] => wrong("power on or power off"),
            ["advance", rest @ ..] => match parse_duration(&rest.concat()) {
                Ok(span) => Ok(Some(Order::Advance(span))),
                Err(_) => wrong("a number with a unit, as in `advance 250ms` or `advance 2s`"),
            },
            ["run", "until", "idle"] => Ok(Some(Order::RunUntilIdle)),
            ["run", "until", rest @ ..] if !rest.is_empty() => {
                // Here an axis has the names that any model gives it.
                if let [name, position] = rest
                    && let (Some(axis), Ok(position)) = (axis(name), position.parse())
                {
                    return Ok(Some(Order::RunUntil(Condition::AxisAt { axis, position })));
                }
                let text = line.split_once("until").map_or("", |(_, text)| text);
                let named = (0..).zip(axes).map(|(index, name)| (index, (*name).to_owned()));
                match Names::new(named, signals.to_vec()).read(text) {
                    Ok(Condition::Idle) => Ok(Some(Order::RunUntilIdle)),
                    Ok(condition) => Ok(Some(Order::RunUntil(condition))),
                    Err(error) => Err(OrderError(format!("run until: {error}"))),
                }
            }
            ["run", ..] => wrong("run until idle, run until x 2500 or run until CONDITION"),
            ["position"] => Ok(Some(Order::Position)),
            ["signals"] => Ok(Some(Order::Signals)),
            ["help"] => Ok(Some(Order::Help)),
            ["quit"] => Ok(Some(Order::Quit)),
            [name, rest @ ..] => {
                let switch = signals.iter().find(|signal| signal.name == *name);
                let Some(positions) = switch.and_then(|switch| switch.positions.as_ref()) else {
                    return wrong("not an order; type help for the list");
                };
                match rest {
                    [position] if positions.iter().any(|known| known == position) => {
                        Ok(Some(Order::Turn((*name).to_owned(), (*position).to_owned())))
                    }
                    _ => {
                        let [first, second] = positions;
                        wrong(&format!("{name} {first} or {name} {second}"))
                    }
                }
            }
        }
    }
}

/// What an order leads to: text to print, if there is any.
pub type Outcome = Pin<Box<dyn Future<Output = Result<String, Error>> + Send>>;

impl Control {
    /// Carries an order out. It is given at once, so orders take effect in the order of these
    /// calls; what comes of it can be awaited.
    pub fn give(&self, order: &Order) -> Outcome {
        match order {
            Order::Press(name) => done(self.press(name)),
            Order::Hold(name) => done(self.hold(name)),
            Order::Release(name) => done(self.release(name)),
            Order::Turn(name, position) => done(self.turn(name, position)),
            Order::Input { port, bit, level } => done(self.input(*port, *bit, *level)),
            Order::Set(name, value) => done(self.set_signal(name, *value)),
            Order::Erase => {
                let seconds = self.model().panel_erase_ms().unwrap_or(0) as f64 / 1_000.0;
                let (before, effect) = (self.view(), self.erase());
                Box::pin(async move {
                    let (before, effect) = (before.await?, effect.await?);
                    Ok(match effect {
                        Effect::Something if before.powered => format!(
                            "ok: the memory is erased, which takes {seconds} s; then press on, for \
                             the emergency stop has switched the stages off"
                        ),
                        Effect::Something => {
                            "ok, but nothing is erased: the power is off".to_owned()
                        }
                        effect => said(&effect),
                    })
                })
            }
            Order::Power(on) => done(self.power(*on)),
            Order::Advance(span) => answer(self.advance(*span), |at| format!("now {at}")),
            Order::RunUntilIdle => answer(self.run_until_idle(), |at| format!("idle at {at}")),
            Order::RunUntil(condition) => {
                answer(self.run_until(condition.clone()), |at| format!("there at {at}"))
            }
            Order::Position => answer(self.view(), |view| position(&view)),
            Order::Signals => answer(self.signals(), |signals| list(&signals)),
            Order::Help => {
                let model = self.model().clone();
                answer(self.signals(), move |signals| help(&model, &signals))
            }
            Order::Quit => {
                self.stop();
                Box::pin(async { Ok(String::new()) })
            }
        }
    }
}

/// That something changed nothing is worth a word.
fn done(reply: impl Future<Output = Result<Effect, ControlError>> + Send + 'static) -> Outcome {
    answer(reply, |effect| said(&effect))
}

fn said(effect: &Effect) -> String {
    match effect {
        Effect::Something => "ok".to_owned(),
        Effect::Nothing { why: Some(why) } => format!("ok, without effect: {why}"),
        Effect::Nothing { why: None } => "ok, without effect".to_owned(),
    }
}

fn answer<T: Send + 'static>(
    reply: impl Future<Output = Result<T, ControlError>> + Send + 'static,
    text: impl FnOnce(T) -> String + Send + 'static,
) -> Outcome {
    Box::pin(async { Ok(text(reply.await?)) })
}

/// `X 2500 Y 0 Z 0 A 0`
fn position(view: &View) -> String {
    let axes: Vec<_> =
        view.axes.iter().map(|axis| format!("{} {}", axis.name, axis.position)).collect();
    axes.join(" ")
}

fn list(signals: &[Signal]) -> String {
    let lines: Vec<_> = signals
        .iter()
        .map(|signal| {
            let values = match (&signal.kind, &signal.positions) {
                (_, Some([first, second])) => format!("{first}|{second}"),
                (SignalKind::Analogue { low, high }, _) => format!("{low}..{high}"),
                _ => "0|1".to_owned(),
            };
            format!("{:<16}  {values:<12}  {}", signal.name, signal.about)
        })
        .collect();
    lines.join("\n")
}

fn parse_input(words: &[&str]) -> Option<Order> {
    let [place, level @ ("0" | "1")] = words else { return None };
    let (port, bit) = place.split_once('.')?;
    let bit = bit.parse().ok().filter(|bit| *bit < 8)?;
    Some(Order::Input { port: port.parse().ok()?, bit, level: *level == "1" })
}

/// A signal by its whole name, and a number or the name of a position; else what would be right.
fn parse_set(words: &[&str], signals: &[Signal]) -> Result<Order, String> {
    let named = |name: &str| signals.iter().find(|signal| signal.name == name);
    let Some((value, name)) = words.split_last() else {
        return Err("set SIGNAL VALUE, as in `set probe 1`".to_owned());
    };
    let name = name.join(" ");
    let Some(signal) = named(&name) else {
        let whole = words.join(" ");
        return Err(match named(&whole) {
            Some(signal) => values(signal),
            None => like(if name.is_empty() { &whole } else { &name }, signals),
        });
    };
    if signal.position(value).is_some() {
        return Ok(Order::Turn(name, (*value).to_owned()));
    }
    let value = signal.value_of(value).ok_or_else(|| values(signal))?;
    Ok(Order::Set(name, value))
}

/// What a signal can be set to.
fn values(signal: &Signal) -> String {
    let name = &signal.name;
    match (&signal.kind, &signal.positions) {
        (_, Some([first, second])) => format!("set {name} {first} or set {name} {second}"),
        (SignalKind::Analogue { low, high }, _) => format!("set {name} {low} to {high}"),
        _ => format!("set {name} 0 or set {name} 1"),
    }
}

/// `in1`, as profiles number the inputs, has the name of the bit that shows it.
fn by_number(name: &str, signals: &[Signal]) -> Option<String> {
    let number: u8 = name.strip_prefix("in")?.parse().ok()?;
    let about = format!("user input {number}");
    let signal = signals.iter().find(|signal| signal.about == about)?;
    Some(format!("{name} is called {0}, as in `{0} 1`", signal.name))
}

/// What is meant by a name that no signal has.
fn like(name: &str, signals: &[Signal]) -> String {
    if let Some(right) = by_number(name, signals) {
        return right;
    }
    let near = |signal: &&Signal| {
        let known = signal.name.as_str();
        let part = name.len() > 2 && (known.contains(name) || name.contains(known));
        part || distance(name, known) <= known.len() / 3
    };
    let near: Vec<_> = signals.iter().filter(near).map(|signal| signal.name.as_str()).collect();
    match near.as_slice() {
        [] => format!("there is no signal `{name}`; `signals` lists those there are"),
        [..] => format!("there is no signal `{name}`; did you mean {}?", near.join(" or ")),
    }
}

/// How many letters are to be put in, left out or exchanged to make one word of the other.
fn distance(one: &str, other: &str) -> usize {
    let mut row: Vec<usize> = (0..=other.chars().count()).collect();
    for (i, a) in one.chars().enumerate() {
        let mut corner = std::mem::replace(&mut row[0], i + 1);
        for (j, b) in other.chars().enumerate() {
            let exchanged = corner + usize::from(a != b);
            corner = row[j + 1];
            row[j + 1] = exchanged.min(corner + 1).min(row[j] + 1);
        }
    }
    row.last().copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use vimc4_device::SignalId;

    use super::*;

    fn signals() -> Vec<Signal> {
        let signal = |id, name: &str, kind, positions: Option<[&str; 2]>| Signal {
            id: SignalId(id),
            name: name.to_owned(),
            kind,
            positions: positions.map(|p| p.map(str::to_owned)),
            about: String::new(),
        };
        vec![
            signal(0, "start", SignalKind::Button, None),
            signal(1, "estop", SignalKind::Button, None),
            signal(2, "key", SignalKind::Switch, Some(["test", "auto"])),
            signal(3, "limit x-", SignalKind::Input, None),
            Signal {
                about: "user input 1".to_owned(),
                ..signal(4, "input 0.2", SignalKind::Input, None)
            },
            signal(5, "ball x", SignalKind::Analogue { low: -9, high: 9 }, None),
        ]
    }

    fn parse(line: &str) -> Result<Option<Order>, String> {
        Order::parse(line, &["X", "Y", "Z", "A"], &signals()).map_err(|error| error.to_string())
    }

    #[test]
    fn every_word_of_the_product_is_understood() {
        let text = str::to_owned;
        for (line, order) in [
            ("press start", Order::Press(text("start"))),
            ("  press   estop ", Order::Press(text("estop"))),
            ("release estop", Order::Release(text("estop"))),
            ("hold start", Order::Hold(text("start"))),
            ("key auto", Order::Turn(text("key"), text("auto"))),
            ("input 0.3 1", Order::Input { port: 0, bit: 3, level: true }),
            ("input 65531.0 0", Order::Input { port: 65_531, bit: 0, level: false }),
            ("set limit x- 1", Order::Set(text("limit x-"), 1)),
            ("set key auto", Order::Turn(text("key"), text("auto"))),
            ("set key 1", Order::Set(text("key"), 1)),
            ("set ball x -9", Order::Set(text("ball x"), -9)),
            ("erase", Order::Erase),
            ("power off", Order::Power(false)),
            ("advance 250ms", Order::Advance(Duration::from_millis(250))),
            ("advance 1.5s", Order::Advance(Duration::from_millis(1_500))),
            ("advance 0.1h", Order::Advance(Duration::from_secs(360))),
            ("run until idle", Order::RunUntilIdle),
            ("run until x 2500", Order::RunUntil(Condition::AxisAt { axis: 0, position: 2_500 })),
            ("run until A -5", Order::RunUntil(Condition::AxisAt { axis: 3, position: -5 })),
            ("run until z3 0", Order::RunUntil(Condition::AxisAt { axis: 5, position: 0 })),
            (
                "run  until z < -5000 or limit x+",
                Order::RunUntil(Condition::Any(vec![
                    Condition::AxisBelow { axis: 2, position: -5_000 },
                    Condition::Limit { axis: 0, positive: true, active: true },
                ])),
            ),
            ("position", Order::Position),
            ("signals", Order::Signals),
            ("help", Order::Help),
            ("quit", Order::Quit),
        ] {
            assert_eq!(parse(line), Ok(Some(order)), "{line}");
        }
        assert_eq!(parse("   "), Ok(None));
    }

    #[test]
    fn a_wrong_line_says_what_would_be_right() {
        for (line, right) in [
            ("press", "press start, estop"),
            ("press stpo", "press start, estop"),
            ("release key", "release start, estop"),
            ("key", "key test or key auto"),
            ("key automatic", "key test or key auto"),
            ("input 0.8 1", "as in `input 0.3 1`"),
            ("input 0.3 2", "as in `input 0.3 1`"),
            ("input in1 1", "in1 is called input 0.2, as in `input 0.2 1`"),
            ("set", "as in `set probe 1`"),
            ("set in1 1", "in1 is called input 0.2, as in `input 0.2 1`"),
            ("set in7 1", "no signal `in7`; `signals` lists those there are"),
            ("set key shut", "set key test or set key auto"),
            ("set limit x-", "set limit x- 0 or set limit x- 1"),
            ("set limit x- 2", "set limit x- 0 or set limit x- 1"),
            ("set limitx- 1", "no signal `limitx-`; did you mean limit x-?"),
            ("set ball x 10", "set ball x -9 to 9"),
            ("set nothing 1", "no signal `nothing`; `signals` lists those there are"),
            ("advance 250", "as in `advance 250ms`"),
            ("advance 99999999999h", "as in `advance 250ms`"),
            ("power", "power on or power off"),
            ("run", "run until idle"),
            ("run until", "run until CONDITION"),
            ("run until b 5", "axes are x, y, z, a"),
            ("run until x < far", "is wrong at `far`: a position in steps"),
            ("dance", "type help"),
        ] {
            let error = parse(line).unwrap_err();
            assert!(error.contains(right), "{line}: {error}");
            let said = line.strip_prefix("run until ").unwrap_or(line);
            assert!(error.contains(said), "{line}: {error}");
        }
    }
}
