//! The programs of the table, and what is tried with each.

use std::fs;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::thread;
use std::time::Duration;

use super::Outcome;
use super::bench::{Bench, CONVERSATION, Ended, Typed, Way, has, has_lines, source, until, write};
use super::process::limits::InTime;

/// What a cell says, and how it is known.
#[derive(Clone, Copy)]
pub(crate) enum Proof {
    /// A test shows it.
    Test(&'static str, fn(Way) -> Outcome),
    /// It was tried by hand with this version: by a test that runs only when it is asked for.
    ByHand(&'static str, &'static str, fn(Way) -> Outcome),
    /// There is nothing to connect in this way.
    None,
}

/// A row of the table.
pub(crate) struct Program {
    pub(crate) name: &'static str,
    /// What has to be there: a command of the shell that succeeds then, and what to say if not.
    needs: &'static [(&'static str, &'static str)],
    terminal: Proof,
    lines: Proof,
    tcp: Proof,
    rfc2217: Proof,
}

impl Program {
    /// What is missing here.
    pub(crate) fn lacks(&self) -> Option<&'static str> {
        self.needs.iter().find(|(command, _)| !has(command)).map(|(_, reason)| *reason)
    }

    pub(crate) fn cell(&self, way: Way) -> Proof {
        match way {
            Way::Terminal => self.terminal,
            Way::Lines => self.lines,
            Way::Tcp => self.tcp,
            Way::Rfc2217 => self.rfc2217,
        }
    }

    /// The text of a cell.
    pub(crate) fn says(&self, way: Way) -> String {
        match self.cell(way) {
            Proof::Test(text, _) => text.to_owned(),
            Proof::ByHand(text, on, _) => format!("{text} (by hand, on {on})"),
            Proof::None => "–".to_owned(),
        }
    }
}

/// What `vimc4 lines` lacks here, if anything.
pub(crate) fn lines_lack() -> Option<&'static str> {
    (!has_lines()).then_some("Linux 5.5 that lets `vimc4 lines` work")
}

const SERIAL: (&str, &str) = ("python3 -c 'import serial'", "python3 with pyserial");
const VISA: (&str, &str) = ("python3 -c 'import pyvisa, pyvisa_py'", "pyvisa and pyvisa-py");
const SOCAT: (&str, &str) = ("socat -V", "socat");
const MONO: (&str, &str) = ("mono --version && command -v mcs", "mono-mcs");
const NODE: (&str, &str) =
    ("NODE_PATH=$(npm root -g) node -e 'require(\"serialport\")'", "node with serialport");
const JAVA: (&str, &str) = ("javac -version", "a Java development kit");
const CC: (&str, &str) = (
    "printf 'int main(void) { return 0; }' | cc -static -x c -o /dev/null -",
    "a C compiler that links statically",
);
const SCRIPT: (&str, &str) = ("script --version", "script of util-linux");
const DOSBOX: (&str, &str) = ("dosbox -version", "dosbox");
const AS: (&str, &str) =
    ("as --32 -o /dev/null /dev/null && ld -m elf_i386 -v", "GNU as and ld for x86");

