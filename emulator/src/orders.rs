//! The lines that people type while controllers run.

use std::future::{Future, poll_fn};
use std::io::{self, BufRead, Read};
use std::pin::Pin;
use std::task::{Context, Poll};
use std::thread;

use tokio::sync::mpsc;
use vimc4::{Emulator, Names, Order, Sort};

use crate::text;

/// Longer than any order, in bytes with its end.
const LONGEST: usize = 1_000;

/// How many characters of a longer line are shown.
const SHOWN: usize = 40;

/// A typed line.
pub(crate) enum Typed {
    Line(String),
    /// The beginning of a line that is too long for an order.
    TooLong(String),
}

/// Reads standard input line by line in a thread of its own. The channel closes at its end.
pub(crate) fn read() -> mpsc::Receiver<Typed> {
    let (sender, lines) = mpsc::channel(16);
    // Without the thread no orders can be typed, but the controllers run.
    let _ = thread::Builder::new().name("orders".to_owned()).spawn(move || {
        if in_background() {
            // There is no input, but it has not ended either.
            loop {
                thread::park();
            }
        }
        let mut input = io::stdin().lock();
        while let Ok(Some(line)) = next(&mut input) {
            if sender.blocking_send(line).is_err() {
                return;
            }
        }
    });
    lines
}

/// The next line; of one that is too long only the beginning is kept.
fn next(input: &mut impl BufRead) -> io::Result<Option<Typed>> {
    let mut line = Vec::new();
    let mut piece = |line: &mut Vec<u8>| {
        input.take(LONGEST as u64).read_until(b'\n', line).map(|count| count == LONGEST)
    };
    let full = piece(&mut line)?;
    if line.is_empty() {
        return Ok(None);
    }
    let text = String::from_utf8_lossy(&line).into_owned();
    if !full || line.ends_with(b"\n") {
        return Ok(Some(Typed::Line(text)));
    }
    // Its rest is not an order either.
    loop {
        line.clear();
        if !piece(&mut line)? || line.ends_with(b"\n") {
            return Ok(Some(Typed::TooLong(text.chars().take(SHOWN).collect())));
        }
    }
}

/// A program in the background that reads from its terminal is stopped by the system.
#[cfg(unix)]
fn in_background() -> bool {
    let group = rustix::termios::tcgetpgrp(rustix::stdio::stdin());
    group.is_ok_and(|group| group != rustix::process::getpgrp())
}

#[cfg(not(unix))]
fn in_background() -> bool {
    false
}

/// No more orders than these are awaited at each controller.
const MOST_WAITING: usize = 1_000;

/// No more of those that are done at once are given before they are answered; input with more of
/// them waits for that.
const MOST_GIVEN: usize = 1_000;

/// What a line asks for, beyond what was done at once.
#[derive(PartialEq, Eq)]
pub(crate) enum Next {
    Continue,
    Quit,
}

/// The orders that have been given and are not answered yet, oldest first.
///
/// Everything is ordered at once, so that STOP can be pressed while the machine is awaited. What
/// is done at once is answered in the order of the lines, and what lasts when it is done. An answer
/// says which order it belongs to, unless that is the oldest of its controller without one.
pub(crate) struct Desk<'a> {
    emulators: &'a [Emulator],
    names: &'a Names,
    open: Vec<Open>,
}

/// An order without its answer.
struct Open {
    /// The number of the controller; 0 for none of them.
    number: usize,
    order: String,
    lasts: bool,
    /// Its answer says which order it is: something that was ordered later has been answered, or
    /// something that was ordered before has not.
    named: bool,
    coming: Pin<Box<dyn Future<Output = Answer> + Send>>,
    answer: Option<Answer>,
}

/// What comes of an order, or what was wrong.
type Answer = Result<String, String>;

