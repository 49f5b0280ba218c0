//! `vimc4 doctor`: what a program will find at a port.

use std::fmt::Write as _;
#[cfg(unix)]
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use vimc4_catalogue::{Family, Handling, Model};
use vimc4_device::escape;

use crate::completions;
use crate::failure::Failure;
use crate::here::here;
use crate::output;
use crate::port::{self, ModemLines, Port, PortError, speed};
use crate::text::{shortened, shown_in_line};

#[derive(clap::Args)]
#[command(
    long_about = concat!("\
Say what a program will find at a port, and how to fix what is wrong

PORT is ", here!("the link of a pseudo-terminal (./vimc4.pty), a serial port (/dev/ttyUSB0, COM3) or TCP
(127.0.0.1:4004, tcp:HOST:PORT). It is opened as a program would open it: where the link leads, who
may use it, its speed, whether it has modem lines, who else has it open, and whether a controller",
"a serial port (COM3) or TCP (127.0.0.1:4004, tcp:HOST:PORT). It is opened as a program would
open it: whether that can be done, whether it has modem lines, and whether a controller"), "
answers, and as which. Nothing is moved, switched or stored: it is asked where its axes are, and for
its name. While another program has the port open it is not asked, and a data field that was left
half stored ends with the first question. A controller that moves answers the questions when it
comes to rest, and whichever program has the port open then gets the answers."),
    after_long_help = concat!("\
Exit codes: 0 a program will find what it needs, 1 something should be mended, 2 it cannot be opened.

Examples:
  vimc4 doctor ", here!("./vimc4.pty", "COM7"), "
  vimc4 doctor 127.0.0.1:4004
  vimc4 doctor ", here!("/dev/ttyUSB0", "COM3"), " --baud 9600")
)]
pub(crate) struct Arguments {
    /// The port
    #[arg(add = completions::ports())]
    port: String,
    #[arg(long, value_name = "RATE", help = concat!(
        "The speed that the program uses on a serial port; if nothing answers, others are tried \
         [default: 19200",
        here!(", and that of a pseudo-terminal as it is]", "]")
    ))]
    baud: Option<u32>,
}

/// How long to listen before asking anything.
const LISTEN: Duration = Duration::from_millis(200);

/// How long an answer may take, and how long what belongs to it may be behind.
const ANSWER: Duration = Duration::from_millis(500);
const PAUSE: Duration = Duration::from_millis(250);

/// No answer is longer, in bytes and in time.
const LONGEST: usize = 2_048;
const LATEST: Duration = Duration::from_secs(1);

/// How many characters of foreign text are shown.
const EXCERPT: usize = 200;

/// The most programs that are named.
#[cfg(unix)]
const NAMED: usize = 5;

/// The speed of most serial lines to a controller.
const BAUD: u32 = 19_200;

/// What is known of a port before it is opened as a program would open it.
#[derive(Default)]
struct Before {
    /// The speed of a pseudo-terminal.
    baud: Option<u32>,
    /// Another program has it open.
    busy: bool,
    /// It is a terminal for people and not held by an emulator: an old link may lead there.
    stale: bool,
}

/// What was found, line by line.
#[derive(Default)]
struct Findings {
    text: String,
    /// Something should be mended.
    has_problem: bool,
}

impl Findings {
    fn fine(&mut self, what: &str, found: &str) {
        self.line(what, found);
    }

    fn problem(&mut self, what: &str, found: &str, remedy: &str) {
        self.has_problem = true;
        self.line(what, found);
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{:<14}-> {remedy}", "");
    }