/// All rows.
#[expect(clippy::too_many_lines, reason = "it is a table")]
pub(crate) fn programs() -> Vec<Program> {
    use Proof::{ByHand, None, Test};
    const WINE: &str = "Wine 8.0";
    vec![
        Program {
            name: "pyserial",
            needs: &[SERIAL],
            terminal: Test("bytes; each of the six lines is an `OSError`", pyserial),
            lines: Test("yes, all six lines", pyserial),
            tcp: Test("yes; pyserial makes the lines up", pyserial),
            rfc2217: Test("yes, all six lines", pyserial),
        },
        Program {
            name: "PyVISA with pyvisa-py",
            needs: &[SERIAL, VISA],
            terminal: Test("yes", visa),
            lines: Test("yes", visa),
            tcp: Test("yes", visa),
            rfc2217: None,
        },
        Program {
            name: "Node: serialport, net",
            needs: &[NODE],
            terminal: Test("bytes; `set` and `get` fail", node),
            lines: Test("yes", node),
            tcp: Test("yes", node),
            rfc2217: None,
        },
        Program {
            name: "Mono: SerialPort, TcpClient",
            needs: &[MONO],
            terminal: Test("no: `Open` throws", mono),
            lines: Test("yes", mono),
            tcp: Test("yes", mono),
            rfc2217: None,
        },
        Program {
            name: "Java: files, Socket",
            needs: &[JAVA],
            terminal: Test("yes", java),
            lines: Test("yes", java),
            tcp: Test("yes", java),
            rfc2217: None,
        },
        Program {
            name: "C, linked statically: termios, sockets",
            needs: &[CC],
            terminal: Test("bytes; `TIOCMGET` and the others fail", c),
            lines: Test("yes", c),
            tcp: Test("yes", c),
            rfc2217: None,
        },
        Program {
            name: "Rust: serialport, TcpStream",
            needs: &[],
            terminal: Test("bytes; every call for a line fails", rust),
            lines: Test("yes", rust),
            tcp: Test("yes", rust),
            rfc2217: None,
        },
        Program {
            name: "socat",
            needs: &[SOCAT],
            terminal: Test("yes", socat),
            lines: Test("yes", socat),
            tcp: Test("yes", socat),
            rfc2217: None,
        },
        Program {
            name: "gensiot of gensio, the library of ser2net",
            needs: &[("command -v gensiot", "gensio-bin")],
            terminal: None,
            lines: None,
            tcp: None,
            rfc2217: Test("yes", gensiot),
        },
        Program {
            name: "ser2net, as a client",
            needs: &[("PATH=$PATH:/usr/sbin command -v ser2net", "ser2net"), SOCAT],
            terminal: None,
            lines: None,
            tcp: None,
            rfc2217: Test("yes", ser2net),
        },
        Program {
            name: "picocom",
            needs: &[("picocom --help", "picocom"), SCRIPT],
            terminal: Test("yes; `--lower-dtr` and `--lower-rts` end it", picocom),
            lines: Test("yes", picocom),
            tcp: None,
            rfc2217: None,
        },
        Program {
            name: "minicom",
            needs: &[("command -v minicom", "minicom"), SCRIPT],
            terminal: Test("yes", minicom),
            lines: Test("yes", minicom),
            tcp: None,
            rfc2217: None,
        },
        Program {
            name: "screen",
            needs: &[("command -v screen", "screen")],
            terminal: Test("yes", screen),
            lines: Test("yes", screen),
            tcp: None,
            rfc2217: None,
        },
        Program {
            name: "QEMU, a guest at COM1",
            needs: &[("qemu-system-i386 --version", "qemu-system-x86"), AS],
            terminal: Test("yes", qemu),
            lines: Test("yes", qemu),
            tcp: Test("yes", qemu),
            rfc2217: None,
        },
        Program {
            name: "DOSBox, the registers of the 8250",
            needs: &[DOSBOX, AS],
            terminal: Test("yes", dosbox_8250),
            lines: Test("yes", dosbox_8250),
            tcp: Test("yes", dosbox_8250),
            rfc2217: None,
        },
        Program {
            name: "DOSBox, INT 14h",
            needs: &[DOSBOX, AS],
            terminal: Test("no: it waits for DSR and CTS", dosbox_bios),
            lines: Test("yes", dosbox_bios),
            tcp: Test("yes", dosbox_bios),
            rfc2217: None,
        },
        Program {
            name: "Wine",
            needs: &[
                ("command -v wine", "wine"),
                ("command -v x86_64-w64-mingw32-gcc", "gcc-mingw-w64-x86-64"),
            ],
            terminal: ByHand(
                "bytes; `EscapeCommFunction`, `GetCommModemStatus` and a `WaitCommEvent` that has \
                 to wait fail",
                WINE,
                wine,
            ),
            lines: ByHand("yes", WINE, wine_with_lines),
            tcp: None,
            rfc2217: None,
        },
    ]
}

// --- libraries ---

const NO_LINES: &str = "Inappropriate ioctl";

/// How the lines are with `vimc4 lines`, as every client prints it.
const LINES: &str = "CTS 1 DSR 1 DCD 0";

type Run = Result<Ended, Box<dyn std::error::Error>>;

