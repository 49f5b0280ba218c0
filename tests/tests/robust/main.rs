//! Rough treatment, end to end: crowds, clients that reset, flood, vanish, lock up or reconnect
//! without end, and a process that is killed while it writes its flash file.
//!
//! Linux shows a process its threads and descriptors as files, which is how these tests see
//! that nothing is left behind. What needs a tool that is missing is shown as ignored, with the
//! reason in its name; with `VIMC4_REQUIRE_TOOLS=1` it fails instead.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[cfg(target_os = "linux")]
mod crowd;
#[cfg(target_os = "linux")]
mod kill;
#[cfg(target_os = "linux")]
#[path = "../../../emulator/tests/process/limits.rs"]
mod limits;
#[cfg(target_os = "linux")]
mod tcp;
#[cfg(target_os = "linux")]
mod terminal;
#[cfg(target_os = "linux")]
mod tools;

#[cfg(target_os = "linux")]
fn main() -> std::process::ExitCode {
    use libtest_mimic::{Arguments, Trial};

    // Some tests need other processes: clients, and emulators that are killed. They are this
    // program in another role.
    match std::env::var(tools::ROLE).as_deref() {
        Ok(kill::ROLE) => return kill::store_until_killed(),
        Ok(terminal::ROLE) => return terminal::hold_until_killed(),
        Ok(tcp::ROLE) => return tcp::lose_the_network(),
        Ok(other) => panic!("no role {other}"),
        Err(_) => {}
    }
    let mut arguments = Arguments::from_args();
    // The tests take turns: two of them count what belongs to the whole process, and all of
    // them put a small computer to work.
    arguments.test_threads = Some(1);
    let required = std::env::var_os("VIMC4_REQUIRE_TOOLS").is_some_and(|value| value == "1");
    let test = |name: &str, body: fn()| {
        Trial::test(name, move || {
            body();
            Ok(())
        })
    };
    let with = |there: bool, reason: &str, name: &str, body: fn()| {
        let name = if there { name.to_owned() } else { format!("{name} ({reason})") };
        test(&name, body).with_ignored_flag(!there && !required)
    };
    let mut trials = Vec::new();
    for tests in [crowd::TESTS, tcp::TESTS, terminal::TESTS, kill::TESTS] {
        trials.extend(tests.iter().map(|(name, body)| test(name, *body)));
    }
    let vanishes = "tcp: a client that vanishes is noticed within 15 s";
    if tools::has("unshare", &["--version"]) && tools::has("ip", &["-V"]) {
        // Tools can be installed; what the system forbids it forbids.
        let allowed = tools::has("unshare", &["-rn", "ip", "link", "set", "lo", "up"]);
        let name = if allowed {
            vanishes
        } else {
            "tcp: a client that vanishes (no network of its own is allowed here)"
        };
        trials.push(test(name, tcp::a_client_vanishes).with_ignored_flag(!allowed));
    } else {
        trials.push(with(false, "needs unshare and ip", vanishes, tcp::a_client_vanishes));
    }
    let hangs_up = "terminal: a client hangs it up, and the next one finds it as it was";
    let (root, python) =
        (rustix::process::geteuid().is_root(), tools::has("python3", &["--version"]));
    if python && !root {
        // Tools can be installed; what the system forbids it forbids.
        let name = "terminal: a client hangs it up (only root may)";
        trials.push(test(name, terminal::a_client_hangs_up).with_ignored_flag(true));
    } else {
        trials.push(with(python, "needs python3", hangs_up, terminal::a_client_hangs_up));
    }
    let discipline = "terminal: a client changes the line discipline, and it ends with it";
    if python && !terminal::has_another_discipline() {
        let name = "terminal: a client changes the line discipline (the system has no other)";
        let body = terminal::a_client_changes_the_discipline;
        trials.push(test(name, body).with_ignored_flag(true));
    } else {
        let body = terminal::a_client_changes_the_discipline;
        trials.push(with(python, "needs python3", discipline, body));
    }
    // Who is not root has run them as an ordinary user already.
    if rustix::process::geteuid().is_root() {
        trials.push(with(
            tools::has("setpriv", &["--version"]),
            "needs setpriv",
            "an ordinary user's terminals",
            terminal::as_an_ordinary_user,
        ));
    }
    libtest_mimic::run(&arguments, trials).exit_code()
}

#[cfg(not(target_os = "linux"))]
fn main() {}
