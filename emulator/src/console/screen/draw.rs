//! How the screen is divided, and each part of it drawn.

use ratatui_core::buffer::Buffer;
use ratatui_core::layout::{Position, Rect};
use vimc4_catalogue::Details;
use vimc4_device::{AXES, AxisView, Grouped, SignalKind, View};

use super::brush::{Brush, fitted, seconds};
use super::ink::{Ink, Inks};
use super::keys;
use super::path::Path;
use super::picture::{Picture, SaidKind, Side, Talk};
use crate::console::camera;

/// No terminal may be smaller.
pub(crate) const SMALLEST: (u16, u16) = (60, 20);

/// Where everything is.
struct Panes {
    heading: Rect,
    listing: Rect,
    talk: Rect,
    axes: Rect,
    path: Rect,
    ports: Rect,
    panel: Rect,
    line: Rect,
    said: Rect,
    prompt: Rect,
}

/// Divides the screen: text at the left, the machine at the right, time and the command line below.
fn divided(area: Rect, picture: &Picture) -> Panes {
    let Rect { x, y, width, height } = area;
    let row = |row: u16, rows: u16| Rect { x, y: y + row, width, height: rows };
    let said_rows = (height / 6).clamp(3, 10);
    let line_rows = if height >= 40 && !picture.line.marks.is_empty() { 3 } else { 2 };
    let panel_rows = 1;
    let below = panel_rows + line_rows + said_rows + 1;
    let middle = height.saturating_sub(1 + below);
    let left = if width >= 140 { width * 2 / 5 } else { width / 2 };
    let right = width - left - 1;
    let at = |x: u16, row: u16, width: u16, rows: u16| Rect { x, y: y + row, width, height: rows };
    // The listing gets what it needs, and the conversation no less than half.
    let lines = picture.listing.lines.len().min(1_000) as u16 + 1;
    let listing = lines.min(middle / 2).max(middle.min(3));
    let axes = axes(&picture.view).count() as u16 + 1;
    let ports =
        if middle >= 24 { 1 + port_lines(&picture.view, right).len() as u16 + 1 } else { 0 };
    let beside = x + left + 1;
    Panes {
        heading: row(0, 1),
        listing: at(x, 1, left, listing),
        talk: at(x, 1 + listing, left, middle - listing),
        axes: at(beside, 1, right, axes.min(middle)),
        path: at(beside, 1 + axes, right, middle.saturating_sub(axes + ports)),
        ports: at(beside, 1 + middle.saturating_sub(ports), right, ports),
        panel: row(1 + middle, panel_rows),
        line: row(1 + middle + panel_rows, line_rows),
        said: row(1 + middle + panel_rows + line_rows, said_rows),
        prompt: row(height.saturating_sub(1), 1),
    }
}

/// Draws all of it, and says where the cursor is, if there is one.
pub(crate) fn draw(
    picture: &Picture,
    inks: Inks,
    area: Rect,
    buffer: &mut Buffer,
) -> Option<Position> {
    if area.width < SMALLEST.0 || area.height < SMALLEST.1 {
        let (width, height) = SMALLEST;
        let mut brush = Brush::new(buffer, area, inks);
        let needed = format!("{width} x {height} characters are needed");
        for line in broken(&needed, brush.width()) {
            brush.line(&[(line, Ink::Alarm)]);
        }
        return None;
    }
    let panes = divided(area, picture);
    for y in panes.axes.top()..panes.panel.top() {
        buffer.set_string(panes.axes.x.saturating_sub(1), y, "│", inks.style(Ink::Faint));
    }
    heading(picture, &mut Brush::new(buffer, panes.heading, inks));
    listing(picture, buffer, panes.listing, inks);
    talk(picture, buffer, panes.talk, inks);
    draw_axes(picture, buffer, panes.axes, inks);
    let path = Path {
        machine: &picture.machine,
        strokes: &picture.strokes,
        now: picture.line.now,
        here: camera::carriages(&picture.view),
        gaze: picture.gaze,
    };
    path.draw(buffer, panes.path, inks);
    if panes.ports.height > 0 {
        let mut brush = Brush::titled(buffer, panes.ports, inks, "ports", "");
        for line in port_lines(&picture.view, panes.ports.width) {
            brush.line(&[(line, Ink::Plain)]);
        }
    }
    panel(picture, &mut Brush::new(buffer, panes.panel, inks));
    time_line(picture, buffer, panes.line, inks);
    said(picture, buffer, panes.said, inks);
    if picture.shows_keys {
        keys::draw(buffer, area, inks);
    }
    prompt(picture, &mut Brush::new(buffer, panes.prompt, inks))
}