/// Runs a client of this folder.
fn client(bench: &Bench, interpreter: &str, file: &str, arguments: &[&str]) -> Run {
    let line = format!("{interpreter} {} {}", source(file).display(), arguments.join(" "));
    bench.run(&mut bench.host(&line))
}

/// The code that the guide prints in this language under this heading.
fn code(bench: &Bench, heading: &str, language: &str) -> Result<String, String> {
    let section = super::GUIDE.split(&format!("\n## {heading}\n")).nth(1).unwrap_or_default();
    let code = section.split(&format!("```{language}\n")).nth(1);
    let code = code.and_then(|rest| rest.split("```").next());
    code.map(|code| bench.here(code)).ok_or(format!("docs/connect.md has no code in {heading}"))
}

/// What the guide prints in Python works as it stands.
fn python_recipe(bench: &Bench, heading: &str) -> Outcome {
    write(bench, "recipe.py", &code(bench, heading, "python")?)?;
    let ended = bench.run(&mut bench.host("python3 recipe.py"))?;
    if ended.success { Ok(()) } else { Err(ended.to_string().into()) }
}

fn pyserial(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    if way == Way::Tcp {
        let url = format!("socket://{}", bench.address());
        return client(&bench, "python3", "client.py", &[&url, "lines"])?.held("CTS 1 DSR 1 DCD 1");
    }
    if way == Way::Rfc2217 {
        let url = bench.recipe("port = serial.serial_for_url(\"rfc2217://")?;
        let url = url.split('"').nth(1).unwrap_or_default();
        return client(&bench, "python3", "client.py", &[url, "lines"])?.held(LINES);
    }
    python_recipe(&bench, "pyserial")?;
    let ended = client(&bench, "python3", "client.py", &[&bench.link(), "lines"])?;
    if way == Way::Lines {
        return ended.held(LINES);
    }
    for line in ["dtr", "rts", "cts", "dsr", "dcd", "ri"] {
        ended.failed(CONVERSATION, &format!("{line}: {NO_LINES}"))?;
    }
    Ok(())
}

fn gensiot(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let mut program = Typed::at(&mut bench.shell(&bench.recipe("gensiot ")?))?;
    program.converses()?;
    program.ends().map(drop)
}

/// What ser2net passes on is an ordinary socket, at which socat is typed.
fn ser2net(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let free = TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
    let line = bench.recipe("ser2net -n ")?.replace("4005", &free.to_string());
    let line = format!("env PATH=$PATH:/usr/sbin {line}");
    let _passes_on = Typed::at(&mut bench.shell(&line))?;
    // It passes on one connection at a time, so none is made only to see whether it listens.
    let line = format!("socat - tcp:127.0.0.1:{free},retry=300,interval=0.1");
    let mut program = Typed::at(&mut bench.shell(&line))?;
    program.converses()?;
    program.ends().map(drop)
}

fn visa(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let resource = match way {
        Way::Terminal | Way::Lines => {
            python_recipe(&bench, "LabVIEW, PyVISA and other VISA software")?;
            bench.recipe("ASRL")?
        }
        Way::Tcp | Way::Rfc2217 => bench.recipe("TCPIP0::")?,
    };
    client(&bench, "python3", "client.py", &[&resource])?.held("")
}

fn node(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let interpreter = "env NODE_PATH=\"$(npm root -g)\" node";
    if way == Way::Tcp {
        return client(&bench, interpreter, "client.js", &[&bench.address()])?.held("");
    }
    let ended = client(&bench, interpreter, "client.js", &[&bench.link(), "lines"])?;
    if way == Way::Lines {
        return ended.held(LINES);
    }
    ended.failed(CONVERSATION, &format!("{NO_LINES} for device, cannot set"))?;
    ended.failed(CONVERSATION, &format!("{NO_LINES} for device, cannot get"))
}

