//! The façade as a test of host software uses it.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use vimc4::{
    Builder, Button, Clock, Condition, ControlError, Emulator, Error, MemoryPort, Model, ModemLine,
    Time,
};

fn manual(model: &str) -> Builder {
    Emulator::builder().model(model).time(Clock::Manual)
}

fn send(port: &mut MemoryPort, line: &str) {
    port.write_all(line.as_bytes()).unwrap();
}

/// What has been answered so far.
fn answers(emu: &Emulator, port: &mut MemoryPort) -> String {
    emu.now().unwrap();
    String::from_utf8(port.drain()).unwrap()
}

#[test]
fn handshake_lines_follow_the_buffer_and_tell_of_the_host() {
    let emu = manual("smcu").start().unwrap();
    let (sender, cts) = std::sync::mpsc::channel();
    let (tell, told) = std::sync::mpsc::channel();
    let log = vimc4::Traffic::new(vimc4::Verbosity::Conversation, move |line| {
        let _ = tell.send(line);
    });
    emu.control().watch(log).wait().unwrap();
    let told_of = |what: &str| told.try_iter().any(|line| line.ends_with(what));
    let ready = move |_, ready| sender.send(ready).unwrap();
    let host = emu.control().handshake_lines(ready).wait().unwrap();
    assert!(emu.control().takes_more().wait().unwrap());
    // Time stands still, so the buffer fills up to where the host is to wait.
    let mut port = emu.connect().unwrap();
    send(&mut port, &"PR1,0;".repeat(500));
    assert!(!emu.control().takes_more().wait().unwrap());
    assert_eq!(cts.try_iter().collect::<Vec<_>>(), [false]);
    // Lines that come later learn it too.
    let (sender, late) = std::sync::mpsc::channel();
    let later = move |_, ready| sender.send(ready).unwrap();
    let another = emu.control().handshake_lines(later).wait().unwrap();
    assert_eq!(late.try_iter().collect::<Vec<_>>(), [false]);
    drop(another);
    assert!(!told_of("RTS off"));
    host.switched("RTS", false);
    emu.now().unwrap();
    assert!(told_of("pty: the host has switched RTS off"));
    // What the host still has to send comes when there is room, and then there is.
    for _ in 0..20 {
        emu.run_until_idle().unwrap();
    }
    assert_eq!(emu.position().unwrap()[0], 500);
    assert!(emu.control().takes_more().wait().unwrap());
    assert_eq!(cts.try_iter().last(), Some(true));
}

#[test]
fn start_shows_on_the_modem_line_that_the_profile_names() {
    for (line, modem_line, bit) in [
        ("cts", ModemLine::Cts, 0x10),
        ("dsr", ModemLine::Dsr, 0x20),
        ("ri", ModemLine::Ri, 0x40),
        ("dcd", ModemLine::Dcd, 0x80),
    ] {
        let text = vimc4::model_profile("imc4-m").unwrap();
        let wired = format!("[line]\nstart_line = \"{line}\"");
        let model = Model::from_toml(&text.replace("[line]", &wired)).unwrap();
        let builder = Emulator::builder().with_model(model).time(Clock::Manual);
        let emu = builder.rfc2217("127.0.0.1:0").start().unwrap();
        let (sender, seen) = std::sync::mpsc::channel();
        let lines = move |line, on| sender.send((line, on)).unwrap();
        let _host = emu.control().handshake_lines(lines).wait().unwrap();
        let mut client = TcpStream::connect(emu.rfc2217_addr().unwrap()).unwrap();
        client.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        // The client agrees to RFC 2217 and gets the state of the lines at once.
        client.write_all(b"\xff\xfb\x2c").unwrap();
        let mut state = || {
            let (mut last, mut byte) = ([0; 7], [0]);
            while !(last.starts_with(b"\xff\xfa\x2c\x6b") && last.ends_with(b"\xff\xf0")) {
                client.read_exact(&mut byte).unwrap();
                last.rotate_left(1);
                last[6] = byte[0];
            }
            last[4] & bit != 0
        };
        assert!(!state(), "{line}");
        emu.hold("start").unwrap();
        assert!(state(), "{line}");
        emu.release("start").unwrap();
        assert!(!state(), "{line}");
        emu.now().unwrap();
        let changes: Vec<(ModemLine, bool)> = seen.try_iter().collect();
        assert_eq!(changes, [false, true, false].map(|on| (modem_line, on)), "{line}");
    }
}