    fn line(&mut self, what: &str, found: &str) {
        let _ = writeln!(self.text, "{what:<14}{}", shown_in_line(found));
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let mut findings = Findings::default();
    let name = arguments.port.as_str();
    let is_tcp = port::is_tcp(name);
    let mut before = Before::default();
    if !is_tcp {
        match before_opening(name, &mut findings) {
            Some(found) => before = found,
            None => {
                output::print(&findings.text)?;
                return Err(Failure::usage(format!(
                    "{name} is not a serial port and no pseudo-terminal; name one, or a link to one, or \
                     HOST:PORT for TCP"
                )));
            }
        }
    }
    if before.stale {
        // Opening it as a serial port would already disturb its user.
        output::print(&findings.text)?;
        return Ok(ExitCode::FAILURE);
    }
    let baud = speed(name, arguments.baud, before.baud.unwrap_or(BAUD))?;
    let mut port = match Port::open(name, baud) {
        Ok(port) => port,
        Err(error) => {
            // What was seen up to here may say why.
            output::print(&findings.text)?;
            return Err(Failure::usage(error));
        }
    };
    if is_tcp {
        findings.fine("connection", &format!("something listens at {name}"));
    } else {
        modem_lines(&mut port, &mut findings);
    }
    // The conversation may take a while.
    output::print(&std::mem::take(&mut findings.text))?;
    if before.busy {
        let why = "not asked: the question would get into what the other program says";
        findings.fine("controller", why);
    } else {
        conversation(&mut port, &mut findings);
    }
    output::print(&findings.text)?;
    Ok(if findings.has_problem { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

// --- what the system knows ---

/// What is known of a path before it is opened; `None` if it is not a line.
#[cfg(unix)]
fn before_opening(name: &str, findings: &mut Findings) -> Option<Before> {
    use std::fs;
    use std::os::unix::fs::FileTypeExt;

    let path = Path::new(name);
    let mut before = Before::default();
    if let Ok(target) = fs::read_link(path) {
        findings.fine("link", &format!("{name} leads to {}", target.display()));
    }
    let Ok(file) = fs::metadata(path) else { return Some(before) };
    // What may not be opened may still be a terminal.
    let settings = file.file_type().is_char_device().then(|| line_settings(path));
    if matches!(settings, None | Some(Ok(None))) {
        return None;
    }
    permission(path, &file, findings);
    let users = vimc4::Users::of(path).unwrap_or_default();
    match users.server() {
        Some(server) => {
            let who = format!("{} (process {}) answers at it", server.name, server.process);
            findings.fine("emulator", &who);
        }
        None if is_pseudo(path) && users.all_looked_at => findings.problem(
            "emulator",
            "no emulator holds the other end of this pseudo-terminal",
            "it may belong to a terminal window: start `vimc4 serve`, which makes the link anew",
        ),
        None => {}
    }
    let others: Vec<_> = users
        .seen
        .iter()
        .filter(|user| !user.serves && user.process != std::process::id())
        .collect();
    before.busy = !others.is_empty();
    let named = others.iter().take(NAMED);
    let mut named: Vec<String> =
        named.map(|user| format!("{} (process {})", user.name, user.process)).collect();
    if others.len() > NAMED {
        named.push(format!("{} more", others.len() - NAMED));
    }
    match named.as_slice() {
        [] if users.all_looked_at => findings.fine("open", "no other program has it open"),
        [] => findings.fine("open", "no other program is seen to have it open; root can see more"),
        [one] => findings.problem(
            "open",
            &format!("{one} has it open"),
            "two programs take the answers from each other: close that one first",
        ),
        many => findings.problem(
            "open",
            &format!("{} have it open", many.join(" and ")),
            "programs take the answers from each other: close those first",
        ),
    }
    if let Some(Ok(Some(settings))) = settings {
        before.stale = is_pseudo(path) && users.server().is_none() && is_edited(&settings);
        // A program that opens it as a serial port sets all of that.
        findings.fine("settings", &format!("{}, until the program sets its own", shown(&settings)));
        before.baud = is_pseudo(path).then_some(settings.output_speed());
        if before.stale {
            findings.problem(
                "controller",
                "not asked: this is a terminal for people, and what leads here is stale",
                "start `vimc4 serve`, which makes the link anew",
            );
        }
    }
    Some(before)
}

#[cfg(unix)]
fn is_pseudo(path: &Path) -> bool {
    path.canonicalize().is_ok_and(|path| path.starts_with("/dev/pts"))
}

#[cfg(unix)]
fn permission(path: &Path, file: &std::fs::Metadata, findings: &mut Findings) {
    use std::os::unix::fs::MetadataExt;

    use rustix::fs::{Access, access};

    let rights = format!("{:03o}, owner {}, group {}", file.mode() & 0o777, file.uid(), file.gid());
    match access(path, Access::READ_OK | Access::WRITE_OK) {
        Ok(()) => findings.fine("permission", &format!("to read and to write ({rights})")),
        Err(_) => findings.problem(
            "permission",
            &format!("you may not read and write it ({rights})"),
            match is_pseudo(path) {
                true => {
                    "it belongs to the user who started the emulator: run both as the same user"
                }
                false => {
                    "join the group that may, `dialout` on most systems (`sudo usermod -aG dialout \
                     $USER`), and log in again"
                }
            },
        ),
    }
}

/// How the line is set before a program sets it; `None` if it is not a line.
#[cfg(unix)]
fn line_settings(path: &Path) -> rustix::io::Result<Option<rustix::termios::Termios>> {
    use rustix::fs::{Mode, OFlags, open};
    use rustix::io::Errno;

    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    match rustix::termios::tcgetattr(&open(path, flags, Mode::empty())?) {
        Err(Errno::NOTTY) => Ok(None),
        settings => settings.map(Some),
    }
}

#[cfg(unix)]
fn shown(settings: &rustix::termios::Termios) -> String {
    use rustix::termios::ControlModes;

    let mut text = format!("{} baud", settings.output_speed());
    let modes = settings.control_modes;
    let bits = match modes & ControlModes::CSIZE {
        ControlModes::CS5 => 5,
        ControlModes::CS6 => 6,
        ControlModes::CS7 => 7,
        _ => 8,
    };
    let parity = match (modes.contains(ControlModes::PARENB), modes.contains(ControlModes::PARODD))
    {
        (false, _) => 'N',
        (true, false) => 'E',
        (true, true) => 'O',
    };
    let stop = if modes.contains(ControlModes::CSTOPB) { 2 } else { 1 };
    text += &format!(", {bits}{parity}{stop}");
    if modes.contains(ControlModes::CRTSCTS) {
        text += ", RTS/CTS";
    }
    if is_edited(settings) {
        text += ", edited and echoed like a terminal for people";
    }
    text
}

/// Whether it is set as terminals for people are.
#[cfg(unix)]
fn is_edited(settings: &rustix::termios::Termios) -> bool {
    use rustix::termios::LocalModes;

    settings.local_modes.intersects(LocalModes::ICANON | LocalModes::ECHO)
}

#[cfg(not(unix))]
fn before_opening(_name: &str, _findings: &mut Findings) -> Option<Before> {
    Some(Before::default())
}

fn modem_lines(port: &mut Port, findings: &mut Findings) {
    match port.modem_lines() {
        ModemLines::None if cfg!(target_os = "linux") => findings.fine(
            "modem lines",
            "none, as with every pseudo-terminal: a program that insists on them (Mono, Wine, \
             .dtr of pyserial) needs `vimc4 lines -- PROGRAM`",
        ),
        ModemLines::None => findings.fine(
            "modem lines",
            here!(
                "none, as with every pseudo-terminal: a program that insists on them needs TCP or a \
                 serial port",
                "none: a program that insists on them needs another port, or TCP"
            ),
        ),
        ModemLines::Are(lines) => {
            let shown: Vec<String> = lines
                .iter()
                .map(|(name, on)| format!("{name} {}", if *on { "on" } else { "off" }))
                .collect();
            findings.fine("modem lines", &shown.join(", "));
        }
        ModemLines::Unasked => {}
    }
}

// --- what the other end says ---

/// Nothing that is asked moves, switches or stores anything, whatever the controller does: it
/// does not know the question of another family.
fn conversation(port: &mut Port, findings: &mut Findings) {
    let mut heard = Vec::new();
    let Err(why) = talk(port, findings, &mut heard) else { return };
    if heard.is_empty() || is_telnet(&heard) {
        findings.problem(
            "controller",
            &format!("the other end has gone: {why}"),
            match port::is_tcp(port.name()) {
                true => {
                    "one client holds the line at a time, and another one may have it: close that one"
                }
                false => {
                    "the emulator has ended, or the adapter was pulled out: start `vimc4 serve` again, \
                     or plug it in"
                }
            },
        );
    } else {
        findings.problem(
            "controller",
            &format!("the other end has gone ({why}), after it said `{}`", excerpt(&heard)),
            "controllers end no connection: look who it is that answers there",
        );
    }
}

/// Everything that comes is added to `heard`.
fn talk(port: &mut Port, findings: &mut Findings, heard: &mut Vec<u8>) -> Result<(), PortError> {
    let Heard { bytes: unasked, silent } = hear(port, LISTEN, heard)?;
    if is_telnet(&unasked) {
        findings.problem(
            "line",
            &format!("it speaks Telnet: `{}`", excerpt(&unasked)),
            "programs that speak RFC 2217 can use it, such as rfc2217:// of pyserial; for all others \
             set it to raw TCP, because 253 to 255 are commands of controllers",
        );
    } else if !unasked.is_empty() {
        findings.problem(
            "line",
            &format!("it speaks without being asked: `{}`", excerpt(&unasked)),
            "a program runs that sends something, the speed is wrong, or it is not a controller",
        );
    }
    if !silent {
        findings.fine("controller", "not asked: what never falls silent has no answers");
        return Ok(());
    }
    let handlings = |family: Family| {
        let models = family.models().into_iter().filter_map(Model::builtin);
        models.map(|model| Handling::of(&model)).collect::<Vec<_>>()
    };
    let families = Family::ALL.map(handlings);
    let mut speeds: Vec<Option<u32>> = vec![port.baud()];
    if port.baud().is_some() {
        let all = families.iter().flatten().flat_map(|handling| handling.speeds);
        for speed in all.copied().map(Some) {
            if !speeds.contains(&speed) {
                speeds.push(speed);
            }
        }
    }
    let mut said = Vec::new();
    for (number, speed) in speeds.into_iter().enumerate() {
        if let (Some(speed), true) = (speed, number > 0) {
            port.set_baud(speed)?;
        }
        let Some(found) = question(port, &families, &mut said, heard)? else { continue };
        describe(port, &found, findings, heard)?;
        if let (Some(speed), true) = (speed, number > 0) {
            findings.problem(
                "speed",
                &format!("it answers at {speed} baud only"),
                &format!("set the program to {speed} baud"),
            );
        }
        return Ok(());
    }
    match said.is_empty() {
        true => findings.problem(
            "controller",
            "nothing answers",
            "check that it is on, and the cable: crossed (null modem) where the controller needs \
             it. If it moves, or its time is manual, the questions wait on the line: it answers \
             when it has come to rest, and whichever program has the port open then should drop the answers",
        ),
        false => findings.problem(
            "controller",
            &format!("what answers makes no sense: `{}`", excerpt(&said)),
            "it is another device, or a serial line behind it has the wrong speed",
        ),
    }
    Ok(())
}

/// A controller that answers.
struct Found<'a> {
    handling: &'a Handling,
    /// Where its axes are.
    places: Vec<i64>,
    /// What it has answered to the question before, if it has not understood that.
    refused: Option<String>,
}

/// Asks in the language of each family. Failures are added to `said`.
fn question<'a>(
    port: &mut Port,
    families: &'a [Vec<Handling>],
    said: &mut Vec<u8>,
    heard: &mut Vec<u8>,
) -> Result<Option<Found<'a>>, PortError> {
    let mut last = Vec::new();
    for models in families {
        let Some(handling) = models.first() else { continue };
        let mut refused = None;
        // A half line left by an earlier client spoils the first question.
        for _ in 0..2 {
            let answer = ask(port, handling.position, heard)?;
            if let Some(places) = handling.read_position(&answer) {
                return Ok(Some(Found { handling, places, refused }));
            }
            refused = handling.model().family().refusal(&answer);
            said.extend(&answer);
            last.push((handling.model().family(), answer));
        }
    }
    // Some models of a family answer differently from the first: with no axis configured an old
    // card answers `0`. So does what answers `0` to everything, also to a question that it cannot
    // know.
    let reads = |handling: &&'a Handling| {
        let family = handling.model().family();
        let (own, others): (Vec<_>, Vec<_>) = last.iter().partition(|(of, _)| *of == family);
        let refuses = others.iter().any(|(_, answer)| family.refusal(answer).is_some());
        let places = own.last().and_then(|(_, answer)| handling.read_position(answer));
        Some((*handling, places.filter(|_| refuses)?))
    };
    let found = families.iter().flatten().find_map(|handling| reads(&handling));
    Ok(found.map(|(handling, places)| Found { handling, places, refused: None }))
}