fn mono(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let compiler = format!("mcs -r:System.dll -out:client.exe {}", source("client.cs").display());
    let compiled = bench.run(&mut bench.shell(&compiler))?;
    if !compiled.success {
        return Err(compiled.to_string().into());
    }
    let lines = if way == Way::Lines { "lines" } else { "" };
    let line = format!("mono client.exe {} {lines}", bench.place());
    let ended = bench.run(&mut bench.host(&line))?;
    match way {
        Way::Terminal => ended.failed("", NO_LINES),
        Way::Lines => ended.held(LINES),
        Way::Tcp | Way::Rfc2217 => ended.held(""),
    }
}

fn java(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    client(&bench, "java", "Client.java", &[&bench.place()])?.held("")
}

fn c(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let compile = |file: &str| -> Outcome {
        let compiler = format!("cc -Wall -Werror -static -o client {file}");
        let compiled = bench.run(&mut bench.shell(&compiler))?;
        if compiled.success { Ok(()) } else { Err(compiled.to_string().into()) }
    };
    if way != Way::Tcp {
        // What the guide prints, as a program.
        let code = format!(
            "#define _DEFAULT_SOURCE\n#include <fcntl.h>\n#include <termios.h>\n\
             #include <unistd.h>\nint main(void) {{\n{}return answer != '0';\n}}\n",
            code(&bench, "C and termios", "c")?
        );
        write(&bench, "recipe.c", &code)?;
        compile("recipe.c")?;
        let ended = bench.run(&mut bench.host("./client"))?;
        if !ended.success {
            return Err(ended.to_string().into());
        }
    }
    compile(&source("client.c").display().to_string())?;
    let lines = if way == Way::Tcp { "" } else { "lines" };
    let ended = bench.run(&mut bench.host(&format!("./client {} {lines}", bench.place())))?;
    match way {
        Way::Terminal => ended.failed(CONVERSATION, NO_LINES),
        Way::Lines => ended.held(LINES),
        Way::Tcp | Way::Rfc2217 => ended.held(""),
    }
}

/// The variable that makes this program the Rust client: where it connects to.
pub(crate) const CLIENT: &str = "VIMC4_TEST_CLIENT";

trait Port: Read + Write {}
impl<P: Read + Write + ?Sized> Port for P {}

fn converse(port: &mut (impl Port + ?Sized)) -> std::io::Result<()> {
    let mut ask = |line: &[u8], count| {
        let mut answer = vec![0; count];
        port.write_all(line)?;
        port.read_exact(&mut answer)?;
        print!("{}", String::from_utf8_lossy(&answer));
        std::io::stdout().flush()
    };
    ask(b"@01\r", 1)?;
    ask(b"@0A20000,10000\r", 0)?;
    thread::sleep(Duration::from_millis(300));
    ask(b"\xfd", 1)?;
    ask(b"@0S\r", 1)?;
    ask(b"@0P\r", 19)?;
    println!();
    Ok(())
}