#[test]
fn commands_can_be_waited_for() {
    let emu = manual("imc4").start().unwrap();
    let mut port = emu.connect().unwrap();
    send(&mut port, "@01\r@0A5,900\r@0A6,900\r");
    // What has come already counts, each once.
    assert_eq!(&emu.next_command("@A").unwrap().bytes[..], b"@0A5,900");
    emu.run_until_idle().unwrap();
    assert_eq!(&emu.next_command("@A").unwrap().bytes[..], b"@0A6,900");
    assert_eq!(emu.commands().unwrap().len(), 3);
    emu.forget().unwrap();
    assert!(emu.commands().unwrap().is_empty() && emu.events().unwrap().is_empty());
    // And what has not come yet.
    let reply = emu.control().next_command("@P");
    send(&mut port, "@0P\r");
    assert_eq!(reply.wait().unwrap().mnemonic, "@P");
    let never = emu.control().next_command("@P").wait_within(Duration::from_millis(20));
    assert_eq!(never.unwrap_err(), ControlError::Late(Duration::from_millis(20)));
    // Nobody waits for what has ended.
    let (control, reply) = (emu.control().clone(), emu.control().next_command("@A"));
    drop(emu);
    assert_eq!(reply.wait().unwrap_err(), ControlError::Ended);
    assert_eq!(control.next_command("@A").wait().unwrap_err(), ControlError::Ended);
    let silent = manual("imc4").record(false).start().unwrap();
    assert!(silent.next_command("@A").is_err());
}

#[test]
fn what_never_happens_is_said_and_no_time_is_spent_on_it() {
    let emu = manual("imc4").start().unwrap();
    let mut port = emu.connect().unwrap();
    send(&mut port, "@01\r@0A100,900\r");
    let never = emu.run_until(&Condition::AxisAt { axis: 0, position: 101 });
    assert!(matches!(never, Err(Error::Control(ControlError::Never))));
    assert_eq!(emu.now().unwrap(), Time::ZERO);
}

#[test]
fn the_panel_and_the_power_are_in_the_hands_of_the_test() {
    let emu = manual("imc4").start().unwrap();
    let mut port = emu.connect().unwrap();
    emu.press("estop").unwrap();
    send(&mut port, "@01\r@0A100,900\r");
    assert_eq!(answers(&emu, &mut port), "09");
    emu.release("estop").unwrap();
    emu.press("on").unwrap();
    emu.turn("cover", "open").unwrap();
    send(&mut port, "@01\r@0A100,900\r");
    assert_eq!(answers(&emu, &mut port), "0H");
    emu.turn("key", "test").unwrap();
    send(&mut port, "@0A100,900\r");
    emu.run_until_idle().unwrap();
    assert_eq!(answers(&emu, &mut port), "0");
    emu.power(false).unwrap();
    send(&mut port, "@0P\r");
    assert_eq!(answers(&emu, &mut port), "");
    emu.power(true).unwrap();
    send(&mut port, "@0P\r");
    emu.run_until_idle().unwrap();
    assert_eq!(answers(&emu, &mut port), "0000000000000000000");
    let wrong = emu.press("stpo").unwrap_err().to_string();
    assert!(wrong.contains("there is no button `stpo`; did you mean stop?"), "{wrong}");
}

/// Whoever wants to see everything has it before the first client, however quick that is.
#[test]
fn one_that_begins_paused_takes_nothing_in_before_it_goes_on() {
    for clock in [Clock::Real, Clock::Instant] {
        let builder = Emulator::builder().time(clock).tcp("127.0.0.1:0");
        let emu = builder.paused(true).start().unwrap();
        let mut client = std::net::TcpStream::connect(emu.tcp_addr().unwrap()).unwrap();
        client.write_all(b"@01\r@0A400,900\r").unwrap();
        assert_eq!(emu.pause().unwrap(), Time::ZERO, "{clock}");
        assert_eq!(emu.commands().unwrap().len(), 0, "{clock}");
        emu.resume().unwrap();
        let mut answers = [0; 2];
        client.read_exact(&mut answers).unwrap();
        assert_eq!((&answers, emu.position().unwrap()[0]), (b"00", 400), "{clock}");
    }
}

#[test]
fn a_snapshot_is_returned_to() {
    let emu = manual("imc4").start().unwrap();
    let mut port = emu.connect().unwrap();
    send(&mut port, "@01\r@0A5000,10000\r");
    emu.advance(Duration::from_millis(50)).unwrap();
    let snapshot = emu.snapshot().unwrap();
    let first = emu.run_until_idle().unwrap();
    emu.restore(&snapshot).unwrap();
    assert_eq!(emu.snapshot().unwrap(), snapshot);
    assert_eq!(emu.run_until_idle().unwrap(), first);
    assert_eq!(emu.position().unwrap(), [5_000, 0, 0, 0]);
    // Another emulator goes on from there too.
    let other = manual("imc4").start().unwrap();
    other.restore(&snapshot).unwrap();
    assert_eq!(other.run_until_idle().unwrap(), first);
}