/// Reports which controller answers.
fn describe(
    port: &mut Port,
    found: &Found<'_>,
    findings: &mut Findings,
    heard: &mut Vec<u8>,
) -> Result<(), PortError> {
    let Found { handling, places, refused } = found;
    let family = handling.model().family();
    let who = format!("one of {family} answers");
    let all = handling.model().axis_names();
    let place = |(axis, place)| format!("{axis} {place}");
    findings.fine(
        "controller",
        &match places.len() {
            0 => format!("{who}; no axis is configured"),
            // Which they are it does not say.
            few if !handling.names_axes(few) => {
                let places: Vec<String> = places.iter().map(i64::to_string).collect();
                format!("{who}: the configured axes are at {}", places.join(", "))
            }
            _ => {
                let places: Vec<String> = all.iter().zip(places).map(place).collect();
                format!("{who}: {}", places.join(", "))
            }
        },
    );
    if let Some(refused) = refused {
        findings.fine(
            "left over",
            &format!(
                "to the first question it answered {refused}: somebody has left half a line or \
                 half a data field, which has ended now"
            ),
        );
    }
    for line in handling.names {
        let name = ask(port, line, heard)?;
        if family.refusal(&name).is_none() && name.len() > 2 {
            findings.fine("model", &format!("it answers {line} with `{}`", excerpt(&name)));
            return Ok(());
        }
    }
    findings.fine("model", "it does not say");
    Ok(())
}

