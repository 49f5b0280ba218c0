//! The command, end to end.

#![expect(clippy::cognitive_complexity, clippy::too_many_lines, reason = "one test is one story")]
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};

use rustix::process::Signal;
use serde_json::Value;

#[path = "serve/log.rs"]
mod log;

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{EndsInTime, InTime, LIMIT, joined};
use process::{Process, VIMC4, ask, connect, rest_of, root, run, said, tcp, terminal, vimc4};

/// `vimc4 serve` with these arguments and no others.
fn serving(folder: &Path, arguments: &[&str]) -> Process {
    Process::start(vimc4(folder, &["serve"]).args(arguments))
}

/// Skips the addresses.
fn until_ready(serve: &mut Process) {
    while serve.line() != "ready" {}
}

/// What the line says that says that it is ready.
fn ready(json: &str) -> Value {
    let value: Value = serde_json::from_str(json).unwrap();
    assert_eq!(value["ready"], true);
    value
}

#[test]
fn it_says_where_it_listens_and_that_it_is_ready() {
    let folder = tempfile::tempdir().unwrap();
    let mut serve = serving(folder.path(), &["--tcp", "127.0.0.1:0"]);
    let link = folder.path().canonicalize().unwrap().join("vimc4.pty");
    assert_eq!(serve.line(), format!("pty {}", link.display()));
    let tcp = serve.line();
    assert_eq!(serve.line(), "ready");
    let mut client = connect(tcp.strip_prefix("tcp ").unwrap());
    assert_eq!(ask(&mut client, "@07\r", 1), "0");
    let mut port = terminal(&link);
    port.write_all(b"@0P\r").unwrap();
    let mut answer = [0; 19];
    port.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"0000000000000000000");
    assert_eq!(serve.order("quit"), "");
    assert_eq!(serve.end().0, Some(0));
    assert!(!link.is_symlink());
}

/// Ends what a script has left running.
struct Left<'a>(&'a Path);

impl Drop for Left<'_> {
    fn drop(&mut self) {
        let kill = "test ! -e kept/pid || kill $(cat kept/pid)";
        let _ = Command::new("sh").args(["-c", kill]).current_dir(self.0).status_in_time();
    }
}

/// As the page on installing has it for CI: the script ends, and what it has started goes on until the
/// other script ends it.
#[test]
fn the_scripts_for_ci_serve_the_steps_that_follow() {
    let folder = tempfile::tempdir().unwrap();
    let _left = Left(folder.path());
    let script = |name: &str, arguments: &[&str]| {
        let programs = Path::new(VIMC4).parent().unwrap().display();
        let path = format!("{programs}:{}", std::env::var("PATH").unwrap());
        let mut script = Command::new(root().join("ci").join(name));
        script.arg("kept").args(arguments).env("PATH", path);
        said(script.current_dir(folder.path()).output_in_time().unwrap())
    };
    let serve = |options: &str| script("serve.sh", &options.split(' ').collect::<Vec<_>>());
    let finish = || script("finish.sh", &[]);
    let kept = |name: &str| folder.path().join("kept").join(name);
    fs::create_dir(folder.path().join("kept")).unwrap();
    // It is nobody's of an earlier run.
    fs::write(kept("session-1-notes.jsonl"), "notes").unwrap();
    // Nothing of an earlier run is taken for one of a later run.
    for line in ["@07", "@01"] {
        let served = serve("--tcp 127.0.0.1:0 --pty none");
        assert_eq!(served.0, 0, "{served:?}");
        assert!(!kept("session.html").exists());
        let mut client = connect(tcp(&ready(&served.1), 0));
        assert_eq!(ask(&mut client, &format!("{line}\r"), 1), "0");
        let (code, _, errors) = serve("--pty none");
        assert!(code == 1 && errors.contains("still serves into kept"), "{errors}");
        let (code, out, errors) = finish();
        assert!(code == 0 && out.starts_with("equal: 1 input"), "{out}{errors}");
        let told = fs::read_to_string(kept("conversation.log")).unwrap();
        assert!(told.contains(line) && told.matches("@0").count() == 1, "{told}");
        assert!(kept("session.html").exists());
    }
    assert_eq!(serve("--tcp 127.0.0.1:0 --pty none --count 2").0, 0);
    assert_eq!(finish().0, 0);
    assert!(kept("session-1.html").exists() && kept("session-2.html").exists());
    assert!(kept("session-1-notes.jsonl").exists());
    // What cannot begin is said, and is no step that waits.
    let (code, out, errors) = serve("--model nothing");
    assert_eq!((code, out.as_str()), (1, ""));
    assert!(errors.contains("there is no model `nothing`"), "{errors}");
    // Another process that has the number is none of its own.
    let mut other = Command::new("sleep").arg("60").start().unwrap();
    fs::write(kept("pid"), other.id().to_string()).unwrap();
    let (code, _, errors) = finish();
    assert!(code == 1 && errors.contains("there is no recording in kept"), "{errors}");
    assert!(errors.contains("there is no model `nothing`"), "{errors}");
    assert!(other.try_wait().unwrap().is_none());
    other.kill().unwrap();
    other.wait_in_time().unwrap();
    for name in ["serve.sh", "finish.sh"] {
        for arguments in [&[][..], &["--model", "imc4"]] {
            let mut script = Command::new(root().join("ci").join(name));
            let (code, out, errors) = said(script.args(arguments).output_in_time().unwrap());
            assert_eq!((code, out.as_str()), (2, ""), "{errors}");
            let usage = format!("{name} FOLDER");
            assert!(errors.starts_with("usage: ") && errors.contains(&usage), "{errors}");
        }
    }
    // Without what tells that nobody would know what serves.
    std::os::unix::fs::symlink(root().join("ci/serve.sh"), folder.path().join("alone.sh")).unwrap();
    let alone = Command::new(folder.path().join("alone.sh")).arg("kept").output_in_time().unwrap();
    let (code, _, errors) = said(alone);
    assert!(code == 1 && errors.contains("serving.sh, which belongs beside"), "{errors}");
}