#[test]
fn a_stored_program_survives_in_its_file_and_is_erased_at_the_panel() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("flash");
    let start = || manual("imc4").flash(&file).start().unwrap();
    {
        let emu = start();
        let mut port = emu.connect().unwrap();
        send(&mut port, "@01\r@0i\r0100,900\r9\r");
        emu.run_until_idle().unwrap();
        assert_eq!(answers(&emu, &mut port), "0000");
        let wrong = manual("imc4").flash(&file).start().unwrap_err();
        assert!(wrong.to_string().contains("in use by another emulator"), "{wrong}");
    }
    let emu = start();
    emu.press(Button::Start).unwrap();
    emu.run_until_idle().unwrap();
    assert_eq!(emu.position().unwrap(), [100, 0, 0, 0]);
    emu.erase().unwrap();
    emu.run_until_idle().unwrap();
    drop(emu);
    let emu = start();
    assert!(emu.view().unwrap().details.program().is_none());
    drop(emu);
    // What is not a flash file is left alone.
    fs::write(&file, "vimc4 flash 1\nnonsense\n").unwrap();
    let wrong = manual("imc4").flash(&file).start().unwrap_err();
    assert!(matches!(wrong, Error::Flash { .. }));
    assert!(wrong.to_string().contains("line 2"), "{wrong}");
    assert_eq!(fs::read_to_string(&file).unwrap(), "vimc4 flash 1\nnonsense\n");
}

#[test]
fn only_a_panel_that_can_erases() {
    let emu = manual("imc-s8").start().unwrap();
    assert!(matches!(emu.erase(), Err(Error::Control(ControlError::Unsupported(_)))));
}

#[test]
fn with_pacing_a_reply_takes_its_time_on_the_line() {
    let emu = manual("imc4").line_pacing(true).start().unwrap();
    let mut port = emu.connect().unwrap();
    send(&mut port, "@01\r");
    // Four characters there and one back, at 19,200 baud.
    let idle = emu.run_until_idle().unwrap().as_nanos();
    assert!((2_604_166..2_604_176).contains(&idle), "{idle}");
    assert_eq!(answers(&emu, &mut port), "0");
}

#[cfg(unix)]
#[test]
fn a_link_lives_as_long_as_its_emulator() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("port");
    let emu = Emulator::builder().pty(link.as_path()).start().unwrap();
    assert_eq!(emu.port(), Some(link.as_path()));
    assert!(fs::read_link(&link).unwrap().starts_with("/dev/pts"));
    drop(emu);
    assert!(!link.is_symlink());
    // Somebody's own file is left alone, and nothing else is made.
    fs::write(&link, "precious").unwrap();
    let flash = folder.path().join("flash");
    let wrong = Emulator::builder().pty(link.as_path()).flash(&flash).start().unwrap_err();
    assert!(matches!(wrong, Error::Link(_)), "{wrong}");
    assert_eq!(fs::read_to_string(&link).unwrap(), "precious");
    assert!(!flash.exists());
}

#[test]
fn what_is_wrong_is_said_with_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let message = |builder: Builder| builder.start().unwrap_err().to_string();
    assert!(message(manual("imc5")).contains("built in are imc4, imc4-m"));
    assert!(message(manual("imc4").machine("none.toml")).contains("none.toml"));
    assert!(message(manual("imc4").tcp("nonsense")).contains("write host:port"));
    let profile = folder.path().join("mine.toml");
    let text = vimc4::machine_profile("mill").unwrap().replacen("[axes.x]", "[axes.x]\nfoo = 1", 1);
    let line = text.lines().position(|line| line == "foo = 1").unwrap() + 1;
    fs::write(&profile, text).unwrap();
    let wrong = message(manual("imc4").machine(profile.to_str().unwrap()));
    assert!(wrong.contains(&format!("line {line}")) && wrong.contains("foo"), "{wrong}");
    let taken = manual("imc4").tcp("127.0.0.1:0").start().unwrap();
    let address = taken.tcp_addr().unwrap().to_string();
    assert!(message(manual("imc4").tcp(address)).contains("is taken"));
}

#[test]
fn profiles_of_ones_own_are_read_from_files() {
    let folder = tempfile::tempdir().unwrap();
    let (model, machine) = (folder.path().join("model.toml"), folder.path().join("machine.toml"));
    fs::write(&model, vimc4::model_profile("imc4").unwrap()).unwrap();
    fs::write(&machine, vimc4::machine_profile("mill").unwrap()).unwrap();
    let emu = manual(model.to_str().unwrap()).machine(machine.to_str().unwrap()).start().unwrap();
    assert_eq!(emu.model().name(), "imc4");
    let mut port = emu.connect().unwrap();
    // A machine with ends: the reference run ends at a switch.
    send(&mut port, "@07\r@0R7\r");
    emu.run_until_idle().unwrap();
    assert_eq!(answers(&emu, &mut port), "00");
}

