//! The full screen as somebody sits before it: keys in, pictures out.

use std::collections::VecDeque;
use std::env;
use std::io::{self, IsTerminal};
use std::panic;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crossterm::cursor::{MoveTo, Show};
use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use crossterm::execute;
use crossterm::style::{Attribute, Print, SetAttribute};
use crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode, size,
};
use ratatui_core::terminal::Terminal;
use vimc4_device::SignalKind;

use super::backend::TerminalBackend;
use super::draw::draw;
use super::keys::{self, Act};
use super::look::{Look, UNITS, inks};
use super::path::Gaze;
use super::picture::{Prompt, SaidKind};
use vimc4::{Report, Reports};

use crate::console::camera;
use crate::console::script::{self, Console};
use crate::console::session::{Outcome, Session, Wrong, hint};
use crate::failure::Failure;
use crate::live::{self, Live, Until};

/// How the screen was left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Leaving {
    /// To the line console.
    Closed,
    /// With the program.
    Quits,
}

/// How often a running controller is looked at anew while something moves.
const BETWEEN: Duration = Duration::from_millis(100);

/// How often what is read of a recording is shown.
const READING: Duration = Duration::from_millis(250);

/// Whether there is a terminal that the screen can be drawn on.
///
/// # Errors
///
/// If there is none, with what to do instead.
pub(crate) fn check() -> Result<(), Failure> {
    if !io::stdin().is_terminal() || !io::stdout().is_terminal() {
        return Err(Failure::usage(
            "the full screen needs a terminal; leave --screen out, or write it into a file with \
             `picture FILE`",
        ));
    }
    let terminal = env::var("TERM").unwrap_or_default();
    if cfg!(unix) && (terminal.is_empty() || terminal == "dumb") {
        return Err(Failure::usage(
            "TERM says that this terminal can only print lines; set TERM, for example to \
             xterm-256color, or leave --screen out",
        ));
    }
    Ok(())
}

/// A terminal that is the screen's, and is given back whatever happens.
struct Stage(Terminal<TerminalBackend>);

impl Stage {
    fn enter() -> io::Result<Stage> {
        let before = panic::take_hook();
        // What a panic says is read where it can be read.
        panic::set_hook(Box::new(move |panic| {
            leave();
            before(panic);
        }));
        enable_raw_mode()?;
        IS_ENTERED.store(true, Ordering::Relaxed);
        execute!(io::stdout(), EnterAlternateScreen)?;
        Ok(Stage(Terminal::new(TerminalBackend(io::stdout()))?))
    }
}

/// Whether the terminal is the screen's, and there is something to give back.
static IS_ENTERED: AtomicBool = AtomicBool::new(false);

/// Gives the terminal back as it was, if it is the screen's.
pub(crate) fn leave() {
    if !IS_ENTERED.swap(false, Ordering::Relaxed) {
        return;
    }
    let _ = execute!(io::stdout(), LeaveAlternateScreen, Show);
    let _ = disable_raw_mode();
}

impl Drop for Stage {
    fn drop(&mut self) {
        leave();
        // In the middle of a panic there is no other hook to be had.
        if !thread::panicking() {
            let _ = panic::take_hook();
        }
    }
}

/// Shows everything until somebody has seen enough.
///
/// # Errors
///
/// If the terminal does not work.
///
/// `is_first` says that no line console is behind it: then `q` quits the program.
pub(crate) fn run(session: &mut Session, is_first: bool) -> Result<Leaving, Failure> {
    let failed = |error: io::Error| Failure::usage(format!("cannot use the terminal: {error}"));
    let mut stage = Stage::enter().map_err(failed)?;
    // From now on another size is heard of.
    let _ = event::poll(Duration::ZERO);
    let mut ears = Ears::listen();
    session.cancel.look = Some(is_interrupted);
    let shown_before = session.show.replace(Arc::new(show_below));
    let mut look = Look::new(inks());
    look.is_first = is_first;
    let leaving = loop {
        let picture = look.picture(session);
        if IS_WRITTEN_OVER.swap(false, Ordering::Relaxed) {
            stage.0.clear().map_err(failed)?;
        }
        let drawn = stage.0.draw(|frame| {
            let area = frame.area();
            if let Some(cursor) = draw(&picture, look.inks, area, frame.buffer_mut()) {
                frame.set_cursor_position(cursor);
            }
        });
        drawn.map_err(failed)?;
        let is_busy =
            picture.view.axes.iter().any(|axis| axis.speed != 0) || !picture.view.timers.is_empty();
        let longest = (session.is_running() && is_busy).then_some(BETWEEN);
        let happening = match session.debugger.has_unread() {
            true => ears.while_reading(session),
            false => ears.next(longest),
        };
        let Some(happening) = happening else { continue };
        match answer(happening, &mut look, session, &mut ears) {
            Next::GoOn => {}
            Next::LetGo(until) => {
                let let_go = session.let_go(until);
                follow(let_go, session, &mut ears);
            }
            Next::Leave(leaving) => break leaving,
            Next::Redraw => stage.0.clear().map_err(failed)?,
            Next::Suspend => {
                leave();
                suspend();
                enable_raw_mode().map_err(failed)?;
                IS_ENTERED.store(true, Ordering::Relaxed);
                execute!(io::stdout(), EnterAlternateScreen).map_err(failed)?;
                stage.0.clear().map_err(failed)?;
            }
        }
    };
    session.cancel.look = None;
    session.show = shown_before;
    drop(stage);
    Ok(leaving)
}

