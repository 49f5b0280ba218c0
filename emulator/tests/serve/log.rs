//! The conversation as `serve -v` tells it.

use std::fs::File;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use tempfile::TempDir;

use super::process::limits::{InTime, LIMIT, Timed};
use super::process::{Process, VIMC4, ask, connect, tcp, terminal, vimc4};
use super::{ready, serving};

/// A controller that tells its conversation.
struct Talk {
    serve: Process,
    client: TcpStream,
    pty: String,
    _folder: TempDir,
}

impl Talk {
    fn start(arguments: &str) -> Talk {
        let folder = tempfile::tempdir().unwrap();
        let mut all = vec!["--tcp", "127.0.0.1:0", "--json", "-v"];
        all.extend(arguments.split_whitespace());
        let mut serve = serving(folder.path(), &all);
        let ready = ready(&serve.line());
        let pty = ready["controllers"][0]["pty"].as_str().unwrap().to_owned();
        let client = connect(tcp(&ready, 0));
        Talk { serve, client, pty, _folder: folder }
    }

    /// Sends something; the controller has it then.
    fn send(&mut self, bytes: &[u8]) {
        self.client.write_all(bytes).unwrap();
        self.settle();
    }

    /// Waits until everything that was sent has been taken in.
    fn settle(&mut self) {
        assert!(self.order("position").contains("X "));
    }

    fn order(&mut self, order: &str) -> String {
        self.serve.order(order)
    }

    fn ask(&mut self, line: &str, count: usize) -> String {
        ask(&mut self.client, line, count)
    }

    fn open_pty(&self) -> Timed<File> {
        terminal(&self.pty)
    }

    /// What was told, without the times.
    fn end(mut self) -> Vec<String> {
        self.serve.order("quit");
        let (code, errors) = self.serve.end();
        assert_eq!(code, Some(0), "{errors}");
        let told = errors.lines().map(|line| line.split_once(" s  ").map_or(line, |line| line.1));
        told.map(str::to_owned).collect()
    }
}

/// These are the ends of lines, or their beginnings if they end in `…`, in this order.
#[track_caller]
fn assert_told(told: &[String], lines: &[&str]) {
    let mut rest = told.iter();
    for line in lines {
        let is_it = |told: &&String| match line.strip_suffix('…') {
            Some(beginning) => told.starts_with(beginning),
            None => told.ends_with(line),
        };
        assert!(rest.any(|told| is_it(&told)), "{line}: {told:#?}");
    }
}

#[test]
fn nothing_that_happens_to_the_machine_or_a_program_is_left_out() {
    let mut talk = Talk::start("--model imc-s8 --machine mill --time instant");
    assert_eq!(talk.ask("@07\r@0R7\r", 2), "00");
    assert_eq!(talk.ask("@0A30000,4000,20000,4000,0,900,0,900\r", 1), "2");
    assert_eq!(talk.ask("@0R7\r@0i\rm50000,9000,0,900,0,900,0,900\r9\r@0S\r", 5), "00002");
    assert_eq!(talk.order("press start"), "ok");
    assert_told(
        &talk.end(),
        &[
            "warning: the X carriage ran on when its motor was halted without a ramp: 79 steps…",
            "warning: the Y carriage ran on when its motor was halted without a ramp: 52 steps…",
            "2  after 6 s: limit switch X+ at step 24,001 and limit switch Y+ at step 16,001",
            "@0S  start",
            "line 1: m",
            "warning: the X carriage ran on…",
            "warning: the program ended in line 1 with error 2: limit switch X+ at step 24,001",
            "2  after 2.7 s: line 1 of the program, `m50000,9000,0,900,0,900,0,900`: limit switch…",
            "standard input: press start",
            "line 1: m",
            "warning: the program ended in line 1 with error 2: X is on limit switch X+: @0R1 leaves it",
        ],
    );
}

#[test]
fn a_program_that_stop_halts_and_a_motion_replaces_is_told() {
    let mut talk = Talk::start("");
    assert_eq!(talk.ask("@01\r@0i\r05000,1000\r9\r", 4), "0000");
    assert_eq!(talk.order("press start"), "ok");
    assert_eq!(talk.order("press stop"), "ok");
    assert_eq!(talk.ask("@0A5,300\r", 1), "0");
    assert_told(
        &talk.end(),
        &[
            "cut short: in line 1 of the program, by STOP at the panel: START or @0S goes on with it",
            "cut short: in line 1 of the program, by a motion of the host: the rest of it is dropped",
        ],
    );
}

