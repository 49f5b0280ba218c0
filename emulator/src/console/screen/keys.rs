//! The keys of the full screen: one table, from which the help on them comes too.

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;

use super::brush::Brush;
use super::ink::{Ink, Inks};
use crate::here::here;

/// What a key does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Act {
    /// A line, as if it had been typed.
    Line(&'static str),
    /// Goes by so many of what the arrow keys go by.
    Scrub(i64),
    /// The next thing that the arrow keys can go by.
    NextUnit,
    /// Works a thing of the panel: presses a button, lets go of one that latches, turns a switch.
    Panel(&'static str),
    /// Opens the command line.
    Type,
    /// The last line again.
    Again,
    /// Sets or takes away a breakpoint at the present line.
    Breakpoint,
    /// Lets a running controller go on, or holds it.
    HoldOrGo,
    /// Goes over to the next branch.
    NextBranch,
    Nearer,
    Farther,
    /// Moves the picture of the path.
    Move(i8, i8),
    WholePath,
    /// Writes the screen into a file.
    Picture,
    Keys,
    Redraw,
    Suspend,
    Quit,
}

/// A key: what it is, how it is written, what it does.
struct Key {
    code: KeyCode,
    control: bool,
    shift: Option<bool>,
    shown: &'static str,
    about: &'static str,
    act: Act,
}

const fn key(code: KeyCode, shown: &'static str, about: &'static str, act: Act) -> Key {
    Key { code, control: false, shift: None, shown, about, act }
}

const fn letter(letter: char, shown: &'static str, about: &'static str, act: Act) -> Key {
    key(KeyCode::Char(letter), shown, about, act)
}

const fn control(letter: char, shown: &'static str, about: &'static str, act: Act) -> Key {
    Key { control: true, ..key(KeyCode::Char(letter), shown, about, act) }
}

const fn arrow(
    code: KeyCode,
    shift: bool,
    shown: &'static str,
    about: &'static str,
    by: i64,
) -> Key {
    Key { shift: Some(shift), ..key(code, shown, about, Act::Scrub(by)) }
}

/// All keys, in the order of the help. What has no text of its own is told of with the one before.
const KEYS: &[Key] = &[
    arrow(KeyCode::Left, false, "← →", "back and forward by one", -1),
    arrow(KeyCode::Right, false, "", "", 1),
    arrow(KeyCode::Left, true, "Shift ← →", "by ten; PgUp PgDn too", -10),
    arrow(KeyCode::Right, true, "", "", 10),
    key(KeyCode::PageUp, "", "", Act::Scrub(-10)),
    key(KeyCode::PageDown, "", "", Act::Scrub(10)),
    letter('u', "u", "change what they go by", Act::NextUnit),
    key(KeyCode::Home, "Home End", "to the beginning, the end", Act::Line("goto start")),
    key(KeyCode::End, "", "", Act::Line("goto end")),
    letter('s', "s", "by a line, into loops", Act::Line("step")),
    letter('n', "n", "over loops", Act::Line("over")),
    letter('o', "o", "out of the loop", Act::Line("out")),
    letter('c', "c", "continue to a breakpoint", Act::Line("continue")),
    letter('r', "r", "reverse to a breakpoint", Act::Line("reverse")),
    letter(' ', "Space", "hold what runs, let it go", Act::HoldOrGo),
    letter('b', "b", "breakpoint at this line", Act::Breakpoint),
    letter('v', "v", "over to the next branch", Act::NextBranch),
    letter('y', "y", "why has this happened?", Act::Line("why")),
    letter('S', "S", "START", Act::Panel("start")),
    letter('X', "X", "STOP", Act::Panel("stop")),
    letter('E', "E", "emergency stop, on and off", Act::Panel("estop")),
    letter('K', "K", "key switch", Act::Panel("key")),
    letter('C', "C", "cover", Act::Panel("cover")),
    letter('O', "O", "ON button", Act::Panel("on")),
    letter('+', "+ -", "nearer and farther", Act::Nearer),
    letter('-', "", "", Act::Farther),
    letter('h', "h j k l", "move the path", Act::Move(-1, 0)),
    letter('j', "", "", Act::Move(0, -1)),
    letter('k', "", "", Act::Move(0, 1)),
    letter('l', "", "", Act::Move(1, 0)),
    letter('0', "0", "the whole path", Act::WholePath),
    letter(':', ":", "type a command; Esc leaves", Act::Type),
    key(KeyCode::Enter, "Enter", "the last command again", Act::Again),
    letter('p', "p", "a picture of this (SVG)", Act::Picture),
    letter('?', "?", "these keys", Act::Keys),
    key(KeyCode::Esc, "", "", Act::Redraw),
    control('l', "", "", Act::Redraw),
    control('z', here!("Ctrl-Z", ""), here!("suspend; `fg` comes back", ""), Act::Suspend),
    letter('q', "q", "quit, or back to lines", Act::Quit),
    control('c', "", "", Act::Quit),
    control('d', "", "", Act::Quit),
];

/// The most important ones, for the line at the bottom.
pub(super) const SHORT: &[(&str, &str)] = &[
    (":", "command"),
    ("← →", "scrub"),
    ("s", "step"),
    ("c", "continue"),
    ("r", "reverse"),
    ("?", "keys"),
    ("q", "quit"),
];

/// What a key does.
pub(crate) fn act(event: &KeyEvent) -> Option<Act> {
    let control = event.modifiers.contains(KeyModifiers::CONTROL);
    let shift = event.modifiers.contains(KeyModifiers::SHIFT);
    let is_it = |key: &&Key| {
        key.code == event.code
            && key.control == control
            && key.shift.is_none_or(|wanted| wanted == shift)
    };
    KEYS.iter().find(is_it).map(|key| key.act)
}

/// The key that works a thing of the panel.
pub(super) fn of_signal(name: &str) -> Option<&'static str> {
    let works = |key: &&Key| matches!(key.act, Act::Panel(signal) if signal == name);
    KEYS.iter().find(works).map(|key| key.shown)
}