fn heading(picture: &Picture, brush: &mut Brush<'_>) {
    let View { model, machine, activity, waits_for, .. } = &picture.view;
    let doing = match waits_for {
        Some(waits) => format!("{activity}, waits for {waits}"),
        None => activity.to_string(),
    };
    let time = seconds(picture.line.now.as_nanos());
    let command = picture.command.as_deref().unwrap_or_default();
    let text = format!(" {model} on {machine}  {time}  {}  {doing}  {command}", picture.clock);
    let width = brush.width();
    brush.bar(&fitted(&text, width), Ink::Present);
}

fn listing(picture: &Picture, buffer: &mut Buffer, area: Rect, inks: Inks) {
    let listing = &picture.listing;
    let note = format!("{} lines", listing.lines.len());
    let mut brush = Brush::titled(buffer, area, inks, &listing.of, &note);
    let room = brush.room();
    let present = listing.lines.iter().position(|line| line.is_present).unwrap_or(0);
    let last = listing.lines.len().saturating_sub(room);
    let first = present.saturating_sub(room / 2).min(last);
    let digits = listing.lines.last().map_or(1, |line| line.number.to_string().len());
    let longest = listing.lines.iter().map(|line| line.text.chars().count()).max().unwrap_or(0);
    let longest = longest.min(32);
    for line in listing.lines.iter().skip(first).take(room) {
        let point = if line.breakpoint.is_some() { '*' } else { ' ' };
        let head = format!("{point}{:>digits$} ", line.number);
        if line.is_present {
            let width = brush.width();
            let text = format!("{head}{:<longest$}  {}", line.text, line.meaning);
            brush.bar(&fitted(&text, width), Ink::Present);
        } else {
            let ink = if line.breakpoint.is_some() { Ink::Alarm } else { Ink::Faint };
            brush.line(&[
                (head, ink),
                (format!("{:<longest$}  ", line.text), Ink::Plain),
                (line.meaning.clone(), Ink::Faint),
            ]);
        }
    }
}

/// The part of what something means that stands in its first line.
fn first_of(talk: &Talk, rest: &[String]) -> String {
    let left: usize = rest.iter().map(|line| line.chars().count() + 1).sum();
    let length = talk.meaning.chars().count();
    talk.meaning.chars().take(length.saturating_sub(left)).collect()
}