#[test]
fn an_option_that_is_given_twice_or_has_no_effect_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("list.txt", "@07\n");
    write("program.txt", "0400,900,0,900,0,900,0,900\n9\n");
    write("job.ncp", "IMF_PBL_V1.0\nPROGEND\n");
    write("plot.plt", "PA0,0;\n");
    for (line, wrong) in [
        ("serve --model imc4 --model imc4-m", "cannot be used multiple times"),
        ("serve --json --json", "cannot be used multiple times"),
        ("run list.txt --plot a.svg --plot b.png", "cannot be used multiple times"),
        ("ncp run job.ncp --machine mill --machine bench", "cannot be used multiple times"),
        ("circle --radius 20 --radius 30", "cannot be used multiple times"),
        ("serve --pty none --tcp none", "no program can reach the controller; give --pty, --tcp"),
        ("serve --pty none --replace", "--replace has no effect without a pseudo-terminal"),
        ("serve --tcp none --tcp-clients observe", "--tcp-clients has no effect with --tcp none"),
        ("lines --lines none --dcd true", "--dcd has no effect with --lines none"),
        ("lines --serve --tcp-clients observe true", "--tcp-clients has no effect with --tcp none"),
        ("run list.txt --keep-going", "--keep-going has no effect with commands; leave it out"),
        ("run list.txt --axes 7 --keep-going", "--axes and --keep-going have no effect with comm"),
        ("run program.txt --ignore-numbers", "--ignore-numbers has no effect with a stored"),
        ("run job.ncp --loops 3", "--loops has no effect with a job"),
        ("run plot.plt --model smcu --machine board-plotter --loops 2", "with a plot file"),
        ("console list.txt --tcp none --count 2", "--tcp and --count have no effect with a file"),
        ("console imc4 --keep-going", "--keep-going has no effect without a file"),
        ("console imc4 --model imc-s8", "--model has no effect beside the name of a model"),
        ("console imc4 --pty none --tcp none --count 2", "--count has no effect without clients"),
        ("doctor 127.0.0.1:1 --baud 9600", "--baud has no effect on 127.0.0.1:1, which is TCP"),
        ("send list.txt --to tcp:127.0.0.1:1 --baud 9600", "--baud has no effect on tcp:127.0"),
        ("conform 127.0.0.1:1 --baud 9600", "--baud has no effect on 127.0.0.1:1"),
    ] {
        let (code, out, errors) = run(folder.path(), &line.split(' ').collect::<Vec<_>>());
        let told = errors.split_whitespace().collect::<Vec<_>>().join(" ").replace(" help: ", "; ");
        assert_eq!((code, out.as_str()), (2, ""), "{line}: {errors}");
        assert!(told.contains(wrong), "{line}: {errors}");
    }
    // Whatever else makes a way in.
    for way in ["--http 127.0.0.1:0", "--dap 0", "--rfc2217 127.0.0.1:0"] {
        let mut arguments = vec!["--pty", "none", "--tcp", "none"];
        arguments.extend(way.split(' '));
        let mut serve = serving(folder.path(), &arguments);
        until_ready(&mut serve);
    }
}

#[test]
fn the_json_line_is_exactly_the_documented_one() {
    let folder = tempfile::tempdir().unwrap();
    let mut serve = serving(folder.path(), &["--tcp", "127.0.0.1:0", "--json"]);
    let line = serve.line();
    let address = tcp(&ready(&line), 0).to_owned();
    let link = folder.path().canonicalize().unwrap().join("vimc4.pty");
    assert_eq!(
        line,
        format!(
            "{{\"ready\":true,\"controllers\":[{{\"model\":\"imc4\",\"pty\":\"{}\",\"tcp\":\
             \"{address}\",\"rfc2217\":null,\"serial\":null}}],\"control\":null}}",
            link.display()
        )
    );
}