impl<'a> Desk<'a> {
    pub(crate) fn new(emulators: &'a [Emulator], names: &'a Names) -> Desk<'a> {
        Desk { emulators, names, open: Vec::new() }
    }

    /// Whether everything is answered.
    pub(crate) fn is_empty(&self) -> bool {
        self.open.is_empty()
    }

    /// Whether it takes another line now.
    pub(crate) fn has_room(&self) -> bool {
        self.open.iter().filter(|open| !open.lasts).count() < MOST_GIVEN
    }

    /// The input has ended: orders that wait only for something from outside are given up.
    pub(crate) fn leave(&self) {
        for emulator in self.emulators {
            emulator.control().cancel_all_unless_by_itself();
        }
    }

    /// What is still awaited is given up.
    pub(crate) fn give_up(&self) {
        for emulator in self.emulators {
            emulator.control().cancel_all();
        }
    }

    /// Refuses a line that is too long for an order.
    pub(crate) fn refuse(&mut self, beginning: &str) {
        let beginning = text::shown_in_line(beginning);
        let wrong = format!("`{beginning}…` is wrong: no order has {LONGEST} characters");
        // The message itself names it.
        self.open(self.outside(), "", false, async { Err(wrong) });
    }

    /// The number of what belongs to no controller: where there is one only, that is the one.
    fn outside(&self) -> usize {
        usize::from(self.emulators.len() == 1)
    }

    /// Gives the order of one line. With several controllers it begins with the number of one.
    pub(crate) fn take(&mut self, line: &str) -> Next {
        let line = line.trim();
        let count = self.emulators.len();
        let (number, order) = match line {
            "" => return Next::Continue,
            "quit" => return Next::Quit,
            _ if line.split_whitespace().next() == Some("help") => (self.outside(), line),
            _ if count == 1 => (1, line),
            _ => {
                let (number, order) = line.split_once(' ').unwrap_or((line, ""));
                match number.parse() {
                    Ok(number) if (1..=count).contains(&number) && !order.is_empty() => {
                        (number, order)
                    }
                    _ => {
                        let wrong = format!(
                            "`{line}` is wrong: begin with the number of a controller, 1 to \
                             {count}, as in `1 press start`"
                        );
                        self.open(0, "", false, async { Err(wrong) });
                        return Next::Continue;
                    }
                }
            }
        };
        let Some(emulator) = self.emulators.get(number.saturating_sub(1)) else {
            return Next::Continue;
        };
        match Order::read(order, self.names) {
            Ok(None) => {}
            Ok(Some(Order::Quit)) => return Next::Quit,
            Ok(Some(given)) if self.awaits_enough(number, &given) => {
                let wrong =
                    format!("{MOST_WAITING} orders are awaited already; `cancel` gives them up");
                self.open(number, order, false, async { Err(wrong) });
            }
            Ok(Some(given)) => {
                let outcome = emulator.control().by("standard input").give(&given);
                let remark = number == 0 && count > 1;
                self.open(number, order, lasts(&given), async move {
                    let mut text = outcome.await.map_err(|error| error.to_string())?;
                    if remark {
                        text.push_str(
                            "\nBegin each with the number of a controller, as in `1 press start`.",
                        );
                    }
                    Ok(text)
                });
            }
            Err(error) => {
                // It has its turn, as if it had been an order, and says itself which line it was.
                let turn = emulator.control().now();
                self.open(number, "", false, async move {
                    let _ = turn.await;
                    Err(error.to_string())
                });
            }
        }
        Next::Continue
    }

    /// Whether an order of that controller would be one too many to be awaited.
    fn awaits_enough(&self, number: usize, order: &Order) -> bool {
        let awaited = || self.open.iter().filter(|open| open.lasts && open.number == number);
        lasts(order) && awaited().count() >= MOST_WAITING
    }

    fn open(
        &mut self,
        number: usize,
        order: &str,
        lasts: bool,
        coming: impl Future<Output = Answer> + Send + 'static,
    ) {
        let (order, coming) = (text::shown_in_line(order), Box::pin(coming));
        self.open.push(Open { number, order, lasts, named: false, coming, answer: None });
    }

    /// The next answer, as it is printed.
    pub(crate) async fn answer(&mut self) -> String {
        poll_fn(|cx| self.poll_answer(cx)).await
    }

    fn poll_answer(&mut self, cx: &mut Context<'_>) -> Poll<String> {
        let Some(mut place) = self.find(cx, self.open.len()) else { return Poll::Pending };
        // What was decided before that may have become known only meanwhile.
        while let Some(earlier) = self.find(cx, place) {
            place = earlier;
        }
        let mut open = self.open.remove(place);
        for earlier in &mut self.open[..place] {
            if earlier.number == open.number {
                earlier.named = true;
                open.named = true;
            }
        }
        Poll::Ready(open.print(self.emulators.len() > 1))
    }

    /// The first one that can be answered, among so many. Only what lasts can be overtaken.
    fn find(&mut self, cx: &mut Context<'_>, among: usize) -> Option<usize> {
        for (place, open) in self.open.iter_mut().take(among).enumerate() {
            if open.answer.is_none()
                && let Poll::Ready(answer) = open.coming.as_mut().poll(cx)
            {
                open.answer = Some(answer);
            }
            if open.answer.is_some() {
                return Some(place);
            }
            if !open.lasts {
                return None;
            }
        }
        None
    }
}

/// Whether an order may take its time, while others are carried out.
fn lasts(order: &Order) -> bool {
    order.verb().sort() == Sort::Time
}

impl Open {
    /// Errors come where the answers do: a script waits for a line there.
    fn print(self, several: bool) -> String {
        let number = match self.number {
            0 => String::new(),
            number if several => format!("{number}: "),
            _ => String::new(),
        };
        let order = match self.named && !self.order.is_empty() {
            true => format!("{}: ", self.order),
            false => String::new(),
        };
        let text = match self.answer {
            Some(Ok(text)) => format!("{order}{text}"),
            Some(Err(wrong)) => format!("error: {order}{wrong}"),
            None => return String::new(),
        };
        text.split('\n').map(|line| format!("{number}{line}\n")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_is_too_long_is_one_line_all_the_same() {
        let long = |count: usize, end: &str| "x".repeat(count) + end;
        let input = [
            long(LONGEST - 1, "\n"),
            long(LONGEST, "\n"),
            long(3 * LONGEST, "quit\n"),
            "quit\n".to_owned(),
            long(LONGEST, ""),
        ];
        let joined = input.concat();
        let mut input = joined.as_bytes();
        let mut read = Vec::new();
        while let Some(typed) = next(&mut input).unwrap() {
            read.push(match typed {
                Typed::Line(line) => (true, line.len()),
                Typed::TooLong(beginning) => (false, beginning.len()),
            });
        }
        assert_eq!(
            read,
            [(true, LONGEST), (false, SHOWN), (false, SHOWN), (true, 5), (false, SHOWN)]
        );
    }
}