/// Handles a key, a report or a pause, and says what the screen does next.
fn answer(happening: Happening, look: &mut Look, session: &mut Session, ears: &mut Ears) -> Next {
    match happening {
        Happening::Terminal(Ok(Event::Key(key))) if key.kind != KeyEventKind::Release => {
            return handle(look, session, key);
        }
        Happening::Terminal(Ok(Event::Paste(text))) if look.prompt.is_open => {
            let printed = text.chars().filter(|c| !c.is_control());
            printed.for_each(|c| insert(&mut look.prompt, c));
        }
        Happening::Terminal(Ok(_)) => {}
        Happening::Terminal(Err(_)) => return Next::Leave(Leaving::Quits),
        Happening::Report(report) => live::follow(&mut session.debugger, &report),
        Happening::Paused(reports, report) => {
            let paused = session.paused(reports, &report);
            follow(paused, session, ears);
        }
        Happening::Ended => session.say("the controller has ended", SaidKind::Wrong),
    }
    Next::GoOn
}

/// Follows a controller that runs on, or shows what it has answered.
fn follow(answered: Result<Option<String>, Wrong>, session: &mut Session, ears: &mut Ears) {
    match answered {
        Ok(Some(said)) => session.say(&said, SaidKind::Answer),
        Ok(None) => ears.follow(session),
        Err(Wrong(wrong)) => session.say(&wrong, SaidKind::Wrong),
    }
}

/// Whether the last line has something else than was drawn there.
static IS_WRITTEN_OVER: AtomicBool = AtomicBool::new(false);

/// Shows how far a search has come on the last line of the screen, which is drawn anew afterwards.
fn show_below(text: &str) {
    let Ok((width, height)) = size() else { return };
    IS_WRITTEN_OVER.store(true, Ordering::Relaxed);
    let width = usize::from(width.saturating_sub(1));
    let line: String = format!(" {text:<width$}").chars().take(width).collect();
    // Who cannot be told waits all the same.
    let _ = execute!(
        io::stdout(),
        MoveTo(0, height.saturating_sub(1)),
        SetAttribute(Attribute::Reverse),
        Print(line),
        SetAttribute(Attribute::Reset)
    );
}

/// Stops the program as Ctrl-Z does, until the shell lets it go on.
#[cfg(unix)]
fn suspend() {
    let _ = io::Write::flush(&mut io::stdout());
    // Of the whole group, as the terminal does it: whoever waits for the program sees it too.
    let _ = rustix::process::kill_current_process_group(rustix::process::Signal::TSTP);
}

#[cfg(not(unix))]
fn suspend() {}

/// What the screen waits for.
enum Happening {
    Terminal(io::Result<Event>),
    /// The running controller has been given something.
    Report(Box<Report>),
    /// It is paused.
    Paused(Reports, Box<Report>),
    /// It has ended.
    Ended,
}

/// The keyboard, read in a thread of its own: one event each time it is asked for. So nobody reads
/// what is meant for whoever has the terminal next. What a running controller is given comes the same
/// way.
struct Ears {
    ask: Sender<()>,
    is_asked: bool,
    tell: Sender<Happening>,
    happenings: Receiver<Happening>,
}