#[test]
fn signals_end_it_with_its_links_removed() {
    for (signal, code) in [(Signal::INT, 0), (Signal::TERM, 0), (Signal::QUIT, 131)] {
        let folder = tempfile::tempdir().unwrap();
        let arguments = ["--count", "3", "--tcp", "127.0.0.1:0", "--time", "instant"];
        let mut serve = serving(folder.path(), &arguments);
        while serve.line() != "ready" {}
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
        serve.signal(signal);
        assert_eq!(serve.end(), (Some(code), String::new()));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}

#[test]
fn people_type_orders() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--tcp", "127.0.0.1:0", "--json", "--time", "manual"];
    let mut serve = serving(folder.path(), &arguments);
    let ready = ready(&serve.line());
    let mut client = connect(tcp(&ready, 0));
    assert_eq!(ask(&mut client, "@01\r", 1), "0");
    client.write_all(b"@0A5000,10000\r").unwrap();
    assert_eq!(serve.order("advance 50ms"), "now 0.050000000 s");
    assert_eq!(serve.order("press stop"), "ok");
    assert_eq!(serve.order("run until idle"), "idle at 0.100000000 s");
    assert_eq!(serve.order("position"), "X 280 Y 0 Z 0 A 0");
    assert_eq!(ask(&mut client, "", 1), "F");
    for order in [
        "press estop",
        "release estop",
        "press on",
        "key test",
        "key auto",
        "cover open",
        "cover closed",
        "input 0.3 1",
        "power off",
        "power on",
    ] {
        assert_eq!(serve.order(order), "ok", "{order}");
    }
    assert!(serve.order("erase").starts_with("ok: the memory is erased, which takes 20 s; "));
    // What changes nothing says why.
    assert_eq!(serve.order("press start"), "ok, without effect: the controller is busy");
    assert!(serve.order("run until idle").starts_with("idle at "));
    let already = "it was so already";
    for (order, why) in [
        ("press start", "the stages are off since an emergency stop: press ON"),
        ("press stop", "nothing moves and no program runs"),
        ("power off", ""),
        ("press start", "the power is off"),
        ("power off", already),
        ("power on", ""),
        ("press start", "no motion was stopped, and no program is stored"),
        ("press on", "the stages are on already"),
        ("set overtemperature 1", ""),
        ("press start", "the power stages are too hot"),
        ("press on", "the power stages are too hot"),
        ("set overtemperature 0", ""),
        ("set power-ok 0", ""),
        ("press start", "the motor supply is off"),
        ("set power-ok 1", ""),
        ("release stop", already),
        ("key auto", already),
        ("set cover closed", already),
        ("input 0.3 1", already),
        ("power on", already),
        ("cover open", ""),
        ("press start", "the cover is open with the key on automatic"),
        ("cover closed", ""),
        ("press estop", ""),
        ("press estop", already),
        ("press on", "the emergency stop is pressed"),
        ("press start", "the emergency stop is pressed"),
        ("release estop", ""),
        ("press on", ""),
        ("hold stop", ""),
        ("press start", "STOP is pressed"),
        ("release stop", ""),
    ] {
        let answer = match why {
            "" => "ok".to_owned(),
            why => format!("ok, without effect: {why}"),
        };
        assert_eq!(serve.order(order), answer, "{order}");
    }
    assert!(serve.order("help").starts_with("press BUTTON"));
    while serve.line().split_once(' ').is_some_and(|(order, _)| order != "quit") {}
    // A wrong line says what would be right, and nothing else happens.
    for (wrong, right) in [
        (
            "press stpo",
            "error: `press stpo` is wrong at `stpo`: there is no button `stpo`; did you mean stop?",
        ),
        ("move it", "error: `move it` is wrong: not an order; type help for the list"),
        (
            "\ninput 9.9 1",
            "error: `input 9.9 1` is wrong at `9.9 1`: PORT.BIT, with a bit from 0 to 7",
        ),
        (
            "run until x 5",
            "error: this never happens unless something else does first; give the command or the \
             order that leads there before",
        ),
    ] {
        let answer = serve.order(wrong);
        assert!(answer.starts_with(right), "{answer}");
    }
    // The end of the input does not end it.
    drop(serve.input.take());
    assert_eq!(ask(&mut client, "@0P\r", 0), "");
    std::thread::sleep(std::time::Duration::from_millis(50));
    assert!(serve.child.try_wait().unwrap().is_none());
    serve.signal(Signal::TERM);
    assert_eq!(serve.end(), (Some(0), String::new()));
}

#[test]
fn another_family_is_served_with_its_own_axes_and_a_hint() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--model", "smcu", "--machine", "board-plotter", "--tcp", "127.0.0.1:0"];
    let mut serve = serving(folder.path(), &[&arguments[..], &["--json", "-v"]].concat());
    let places = ready(&serve.line());
    assert_eq!(places["controllers"][0]["model"], "smcu");
    let mut client = connect(tcp(&places, 0));
    assert_eq!(ask(&mut client, "PR20,10;!ON0;", 13), "C\rP20,10,0\rC\r");
    assert_eq!(serve.order("position"), "X 20 Y 10");
    // A border, behind which nothing is executed; then the next job.
    assert_eq!(ask(&mut client, "IW0,0,25,25;PA90,10;", 6), "C\rE08\r");
    assert_eq!(ask(&mut client, "PA5,5;IN;!CT1;", 3), "ZC\r");
    assert!(serve.order("erase").contains("no memory that could be erased"));
    let wrong = serve.order("run until z9 5");
    assert!(wrong.contains("axes are x, y, z"), "{wrong}");
    let never = "error: this never happens unless something else does first";
    assert!(serve.order("run until x > 5000").starts_with(never));
    serve.give("run until command PA and x >= 0\nposition\n");
    assert!(serve.line().starts_with("position: X "));
    assert_eq!(ask(&mut client, "PA7,7;", 2), "C\r");
    assert!(serve.line().starts_with("run until command PA and x >= 0: there at "));
    assert_eq!(serve.order("quit"), "");
    let (code, errors) = serve.end();
    assert_eq!(code, Some(0), "{errors}");
    assert!(errors.contains("waits for CTS of the smcu needs TCP, a serial port"), "{errors}");
    assert!(errors.contains("PR20,10  move by X +20 Y +10"), "{errors}");
    let reason = "X came to the end of the window, 0 to 25, at step 25; commands wait for !GO, IN \
                  begins anew";
    assert!(errors.contains(reason), "{errors}");
    assert!(!errors.contains("buffer was full"), "{errors}");
}

#[test]
fn several_controllers_are_numbered() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["--count", "2", "--tcp", "127.0.0.1:0", "--json", "--flash", "f.bin", "--pty", "p"];
    let mut serve = serving(folder.path(), &arguments);
    let places = ready(&serve.line());
    let names: Vec<_> = places["controllers"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| c["pty"].as_str().unwrap().rsplit('/').next().unwrap().to_owned())
        .collect();
    assert_eq!(names, ["p-1", "p-2"]);
    assert!(folder.path().join("f-1.bin").exists() && folder.path().join("f-2.bin").exists());
    let mut second = connect(tcp(&places, 1));
    assert_eq!(ask(&mut second, "@01\r@0A10,900\r", 2), "00");
    assert_eq!(serve.order("2 position"), "2: X 10 Y 0 Z 0 A 0");
    assert_eq!(serve.order("1 position"), "1: X 0 Y 0 Z 0 A 0");
    for wrong in ["position", "3 position"] {
        let answer = serve.order(wrong);
        assert!(answer.contains("begin with the number of a controller, 1 to 2"), "{answer}");
    }
    assert!(serve.order("1 press stpo").starts_with("1: error: `press stpo` is wrong at `stpo`"));
    assert!(serve.order("1 press stop").starts_with("1: ok, without effect"));
    serve.signal(Signal::TERM);
    assert_eq!(serve.end(), (Some(0), String::new()));
}