/// A host program in Rust; it prints what the others print.
pub(crate) fn rust_client(name: &str) -> ExitCode {
    let run = || -> Outcome {
        if name.contains(':') {
            return Ok(converse(&mut TcpStream::connect(name)?)?);
        }
        let port = serialport::new(name, 19_200).timeout(Duration::from_secs(5));
        let mut port = port.open_native()?;
        converse(&mut port)?;
        let port: &mut dyn serialport::SerialPort = &mut port;
        port.write_data_terminal_ready(false)?;
        port.write_request_to_send(true)?;
        let (cts, dsr) = (port.read_clear_to_send()?, port.read_data_set_ready()?);
        let dcd = port.read_carrier_detect()?;
        println!("CTS {} DSR {} DCD {}", u8::from(cts), u8::from(dsr), u8::from(dcd));
        Ok(())
    };
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn rust(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let program = std::env::current_exe()?;
    let mut host = bench.host(&program.display().to_string());
    let ended = bench.run(host.env(CLIENT, bench.place()))?;
    match way {
        // What `ENOTTY` is to this library.
        Way::Terminal => ended.failed(CONVERSATION, "Not a typewriter"),
        Way::Lines => ended.held(LINES),
        Way::Tcp | Way::Rfc2217 => ended.held(""),
    }
}

// --- terminal programs ---

fn socat(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let begins = if way == Way::Tcp { "socat - tcp:" } else { "socat - /home" };
    // Without `crnl` here: a pipe, unlike a terminal, sends CR itself.
    let line = bench.recipe(begins)?.replace(",crnl", "");
    let mut socat = Typed::at(&mut bench.host(&line))?;
    socat.converses()?;
    socat.ends()?;
    Ok(())
}

fn picocom(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let line = bench.recipe("picocom ")?;
    let options: &[&str] = match way {
        Way::Lines => &["", " --lower-dtr --lower-rts"],
        Way::Terminal | Way::Tcp | Way::Rfc2217 => &[""],
    };
    for options in options {
        let mut picocom = Typed::on_a_screen(&bench, &bench.by_way(&(line.clone() + options)))?;
        picocom.shows("Terminal ready\r\n")?;
        bench.anew()?;
        picocom.converses()?;
        picocom.types(b"\x01\x18")?;
        if !picocom.ends()? {
            return Err("picocom ended badly".into());
        }
    }
    if way == Way::Terminal {
        for option in ["--lower-dtr", "--lower-rts"] {
            let picocom = Typed::on_a_screen(&bench, &format!("{line} {option}"))?;
            picocom.shows("FATAL: failed to lower ")?;
            if picocom.ends()? {
                return Err(format!("picocom {option} ended well").into());
            }
        }
    }
    Ok(())
}

fn minicom(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let captured = bench.folder().join("captured");
    let line = format!("{} -C {}", bench.recipe("minicom ")?, captured.display());
    let mut minicom = Typed::on_a_screen(&bench, &bench.by_way(&line))?;
    minicom.shows("Press CTRL-A Z for help")?;
    minicom.types(b"@01\r@0A500,9000\r@0P\r")?;
    minicom.shows("0001F4000000000000")?;
    // Leave without resetting the line, and confirm.
    minicom.types(b"\x01q")?;
    minicom.shows("without reset")?;
    minicom.types(b"\r")?;
    minicom.ends()?;
    is(fs::read_to_string(&captured)?.trim_end(), "0000001F4000000000000")
}

fn screen(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let sockets = bench.folder().join("s");
    fs::create_dir(&sockets)?;
    fs::set_permissions(&sockets, fs::Permissions::from_mode(0o700))?;
    // As the guide has it, but without a terminal of its own.
    let line = bench.recipe("screen ")?.replacen("screen", "screen -DmS vimc4", 1);
    let _screen = Typed::at(bench.host(&line).env("SCREENDIR", &sockets))?;
    let tell = |order: &[&str]| {
        let mut screen = bench.command("screen");
        screen.args(["-S", "vimc4", "-p0", "-X"]).args(order).env("SCREENDIR", &sockets);
        screen.output_in_time().is_ok_and(|output| output.status.success())
    };
    until("screen is there", || tell(&["stuff", "@01\r"]))?;
    let copy = bench.folder().join("copy");
    let shows = |text: &str| {
        let read = || fs::read_to_string(&copy).unwrap_or_default();
        let so = || {
            tell(&["hardcopy", &copy.display().to_string()]);
            read().trim_end() == text
        };
        until(text, so).map_err(|_| format!("instead of {text}: {:?}", read()))
    };
    shows("0")?;
    tell(&["stuff", "@0A500,9000\r@0P\r"]);
    shows("0000001F4000000000000")?;
    tell(&["quit"]);
    Ok(())
}

// --- computers ---

/// Assembles the program for DOS or for a computer without one.
fn assemble(bench: &Bench, name: &str, symbols: &[&str], at: &str) -> Outcome {
    let mut assembler = bench.command("as");
    assembler.args(["--32", "-o", "serial.o"]).arg(source("serial.s"));
    for symbol in symbols {
        assembler.args(["--defsym", symbol]);
    }
    let mut linker = bench.command("ld");
    linker.args(["-m", "elf_i386", "--oformat", "binary", "-e", "0", "-Ttext", at]);
    linker.args(["-o", name, "serial.o"]);
    for command in [&mut assembler, &mut linker] {
        let ended = bench.run(command)?;
        if !ended.success {
            return Err(ended.to_string().into());
        }
    }
    Ok(())
}

fn is(printed: &str, expected: &str) -> Outcome {
    match printed == expected {
        true => Ok(()),
        false => Err(format!("{printed:?} instead of {expected:?}").into()),
    }
}

/// A computer whose only program is the conversation.
fn qemu(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    assemble(&bench, "boot.img", &["BOOT=1"], "0x7c00")?;
    let computer = "-display none -nodefaults -no-reboot -m 1 -debugcon stdio \
                    -device isa-debug-exit,iobase=0xf4 -drive file=boot.img,format=raw,if=floppy";
    let port = if way == Way::Tcp { "-serial tcp:" } else { "-chardev serial," };
    let line = bench.recipe(&format!("qemu-system-i386 … {port}"))?.replace('…', computer);
    let ended = bench.run(&mut bench.host(&line))?;
    // `isa-debug-exit` never ends with 0.
    is(&ended.printed, CONVERSATION).map_err(|error| format!("{error}: {ended}").into())
}

/// What a program in DOSBox prints, with this line as its COM1.
fn dosbox(
    bench: &Bench,
    symbols: &[&str],
    serial: &str,
) -> Result<String, Box<dyn std::error::Error>> {
    assemble(bench, "SERIAL.COM", symbols, "0x100")?;
    bench.anew()?;
    let _ = fs::remove_file(bench.folder().join("OUT.TXT"));
    let folder = bench.folder().display();
    let settings = format!(
        "[mixer]\nnosound=true\n[midi]\nmididevice=none\n[serial]\n{serial}\n\
         [autoexec]\nmount c \"{folder}\"\nc:\nSERIAL > OUT.TXT\nexit\n"
    );
    write(bench, "dosbox.conf", &settings)?;
    let mut dosbox = bench.host("dosbox -conf dosbox.conf");
    dosbox.env("SDL_VIDEODRIVER", "dummy").env("SDL_AUDIODRIVER", "dummy");
    let ended = bench.run(&mut dosbox)?;
    let printed = fs::read(bench.folder().join("OUT.TXT"));
    let printed = printed.map_err(|error| format!("OUT.TXT: {error}; {ended}"))?;
    Ok(String::from_utf8_lossy(&printed).into_owned())
}

/// The guide's line for DOSBox.
fn dosbox_recipe(bench: &Bench) -> Result<String, String> {
    bench.recipe(match bench.way {
        Way::Terminal | Way::Lines => "serial1=directserial ",
        Way::Tcp | Way::Rfc2217 => "serial1=nullmodem ",
    })
}

fn dosbox_8250(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let recipe = dosbox_recipe(&bench)?;
    is(&dosbox(&bench, &[], &recipe)?, CONVERSATION)?;
    if way == Way::Tcp {
        // With `usedtr` the connection comes with DTR, too late for what is sent at once, and
        // without `transparent` the lines go as bytes of their own: the first command is spoilt.
        is(&dosbox(&bench, &[], &format!("{recipe} usedtr:1"))?, "?")?;
        let printed = dosbox(&bench, &[], &recipe.replace(" transparent:1", ""))?;
        if printed.starts_with('0') {
            return Err(format!("without transparent:1 it printed {printed}").into());
        }
    } else {
        // A path that does not begin in /dev is not a port: the registers read 255.
        let absolute = recipe.replace("../", "/");
        is(&dosbox(&bench, &[], &absolute)?, &"\u{fffd}".repeat(CONVERSATION.len()))?;
    }
    Ok(())
}

fn dosbox_bios(way: Way) -> Outcome {
    let mut bench = Bench::new(way)?;
    let recipe = dosbox_recipe(&bench)?;
    let printed = dosbox(&bench, &["BIOS=1"], &recipe)?;
    is(&printed, if way == Way::Terminal { "!" } else { CONVERSATION })?;
    if way == Way::Lines {
        // DOSBox's BIOS takes a carrier for a failure.
        bench.options = "--dcd";
        is(&dosbox(&bench, &["BIOS=1"], &recipe)?, "!")?;
    }
    Ok(())
}

// --- Wine ---

/// A Windows of its own in the folder, ended with the test.
struct Wine<'b>(&'b Bench);