#[test]
fn what_a_client_wrote_before_it_closed_comes_before_the_news_of_that() {
    let mut talk = Talk::start("");
    let mut pty = talk.open_pty();
    let mut answer = [0];
    pty.write_all(b"@01\r").unwrap();
    pty.read_exact(&mut answer).unwrap();
    pty.write_all(b"@0A3000,900\r").unwrap();
    talk.settle();
    for _ in 0..20 {
        // Taken in first, so that it is news that the other one speaks again.
        talk.send(b"@0P\r");
        pty.write_all(b"@0A1").unwrap();
        drop(pty);
        talk.settle();
        pty = talk.open_pty();
        pty.write_all(b"\r").unwrap();
        talk.settle();
    }
    drop(pty);
    let told = talk.end();
    for (number, line) in told.iter().enumerate() {
        let before = |text: &str| told[..number].iter().rfind(|line| line.ends_with(text)).cloned();
        if line.contains("left half a line") {
            let coming = told[number + 1].ends_with("a client opened the line");
            assert!(line.starts_with("pty: an earlier client left half a line, `@0A1`"), "{line}");
            let closed = told[number - 1] == "pty: a client closed the line";
            assert!(coming || closed, "{number}: {told:#?}");
        }
        if line == "pty: a client closed the line" {
            assert_eq!(before("speaks").unwrap(), "pty: a client speaks", "{number}: {told:#?}");
        }
    }
}

/// How many warnings were left out is said although no other one comes and no client closes.
#[test]
fn what_is_left_out_of_a_flood_is_told_in_time() {
    let mut talk = Talk::start("");
    let errors = talk.serve.errors();
    let address = talk.client.peer_addr().unwrap();
    talk.ask("@01\r", 1);
    let refused: Vec<_> = (0..5).map(|_| TcpStream::connect(address).unwrap()).collect();
    let told = std::iter::from_fn(|| errors.recv_timeout(LIMIT).ok());
    let told = told.filter_map(|line| Some(line.split_once(" s  ")?.1.to_owned()));
    let told: Vec<_> = told.take_while(|line| !line.contains("4 more were left out")).collect();
    let kept = told.iter().filter(|line| line.contains(": refused ")).count();
    assert_eq!((refused.len(), kept), (5, 1), "{told:#?}");
    assert!(!told.iter().any(|line| line.contains("closed the line")), "{told:#?}");
}

/// However quickly it came and went.
#[test]
fn what_a_client_sent_is_told_between_its_coming_and_its_going() {
    const CLIENTS: usize = 200;
    let mut talk = Talk::start("");
    for _ in 0..CLIENTS {
        let mut pty = talk.open_pty();
        pty.write_all(b"@0d100\r").unwrap();
        drop(pty);
        // It may be seen in any of these states, and by who waits or by who asks.
        std::thread::sleep(Duration::from_millis(1));
        talk.settle();
    }
    let told = talk.end();
    let of_pty = |line: &&String| line.starts_with("pty: a client ") && !line.ends_with("speaks");
    let told: Vec<&String> =
        told.iter().filter(|line| line.starts_with("@0d") || of_pty(line)).collect();
    assert_eq!(told.len(), 3 * CLIENTS);
    for visit in told.chunks(3) {
        let [opened, sent, closed] = visit else { panic!("{visit:?}") };
        assert_eq!(*opened, "pty: a client opened the line", "{visit:?}");
        assert!(sent.starts_with("@0d100"), "{visit:?}");
        assert_eq!(*closed, "pty: a client closed the line", "{visit:?}");
    }
}

#[test]
fn what_was_so_already_is_said_to_have_been() {
    let mut talk = Talk::start("--machine bench");
    assert_eq!(talk.ask("@01\r", 1), "0");
    talk.send(b"@0R1\r");
    assert_eq!(talk.order("hold stop"), "ok");
    assert_eq!(talk.order("hold stop"), "ok, without effect: it was so already");
    assert_eq!(talk.order("power off"), "ok");
    assert_eq!(talk.order("hold stop"), "ok, without effect: it was so already");
    assert_eq!(talk.order("release stop"), "ok");
    assert_eq!(talk.order("press stop"), "ok, without effect: the power is off");

    let mut talk = Talk::start("--model motionsystem");
    assert_eq!(talk.order("set fault data-memory-error 1"), "ok");
    let again = talk.order("set fault data-memory-error 1");
    assert_eq!(again, "ok, without effect: it was so already");
}