#[test]
fn the_conversation_is_shown_and_logged_as_people_read_it() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["--tcp", "127.0.0.1:0", "--json", "--time", "instant", "-v", "--log", "traffic.log"];
    let mut serve = serving(folder.path(), &arguments);
    let mut client = connect(tcp(&ready(&serve.line()), 0));
    assert_eq!(ask(&mut client, "@01\r@0A 5000,900\r", 2), "00");
    serve.signal(Signal::TERM);
    let (_, errors) = serve.end();
    let log = fs::read_to_string(folder.path().join("traffic.log")).unwrap();
    for text in [&errors, &log] {
        assert!(text.contains("@0A 5000,900  relative move X +5,000 steps at 900 Hz"), "{text}");
        assert!(text.contains("0  after 5.6 s"), "{text}");
    }
}

#[test]
fn what_is_wrong_is_one_message_with_the_remedy_and_exit_code_2() {
    let folder = tempfile::tempdir().unwrap();
    let holder = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = holder.local_addr().unwrap().to_string();
    fs::write(folder.path().join("file"), "precious").unwrap();
    fs::write(folder.path().join("bad.flash"), "vimc4 flash 1\nnonsense\n").unwrap();
    let (_, profile, _) = run(folder.path(), &["models", "show", "imc4"]);
    let baud = profile.lines().find(|line| line.starts_with("baud")).unwrap();
    fs::write(folder.path().join("bad.toml"), profile.replace(baud, "baud = 1234")).unwrap();
    for (arguments, words) in [
        (vec!["--tcp", &taken], vec!["is taken", "choose another address"]),
        (vec!["--tcp", "nonsense"], vec!["`nonsense` is not an address", "host:port"]),
        (vec!["--model", "imc5"], vec!["no model `imc5`", "built in are imc4"]),
        (vec!["--machine", "none.toml"], vec!["none.toml", "No such file", "check the name"]),
        (vec!["--model", "bad.toml"], vec!["bad.toml", "baud = 1234", "use 19200 or 9600"]),
        (vec!["--flash", "none/flash"], vec!["none/flash", "can be written to"]),
        (vec!["--flash", "bad.flash"], vec!["bad.flash", "line 2", "name another file"]),
        (vec!["--pty", "file"], vec!["file exists", "choose another name"]),
        (vec!["--log", "none/log"], vec!["none/log", "can be written to"]),
        (vec!["--serial", "/dev/none"], vec!["/dev/none", "check its name"]),
        (vec!["--time", "fast"], vec!["`fast` is not a clock", "8x or 0.5x"]),
        (vec!["--time", "0x"], vec!["`0x` is not a clock"]),
        (vec!["--count", "0"], vec!["invalid value '0'"]),
        (vec!["--tcp-clients", "share"], vec!["refuse, takeover, observe"]),
        (vec!["--nonsense"], vec!["unexpected argument '--nonsense'"]),
    ] {
        let mut all = [&["serve"], &arguments[..]].concat();
        if !all.contains(&"--tcp") {
            all.extend(["--tcp", "127.0.0.1:0"]);
        }
        let (code, out, errors) = run(folder.path(), &all);
        assert_eq!((code, out.as_str()), (2, ""), "{arguments:?}: {errors}");
        for word in words {
            assert!(errors.contains(word), "{arguments:?}: {errors}");
        }
    }
    // Nothing has changed.
    let mut names: Vec<_> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["bad.flash", "bad.toml", "file"]);
    assert_eq!(fs::read_to_string(folder.path().join("file")).unwrap(), "precious");
}

#[test]
fn a_flash_file_survives_a_killed_process() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--tcp", "127.0.0.1:0", "--json", "--flash", "flash"];
    let mut serve = serving(folder.path(), &arguments);
    let mut client = connect(tcp(&ready(&serve.line()), 0));
    assert_eq!(ask(&mut client, "@01\r@0i\r", 2), "00");
    assert_eq!(ask(&mut client, "0100,900\r9\r", 2), "00");
    serve.signal(Signal::KILL);
    serve.child.wait_in_time().unwrap();
    // The link of the killed one leads nowhere and is replaced.
    let mut serve = serving(folder.path(), &arguments);
    let mut client = connect(tcp(&ready(&serve.line()), 0));
    assert_eq!(serve.order("press start"), "ok");
    assert!(serve.order("run until idle").starts_with("idle at"));
    assert_eq!(ask(&mut client, "@0P\r", 19), "0000064000000000000");
}

/// A file that may have no more than so many bytes is as good as a full disk: the controller that cannot
/// store confirms nothing and ends, and the others go on.
#[test]
fn a_full_disk_ends_only_the_controller_that_cannot_store() {
    let folder = tempfile::tempdir().unwrap();
    let script = format!(
        "ulimit -f 1; trap '' XFSZ; exec {VIMC4} serve --json --tcp 127.0.0.1:0 --pty none --count 2 \
         --flash flash"
    );
    let mut bash = Command::new("bash");
    bash.args(["-c", &script]).current_dir(folder.path()).stderr(Stdio::piped());
    let mut serve = Process::start(&mut bash);
    let places = ready(&serve.line());
    let mut full = connect(tcp(&places, 0));
    assert_eq!(ask(&mut full, "@01\r@0i\r", 2), "00");
    let mut confirmed = 0;
    while full.write_all(b"0100,900\r").is_ok() && matches!(full.read(&mut [0]), Ok(1)) {
        confirmed += 1;
        assert!(confirmed < 1_000);
    }
    assert!(confirmed > 10, "{confirmed}");
    let errors = serve.errors();
    let said = errors.recv_timeout(LIMIT).unwrap();
    assert!(
        said.starts_with("controller 1 has ended, the others go on: cannot write flash file "),
        "{said}"
    );
    let mut other = connect(tcp(&places, 1));
    assert_eq!(ask(&mut other, "@01\r", 1), "0");
    serve.give("quit\n");
    assert_eq!(serve.ended().code(), Some(1));
    let rest = rest_of(&errors);
    assert!(rest.contains("cannot write flash file"), "{rest}");
}