fn ask(port: &mut Port, line: &str, heard: &mut Vec<u8>) -> Result<Vec<u8>, PortError> {
    port.send(format!("{line}\r").as_bytes())?;
    Ok(hear(port, ANSWER, heard)?.bytes)
}

/// What comes, up to the first pause.
struct Heard {
    bytes: Vec<u8>,
    /// There was one.
    silent: bool,
}

fn hear(port: &mut Port, limit: Duration, all: &mut Vec<u8>) -> Result<Heard, PortError> {
    let mut heard = Heard { bytes: Vec::new(), silent: true };
    let end = Instant::now() + limit + LATEST;
    let mut until = Instant::now() + limit;
    while let Some((_, bytes)) = port.next(until)? {
        heard.bytes.extend_from_slice(&bytes);
        all.extend_from_slice(&bytes);
        let now = Instant::now();
        if heard.bytes.len() > LONGEST || now > end {
            heard.silent = false;
            break;
        }
        until = (now + PAUSE).min(end);
    }
    heard.silent &= Instant::now() < end;
    Ok(heard)
}

/// Whether it begins with the negotiation of a Telnet server: what follows 255, and what to do.
fn is_telnet(bytes: &[u8]) -> bool {
    matches!(bytes, [0xFF, 0xFB..=0xFE, ..])
}

fn excerpt(bytes: &[u8]) -> String {
    let text = escape(bytes.get(..LONGEST).unwrap_or(bytes));
    shortened(&text, EXCERPT).into_owned()
}