#[test]
fn a_control_code_is_told_by_what_it_does_now() {
    let mut talk = Talk::start("--model imc4 --machine mill --time manual");
    assert_eq!(talk.ask("@03\r", 1), "0");
    talk.send(b"@0R3\r");
    talk.order("advance 10ms");
    talk.send(b"\xFD");
    talk.order("advance 100ms");
    talk.send(b"\xFF");
    assert_eq!(talk.ask("", 1), "2");
    assert_eq!(talk.ask("@01\r", 1), "0");
    talk.send(b"@0A5000,900\r");
    talk.order("advance 100ms");
    talk.send(b"\xFF");
    talk.order("run until idle");
    assert_eq!(talk.ask("", 1), "0");
    talk.send(b"@0A5000,900\r@0P\r");
    talk.order("advance 100ms");
    talk.send(b"\xFE");
    assert_eq!(talk.ask("@01\r", 1), "0");
    talk.send(b"@0A5000,900\r");
    talk.order("power off");
    talk.order("power on");
    assert_eq!(talk.ask("@01\r@0i\r0 5000,900\r9\r", 4), "0000");
    assert_eq!(talk.order("press start"), "ok");
    talk.order("advance 100ms");
    talk.send(b"\xFF");
    talk.order("run until idle");
    assert_eq!(talk.order("press start"), "ok");
    assert_told(
        &talk.end(),
        &[
            ": 253  stop: taken for the switch of Y, the reference run goes on",
            ": 255  break: the reference run ends at once",
            ": the reference run was broken off by 255 from the line",
            "@0A5000,900  relative move…",
            ": 255  break: what moves brakes, and the rest of it is forgotten",
            "        cut short: by 255 from the line",
            "0  after…",
            "@0A5000,900  relative move…",
            ": 254  reset: everything as after power-on",
            "        cut short: by 254 from the line, without an answer; 4 characters that waited are \
             lost",
            "@0A5000,900  relative move…",
            "standard input: power off",
            "        cut short: by the loss of power, without an answer",
            "line 1: 0",
            ": 255  break: what moves brakes, and the rest of it is forgotten",
            "        cut short: in line 1 of the program, by 255 from the line",
            "standard input: press start",
            "line 1: 0",
            "the controller ends, as if its power were switched off",
            "        cut short: in line 1 of the program, by the loss of power",
        ],
    );
}

#[test]
fn a_control_code_with_nothing_to_end_has_no_effect_although_it_is_answered() {
    let mut talk = Talk::start("--model c142");
    for code in [b"\xFE", b"\xFF"] {
        talk.send(code);
        assert_eq!(talk.ask("", 1), "0");
    }
    let nothing = "        no effect: there is nothing that it could end";
    assert_told(
        &talk.end(),
        &[
            ": 254  reset: everything as after power-on",
            "0",
            nothing,
            ": 255  break: what moves brakes, and the rest of it is forgotten",
            "0",
            nothing,
        ],
    );
}

#[test]
fn erasing_at_the_panel_is_told_with_all_that_it_does() {
    let mut talk = Talk::start("--model imc4");
    assert_eq!(talk.order("power off"), "ok");
    assert_eq!(talk.order("erase"), "ok, without effect: the power is off");
    assert_eq!(talk.order("hold stop"), "ok");
    assert_eq!(talk.order("erase"), "ok, but nothing is erased: the power is off");
    assert_eq!(talk.order("power on"), "ok");
    assert_eq!(talk.order("hold stop"), "ok");
    assert_eq!(
        talk.order("erase"),
        "ok: the memory is erased, which takes 20 s; then press on, for the emergency stop has \
         switched the stages off"
    );
    assert_told(
        &talk.end(),
        &[
            "standard input: power off",
            "standard input: erase (estop 1, estop 0, key 0, stop 1, on 1, on 0, stop 0, key 1)",
            "        no effect: the power is off",
            "standard input: hold stop",
            "standard input: erase (estop 1, estop 0, key 0, stop 1, on 1, on 0, stop 0, key 1)",
            "standard input: power on",
            "standard input: erase (estop 1, estop 0, key 0, stop 1, on 1, on 0, stop 0, key 1)",
            "flash: erasing, which takes 20 s",
        ],
    );
}