#[test]
fn the_lists_and_the_version_are_printed() {
    let folder = tempfile::tempdir().unwrap();
    let text = |arguments: &[&str]| {
        let (code, out, errors) = run(folder.path(), arguments);
        assert_eq!(code, 0, "{arguments:?}: {errors}");
        out
    };
    assert!(text(&["models"]).lines().any(|line| line.starts_with("imc-s8 ")));
    assert!(text(&["machines"]).lines().any(|line| line.starts_with("bench ")));
    assert!(text(&["models", "show", "imc4"]).contains("name = \"imc4\""));
    assert!(text(&["machines", "show", "mill"]).contains("name = \"mill\""));
    let version = text(&["-V"]);
    assert!(version.starts_with("vimc4 0.1.0 (commit ") && version.lines().count() == 1);
    let features = if cfg!(feature = "api") { "api" } else { "none" };
    let long = text(&["--version"]);
    assert!(long.starts_with(&format!("{version}target: ")), "{long}");
    assert!(long.ends_with(&format!("\nfeatures: {features}\n")), "{long}");
    assert!(text(&["completions", "bash"]).contains("complete"));
    assert_eq!(run(folder.path(), &["models", "show", "imc5"]).0, 2);
    // A profile of one's own is shown, too, if it is one.
    for (what, name) in [("models", "smcu"), ("machines", "mill")] {
        let own = format!("# my own\n{}", text(&[what, "show", name]));
        std::fs::write(folder.path().join("own.toml"), &own).unwrap();
        assert_eq!(text(&[what, "show", "own.toml"]), own);
        std::fs::write(folder.path().join("own.toml"), own + "more = 1\n").unwrap();
        let (code, _, errors) = run(folder.path(), &[what, "show", "own.toml"]);
        assert_eq!(code, 2);
        assert!(errors.contains("more"));
    }
}

/// Gives all of it at once and ends the input; what is said until the end.
fn all_at_once(arguments: &[&str], orders: &str) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let none = ["--tcp", "127.0.0.1:0", "--pty", "none"];
    let mut serve = serving(folder.path(), &[&none[..], arguments].concat());
    serve.input.take().unwrap().write_all(orders.as_bytes()).unwrap();
    let mut said = String::new();
    serve.output.as_mut().unwrap().read_to_string(&mut said).unwrap();
    assert_eq!(serve.end(), (Some(0), String::new()));
    said.lines().skip_while(|line| *line != "ready").skip(1).map(str::to_owned).collect()
}

#[test]
fn what_was_ordered_before_quit_is_done() {
    let said = all_at_once(
        &["--model", "imc4-m", "--time", "manual"],
        "set probe 1\nadvance 1s\nposition\nhlep\nquit\n",
    );
    let wrong = "error: `hlep` is wrong: not an order; did you mean help? type help for the list";
    assert_eq!(said, ["ok", "now 1.000000000 s", "X 0 Y 0 Z 0 A 0", wrong]);
    // The end of the input ends it in the same way.
    let said = all_at_once(&["--time", "manual", "--until-stdin-closes"], "advance 1s\nposition\n");
    assert_eq!(said, ["now 1.000000000 s", "X 0 Y 0 Z 0 A 0"]);
    // Also by several, and in real time.
    let said = all_at_once(
        &["--model", "smcu", "--count", "2", "--time", "8x"],
        "2 set stop 1\n2 set stop 0\n3 position\n2 position\n1 run until idle\nquit\n",
    );
    assert_eq!(said[..2], ["2: ok", "2: ok"]);
    assert!(said[2].starts_with("error: `3 position` is wrong"), "{said:?}");
    assert_eq!(said[3], "2: X 0 Y 0 Z 0");
    assert!(said[4].starts_with("1: idle at "), "{said:?}");
}

#[test]
fn what_lasts_holds_up_no_other_order_and_says_which_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let mut serve = serving(folder.path(), &["--tcp", "127.0.0.1:0", "--json"]);
    let mut client = connect(tcp(&ready(&serve.line()), 0));
    let never = "this never happens unless something else does first; give the command or the \
                 order that leads there before";
    assert_eq!(serve.order("run until x 5"), format!("error: {never}"));
    assert!(serve.order("run until idle").starts_with("idle at "));
    assert_eq!(ask(&mut client, "@01\r", 1), "0");
    // Below the start-stop frequency nothing brakes. It would take minutes.
    client.write_all(b"@0A50000,300\r").unwrap();
    while serve.order("position") == "X 0 Y 0 Z 0 A 0" {}
    assert_eq!(serve.order("run until x 60000"), format!("error: {never}"));
    serve.give("run until x 49000\nposition\nrun until x 50000\nhlep\npress stop\nposition\n");
    // The answer of a later order says whose it is.
    let position = serve.line();
    assert!(position.starts_with("position: X "), "{position}");
    assert!(serve.line().starts_with("error: `hlep` is wrong"));
    // STOP is pressed although two lines wait, which then wait in vain.
    let never = |order| format!("error: {order}{never}");
    assert_eq!(serve.line(), never("run until x 49000: "));
    assert_eq!(serve.line(), never("run until x 50000: "));
    assert_eq!(serve.line(), "ok");
    assert!(serve.line().starts_with("X "));
    assert_eq!(ask(&mut client, "", 1), "F");
}

#[test]
fn the_end_of_the_input_leaves_nothing_behind_that_waits() {
    let orders = "run until command @A\nrun until signal start changes or line 7\nposition\n";
    let said = all_at_once(&["--until-stdin-closes"], orders);
    assert_eq!(said.len(), 3, "{said:?}");
    let given_up = |line: &String| line.contains("given up at ");
    assert_eq!(said.iter().filter(|line| given_up(line)).count(), 2, "{said:?}");
    // What comes by itself is waited for: a LPKF controller that homes when it is switched on.
    let said = all_at_once(
        &["--until-stdin-closes", "--model", "motionsystem", "--machine", "board-plotter"],
        "run until command PA\nrun until idle\n",
    );
    assert!(said.iter().any(|line| line.contains("idle at ")), "{said:?}");
}