/// The keys, for the help and the manual.
pub(crate) fn told() -> impl Iterator<Item = (&'static str, &'static str)> {
    KEYS.iter().filter(|key| !key.shown.is_empty()).map(|key| (key.shown, key.about))
}

/// Draws the help over everything else.
pub(super) fn draw(buffer: &mut Buffer, area: Rect, inks: Inks) {
    let lines: Vec<_> = told().collect();
    let columns =
        if area.width >= 100 || lines.len() + 4 > usize::from(area.height) { 2 } else { 1 };
    let rows = lines.len().div_ceil(columns);
    const KEY: usize = 10;
    let wide = lines.iter().map(|(_, about)| about.chars().count()).max().unwrap_or(0);
    let room = usize::from(area.width.saturating_sub(2)) / columns;
    let each = (KEY + wide + 2).min(room);
    let width = (each * columns + 2) as u16;
    let height = (rows + 2) as u16;
    let place = Rect {
        x: area.x + area.width.saturating_sub(width) / 2,
        y: area.y + area.height.saturating_sub(height) / 2,
        width: width.min(area.width),
        height: height.min(area.height),
    };
    // Nothing beside the keys is mistaken for more of them.
    buffer.reset();
    let mut brush = Brush::titled(buffer, place, inks, "keys", "any key closes this");
    for row in 0..rows {
        let mut pieces = Vec::new();
        for column in 0..columns {
            let Some((key, about)) = lines.get(column * rows + row) else { continue };
            let about = super::brush::fitted(about, each.saturating_sub(KEY + 2));
            pieces.push((format!(" {key:<KEY$}"), Ink::Key));
            pieces.push((format!("{about:<width$}", width = each - KEY - 1), Ink::Plain));
        }
        brush.line(&pieces);
    }
    brush.line(&[("─".repeat(usize::from(place.width)), Ink::Faint)]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_does_two_things() {
        for (place, key) in KEYS.iter().enumerate() {
            let same = |other: &&Key| {
                (other.code, other.control, other.shift) == (key.code, key.control, key.shift)
            };
            assert_eq!(KEYS.iter().skip(place + 1).find(same).map(|key| key.shown), None);
        }
    }

    #[test]
    fn the_manual_has_every_key() {
        // Read while it runs, in the folder of the package: what is built needs no other folder.
        let manual = std::fs::read_to_string("../docs/stepping.md").unwrap();
        let rows: Vec<String> =
            told().map(|(key, about)| format!("| `{key}` | {about} |\n")).collect();
        let table = rows.concat();
        assert!(manual.contains(&table), "docs/stepping.md is to have this table:\n{table}");
    }

    #[test]
    fn capitals_and_arrows_are_found() {
        let capital = KeyEvent::new(KeyCode::Char('S'), KeyModifiers::SHIFT);
        assert_eq!(act(&capital), Some(Act::Panel("start")));
        let far = KeyEvent::new(KeyCode::Left, KeyModifiers::SHIFT);
        assert_eq!(act(&far), Some(Act::Scrub(-10)));
        assert_eq!(act(&KeyEvent::new(KeyCode::Left, KeyModifiers::NONE)), Some(Act::Scrub(-1)));
        let control = KeyEvent::new(KeyCode::Char('z'), KeyModifiers::CONTROL);
        assert_eq!(act(&control), Some(Act::Suspend));
        assert_eq!(act(&KeyEvent::new(KeyCode::Char('z'), KeyModifiers::NONE)), None);
    }
}