impl Drop for Wine<'_> {
    fn drop(&mut self) {
        let _ = self.with(self.0.shell("wineserver -k")).status_in_time();
    }
}

impl Wine<'_> {
    fn new(bench: &Bench) -> Result<Wine<'_>, Box<dyn std::error::Error>> {
        let wine = Wine(bench);
        let compiler = "x86_64-w64-mingw32-gcc -O -o client.exe ";
        let compiler = bench.shell(&format!("{compiler}{}", source("windows.c").display()));
        wine.does(compiler)?;
        wine.does(bench.shell("wineboot -i"))?;
        wine.does(bench.shell("wineserver -w"))?;
        Ok(wine)
    }

    /// The prefix is `~/.wine`, as in the guide.
    fn with(&self, mut command: Command) -> Command {
        command.env("WINEDEBUG", "-all").env("WINEARCH", "win64");
        command.env("WINEDLLOVERRIDES", "mscoree=;mshtml=").env_remove("WINEPREFIX");
        command
    }

    fn does(&self, command: Command) -> Outcome {
        let ended = self.0.run(&mut self.with(command))?;
        if ended.success { Ok(()) } else { Err(ended.to_string().into()) }
    }

    /// Runs a line, and ends Wine as the guide has it.
    fn cold(&self, line: &str) -> Outcome {
        self.does(self.0.shell(line))?;
        self.0.run(&mut self.with(self.0.shell("wineserver -k")))?;
        // There is no word for "it has ended" but that the next one is another.
        thread::sleep(Duration::from_secs(1));
        Ok(())
    }

    fn client(&self, arguments: &str) -> Run {
        self.0.anew()?;
        self.0.run(&mut self.with(self.0.host(&format!("wine client.exe {arguments}"))))
    }

    /// Where a COM port leads to.
    fn leads_to(&self, port: &str) -> String {
        let link = self.0.folder().join(".wine/dosdevices").join(port);
        fs::read_link(link).map(|to| to.display().to_string()).unwrap_or_default()
    }
}