#[test]
fn what_is_ordered_behind_quit_is_carried_out_as_long_as_something_is_awaited() {
    for (count, one, other) in [("1", "", ""), ("2", "1 ", "2 ")] {
        let folder = tempfile::tempdir().unwrap();
        let nowhere = ["--tcp", "127.0.0.1:0", "--pty", "none", "--count", count];
        let mut serve = serving(folder.path(), &nowhere);
        until_ready(&mut serve);
        serve.give(&format!("{one}run until signal start changes\nquit\n"));
        assert!(serve.order(&format!("{other}position")).contains("X 0 Y 0"));
        let colon = if one.is_empty() { "" } else { "1: " };
        let late = if one.is_empty() { "run until signal start changes: " } else { "" };
        let there = serve.order(&format!("{one}press start"));
        assert!(there.starts_with(&format!("{colon}{late}there at ")), "{there}");
        assert!(serve.line().starts_with(&format!("{colon}ok")));
        assert_eq!(serve.line(), "");
        assert_eq!(serve.end(), (Some(0), String::new()));
        // A second one ends at once.
        let mut serve = serving(folder.path(), &nowhere);
        serve.give(&format!("{one}run until command @A\nquit\n{one}quit\n"));
        assert_eq!(serve.end(), (Some(0), String::new()));
    }
}

#[test]
fn however_many_orders_wait_others_are_heard() {
    let folder = tempfile::tempdir().unwrap();
    let nowhere = ["--tcp", "127.0.0.1:0", "--pty", "none", "--count", "2"];
    let mut serve = serving(folder.path(), &nowhere);
    until_ready(&mut serve);
    serve.give(&"1 run until command @A\n".repeat(1_002));
    let wrong =
        "1: error: run until command @A: 1000 orders are awaited already; `cancel` gives them up";
    assert_eq!([serve.line(), serve.line()], [wrong, wrong]);
    assert_eq!(serve.order("1 position"), "1: position: X 0 Y 0 Z 0 A 0");
    assert!(serve.order("2 press stop").starts_with("2: ok, without effect"));
    serve.give("2 run until signal stop changes\n2 hold stop\n");
    assert!(serve.line().starts_with("2: there at "));
    assert_eq!(serve.line(), "2: ok");
    serve.give("1 cancel\n");
    let said: Vec<String> = (0..1_001).map(|_| serve.line()).collect();
    assert_eq!(said.iter().filter(|line| *line == "1: ok").count(), 1);
    let given_up = |line: &&String| line.contains("run until command @A: given up at ");
    assert_eq!(said.iter().filter(given_up).count(), 1_000);
    serve.give("1 run until command @A\nquit\nquit\n");
    assert_eq!(serve.end(), (Some(0), String::new()));
}

#[test]
fn an_answer_without_a_name_belongs_to_the_oldest_order_that_has_none() {
    for (count, one, colon) in [("1", "", ""), ("2", "1 ", "1: ")] {
        let folder = tempfile::tempdir().unwrap();
        let arguments =
            ["--tcp", "127.0.0.1:0", "--pty", "none", "--until-stdin-closes", "--count", count];
        let mut serve = serving(folder.path(), &arguments);
        until_ready(&mut serve);
        serve.give(&format!("{one}run until command @P\n"));
        let named = serve.order(&format!("{one}run until y 5"));
        assert!(named.starts_with(&format!("{colon}error: run until y 5: this never")), "{named}");
        serve.give(&format!("{one}run until command @P and x < 5\n{one}position\n"));
        assert_eq!(serve.line(), format!("{colon}position: X 0 Y 0 Z 0 A 0"));
        // What is refused as a line quotes it.
        assert!(serve.order(&format!("{one}hlep")).starts_with(&format!("{colon}error: `hlep`")));
        let (code, said, errors) = serve.finish();
        assert_eq!((code, errors.as_str()), (Some(0), ""));
        let [first, second] = said.lines().collect::<Vec<_>>()[..] else { panic!("{said}") };
        assert!(first.starts_with(&format!("{colon}error: run until command @P: given up at ")));
        let again = format!("{colon}error: run until command @P and x < 5: given up at ");
        assert!(second.starts_with(&again), "{second}");
    }
}

#[test]
fn each_line_of_an_answer_has_the_number_of_its_controller() {
    let said = all_at_once(&["--count", "2"], "2 signals\n1 help\nquit\n");
    let (second, first): (Vec<_>, Vec<_>) = said.iter().partition(|line| line.starts_with("2: "));
    assert!(second.len() > 10 && first.len() > 10, "{said:#?}");
    assert!(first.iter().all(|line| line.starts_with("1: ")), "{said:#?}");
}

#[test]
fn however_often_quit_is_said_what_was_ordered_before_is_answered() {
    let never_ends = "advance 90000000s\n";
    let orders = format!("position\ncover open\n{never_ends}quit\nquit\nquit\n");
    for time in ["real", "manual"] {
        for _ in 0..5 {
            let said = all_at_once(&["--time", time], &orders);
            assert_eq!(said[..2], ["X 0 Y 0 Z 0 A 0", "ok"], "{time}: {said:?}");
            assert_eq!(said.len(), 3, "{time}: {said:?}");
        }
    }
}

/// Waits until the pipe behind standard output takes no more.
fn fill(serve: &Process) {
    let mut before = 0;
    process::limits::until("the pipe fills", || {
        let pipe = serve.output.as_ref().unwrap().get_ref().get_ref();
        let now = rustix::io::ioctl_fionread(pipe).unwrap();
        std::thread::sleep(std::time::Duration::from_millis(100));
        now > 60_000 && std::mem::replace(&mut before, now) == now
    });
}

