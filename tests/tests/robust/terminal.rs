//! Clients of a pseudo-terminal.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::atomic::Ordering;
use std::thread;
use std::time::Duration;

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::termios::{
    Action, ControlModes, InputModes, LocalModes, OptionalActions, SpecialCodeIndex,
    ioctl_tiocexcl, tcflow, tcgetattr, tcsetattr,
};
use vimc4::{Clock, Emulator};

use crate::limits::{EndsInTime, InTime, LIMIT, Timed};
use crate::tools::{Counts, Terminal, ask, at, in_role, wait_until};

pub(crate) const TESTS: &[(&str, fn())] = &[
    ("terminal: a thousand clients one after the other read nothing stale", a_thousand_clients),
    ("terminal: a client is killed while it has it for itself", exclusive_clients_are_killed),
    (
        "terminal: a stopped output and flow control end with their client",
        a_client_stops_the_output,
    ),
    ("terminal: two programs at once are told of", two_programs),
    ("terminal: idle before, between and after clients", idle),
];

fn emulator(counts: &Counts) -> (Emulator, PathBuf) {
    let builder = Emulator::builder().time(Clock::Instant).pty(true).sink(counts.clone());
    let emulator = builder.start().unwrap();
    let path = emulator.port().unwrap().to_owned();
    (emulator, path)
}

/// The terminal after a client that has set the axes.
fn used(counts: &Counts) -> (Emulator, PathBuf) {
    let (emulator, path) = emulator(counts);
    let mut first = Terminal::open(&path);
    assert_eq!(ask(&mut first, "@07", 1), "0");
    counts.after_leaving(|| drop(first));
    (emulator, path)
}

/// Clients with all the habits there are, one after the other; each finds the line as if it
/// were the first.
fn a_thousand_clients() {
    let counts = Counts::default();
    let (emulator, path) = used(&counts);
    // Each waits for the news of its leaving, which its successor would be faster than, and which
    // would be taken for that of its successor's.
    let leave = |client: Terminal| counts.after_leaving(|| drop(client));
    for n in 1..=1_000 {
        let mut client = Terminal::open(&path);
        assert_eq!(ask(&mut client, "@0A1,900,0,900,0,900,0,900", 1), "0");
        match n % 4 {
            0 => {
                assert_eq!(ask(&mut client, "@0P", 19), at(n));
                leave(client);
            }
            1 => {
                ioctl_tiocexcl(&client.0).unwrap();
                leave(client);
            }
            2 => {
                // A line that echoes, edits, waits for nothing and is too slow.
                let mut settings = tcgetattr(&client.0).unwrap();
                settings.local_modes |= LocalModes::ECHO | LocalModes::ICANON;
                settings.input_modes |= InputModes::ICRNL;
                settings.special_codes[SpecialCodeIndex::VMIN] = 0;
                settings.set_speed(9_600).unwrap();
                tcsetattr(&client.0, OptionalActions::Now, &settings).unwrap();
                leave(client);
                let mut next = Terminal::open(&path);
                let settings = tcgetattr(&next.0).unwrap();
                assert_eq!(settings.output_speed(), 19_200);
                assert!(!settings.local_modes.contains(LocalModes::ECHO));
                // Who comes and goes at once is no news.
                assert_eq!(ask(&mut next, "@0P", 19), at(n));
                leave(next);
            }
            _ => {
                // It asks and leaves without listening.
                client.write_all(b"@0P\r").unwrap();
                assert!(client.hears(LIMIT));
                leave(client);
                let mut next = Terminal::open(&path);
                assert!(!next.hears(Duration::ZERO), "opening {n} hears its predecessor");
                assert_eq!(ask(&mut next, "@0P", 19), at(n));
                leave(next);
            }
        }
    }
    assert_eq!(emulator.position().unwrap()[0], 1_000);
}

pub(crate) const ROLE: &str = "hold a terminal";
const PATH: &str = "VIMC4_ROBUST_TERMINAL";