impl Ears {
    fn listen() -> Ears {
        let (tell, happenings) = channel();
        let (ask, asked) = channel();
        let told = tell.clone();
        // Without the thread nothing comes, and the screen closes.
        let _ = thread::Builder::new().name("keys".to_owned()).spawn(move || {
            while asked.recv().is_ok() {
                if told.send(Happening::Terminal(event::read())).is_err() {
                    return;
                }
            }
        });
        Ears { ask, is_asked: false, tell, happenings }
    }

    /// Waits, and costs nothing meanwhile. `None` if nothing has come for so long, if somebody wants
    /// to know.
    fn next(&mut self, longest: Option<Duration>) -> Option<Happening> {
        if let Some(event) = ahead().pop_front() {
            return Some(Happening::Terminal(Ok(event)));
        }
        if !self.is_asked {
            self.is_asked = true;
            if self.ask.send(()).is_err() {
                return Some(Happening::Terminal(Err(io::ErrorKind::BrokenPipe.into())));
            }
        }
        let happening = match longest {
            Some(Duration::ZERO) => self.happenings.try_recv().ok()?,
            Some(longest) => self.happenings.recv_timeout(longest).ok()?,
            None => self.happenings.recv().ok()?,
        };
        self.is_asked &= !matches!(happening, Happening::Terminal(_));
        Some(happening)
    }

    /// Reads on in a recording until something comes, or there is something new to be seen.
    fn while_reading(&mut self, session: &mut Session) -> Option<Happening> {
        let (begun, mut next) = (Instant::now(), None);
        session.read_on(|| {
            next = self.next(Some(Duration::ZERO));
            next.is_some() || begun.elapsed() >= READING
        });
        session.notice();
        next
    }

    /// Hears what a running controller is given, until it is paused.
    fn follow(&self, session: &mut Session) {
        let Some(mut reports) = session.live.as_mut().and_then(Live::take_reports) else { return };
        let tell = self.tell.clone();
        // Without the thread nobody hears of it.
        let _ = thread::Builder::new().name("reports".to_owned()).spawn(move || {
            loop {
                let told = match reports.wait() {
                    None => tell.send(Happening::Ended),
                    Some(report) if live::is_pause(&report) => {
                        let _ = tell.send(Happening::Paused(reports, Box::new(report)));
                        return;
                    }
                    Some(report) => tell.send(Happening::Report(Box::new(report))),
                };
                if told.is_err() {
                    return;
                }
            }
        });
    }
}

/// Keys that were pressed while something was looked for.
static AHEAD: Mutex<VecDeque<Event>> = Mutex::new(VecDeque::new());

fn ahead() -> MutexGuard<'static, VecDeque<Event>> {
    AHEAD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether Ctrl-C is among the keys that were pressed while something was looked for. The others have
/// their turn afterwards.
fn is_interrupted() -> bool {
    while matches!(event::poll(Duration::ZERO), Ok(true)) {
        match event::read() {
            Ok(Event::Key(KeyEvent { code: KeyCode::Char('c'), modifiers, .. }))
                if modifiers.contains(KeyModifiers::CONTROL) =>
            {
                return true;
            }
            Ok(event) => ahead().push_back(event),
            Err(_) => return false,
        }
    }
    false
}

/// What comes after a key.
enum Next {
    GoOn,
    /// The running controller goes on, until a time at most.
    LetGo(Until),
    Redraw,
    Suspend,
    Leave(Leaving),
}

fn handle(look: &mut Look, session: &mut Session, key: KeyEvent) -> Next {
    if look.shows_keys {
        look.shows_keys = false;
        return Next::GoOn;
    }
    if look.prompt.is_open {
        return edit(look, session, key);
    }
    let Some(act) = keys::act(&key) else { return Next::GoOn };
    if session.is_running() {
        match act {
            // The first time it pauses the controller, so that nothing runs unseen.
            Act::HoldOrGo | Act::Quit | Act::Line("continue") => {
                session.cancel.wish();
                return Next::GoOn;
            }
            Act::Line(_) | Act::Scrub(_) | Act::Type | Act::Again | Act::Breakpoint => {
                session.say("it runs: Space pauses it first", SaidKind::Wrong);
                return Next::GoOn;
            }
            Act::NextBranch | Act::Picture => return Next::GoOn,
            _ => {}
        }
    }
    match act {
        Act::HoldOrGo if session.live.is_some() => return Next::LetGo(Until::Paused),
        Act::Line(line) => return carry_out(session, line),
        Act::Scrub(by) => {
            let way = if by < 0 { "back" } else { "step" };
            let line = format!("{way} {} {}", by.unsigned_abs(), UNITS[look.unit]);
            return carry_out(session, &line);
        }
        Act::NextUnit => look.unit = (look.unit + 1) % UNITS.len(),
        Act::Panel(name) => return panel(session, name),
        Act::Type => open_prompt(look),
        Act::Again => {
            if let Some(line) = look.typed.last().cloned() {
                return carry_out(session, &line);
            }
        }
        Act::Breakpoint => return breakpoint(session),
        Act::HoldOrGo => {}
        Act::NextBranch => return next_branch(session),
        Act::Nearer => look.gaze.nearer(),
        Act::Farther => look.gaze.farther(),
        Act::Move(right, up) => look.gaze.move_by(right, up),
        Act::WholePath => look.gaze = Gaze::default(),
        Act::Picture => {
            look.pictures += 1;
            let size = size().unwrap_or((80, 24));
            let line = format!("picture console-{}.svg {}x{}", look.pictures, size.0, size.1);
            return carry_out(session, &line);
        }
        Act::Keys => look.shows_keys = true,
        Act::Redraw => return Next::Redraw,
        Act::Suspend => return Next::Suspend,
        Act::Quit if look.is_first => return Next::Leave(Leaving::Quits),
        Act::Quit => return Next::Leave(Leaving::Closed),
    }
    Next::GoOn
}

