//! `vimc4 doctor`: what a program will find at a port.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use vimc4::{Handling, escape};

use crate::failure::Failure;
use crate::output::{self, shortened, shown_in_line};
use crate::port::{self, ModemLines, Port, PortError};

#[derive(clap::Args)]
#[command(
    long_about = "\
Say what a program will find at a port, and what to do about what it will not like

PORT is the link of a pseudo-terminal (./vimc4.pty), a serial port (/dev/ttyUSB0, COM3) or TCP
(127.0.0.1:4004, tcp:HOST:PORT). It is opened as a program would open it: where the link leads, who
may use it, its speed, whether it has modem lines, who else has it open, and whether a controller
answers, and as which. Nothing is moved, switched or stored: it is asked where its axes are, and for
its name.",
    after_long_help = "\
Exit codes: 0 a program will find what it needs, 1 something should be mended, 2 it cannot be opened.

Examples:
  vimc4 doctor ./vimc4.pty
  vimc4 doctor 127.0.0.1:4004
  vimc4 doctor /dev/ttyUSB0 --baud 9600"
)]
pub(crate) struct Arguments {
    /// The port
    port: String,
    /// The speed that the program uses on a serial port; if nothing answers, others are tried
    #[arg(long, value_name = "RATE", default_value_t = 19_200)]
    baud: u32,
}

/// How long it is listened before anything is asked.
const LISTEN: Duration = Duration::from_millis(200);

/// How long an answer may take, and how long what belongs to it may be behind.
const ANSWER: Duration = Duration::from_millis(500);
const PAUSE: Duration = Duration::from_millis(80);

/// No answer is longer, in bytes and in time.
const LONGEST: usize = 2_048;
const LATEST: Duration = Duration::from_secs(1);

/// So many characters of what others say are shown.
const EXCERPT: usize = 200;

/// One controller of each family.
const FAMILIES: [&str; 2] = ["imc4", "smcu"];

/// What was found, line by line.
#[derive(Default)]
struct Findings {
    text: String,
    /// Something should be mended.
    troubled: bool,
}

impl Findings {
    fn fine(&mut self, what: &str, found: &str) {
        self.line(what, found);
    }