#[test]
fn what_was_left_out_is_told_at_the_end() {
    let mut talk = Talk::start("--time manual");
    talk.send(b"@01\r@0A5000,900\r");
    let flood = vec![b'x'; 100_000];
    talk.send(&flood);
    talk.send(&flood);
    let told = talk.end();
    let number = |text: &str| text.chars().filter(char::is_ascii_digit).collect::<String>();
    let mut lost = 0;
    for line in told.iter().filter(|line| line.contains("receive buffer")) {
        let bytes = match line.strip_prefix("warning: the receive buffer was full, ") {
            Some(rest) => number(rest.split(" byte").next().unwrap()),
            None => number(line.split(" of ").nth(1).unwrap()),
        };
        lost += bytes.parse::<u64>().unwrap();
    }
    // The receive buffer has the rest.
    assert!((198_000..200_000).contains(&lost), "{lost}: {told:#?}");
}

#[test]
fn what_belongs_to_no_command_is_told_with_its_bytes() {
    let mut talk = Talk::start("--model smcu --time instant");
    talk.send(b"IN;!CT1;pu;PA5,5;pa100,100;5,6;xy;PA1,2pu;VS9999999999;");
    talk.order("run until idle");
    assert_told(
        &talk.end(),
        &[
            "warning: no effect: pu: lower-case letters are not commands: write PU, not pu",
            "PA5,5  move to X 5 Y 5",
            "warning: no effect: pa100,100: lower-case letters are not commands: write PA, not pa",
            "warning: no effect: 5,6: numbers without a command mean nothing",
            "warning: no effect: xy: lower-case letters are not commands",
            "PA1,2pu  move to X 1 Y 2; pu means nothing: lower-case letters are not commands: write \
             PU, not pu",
            "; 9999999999 is read as 2,147,483,647, numbers go no further",
        ],
    );
}

#[test]
fn of_a_line_that_is_too_long_the_beginning_is_shown() {
    let mut talk = Talk::start("");
    talk.send(&[&b"@0A"[..], &[b'5'; 300], b"\r"].concat());
    assert_eq!(talk.ask("", 1), "5");
    let beginning = format!("@0A{}...  relative move", "5".repeat(37));
    assert_told(&talk.end(), &[&beginning, "5  at once: a line of more than 255 characters"]);
}

#[test]
fn what_is_lost_with_the_power_is_told() {
    let mut talk = Talk::start("--model smcu --machine board-plotter --time manual");
    talk.send(b"IN;!ES1;");
    talk.order("advance 5s");
    talk.send(b"PA3000,0;PA1,1;PD;");
    talk.order("advance 100ms");
    assert_eq!(talk.order("power off"), "ok");
    assert_eq!(talk.order("power on"), "ok");
    talk.send(b"!ES1;");
    talk.order("advance 5s");
    talk.send(b"PA3000,0;PA1,1;");
    talk.order("advance 100ms");
    assert_eq!(talk.order("press stop"), "ok");
    talk.order("advance 5s");
    assert_told(
        &talk.end(),
        &[
            "standard input: power off",
            "        cut short: by the loss of power, without an answer: PA3000,0; 2 commands that \
             waited, PA1,1 the first of them",
            "the controller ends, as if its power were switched off",
            "        cut short: by the loss of power, without an answer: what is left of PA3000,0; \
             PA1,1, which waited",
        ],
    );
}

#[test]
fn the_half_line_that_is_lost_with_the_power_is_told() {
    for (model, sent, half) in [
        ("smcu", "PA50000,0;PA1,1;PA2,", "PA1,1, which waited; the half line PA2,"),
        ("smcu", "!GO;PA1,", "without an answer: the half line PA1,"),
        ("imc4", "@0A5", "by the loss of power: the half line @0A5 is lost"),
    ] {
        // With --fresh-clients the controller has not had it yet.
        for (order, more) in [("power off", ""), ("position", ""), ("position", "--fresh-clients")]
        {
            let arguments = format!("--model {model} --machine bench --time manual {more}");
            let mut talk = Talk::start(&arguments);
            talk.send(sent.as_bytes());
            talk.order(order);
            let told = talk.end();
            let line = told.iter().find(|line| line.starts_with("        cut short: by the loss"));
            assert!(line.is_some_and(|line| line.ends_with(half)), "{sent}: {told:#?}");
        }
    }
    // Nothing is lost where nothing was begun.
    let mut talk = Talk::start("--time manual");
    talk.send(b"@0A5\r \n");
    talk.order("power off");
    assert!(!talk.end().iter().any(|line| line.contains("cut short")));
}