/// Carries out a line and shows what was answered.
fn carry_out(session: &mut Session, line: &str) -> Next {
    match session.goes_on(line) {
        Some(Ok(until)) => {
            session.say(line, SaidKind::Typed);
            return Next::LetGo(until);
        }
        Some(Err(Wrong(wrong))) => {
            session.say(&wrong, SaidKind::Wrong);
            return Next::GoOn;
        }
        None => {}
    }
    match Console::carry_out_once(session, line) {
        Ok(Outcome::Said(text)) if line.starts_with("picture ") => {
            session.say(&text, SaidKind::Answer);
        }
        Err(Wrong(wrong)) if line.starts_with("picture ") => session.say(&wrong, SaidKind::Wrong),
        Ok(Outcome::Said(_) | Outcome::Screen | Outcome::Picture(..)) | Err(_) => {}
        Ok(Outcome::Quit) => return Next::Leave(Leaving::Quits),
        Ok(Outcome::Source(file)) => match script::called(session, &file, 0) {
            Ok(_) => {}
            Err(failure) => session.say(&failure.to_string(), SaidKind::Wrong),
        },
    }
    Next::GoOn
}

/// Works a thing of the panel.
fn panel(session: &mut Session, name: &str) -> Next {
    let view = session.view();
    let signals = vimc4_device::Device::signals(session.debugger.device());
    let Some(signal) = signals.iter().find(|signal| signal.name == name) else {
        session.say(&format!("this controller has no {name}"), SaidKind::Wrong);
        return Next::GoOn;
    };
    let is_on = view.signal(name).unwrap_or(0) != 0;
    let line = match (signal.kind, &signal.positions) {
        (SignalKind::Button, _) if is_on => format!("release {name}"),
        (SignalKind::Button, _) => format!("press {name}"),
        (_, Some(positions)) => format!("{name} {}", positions[usize::from(!is_on)]),
        _ => format!("set {name} {}", i32::from(!is_on)),
    };
    if let Some(live) = session.live.as_ref().filter(|live| live.is_running()) {
        let ordered = live.order(&line);
        match ordered {
            Ok(()) => session.say(&line, SaidKind::Typed),
            Err(wrong) => session.say(&wrong, SaidKind::Wrong),
        }
        return Next::GoOn;
    }
    carry_out(session, &line)
}

/// A breakpoint at the present line, or none.
fn breakpoint(session: &mut Session) -> Next {
    let listing = camera::listing(&mut session.debugger);
    let Some(line) = listing.lines.iter().find(|line| line.is_present) else {
        session.say("no line is the present one", SaidKind::Wrong);
        return Next::GoOn;
    };
    let line = match line.breakpoint {
        Some(breakpoint) => format!("delete {breakpoint}"),
        None => format!("break line {}", line.number),
    };
    carry_out(session, &line)
}

/// Goes to the end of the next branch.
fn next_branch(session: &mut Session) -> Next {
    let history = session.debugger.history();
    let heading = history.heading();
    let branches: Vec<_> = history.branches().collect();
    let place = branches.iter().position(|branch| branch.id == heading).unwrap_or(0);
    let next = branches.get((place + 1) % branches.len().max(1));
    match next.filter(|next| next.id != heading).map(|next| next.name.clone()) {
        Some(name) => carry_out(session, &format!("goto {name}")),
        None => {
            session.say("there is one branch only", SaidKind::Wrong);
            Next::GoOn
        }
    }
}