    fn trouble(&mut self, what: &str, found: &str, remedy: &str) {
        self.troubled = true;
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
    if !is_tcp {
        before_opening(name, &mut findings);
    }
    let mut port = match Port::open(name, arguments.baud) {
        Ok(port) => port,
        Err(error) => {
            // What was seen up to here may say why.
            output::print(&findings.text)?;
            return Err(Failure::usage(error));
        }
    };
    if is_tcp {
        findings.fine("connection", &format!("somebody listens at {name}"));
    } else {
        modem_lines(&mut port, &mut findings);
    }
    conversation(&mut port, &mut findings);
    output::print(&findings.text)?;
    Ok(if findings.troubled { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

// --- what the system knows ---

#[cfg(unix)]
fn before_opening(name: &str, findings: &mut Findings) {
    use std::fs;
    use std::os::unix::fs::FileTypeExt;

    let path = Path::new(name);
    if let Ok(target) = fs::read_link(path) {
        findings.fine("link", &format!("{name} leads to {}", target.display()));
    }
    let Ok(file) = fs::metadata(path) else { return };
    if !file.file_type().is_char_device() {
        findings.trouble(
            "kind",
            &format!("{name} is no terminal"),
            "name a serial port or a link to one",
        );
    }
    permission(path, &file, findings);
    // Who opens it is a user of it, so it is looked before that.
    let users = vimc4::Users::of(path).unwrap_or_default();
    match users.server() {
        Some(server) => {
            let who = format!("{} (process {}) answers at it", server.name, server.process);
            findings.fine("emulator", &who);
        }
        None if is_pseudo(path) && users.all_looked_at => findings.trouble(
            "emulator",
            "no emulator holds the other end of this pseudo-terminal",
            "it may belong to a terminal window: start `vimc4 serve`, which makes the link anew",
        ),
        None => {}
    }
    let others: Vec<String> = users
        .seen
        .iter()
        .filter(|user| !user.serves && user.process != std::process::id())
        .map(|user| format!("{} (process {})", user.name, user.process))
        .collect();
    match others.is_empty() {
        true if users.all_looked_at => findings.fine("open", "nobody else has it open"),
        true => findings.fine("open", "nobody else is seen to have it open; root sees more"),
        false => findings.trouble(
            "open",
            &format!("{} has it open", others.join(" and ")),
            "two programs take the answers from each other: close that one first",
        ),
    }
    settings(path, findings);
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
        Err(_) => findings.trouble(
            "permission",
            &format!("you may not read and write it ({rights})"),
            "join the group that may, `dialout` on most systems (`sudo usermod -aG dialout \
             $USER`), and log in again; or start the emulator as the same user",
        ),
    }
}

/// How the line is set before a program sets it.
#[cfg(unix)]
fn settings(path: &Path, findings: &mut Findings) {
    use rustix::fs::{Mode, OFlags, open};
    use rustix::termios::{ControlModes, LocalModes, tcgetattr};

    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let Ok(settings) = open(path, flags, Mode::empty()).and_then(|port| tcgetattr(&port)) else {
        return;
    };
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
    let cooked = settings.local_modes.intersects(LocalModes::ICANON | LocalModes::ECHO);
    if cooked {
        text += ", edited and echoed like a terminal for people";
    }
    // A program that opens it as a serial port sets all of that.
    findings.fine("settings", &format!("{text}, until the program sets its own"));
}

#[cfg(not(unix))]
fn before_opening(_name: &str, _findings: &mut Findings) {
    let _ = Path::new("");
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
            "none, as with every pseudo-terminal: a program that insists on them needs TCP or a \
             serial port",
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
    if let Err(why) = talk(port, findings) {
        findings.trouble(
            "controller",
            &format!("the other end has gone: {why}"),
            "one client holds the line at a time, and another one may have it: close that one",
        );
    }
}

fn talk(port: &mut Port, findings: &mut Findings) -> Result<(), PortError> {
    let unasked = hear(port, LISTEN)?;
    if !unasked.is_empty() {
        findings.trouble(
            "line",
            &format!("it speaks without being asked: `{}`", excerpt(&unasked)),
            "a program runs that sends something, the speed is wrong, or it is no controller",
        );
    }
    let mut speeds: Vec<Option<u32>> = vec![port.baud()];
    let known = FAMILIES.iter().filter_map(|name| vimc4::model(name).ok());
    let handlings: Vec<Handling> = known.map(|model| Handling::of(&model)).collect();
    if port.baud().is_some() {
        let all = handlings.iter().flat_map(|handling| handling.speeds);
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
        for handling in &handlings {
            // Half a line that somebody has left spoils the first question.
            for _ in 0..2 {
                let answer = ask(port, handling.position)?;
                if handling.read_position(&answer).is_some() {
                    found(port, handling, &answer, findings)?;
                    if let (Some(speed), true) = (speed, number > 0) {
                        findings.trouble(
                            "speed",
                            &format!("it answers at {speed} baud only"),
                            &format!("set the program to {speed} baud"),
                        );
                    }
                    return Ok(());
                }
                said.extend(answer);
            }
        }
    }
    match said.is_empty() {
        true => findings.trouble(
            "controller",
            "nothing answers",
            "check that it is on, and the cable: crossed (null modem) where the controller needs \
             it; a virtual one with manual time answers when time is advanced",
        ),
        false => findings.trouble(
            "controller",
            &format!("what answers makes no sense: `{}`", excerpt(&said)),
            "it is another device, or a serial line behind it has the wrong speed",
        ),
    }
    Ok(())
}

/// A controller answers.
fn found(
    port: &mut Port,
    handling: &Handling,
    answer: &[u8],
    findings: &mut Findings,
) -> Result<(), PortError> {
    let family = handling.model().family();
    let places = handling.read_position(answer).unwrap_or_default();
    let axes = handling.model().axis_names().iter().zip(&places);
    let places: Vec<String> = axes.map(|(axis, place)| format!("{axis} {place}")).collect();
    findings.fine("controller", &format!("one of {family} answers: {}", places.join(", ")));
    for line in handling.names {
        let name = ask(port, line)?;
        if family.refusal(&name).is_none() && name.len() > 2 {
            findings.fine("model", &format!("it answers {line} with `{}`", excerpt(&name)));
            return Ok(());
        }
    }
    findings.fine("model", "it does not say");
    Ok(())
}

fn ask(port: &mut Port, line: &str) -> Result<Vec<u8>, PortError> {
    port.send(format!("{line}\r").as_bytes())?;
    hear(port, ANSWER)
}

/// What comes, up to the first pause.
fn hear(port: &mut Port, patience: Duration) -> Result<Vec<u8>, PortError> {
    let mut heard = Vec::new();
    let end = Instant::now() + patience + LATEST;
    let mut until = Instant::now() + patience;
    while let Some((_, bytes)) = port.next(until)? {
        heard.extend_from_slice(&bytes);
        let now = Instant::now();
        if heard.len() > LONGEST || now > end {
            // Whatever it says goes on; nobody waits for its end.
            thread::sleep(PAUSE);
            break;
        }
        until = (now + PAUSE).min(end);
    }
    Ok(heard)
}

fn excerpt(bytes: &[u8]) -> String {
    let text = escape(bytes.get(..LONGEST).unwrap_or(bytes));
    shortened(&text, EXCERPT).into_owned()
}