/// The client that is going to be killed.
pub(crate) fn hold_until_killed() -> ExitCode {
    let path = PathBuf::from(std::env::var_os(PATH).unwrap());
    let mut terminal = Terminal::open(&path);
    ioctl_tiocexcl(&terminal.0).unwrap();
    println!("{}", ask(&mut terminal, "@0P", 19));
    loop {
        thread::park();
    }
}

/// It does not outlive the test.
struct Holder(Child);

impl Drop for Holder {
    fn drop(&mut self) {
        self.0.kill().unwrap();
        self.0.wait_in_time().unwrap();
    }
}

fn exclusive_clients_are_killed() {
    let counts = Counts::default();
    let (_emulator, path) = emulator(&counts);
    assert_eq!(ask(&mut Terminal::open(&path), "@07", 1), "0");
    for n in 1..=50 {
        let child = in_role(ROLE).env(PATH, &path).stdout(Stdio::piped()).start().unwrap();
        let mut holder = Holder(child);
        let mut said = String::new();
        let output = Timed::new("standard output", holder.0.stdout.take().unwrap());
        BufReader::new(output).read_line(&mut said).unwrap();
        assert_eq!(said.trim_end(), at(n - 1));
        // Root may open what others have for themselves.
        if !rustix::process::geteuid().is_root() {
            assert!(fs::File::open(&path).is_err(), "it is not exclusive");
        }
        drop(holder);
        let mut next = Terminal::open(&path);
        assert_eq!(ask(&mut next, "@0A1,900,0,900,0,900,0,900", 1), "0");
        assert_eq!(ask(&mut next, "@0P", 19), at(n));
    }
}

fn a_client_stops_the_output() {
    let counts = Counts::default();
    let (_emulator, path) = used(&counts);
    for n in 1..=20 {
        let mut rude = Terminal::open(&path);
        assert_eq!(ask(&mut rude, "@0A1,900,0,900,0,900,0,900", 1), "0");
        let mut settings = tcgetattr(&rude.0).unwrap();
        settings.control_modes |= ControlModes::CRTSCTS | ControlModes::CSTOPB;
        settings.input_modes |= InputModes::IXON | InputModes::IXOFF;
        tcsetattr(&rude.0, OptionalActions::Now, &settings).unwrap();
        tcflow(&rude.0, Action::OOff).unwrap();
        counts.after_leaving(|| drop(rude));
        let mut next = Terminal::open(&path);
        let settings = tcgetattr(&next.0).unwrap();
        assert!(!settings.control_modes.intersects(ControlModes::CRTSCTS | ControlModes::CSTOPB));
        assert!(!settings.input_modes.intersects(InputModes::IXON | InputModes::IXOFF));
        // A stopped output would hold a writer that waits for ever.
        let flags = fcntl_getfl(&next.0).unwrap();
        fcntl_setfl(&next.0, flags | OFlags::NONBLOCK).unwrap();
        assert_eq!(ask(&mut next, "@0P", 19), at(n));
        counts.after_leaving(|| drop(next));
    }
}

/// What only Python's `ioctl` can do to a terminal that is not its own, twenty times over: no safe
/// call does it. Each time the next client finds the line as `restored` says.
fn spoiled(ioctl: &str, argument: &str, restored: impl Fn(&Terminal)) {
    let counts = Counts::default();
    let (emulator, path) = used(&counts);
    let script = format!(
        "import fcntl, os, struct, sys\n\
         port = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)\n\
         fcntl.ioctl(port, {ioctl}, {argument})\n"
    );
    for n in 1..=20 {
        counts.after_leaving(|| {
            let status = Command::new("python3").args(["-c", &script]).arg(&path).status_in_time();
            assert!(status.unwrap().success());
        });
        let mut next = Terminal::open(&path);
        restored(&next);
        assert_eq!(ask(&mut next, "@0A1,900,0,900,0,900,0,900", 1), "0");
        assert_eq!(ask(&mut next, "@0P", 19), at(n));
        counts.after_leaving(|| drop(next));
    }
    assert_eq!(emulator.position().unwrap()[0], 20);
}