fn wine(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let wine = Wine::new(&bench)?;
    let link = bench.link();
    // A link of a low number lasts until Wine starts anew, where the computer has a port.
    wine.does(bench.shell(&format!("ln -sf {link} .wine/dosdevices/com1")))?;
    wine.cold("wine cmd /c ver")?;
    if Path::new("/dev/ttyS0").exists() {
        is(&wine.leads_to("com1"), "/dev/ttyS0")?;
    }
    // A high number stays.
    wine.does(bench.shell(&bench.recipe("ln -sf ")?))?;
    wine.cold("wine cmd /c ver")?;
    wine.client("com50")?.held("")?;
    // So does what the registry says.
    wine.cold(&bench.recipe("wine reg add ")?)?;
    wine.client("com1")?.held("")?;
    is(&wine.leads_to("com1"), &link)?;
    let ended = wine.client("com1 lines")?;
    for failure in [
        "EscapeCommFunction: error 50",
        "GetCommModemStatus: error 50",
        "WaitCommEvent RXCHAR: error 995",
        "WaitCommEvent CTS DSR RXCHAR: error 50",
        "WaitCommEvent CTS DSR: error 50",
    ] {
        ended.failed(CONVERSATION, failure)?;
    }
    // Without an emulator, and when it is back.
    let terminal = fs::read_link(&link)?;
    fs::remove_file(&link)?;
    wine.client("com1")?.failed("", "GetCommState: error 1\n")?;
    wine.client("com50")?.failed("", "CreateFile: error 2\n")?;
    wine.client("com77")?.failed("", "CreateFile: error 2\n")?;
    std::os::unix::fs::symlink(terminal, &link)?;
    wine.client("com1")?.held("")?;
    wine.client("com50")?.held("")
}

fn wine_with_lines(way: Way) -> Outcome {
    let bench = Bench::new(way)?;
    let wine = Wine::new(&bench)?;
    wine.cold(&bench.recipe("ln -sf ")?)?;
    wine.client("com50 lines")?.held(
        "EscapeCommFunction\n\
         GetCommModemStatus: 30\n\
         WaitCommEvent RXCHAR: 1\n\
         WaitCommEvent CTS DSR RXCHAR: 1\n\
         WaitCommEvent CTS DSR: 0",
    )
}