#[test]
fn answers_that_nobody_reads_hold_up_neither_clients_nor_signals() {
    for signal in [Signal::TERM, Signal::INT] {
        let folder = tempfile::tempdir().unwrap();
        let arguments = ["--tcp", "127.0.0.1:0", "--json"];
        let mut serve = serving(folder.path(), &arguments);
        let mut client = connect(tcp(&ready(&serve.line()), 0));
        assert_eq!(ask(&mut client, "@07\r", 1), "0");
        // More than a pipe holds, and than waits for one: from somewhere on orders are not read.
        let mut input = serve.input.take().unwrap();
        let writer = std::thread::spawn(move || {
            let _ = input.write_all("position\n".repeat(200_000).as_bytes());
        });
        fill(&serve);
        for _ in 0..100 {
            assert_eq!(ask(&mut client, "@0P\r", 19).len(), 19);
        }
        assert!(folder.path().join("vimc4.pty").is_symlink());
        serve.signal(signal);
        assert_eq!(serve.ended().code(), Some(0));
        assert!(!folder.path().join("vimc4.pty").is_symlink());
        joined("the end of the orders", writer);
        // What it had said is whole.
        let mut said = String::new();
        serve.output.as_mut().unwrap().read_to_string(&mut said).unwrap();
        assert!(said.lines().next().is_some_and(|line| line == "X 0 Y 0 Z 0 A 0"));
    }
}

#[test]
fn who_reads_late_gets_every_answer() {
    let folder = tempfile::tempdir().unwrap();
    let mut serve = serving(folder.path(), &["--tcp", "127.0.0.1:0", "--pty", "none"]);
    until_ready(&mut serve);
    let mut input = serve.input.take().unwrap();
    let writer = std::thread::spawn(move || {
        input.write_all(("position\n".repeat(20_000) + "quit\n").as_bytes()).unwrap();
    });
    fill(&serve);
    let mut said = String::new();
    serve.output.as_mut().unwrap().read_to_string(&mut said).unwrap();
    assert_eq!(said.lines().filter(|line| *line == "X 0 Y 0 Z 0 A 0").count(), 20_000);
    joined("the end of the orders", writer);
    assert_eq!(serve.end(), (Some(0), String::new()));
}

#[test]
fn a_condition_that_can_never_hold_is_refused_with_what_could() {
    let said = all_at_once(
        &["--model", "imc4", "--time", "manual"],
        "run until command @Z\nrun until answer error zz\nrun until port 99 bit 0 on\n\
         run until cover open\nhelp run until\nquit\n",
    );
    for (line, right) in said.iter().zip([
        "is wrong at `@Z`: what a command begins with: @axes, @A, ",
        "is wrong at `zz`: an error of this model: 1, 2, 3, 4, 5, 6, 7, 8, 9, D, F, G, H, R",
        "is wrong at `99 bit 0 on`: a port to read: 0, ",
        "is wrong at `cover open`: `signal cover is open`, if that is meant",
        "run until idle ",
    ]) {
        assert!(line.contains(right), "{right}: {said:#?}");
    }
    for form in
        ["outside x", "signal NAME changes", "signal NAME is VALUE", "at 1.5s", "answered TEXT"]
    {
        assert!(said.iter().any(|line| line.starts_with(form)), "{form}: {said:#?}");
    }
    // A number is the same with or without zeros before it.
    let said = all_at_once(
        &["--model", "smcu", "--time", "manual"],
        "run until answer error 9\nrun until answer error 99\nrun until line 1\nquit\n",
    );
    assert!(said[0].contains("this never happens unless"), "{said:#?}");
    assert!(said[1].contains("an error of this model: E00, E01, "), "{said:#?}");
    assert!(said[2].contains("this model stores no programs"), "{said:#?}");
}

#[test]
fn what_can_follow_is_listed_once_and_only_if_it_is_there() {
    let lines = |model: &str, orders: &str| {
        all_at_once(&["--model", model, "--time", "manual"], &format!("{orders}\nquit\n"))
    };
    for model in ["imc4", "motionsystem"] {
        let help = lines(model, "help run until");
        let axes = help.iter().find_map(|line| line.split_once("axes are ")).unwrap().1;
        let axes: Vec<_> = axes.split(", ").collect();
        let alone: std::collections::BTreeSet<_> = axes.iter().collect();
        assert_eq!(axes.len(), alone.len(), "{model}: {axes:?}");
        assert!(!help.iter().any(|line| line.ends_with(": none")), "{help:#?}");
        let has_ports = help.iter().any(|line| line.starts_with("port "));
        let follows = lines(model, "run until ?");
        assert_eq!(follows.iter().any(|line| line.starts_with("run until port")), has_ports);
    }
    let follows = lines("imc4", "run until ?");
    assert!(follows.iter().any(|line| line == "run until answer error  an error is answered"));
    for (begun, one) in [
        ("run until command ", "run until command @A"),
        ("run until answer error ", "run until answer error 2"),
        ("run until port 0 ", "run until port 0 bit 3"),
        ("help ", "help run until"),
    ] {
        let follows = lines("imc4", &format!("{begun}?"));
        assert!(follows.iter().any(|line| line.starts_with(one)), "{begun}: {follows:#?}");
    }
}

#[test]
fn a_line_that_is_too_long_is_no_order_whatever_it_ends_with() {
    let line = format!("{}quit", " x".repeat(500));
    let said = all_at_once(&["--time", "manual"], &format!("{line}\nposition\nquit\n"));
    assert_eq!(said.len(), 2, "{said:?}");
    assert!(said[0].starts_with("error: ` x x x"), "{said:?}");
    assert!(said[0].ends_with("…` is wrong: no order has 1000 characters"), "{said:?}");
    assert_eq!(said[1], "X 0 Y 0 Z 0 A 0");
}