// --- the command line ---

fn open_prompt(look: &mut Look) {
    look.prompt = Prompt { is_open: true, ..Prompt::default() };
    look.recalled = look.typed.len();
}

fn insert(prompt: &mut Prompt, character: char) {
    let place = byte_of(prompt);
    prompt.text.insert(place, character);
    prompt.cursor += 1;
}

/// Where the cursor is in bytes.
fn byte_of(prompt: &Prompt) -> usize {
    let place = prompt.text.char_indices().nth(prompt.cursor).map(|(place, _)| place);
    place.unwrap_or(prompt.text.len())
}

fn edit(look: &mut Look, session: &mut Session, key: KeyEvent) -> Next {
    let control = key.modifiers.contains(KeyModifiers::CONTROL);
    let prompt = &mut look.prompt;
    prompt.candidates.clear();
    match key.code {
        KeyCode::Esc => look.prompt = Prompt::default(),
        KeyCode::Char('c') if control => look.prompt = Prompt::default(),
        KeyCode::Char('z') if control => return Next::Suspend,
        KeyCode::Char('u') if control => {
            prompt.text.drain(..byte_of(prompt));
            prompt.cursor = 0;
        }
        KeyCode::Char('a') if control => prompt.cursor = 0,
        KeyCode::Char('e') if control => prompt.cursor = prompt.text.chars().count(),
        KeyCode::Char(_) if control => {}
        KeyCode::Char(character) => insert(prompt, character),
        KeyCode::Backspace if prompt.cursor > 0 => {
            prompt.cursor -= 1;
            let place = byte_of(prompt);
            prompt.text.remove(place);
        }
        KeyCode::Backspace => look.prompt = Prompt::default(),
        KeyCode::Delete if byte_of(prompt) < prompt.text.len() => {
            let place = byte_of(prompt);
            prompt.text.remove(place);
        }
        KeyCode::Left => prompt.cursor = prompt.cursor.saturating_sub(1),
        KeyCode::Right => prompt.cursor = (prompt.cursor + 1).min(prompt.text.chars().count()),
        KeyCode::Home => prompt.cursor = 0,
        KeyCode::End => prompt.cursor = prompt.text.chars().count(),
        KeyCode::Up => recall(look, -1),
        KeyCode::Down => recall(look, 1),
        KeyCode::Tab => complete(&mut look.prompt, session),
        KeyCode::Enter => {
            let line = std::mem::take(&mut look.prompt).text;
            let line = line.trim();
            if line.is_empty() {
                return Next::GoOn;
            }
            look.typed.push(line.to_owned());
            return carry_out(session, line);
        }
        _ => {}
    }
    let prompt = &mut look.prompt;
    let is_at_end = prompt.is_open && prompt.cursor == prompt.text.chars().count();
    prompt.hint = if is_at_end { hint(&prompt.text).unwrap_or_default() } else { String::new() };
    Next::GoOn
}

/// A line that was typed before, or after that.
fn recall(look: &mut Look, by: isize) {
    let place = look.recalled.saturating_add_signed(by).min(look.typed.len());
    look.recalled = place;
    let text = look.typed.get(place).cloned().unwrap_or_default();
    look.prompt.cursor = text.chars().count();
    look.prompt.text = text;
}

/// Completes the word before the cursor as far as all that it can be have in common, and shows them
/// if that is nothing more.
fn complete(prompt: &mut Prompt, session: &Session) {
    let cursor = byte_of(prompt);
    let completion = session.complete(&prompt.text, cursor);
    let texts: Vec<&str> = completion.candidates.iter().map(|it| it.text.as_str()).collect();
    let Some((first, others)) = texts.split_first() else { return };
    let common = others.iter().fold(*first, |common, other| {
        let same = common.char_indices().zip(other.chars()).find(|((_, one), other)| one != other);
        let end = same.map_or(common.len().min(other.len()), |((place, _), _)| place);
        &common[..end]
    });
    let end = if others.is_empty() { " " } else { "" };
    let begun = prompt.text.get(completion.from..cursor).unwrap_or_default().to_owned();
    if begun == common && !others.is_empty() {
        prompt.candidates = texts.iter().map(|text| (*text).to_owned()).collect();
        return;
    }
    let word = format!("{common}{end}");
    prompt.text.replace_range(completion.from..cursor, &word);
    let before = prompt.text.get(..completion.from).unwrap_or_default().chars().count();
    prompt.cursor = before + word.chars().count();
}