/// Only root may.
pub(crate) fn a_client_hangs_up() {
    const VHANGUP: &str = "0x5437";
    spoiled(VHANGUP, "0", |next| {
        wait_until("a raw line", || {
            let settings = tcgetattr(&next.0).unwrap();
            !settings.local_modes.intersects(LocalModes::ICANON | LocalModes::ECHO)
        });
    });
}

/// The one that swallows everything; others need a driver, a network, or a modem's answers.
const N_NULL: i32 = 27;

/// Whether this system has it.
pub(crate) fn has_another_discipline() -> bool {
    let known = fs::read_to_string("/proc/tty/ldiscs").unwrap_or_default();
    known.lines().any(|line| line.split_whitespace().eq(["n_null", &N_NULL.to_string()]))
}

pub(crate) fn a_client_changes_the_discipline() {
    const TIOCSETD: &str = "0x5423";
    spoiled(TIOCSETD, &format!("struct.pack('i', {N_NULL})"), |next| {
        assert_eq!(tcgetattr(&next.0).unwrap().line_discipline, 0);
    });
}

fn two_programs() {
    let counts = Counts::default();
    let (_emulator, path) = emulator(&counts);
    let mut mine = Terminal::open(&path);
    assert_eq!(ask(&mut mine, "@07", 1), "0");
    let child = in_role(ROLE).env(PATH, &path).stdout(Stdio::piped()).start().unwrap();
    let _other = Holder(child);
    // Its answer may go to either.
    wait_until("the news of the other one", || counts.shared.load(Ordering::SeqCst) == 1);
}

/// Processor time in ticks of 10 ms, and how often the threads of this process have slept.
fn work() -> (u64, u64) {
    let (mut ticks, mut switches) = (0, 0);
    for task in fs::read_dir("/proc/self/task").unwrap().flatten() {
        // A thread may end between the two looks.
        let Ok(stat) = fs::read_to_string(task.path().join("stat")) else { continue };
        let Ok(status) = fs::read_to_string(task.path().join("status")) else { continue };
        let name = stat.split(['(', ')']).nth(1).unwrap();
        if !name.starts_with("vimc4") && name != "pty watch" {
            continue;
        }
        let fields: Vec<_> = stat.rsplit(") ").next().unwrap().split(' ').collect();
        ticks += fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap();
        let counts = status.lines().filter(|line| line.contains("ctxt_switches"));
        let count = |line: &str| line.split_whitespace().last()?.parse::<u64>().ok();
        switches += counts.filter_map(count).sum::<u64>();
    }
    (ticks, switches)
}

/// For seconds, not for the minute that a measurement would take: a controller that is not
/// asleep does thousands of times as much. Some it may do, since the opening of any terminal of
/// the computer is heard.
fn idle() {
    let counts = Counts::default();
    let (_emulator, path) = emulator(&counts);
    let rest = |when: &str| {
        thread::sleep(Duration::from_millis(100));
        let before = work();
        thread::sleep(Duration::from_secs(1));
        let after = work();
        assert!(after.0 - before.0 <= 1, "{when}: {} ticks", after.0 - before.0);
        assert!(after.1 - before.1 <= 50, "{when}: {} switches", after.1 - before.1);
    };
    rest("before the first client");
    let mut client = Terminal::open(&path);
    assert_eq!(ask(&mut client, "@07", 1), "0");
    rest("with a silent client");
    counts.after_leaving(|| drop(client));
    rest("after it");
}

/// The same without the rights of root, to which nobody's terminal is locked.
pub(crate) fn as_an_ordinary_user() {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("robust");
    fs::copy(std::env::current_exe().unwrap(), &program).unwrap();
    for path in [folder.path(), &program] {
        fs::set_permissions(path, fs::Permissions::from_mode(0o755)).unwrap();
    }
    let output = Command::new("setpriv")
        .args(["--reuid=65534", "--regid=65534", "--clear-groups"])
        .arg(&program)
        .arg("terminal:")
        .current_dir("/")
        .output_in_time()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    let passed = |name| said.lines().any(|line| line.contains(name) && line.ends_with("ok"));
    assert!(TESTS.iter().all(|(name, _)| passed(name)), "{said}");
}