#[test]
fn help_has_what_this_controller_has() {
    let help = |model: &str| all_at_once(&["--model", model, "--time", "manual"], "help\nquit\n");
    let smcu = help("smcu");
    assert_eq!(smcu[0], "press BUTTON          press and release at once: stop");
    for absent in ["key ", "cover", "erase", "estop", "input "] {
        assert!(!smcu.iter().any(|line| line.contains(absent)), "{absent}: {smcu:?}");
    }
    let imc4 = help("imc4").join("\n");
    for present in [
        "start, stop, on, cover-button, estop",
        "key test|auto",
        "cover open|closed",
        "input PORT.BIT 0|1    set a bit of an input port, as in `input 0.2 1`",
        "press ?",
        "\nerase ",
    ] {
        assert!(imc4.contains(present), "{present}: {imc4}");
    }
    // The panel of an iMC-xx does not erase.
    assert!(!help("imc-s8").iter().any(|line| line.starts_with("erase")));
    let numbered = all_at_once(&["--count", "2", "--time", "manual"], "help\nquit\n");
    assert!(numbered.last().unwrap().contains("as in `1 press start`"), "{numbered:?}");
}

#[test]
fn signals_are_set_by_the_words_that_signals_lists() {
    let said = all_at_once(
        &["--model", "imc4-m", "--time", "manual"],
        "set cover open\nset key test\nset cover 1\nset limit x- 1\nset in1 1\nset cover shut\n\
         set nothing 1\nset probe\nsignals\nquit\n",
    );
    assert_eq!(said[..4], ["ok"; 4]);
    assert_eq!(
        said[4..8],
        [
            "error: `set in1 1` is wrong at `in1 1`: in1 is called input 0.2, as in `input 0.2 1`",
            "error: `set cover shut` is wrong at `shut`: cover can be open or closed",
            "error: `set nothing 1` is wrong at `nothing 1`: there is no signal `nothing`; `signals` lists those \
             there are",
            "error: `set probe` is not finished: 0 or 1",
        ]
    );
}

#[test]
fn the_log_says_who_did_what_and_what_came_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["--tcp", "127.0.0.1:0", "--json", "--time", "manual", "-v", "--log", "traffic.log"];
    let mut serve = serving(folder.path(), &arguments);
    let ready = ready(&serve.line());
    let mut client = connect(tcp(&ready, 0));
    assert_eq!(ask(&mut client, "@01\rhello\r", 2), "05");
    client.write_all(b"@0A5000,900\r\xFD").unwrap();
    for order in ["advance 100ms", "press start", "key auto", "cover open", "power off"] {
        assert!(!serve.order(order).starts_with("error"), "{order}");
    }
    // Somebody else at the same time.
    let mut port = terminal(ready["controllers"][0]["pty"].as_str().unwrap());
    assert_eq!(serve.order("power on"), "ok");
    port.write_all(b"@07\r\xFE").unwrap();
    assert_eq!(ask(&mut client, "", 1), "F");
    assert_eq!(ask(&mut client, "", 1), "0");
    assert!(serve.order("erase").starts_with("ok: the memory is erased"));
    serve.signal(Signal::TERM);
    let (_, errors) = serve.end();
    let log = fs::read_to_string(folder.path().join("traffic.log")).unwrap();
    let who = format!("tcp {}: {}", tcp(&ready, 0), client.local_addr().unwrap());
    for text in [&errors, &log] {
        let mut rest = text.as_str();
        for line in [
            "hello  unknown or malformed command",
            "@0A5000,900  relative move",
            &format!("{who}: 253  stop: what moves brakes, and can be resumed"),
            "F  ",
            "standard input: press start",
            "        no effect: only the host can resume a stopped motion, with S (start_resumes_dnc)",
            "standard input: key auto",
            "        no effect: it was so already",
            "standard input: cover open",
            "standard input: power off",
            "standard input: power on",
            "pty: a client speaks",
            "@07  ",
            "pty: a client: 254  reset: everything as after power-on",
            "standard input: erase",
        ] {
            let Some((_, behind)) = rest.split_once(line) else { panic!("{line}: {text}") };
            rest = behind;
        }
    }
}

#[test]
fn the_log_knows_small_letters_and_what_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "--tcp",
        "127.0.0.1:0",
        "--json",
        "--time",
        "instant",
        "-v",
        "--model",
        "c142",
        "--machine",
        "mill",
    ];
    let mut serve = serving(folder.path(), &arguments);
    let ready = ready(&serve.line());
    let mut client = connect(tcp(&ready, 0));
    assert_eq!(ask(&mut client, "@07\r@0r7\r@0m5,900,5,900,0,900,0,900\r", 3), "000");
    assert_eq!(ask(&mut client, "@1P\r@07\r", 1), "0");
    serve.signal(Signal::TERM);
    let (_, errors) = serve.end();
    for line in [
        "@0m5,900,5,900,0,900,0,900  absolute move X to 5 at 900 Hz, Y to 5",
        "@1P  for controller 1, this one is 0",
    ] {
        assert!(errors.contains(line), "{line}: {errors}");
    }
    assert!(!errors.contains("malformed"), "{errors}");
}

#[test]
fn a_control_code_that_ends_nothing_is_said_to_have_no_effect() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["--tcp", "127.0.0.1:0", "--json", "-v"];
    let mut serve = serving(folder.path(), &arguments);
    let ready = ready(&serve.line());
    let mut client = connect(tcp(&ready, 0));
    assert_eq!(ask(&mut client, "@07\r", 1), "0");
    client.write_all(b"\xFD").unwrap();
    assert_eq!(ask(&mut client, "@07\r", 1), "0");
    assert_eq!(serve.order("power off"), "ok");
    client.write_all(b"\xFE").unwrap();
    assert!(serve.order("position").starts_with("X 0"));
    serve.signal(Signal::TERM);
    let (_, errors) = serve.end();
    let mut rest = errors.as_str();
    for line in [
        "253  stop",
        "        no effect: there is nothing that it could end",
        "254  reset",
        "        no effect: the power is off",
    ] {
        let Some((_, behind)) = rest.split_once(line) else { panic!("{line}: {errors}") };
        rest = behind;
    }
}