#[test]
fn an_answer_that_comes_late_is_told_with_its_command() {
    let mut talk = Talk::start("--model motionsystem --machine bench --time manual");
    talk.order("run until idle");
    talk.send(b"PA3000,3000;");
    assert!(talk.order("run until x 500").starts_with("there at"));
    assert_eq!(talk.order("set limit x+ 1"), "ok");
    talk.send(b"!GB;!CS;!CB;!GO;");
    talk.order("run until idle");
    assert_told(
        &talk.end(),
        &[
            "!GB  go back to the start of the broken-off command",
            "!GO  go on",
            "C\\r  at once",
            "C\\r  to !GB, after 218 ms",
        ],
    );
}

#[test]
fn two_handles_of_one_program_are_told() {
    let mut talk = Talk::start("--time manual");
    let mut reads = terminal(&talk.pty);
    let mut writes = terminal(&talk.pty);
    let ask = |reads: &mut Timed<File>, writes: &mut Timed<File>| {
        writes.write_all(b"@07\r").unwrap();
        reads.read_exact(&mut [0]).unwrap();
    };
    ask(&mut reads, &mut writes);
    // Who reads in one place and writes in another gets every answer; who reads in two does not.
    let quiet = terminal(&talk.pty);
    for _ in 0..20 {
        ask(&mut reads, &mut writes);
        talk.settle();
    }
    drop((reads, writes, quiet));
    let told = talk.end();
    let shared: Vec<_> = told.iter().filter(|line| line.contains("have it open at once")).collect();
    let me = format!("(process {}) have it open at once", std::process::id());
    let [line] = shared.as_slice() else { panic!("{told:#?}") };
    assert!(line.starts_with("pty: 2 handles of ") && line.contains(&me), "{line}");
}

#[test]
fn what_happens_is_traced_as_far_as_the_environment_asks() {
    let serve = |level: &str| {
        let folder = tempfile::tempdir().unwrap();
        let arguments = ["serve", "--tcp", "127.0.0.1:0", "--pty", "none", "--json", "-v"];
        let mut command = vimc4(folder.path(), &arguments);
        let mut serve = Process::start(command.env("VIMC4_LOG", level));
        let mut client = connect(tcp(&ready(&serve.line()), 0));
        assert_eq!(ask(&mut client, "@07\r", 1), "0");
        serve.give("quit\n");
        assert_eq!(serve.line(), "");
        serve.end()
    };
    let (code, said) = serve("info");
    assert_eq!(code, Some(0), "{said}");
    let traces: Vec<_> = said.lines().filter(|line| line.contains("controller{")).collect();
    let begins = traces.iter().find(|line| line.contains("begins")).unwrap();
    assert!(begins.contains(" INFO controller{name=\"1\"}: begins model=\"imc4\""), "{begins}");
    let opened = traces.iter().find(|line| line.contains("line opened at_ns=")).unwrap();
    assert!(opened.contains("}:client{transport=\"tcp 127.0.0.1:"), "{opened}");
    assert!(traces.iter().all(|line| !line.contains(" DEBUG ")), "{said}");
    // What -v says is as ever, each in its line.
    assert!(said.lines().any(|line| line.ends_with(" s  @07  set axes X+Y+Z")), "{said}");

    let (_, said) = serve("debug");
    let command = said.lines().find(|line| line.contains("command=1 mnemonic=\"@axes\"")).unwrap();
    assert!(command.contains(" DEBUG controller{name=\"1\"}: command at_ns="), "{command}");
    for quiet in ["", "off", "error"] {
        assert!(!serve(quiet).1.contains("controller{"), "{quiet}");
    }
}

#[test]
fn a_level_that_is_none_is_said() {
    for wrong in ["inof", "INFO", "vimc4=info", "3"] {
        for command in [&["serve", "--tcp", "none"][..], &["models"]] {
            let output = std::process::Command::new(VIMC4)
                .args(command)
                .env("VIMC4_LOG", wrong)
                .output_in_time()
                .unwrap();
            let said = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(2), "{said}");
            let line = format!("VIMC4_LOG={wrong}: this is not a level");
            assert!(said.contains(&line), "{said}");
            assert!(said.contains("use one of off, error, warn, info, debug, trace"), "{said}");
        }
    }
}