#[cfg(all(test, unix))]
mod tests {
    #![expect(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

    use std::fs::File;
    use std::io::Read;
    use std::os::fd::OwnedFd;
    use std::process::{Command, Stdio};

    use ratatui_core::layout::Position;
    use ratatui_core::style::Style;
    use rustix::fs::{Mode, OFlags};
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    use rustix::termios::{Termios, Winsize, tcgetattr, tcsetwinsize};

    use super::*;

    /// In the test's other process, which has a terminal, this is set.
    const IN_TERMINAL: &str = "VIMC4_TEST_PANICS_ON_STAGE";

    const NAME: &str = "console::screen::face::tests::a_panic_gives_the_terminal_back";

    #[test]
    fn a_panic_gives_the_terminal_back() {
        if env::var_os(IN_TERMINAL).is_some() {
            panics_on_stage();
        }
        let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&near).unwrap();
        unlockpt(&near).unwrap();
        let name = ptsname(&near, Vec::new()).unwrap();
        let open = || -> OwnedFd {
            let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
            rustix::fs::open(name.as_c_str(), flags, Mode::empty()).unwrap()
        };
        let far = open();
        let size = Winsize { ws_row: 24, ws_col: 80, ws_xpixel: 0, ws_ypixel: 0 };
        tcsetwinsize(&far, size).unwrap();
        let before = modes(&tcgetattr(&far).unwrap());
        let mut child = Command::new(env::current_exe().unwrap())
            .args([NAME, "--exact", "--nocapture"])
            .env(IN_TERMINAL, "1")
            .env("TERM", "xterm-256color")
            .stdin(Stdio::from(open()))
            .stdout(Stdio::from(open()))
            .stderr(Stdio::from(open()))
            .spawn()
            .unwrap();
        let mut near = File::from(near);
        let reader = thread::spawn(move || {
            let mut seen = Vec::new();
            // When nobody has the far end open any more there is an error.
            let _ = near.read_to_end(&mut seen);
            String::from_utf8_lossy(&seen).into_owned()
        });
        assert!(!child.wait().unwrap().success(), "it has panicked");
        let after = modes(&tcgetattr(&far).unwrap());
        drop(far);
        let seen = reader.join().unwrap();
        assert_eq!(after, before, "the modes of the terminal: {seen:?}");
        let place = |text: &str| seen.find(text).unwrap_or_else(|| panic!("{text:?}: {seen:?}"));
        let (entered, hidden) = (place("\u{1b}[?1049h"), place("\u{1b}[?25l"));
        let (drawn, left) = (place("playing"), place("\u{1b}[?1049l"));
        let said = place("in the middle of it");
        assert!(entered < drawn && drawn < left && left < said, "{seen:?}");
        let shown = seen[left..].find("\u{1b}[?25h").map(|at| left + at);
        let is_shown = shown.is_some_and(|shown| hidden < shown && shown < said);
        assert!(is_shown, "the cursor is seen again: {seen:?}");
        // What is said begins at the left edge: each end of a line is a carriage return too.
        assert!(seen[left..].contains("\r\n") && !seen[left..].contains("[?1049h"), "{seen:?}");
    }

    /// Draws something on the full screen, and panics with the terminal in its hands.
    fn panics_on_stage() -> ! {
        let mut stage = Stage::enter().unwrap();
        let raw = modes(&tcgetattr(io::stdin()).unwrap());
        let draw = stage.0.draw(|frame| {
            let text = if raw.0 { "cooked" } else { "playing" };
            frame.buffer_mut().set_string(0, 0, text, Style::new());
            frame.set_cursor_position(Position::ORIGIN);
        });
        draw.unwrap();
        stage.0.hide_cursor().unwrap();
        panic!("in the middle of it");
    }

    /// Whether lines are edited, what is typed is shown, keys are signals, and ends of lines are
    /// carriage returns too.
    fn modes(of: &Termios) -> (bool, bool, bool, bool) {
        use rustix::termios::{LocalModes, OutputModes};
        let has = |mode| of.local_modes.contains(mode);
        (
            has(LocalModes::ICANON),
            has(LocalModes::ECHO),
            has(LocalModes::ISIG),
            of.output_modes.contains(OutputModes::OPOST | OutputModes::ONLCR),
        )
    }
}