/// A text in lines of so many characters, broken between words.
fn broken(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

fn talk(picture: &Picture, buffer: &mut Buffer, area: Rect, inks: Inks) {
    let mut brush = Brush::titled(buffer, area, inks, "conversation", "");
    // What went wrong is shown whole: what does not fit into its line follows below.
    const INDENT: usize = 15;
    let width = brush.width().saturating_sub(INDENT);
    let rest = |talk: &Talk| -> Vec<String> {
        if talk.side != Side::Problem || width == 0 {
            return Vec::new();
        }
        broken(&format!("{}  {}", talk.text, talk.meaning), width).split_off(1)
    };
    let mut room = brush.room();
    let fits = |talk: &&Talk| {
        let lines = 1 + rest(talk).len();
        let fits = lines <= room;
        room = room.saturating_sub(lines);
        fits
    };
    let shown = picture.talk.iter().rev().take_while(fits).count();
    for talk in &picture.talk[picture.talk.len() - shown..] {
        let (arrow, ink) = match talk.side {
            Side::Host => ("→", Ink::Sent),
            Side::Controller => ("←", Ink::Plain),
            Side::Problem => ("←", Ink::Alarm),
            Side::World => ("·", Ink::Well),
        };
        let time = seconds(talk.at.as_nanos());
        brush.line(&[
            (format!("{time:>12} "), Ink::Faint),
            (format!("{arrow} {}  ", talk.text), ink),
            (first_of(talk, &rest(talk)), Ink::Faint),
        ]);
        for line in rest(talk) {
            brush.line(&[(" ".repeat(INDENT), Ink::Faint), (line, Ink::Faint)]);
        }
    }
}

/// The axes that there is something to say of.
fn axes(view: &View<Details>) -> impl Iterator<Item = &AxisView> {
    view.axes.iter().filter(|axis| axis.configured || axis.position != 0 || axis.index < 3)
}

fn draw_axes(picture: &Picture, buffer: &mut Buffer, area: Rect, inks: Inks) {
    let mut brush = Brush::titled(buffer, area, inks, "axes", "? not referenced");
    let measures = picture.machine.measures();
    for axis in axes(&picture.view) {
        let index = usize::from(axis.index);
        let measure = measures[index.min(AXES - 1)];
        let place = axis.position as f64 * measure.per_step;
        let unknown = if axis.referenced { ' ' } else { '?' };
        let hertz = axis.speed as f64 / 1e6;
        let ink = if axis.configured { Ink::Plain } else { Ink::Faint };
        let speed = if axis.speed == 0 { String::new() } else { format!("{hertz:.0} Hz") };
        let text = format!(
            "{:<2}{unknown}{:>9} {:>8.2} {:<2}{:>9} ",
            axis.name,
            Grouped(axis.position),
            place,
            measure.name,
            speed,
        );
        let left = brush.width().saturating_sub(text.chars().count());
        let (bar, pressed) = travel(picture, axis, left);
        brush.line(&[(text, ink), (bar, if pressed { Ink::Alarm } else { Ink::Plain })]);
    }
}

/// Where the carriage is between the ends of its axis, and whether it presses a limit switch.
fn travel(picture: &Picture, axis: &AxisView, width: usize) -> (String, bool) {
    let index = usize::from(axis.index);
    let machine = picture.machine.axis(index);
    let low_switch = machine.negative_switch.is_some_and(|at| axis.carriage <= at);
    let high_switch = machine.positive_switch.is_some_and(|at| axis.carriage >= at);
    let (Some(low), Some(high)) = (machine.lowest, machine.highest) else {
        return (if width >= 7 { "no ends".to_owned() } else { String::new() }, false);
    };
    let inner = width.saturating_sub(2);
    if inner < 3 || high <= low {
        return (String::new(), false);
    }
    let cells = inner as i128 - 1;
    let part = i128::from(axis.carriage - low) * cells / i128::from(high - low);
    let place = part.clamp(0, cells) as usize;
    let end = |pressed: bool, plain: char| if pressed { '!' } else { plain };
    let mut bar = String::new();
    bar.push(end(low_switch, '├'));
    bar.extend((0..inner).map(|at| if at == place { '●' } else { '─' }));
    bar.push(end(high_switch, '┤'));
    (bar, low_switch || high_switch)
}

/// The ports with their bits, as many beside each other as fit into the width whole.
fn port_lines(view: &View<Details>, width: u16) -> Vec<String> {
    const GAP: &str = "   ";
    let mut ports: Vec<_> = view.ports.iter().collect();
    ports.sort_by_key(|port| (!port.input, port.port));
    let text = |port: &&vimc4_device::PortView| {
        let way = if port.input { "in " } else { "out" };
        format!("{way} {:>5}  {:08b}", port.port, port.value)
    };
    let texts: Vec<String> = ports.iter().map(text).collect();
    let longest = texts.iter().map(String::len).max().unwrap_or(1);
    let columns = (usize::from(width) + GAP.len()) / (longest + GAP.len());
    texts.chunks(columns.clamp(1, 3)).map(|row| row.join(GAP)).collect()
}

/// The buttons and switches, with the keys that work them.
fn panel(picture: &Picture, brush: &mut Brush<'_>) {
    let mut pieces = vec![("panel ".to_owned(), Ink::Strong)];
    for signal in &picture.signals {
        let Some(key) = keys::of_signal(&signal.name) else { continue };
        let value = picture.view.signal(&signal.name).unwrap_or(0);
        let position =
            signal.positions.as_ref().and_then(|names| names.get(value.clamp(0, 1) as usize));
        let is_on = signal.kind == SignalKind::Button && value != 0;
        let state = match position {
            Some(position) => format!(" {position}"),
            None if is_on => " PRESSED".to_owned(),
            None => String::new(),
        };
        pieces.push((format!(" {key}"), Ink::Key));
        let ink = if is_on { Ink::Alarm } else { Ink::Plain };
        pieces.push((format!(" {}{state} ", signal.name), ink));
    }
    brush.line(&pieces);
}

fn time_line(picture: &Picture, buffer: &mut Buffer, area: Rect, inks: Inks) {
    let line = &picture.line;
    let title = format!("time, by {}", picture.unit);
    let note = match line.branches {
        0 | 1 => "← → ? keys".to_owned(),
        branches => format!("{}, one of {branches} branches", line.branch),
    };
    let read = line.read.map(|share| format!("{} % read, ", share / 10)).unwrap_or_default();
    let differs = line.differences.first().map(|at| {
        let millis = at.as_nanos() / 1_000_000;
        format!("≠ recording from {}.{:03} s on, ", millis / 1_000, millis % 1_000)
    });
    let note = format!("{}{read}{note}", differs.unwrap_or_default());
    let mut brush = Brush::titled(buffer, area, inks, &title, &note);
    let begin = seconds(line.begin.as_nanos());
    let end = seconds(line.end.as_nanos());
    let inner = brush.width().saturating_sub(begin.len() + end.len() + 4);
    let span = u128::from(line.end.nanos_since(line.begin).max(1));
    let place = |at: vimc4_device::Time| {
        let part = u128::from(at.nanos_since(line.begin)) * (inner.max(1) as u128 - 1) / span;
        (part as usize).min(inner.saturating_sub(1))
    };
    let now = place(line.now.clamp(line.begin, line.end));
    let mut cells: Vec<(char, Ink)> = (0..inner)
        .map(|at| if at <= now { ('━', Ink::Plain) } else { ('─', Ink::Faint) })
        .collect();
    let things = line.snapshots.iter().map(|at| (*at, '┷', Ink::Faint));
    let things = things.chain(line.partings.iter().map(|at| (*at, '┳', Ink::Sent)));
    let things = things.chain(line.marks.iter().map(|(_, at)| (*at, '◆', Ink::Key)));
    let things = things.chain(line.differences.iter().map(|at| (*at, '≠', Ink::Alarm)));
    for (at, sign, ink) in things {
        if let Some(cell) = cells.get_mut(place(at.clamp(line.begin, line.end))) {
            *cell = (sign, ink);
        }
    }
    if let Some(cell) = cells.get_mut(now) {
        *cell = ('●', Ink::Alarm);
    }
    let mut pieces = vec![(format!(" {begin} "), Ink::Plain)];
    pieces.extend(cells.into_iter().map(|(sign, ink)| (sign.to_string(), ink)));
    pieces.push((format!(" {end}"), Ink::Plain));
    brush.line(&pieces);
    if brush.room() > 0 && !line.marks.is_empty() {
        let marks =
            line.marks.iter().map(|(name, at)| format!("◆ {name} {}", seconds(at.as_nanos())));
        let marks = marks.collect::<Vec<_>>().join("   ");
        brush.line(&[(format!(" {marks}"), Ink::Faint)]);
    }
}

fn said(picture: &Picture, buffer: &mut Buffer, area: Rect, inks: Inks) {
    let watches = picture.watches.join("   ");
    let mut brush = Brush::titled(buffer, area, inks, "answers", &watches);
    let lines: Vec<(&str, SaidKind)> = picture
        .said
        .iter()
        .flat_map(|reply| reply.text.lines().map(|line| (line, reply.kind)))
        .collect();
    // Of an answer that does not fit the beginning is shown, which says why it stopped.
    let last = picture.said.last().map_or(0, |reply| reply.text.lines().count());
    let room = brush.room();
    let first = lines.len().saturating_sub(room.max(last));
    for (line, kind) in lines.iter().skip(first).take(room) {
        let (head, ink) = match kind {
            SaidKind::Typed => ("> ", Ink::Sent),
            SaidKind::Answer => ("  ", Ink::Plain),
            SaidKind::Wrong => ("! ", Ink::Alarm),
        };
        let width = brush.width();
        brush.line(&[(fitted(&format!("{head}{line}"), width), ink)]);
    }
}

fn prompt(picture: &Picture, brush: &mut Brush<'_>) -> Option<Position> {
    let prompt = &picture.prompt;
    let (x, y) = (brush.area.x, brush.area.y);
    if !prompt.is_open {
        let pieces: Vec<_> = keys::SHORT
            .iter()
            .flat_map(|(key, what)| {
                let what = if *key == "q" && !picture.is_first { "back" } else { what };
                [(format!(" {key}"), Ink::Key), (format!(" {what} "), Ink::Faint)]
            })
            .collect();
        brush.line(&pieces);
        return None;
    }
    let width = brush.width();
    // What does not fit is left out at the left.
    let hidden = (prompt.cursor + 4).saturating_sub(width);
    let shown: String = prompt.text.chars().skip(hidden).collect();
    let candidates = match prompt.candidates.as_slice() {
        [] => String::new(),
        candidates => format!("   {}", candidates.join("  ")),
    };
    brush.line(&[
        (":", Ink::Key),
        (shown.as_str(), Ink::Plain),
        (prompt.hint.as_str(), Ink::Faint),
        (candidates.as_str(), Ink::Faint),
    ]);
    let column = (prompt.cursor - hidden.min(prompt.cursor) + 1).min(width.saturating_sub(1));
    Some(Position { x: x + column as u16, y })
}

#[cfg(test)]
mod tests {
    use ratatui_core::style::{Color, Modifier};
    use vimc4_catalogue::{bare, machine, model};
    use vimc4_debug::Debugger;
    use vimc4_device::Input;

    use super::super::look::Look;
    use super::*;
    use crate::console::cancel::Cancel;
    use crate::console::screen::SaidLine;
    use crate::console::session::Session;

    /// A mill in the middle of a move in which it will be stopped, and a text that no terminal may
    /// obey.
    fn picture() -> Picture {
        let (model, machine) = (model("imc4").unwrap(), machine("mill").unwrap());
        let controller = bare(&model, &machine, &[]).unwrap();
        let mut session = Session::new(Debugger::new(controller), machine, Cancel::default());
        session
            .debugger
            .give(Input::Bytes(b"@07\r@0R7\r@0M8000,2000,6000,2000,-500,900,0,900\r@0X\r"));
        for line in ["continue", "mark the end", "last x > 3999", "break command @M", "watch x"] {
            session.carry_out(line).unwrap();
        }
        let mut look = Look::new(Inks { colour: true });
        session.say("a\x1B[2Jb\n", SaidKind::Wrong);
        look.picture(&mut session)
    }

    fn drawn(picture: &Picture, colour: bool, width: u16, height: u16) -> (Buffer, Vec<String>) {
        let area = Rect::new(0, 0, width, height);
        let mut buffer = Buffer::empty(area);
        draw(picture, Inks { colour }, area, &mut buffer);
        let row = |y| (0..width).map(|x| buffer[(x, y)].symbol().to_owned()).collect::<String>();
        let rows = (0..height).map(row).collect();
        (buffer, rows)
    }

    #[test]
    fn everything_is_there_in_a_small_and_in_a_large_terminal() {
        let picture = picture();
        for (width, height) in [(80, 24), (200, 60), (60, 20), (100, 30), (300, 100)] {
            let (_, rows) = drawn(&picture, true, width, height);
            let shown = rows.join("\n");
            assert!(rows[0].starts_with(" imc4 on mill  "), "{shown}");
            for part in [
                "move",
                "axes",
                "path X Y | Z Y",
                "mm per dot",
                "conversation",
                "commands",
                "@0R7",
                "panel",
                "X stop",
                "E estop",
                "key auto",
                "time, by command",
                "●",
                "◆",
                "answers",
                "x = 4000",
                ": command",
                "◉",
            ] {
                // Notes in titles are left out first.
                let is_note = part == "mm per dot" && width < 80;
                let is_there = is_note || shown.contains(part);
                assert!(is_there, "{part} is missing in {width} x {height}:\n{shown}");
            }
            assert!(shown.contains("3,999") || shown.contains("4,000"), "{shown}");
            assert!(!shown.contains('\u{1b}'), "{shown}");
            assert!(shown.contains("! a␛[2Jb"), "{shown}");
        }
    }

    #[test]
    fn no_port_is_cut_in_the_middle_of_its_value() {
        let picture = picture();
        let ports = picture.view.ports.len();
        for (width, height) in [(80, 40), (100, 40), (120, 50), (140, 50), (200, 60)] {
            let (_, rows) = drawn(&picture, true, width, height);
            let is_value = |word: &&str| word.len() == 8 && word.chars().all(|c| "01".contains(c));
            let shown: usize =
                rows.iter().map(|row| row.split_whitespace().filter(is_value).count()).sum();
            assert_eq!(shown, ports, "{width} x {height}:\n{}", rows.join("\n"));
        }
    }

    #[test]
    fn nothing_is_written_into_a_terminal_that_is_too_small() {
        let picture = picture();
        for (width, height) in [(59, 24), (80, 19), (5, 2), (1, 1)] {
            let (_, rows) = drawn(&picture, true, width, height);
            assert!("60 x 20 characters are needed".starts_with(rows[0].trim_end()), "{rows:?}");
        }
    }

    #[test]
    fn what_a_terminal_needs_is_said_whole_in_a_small_one() {
        let (_, rows) = drawn(&picture(), true, 20, 5);
        let said: Vec<&str> = rows.iter().map(|row| row.trim_end()).take(2).collect();
        assert_eq!(said, ["60 x 20 characters", "are needed"]);
    }

    #[test]
    fn of_a_long_answer_the_beginning_is_shown() {
        let mut picture = picture();
        let text = (1..=20).map(|line| format!("answered {line:02}\n")).collect();
        picture.said.push(SaidLine { text, kind: SaidKind::Answer });
        let (_, rows) = drawn(&picture, true, 80, 24);
        let shown = rows.join("\n");
        assert!(shown.contains("answered 01") && !shown.contains("answered 20"), "{shown}");
    }

    #[test]
    fn what_went_wrong_is_shown_whole() {
        let mut picture = picture();
        picture.talk.push(Talk {
            at: vimc4_device::Time::from_nanos(1),
            side: Side::Problem,
            text: "2".to_owned(),
            meaning: "limit switch X+ at step 12,345 of the last move".to_owned(),
            replies_to: None,
        });
        let (_, rows) = drawn(&picture, true, 80, 24);
        let shown = rows.join("\n");
        assert!(shown.contains("← 2  limit switch X+ at"), "{shown}");
        assert!(shown.contains("               step 12,345 of the last"), "{shown}");
    }

    #[test]
    fn without_colour_everything_is_told_apart_by_other_means() {
        let picture = picture();
        let (buffer, _) = drawn(&picture, false, 80, 24);
        let plain =
            |cell: &ratatui_core::buffer::Cell| cell.fg == Color::Reset && cell.bg == Color::Reset;
        assert!(buffer.content().iter().all(plain));
        for modifier in [Modifier::REVERSED, Modifier::BOLD, Modifier::DIM, Modifier::UNDERLINED] {
            assert!(
                buffer.content().iter().any(|cell| cell.modifier.contains(modifier)),
                "{modifier:?}"
            );
        }
        // No background is set with colour either: whatever the terminal has is right.
        let (buffer, _) = drawn(&picture, true, 80, 24);
        assert!(buffer.content().iter().all(|cell| cell.bg == Color::Reset));
        let seen = |colour| buffer.content().iter().any(|cell| cell.fg == colour);
        assert!(seen(Color::Red) && seen(Color::Cyan) && seen(Color::Magenta));
        assert!(!seen(Color::Yellow) && !seen(Color::Blue));
    }

    #[test]
    fn the_keys_fit_into_a_small_terminal() {
        let picture = Picture { shows_keys: true, ..picture() };
        for (width, height) in [(80, 24), (200, 60), (60, 20)] {
            let (_, rows) = drawn(&picture, true, width, height);
            let shown = rows.join("\n");
            for (key, about) in keys::told() {
                assert!(shown.contains(key), "{key} is missing in {width} x {height}:\n{shown}");
                let is_whole = width < 80 || shown.contains(about);
                assert!(is_whole, "{about:?} is cut in {width} x {height}:\n{shown}");
            }
            assert!(!shown.contains("conversation") && !shown.contains("│"), "{shown}");
        }
    }
}