#[test]
fn every_family_is_in_the_hands_of_the_test() {
    let emu = manual("smcu").machine("board-plotter").start().unwrap();
    let mut port = emu.connect().unwrap();
    send(&mut port, "PA5000,0;");
    emu.run_until(&Condition::AxisAt { axis: 0, position: 2_500 }).unwrap();
    assert_eq!(emu.position().unwrap(), [2_500, 0]);
    let underway = emu.snapshot().unwrap();
    emu.run_until_idle().unwrap();
    assert_eq!((emu.position().unwrap(), answers(&emu, &mut port)), (vec![5_000, 0], "C\r".into()));
    emu.restore(&underway).unwrap();
    assert_eq!(emu.position().unwrap(), [2_500, 0]);
    assert_eq!(emu.commands().unwrap()[0].text, "move to X 5,000 Y 0");
}

/// A snapshot is for controllers with the model and the machine that it was taken from.
#[test]
fn a_snapshot_of_another_model_or_machine_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let faster = folder.path().join("faster.toml");
    let text = vimc4::model_profile("imc4").unwrap().replace("baud = 19200", "baud = 9600");
    std::fs::write(&faster, text).unwrap();
    let of = |model: &str, machine: &str| manual(model).machine(machine).start().unwrap();
    let snapshot = of("imc4", "mill").snapshot().unwrap();
    for (model, machine, found, own) in [
        ("imc-s8", "mill", "imc4 on mill", "imc-s8 on mill"),
        ("imc4", "bench", "imc4 on mill", "imc4 on bench"),
        ("smcu", "board-plotter", "imc4 on mill", "smcu on board-plotter"),
        (faster.to_str().unwrap(), "mill", "another imc4 on mill", "imc4 on mill"),
    ] {
        let emulator = of(model, machine);
        let before = emulator.snapshot().unwrap();
        let error = emulator.restore(&snapshot).unwrap_err().to_string();
        let right = format!(
            "this is a state of {found}, and this controller is {own}; restore it on {found}"
        );
        assert_eq!(error, right);
        assert_eq!(emulator.snapshot().unwrap(), before);
    }
    of("imc4", "mill").restore(&snapshot).unwrap();
}

#[test]
fn a_command_that_the_model_has_not_is_not_waited_for() {
    let emu = manual("imc4").start().unwrap();
    for wrong in ["@0A", "@0A5000", "@X5", "", "PA"] {
        let error = emu.next_command(wrong).unwrap_err().to_string();
        let right =
            format!("no command of the imc4 has the mnemonic `{wrong}`; there are @axes, @A, ");
        assert!(error.starts_with(&right), "{error}");
    }
    // Of a command with several forms the letters stand for all.
    let emu = manual("smcu").machine("board-plotter").start().unwrap();
    let mut port = emu.connect().unwrap();
    send(&mut port, "!IS;");
    emu.run_until_idle().unwrap();
    assert!(emu.next_command("!IS").unwrap().mnemonic.starts_with("!IS/"));
}

#[test]
fn a_memory_is_for_models_that_have_one() {
    let folder = tempfile::tempdir().unwrap();
    let flash = folder.path().join("flash");
    drop(manual("smcu").flash(&flash).start().unwrap());
    let emu = manual("imc-s8").flash(&flash).start().unwrap();
    let mut port = emu.connect().unwrap();
    send(&mut port, "@07\r@0i\r71\r9\r");
    assert_eq!(answers(&emu, &mut port), "0000");
    drop((emu, port));
    let error = manual("smcu").flash(&flash).start().unwrap_err();
    assert!(error.to_string().contains("no memory that lasts"), "{error}");
}

#[test]
fn a_client_that_never_stops_sending_keeps_nobody_waiting() {
    let emu = Emulator::builder().tcp("127.0.0.1:0").start().unwrap();
    let mut host = TcpStream::connect(emu.tcp_addr().unwrap()).unwrap();
    let mut answers = host.try_clone().unwrap();
    let over = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            let lines = "@0P\r".repeat(10_000);
            while !over.load(Ordering::Relaxed) {
                if host.write_all(lines.as_bytes()).is_err() {
                    break;
                }
            }
            let _ = host.shutdown(Shutdown::Both);
        });
        scope.spawn(|| std::io::copy(&mut answers, &mut std::io::sink()));
        let mut asked = (0..20).map(|_| emu.control().now().wait_within(Duration::from_secs(20)));
        let late = asked.find_map(Result::err);
        over.store(true, Ordering::Relaxed);
        assert_eq!(late, None);
    });
}
