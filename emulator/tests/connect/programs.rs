//! The programs of the table, and what is tried with each.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::{Command, ExitCode};
use std::thread;
use std::time::Duration;

use super::Outcome;
use super::bench::{Bench, CONVERSATION, Ended, Typed, has, source, until, write};

/// How a program is connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    /// To the pseudo-terminal.
    Terminal,
    /// By TCP.
    Tcp,
}

impl Way {
    pub(crate) const ALL: [Way; 2] = [Way::Terminal, Way::Tcp];

    /// The head of the column.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Way::Terminal => "terminal",
            Way::Tcp => "TCP",
        }
    }
}

/// What a cell says, and how it is known.
#[derive(Clone, Copy)]
pub(crate) enum Proof {
    /// A test shows it.
    Test(&'static str, fn() -> Outcome),
    /// It was tried by hand with this version: by a test that runs only when it is asked for.
    ByHand(&'static str, &'static str, fn() -> Outcome),
    /// There is nothing to connect in this way.
    None,
}

/// A row of the table.
pub(crate) struct Program {
    pub(crate) name: &'static str,
    /// What has to be there: a command of the shell that succeeds then, and what to say if not.
    needs: &'static [(&'static str, &'static str)],
    pub(crate) cells: Vec<(Way, Proof)>,
}

impl Program {
    /// What is missing here.
    pub(crate) fn lacks(&self) -> Option<&'static str> {
        self.needs.iter().find(|(command, _)| !has(command)).map(|(_, reason)| *reason)
    }

    /// The text of a cell.
    pub(crate) fn says(&self, way: Way) -> String {
        match self.cells.iter().find(|(of, _)| *of == way) {
            Some((_, Proof::Test(text, _))) => (*text).to_owned(),
            Some((_, Proof::ByHand(text, on, _))) => format!("{text} (by hand, on {on})"),
            Some((_, Proof::None)) | None => "–".to_owned(),
        }
    }
}

const SERIAL: (&str, &str) = ("python3 -c 'import serial'", "python3 with pyserial");
const VISA: (&str, &str) = ("python3 -c 'import pyvisa, pyvisa_py'", "pyvisa and pyvisa-py");
const SOCAT: (&str, &str) = ("socat -V", "socat");
const MONO: (&str, &str) = ("mono --version && command -v mcs", "mono-mcs");
const NODE: (&str, &str) =
    ("NODE_PATH=$(npm root -g) node -e 'require(\"serialport\")'", "node with serialport");
const JAVA: (&str, &str) = ("javac -version", "a Java development kit");
const SCRIPT: (&str, &str) = ("script --version", "script of util-linux");
const AS: (&str, &str) =
    ("as --32 -o /dev/null /dev/null && ld -m elf_i386 -v", "GNU as and ld for x86");

/// All rows.
pub(crate) fn programs() -> Vec<Program> {
    use Proof::{ByHand, None, Test};
    use Way::{Tcp, Terminal};
    vec![
        Program {
            name: "pyserial",
            needs: &[SERIAL],
            cells: vec![
                (Terminal, Test("bytes; each of the six lines is an `OSError`", pyserial_terminal)),
                (Tcp, Test("yes; the lines are pyserial's invention", pyserial_tcp)),
            ],
        },
        Program {
            name: "PyVISA with pyvisa-py",
            needs: &[SERIAL, VISA],
            cells: vec![(Terminal, Test("yes", visa_terminal)), (Tcp, Test("yes", visa_tcp))],
        },
        Program {
            name: "Node: serialport, net",
            needs: &[NODE],
            cells: vec![
                (Terminal, Test("bytes; `set` and `get` fail", node_terminal)),
                (Tcp, Test("yes", node_tcp)),
            ],
        },
        Program {
            name: "Mono: SerialPort, TcpClient",
            needs: &[MONO],
            cells: vec![
                (Terminal, Test("no: `Open` throws", mono_terminal)),
                (Tcp, Test("yes", mono_tcp)),
            ],
        },
        Program {
            name: "Java: files, Socket",
            needs: &[JAVA],
            cells: vec![(Terminal, Test("yes", java_terminal)), (Tcp, Test("yes", java_tcp))],
        },
        Program {
            name: "Rust: serialport, TcpStream",
            needs: &[],
            cells: vec![
                (Terminal, Test("bytes; every call for a line fails", rust_terminal)),
                (Tcp, Test("yes", rust_tcp)),
            ],
        },
        Program {
            name: "socat",
            needs: &[SOCAT],
            cells: vec![(Terminal, Test("yes", socat_terminal)), (Tcp, Test("yes", socat_tcp))],
        },
        Program {
            name: "picocom",
            needs: &[("picocom --help", "picocom"), SCRIPT],
            cells: vec![
                (Terminal, Test("yes; `--lower-dtr` and `--lower-rts` end it", picocom_terminal)),
                (Tcp, None),
            ],
        },
        Program {
            name: "minicom",
            needs: &[("command -v minicom", "minicom"), SCRIPT],
            cells: vec![(Terminal, Test("yes", minicom_terminal)), (Tcp, None)],
        },
        Program {
            name: "screen",
            needs: &[("command -v screen", "screen"), SCRIPT],
            cells: vec![(Terminal, Test("yes", screen_terminal)), (Tcp, None)],
        },
        Program {
            name: "QEMU, a guest at COM1",
            needs: &[("qemu-system-i386 --version", "qemu-system-x86"), AS],
            cells: vec![(Terminal, Test("yes", qemu_terminal)), (Tcp, Test("yes", qemu_tcp))],
        },
        Program {
            name: "DOSBox, the registers of the 8250",
            needs: &[("dosbox -version", "dosbox"), AS],
            cells: vec![
                (Terminal, Test("yes", dosbox_8250_terminal)),
                (Tcp, Test("yes", dosbox_8250_tcp)),
            ],
        },
        Program {
            name: "DOSBox, INT 14h",
            needs: &[("dosbox -version", "dosbox"), AS],
            cells: vec![
                (Terminal, Test("no: it waits for DSR and CTS", dosbox_bios_terminal)),
                (Tcp, Test("yes", dosbox_bios_tcp)),
            ],
        },
        Program {
            name: "Wine",
            needs: &[
                ("command -v wine", "wine"),
                ("command -v x86_64-w64-mingw32-gcc", "gcc-mingw-w64-x86-64"),
            ],
            cells: vec![
                (
                    Terminal,
                    ByHand(
                        "bytes; `EscapeCommFunction`, `GetCommModemStatus` and waiting \
                         `WaitCommEvent` fail",
                        "Wine 8.0",
                        wine_terminal,
                    ),
                ),
                (Tcp, None),
            ],
        },
    ]
}

// --- libraries ---

const NO_LINES: &str = "Inappropriate ioctl";

type Run = Result<Ended, Box<dyn std::error::Error>>;

/// Runs a client of this folder.
fn client(bench: &Bench, interpreter: &str, file: &str, arguments: &[&str]) -> Run {
    let line = format!("{interpreter} {} {}", source(file).display(), arguments.join(" "));
    bench.run(&mut bench.shell(&line))
}

/// What the guide prints in Python works as it stands.
fn python_recipe(bench: &Bench, heading: &str) -> Outcome {
    let section = super::GUIDE.split(&format!("\n## {heading}\n")).nth(1).unwrap_or_default();
    let code = section.split("```python\n").nth(1).and_then(|rest| rest.split("```").next());
    write(bench, "recipe.py", &bench.here(code.ok_or("docs/connect.md has no such recipe")?))?;
    let ended = bench.run(bench.command("python3").arg("recipe.py"))?;
    if ended.success { Ok(()) } else { Err(ended.to_string().into()) }
}

fn pyserial_terminal() -> Outcome {
    let bench = Bench::new()?;
    python_recipe(&bench, "pyserial")?;
    let ended = client(&bench, "python3", "client.py", &[&bench.link(), "lines"])?;
    for line in ["dtr", "rts", "cts", "dsr", "dcd", "ri"] {
        ended.failed(CONVERSATION, &format!("{line}: {NO_LINES}"))?;
    }
    Ok(())
}

fn pyserial_tcp() -> Outcome {
    let bench = Bench::new()?;
    let url = format!("socket://{}", bench.address());
    client(&bench, "python3", "client.py", &[&url, "lines"])?.held("CTS 1 DSR 1 DCD 1")
}

fn visa_terminal() -> Outcome {
    let bench = Bench::new()?;
    python_recipe(&bench, "LabVIEW, PyVISA and other VISA software")?;
    let resource = bench.recipe("ASRL")?;
    client(&bench, "python3", "client.py", &[&resource])?.held("")
}

fn visa_tcp() -> Outcome {
    let bench = Bench::new()?;
    let resource = bench.recipe("TCPIP0::")?;
    client(&bench, "python3", "client.py", &[&resource])?.held("")
}

const NODE_WITH_SERIALPORT: &str = "env NODE_PATH=\"$(npm root -g)\" node";

fn node_terminal() -> Outcome {
    let bench = Bench::new()?;
    let ended = client(&bench, NODE_WITH_SERIALPORT, "client.js", &[&bench.link(), "lines"])?;
    ended.failed(CONVERSATION, &format!("{NO_LINES} for device, cannot set"))?;
    ended.failed(CONVERSATION, &format!("{NO_LINES} for device, cannot get"))
}

fn node_tcp() -> Outcome {
    let bench = Bench::new()?;
    client(&bench, NODE_WITH_SERIALPORT, "client.js", &[&bench.address()])?.held("")
}

fn mono(bench: &Bench, arguments: &[&str]) -> Run {
    let mut compiler = bench.command("mcs");
    compiler.args(["-r:System.dll", "-out:client.exe"]).arg(source("client.cs"));
    let compiled = bench.run(&mut compiler)?;
    if !compiled.success {
        return Err(compiled.to_string().into());
    }
    bench.run(bench.command("mono").arg("client.exe").args(arguments))
}

fn mono_terminal() -> Outcome {
    let bench = Bench::new()?;
    mono(&bench, &[&bench.link()])?.failed("", NO_LINES)
}

fn mono_tcp() -> Outcome {
    let bench = Bench::new()?;
    mono(&bench, &[&bench.address()])?.held("")
}

fn java_terminal() -> Outcome {
    let bench = Bench::new()?;
    client(&bench, "java", "Client.java", &[&bench.link()])?.held("")
}

fn java_tcp() -> Outcome {
    let bench = Bench::new()?;
    client(&bench, "java", "Client.java", &[&bench.address()])?.held("")
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
    ask(b"@0P\r", 19)
}

/// A host program in Rust; it prints what the others print, and then how the lines are.
pub(crate) fn rust_client(name: &str) -> ExitCode {
    let run = || -> Outcome {
        if name.contains(':') {
            converse(&mut TcpStream::connect(name)?)?;
            println!();
            return Ok(());
        }
        let mut port =
            serialport::new(name, 19_200).timeout(Duration::from_secs(5)).open_native()?;
        converse(&mut port)?;
        println!();
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

fn rust(bench: &Bench, port: &str) -> Run {
    bench.run(Command::new(std::env::current_exe()?).env(CLIENT, port))
}

fn rust_terminal() -> Outcome {
    let bench = Bench::new()?;
    rust(&bench, &bench.link())?.failed(CONVERSATION, "Not a typewriter")
}

fn rust_tcp() -> Outcome {
    let bench = Bench::new()?;
    rust(&bench, &bench.address())?.held("")
}

// --- terminal programs ---

fn socat(address: &str) -> Outcome {
    let bench = Bench::new()?;
    // Without `crnl` here: a pipe, unlike a terminal, sends CR itself.
    let line = bench.recipe(&format!("socat - {address}"))?.replace(",crnl", "");
    let mut socat = Typed::at(&mut bench.shell(&line))?;
    socat.converses()?;
    socat.ends()?;
    Ok(())
}

fn socat_terminal() -> Outcome {
    socat("/home")
}

fn socat_tcp() -> Outcome {
    socat("tcp:")
}

fn picocom_terminal() -> Outcome {
    let bench = Bench::new()?;
    let line = bench.recipe("picocom ")?;
    let mut picocom = Typed::on_a_screen(&bench, &line)?;
    picocom.shows("Terminal ready\r\n")?;
    picocom.converses()?;
    picocom.types(b"\x01\x18")?;
    if !picocom.ends()? {
        return Err("picocom ended badly".into());
    }
    for option in ["--lower-dtr", "--lower-rts"] {
        let picocom = Typed::on_a_screen(&bench, &format!("{line} {option}"))?;
        picocom.shows("FATAL: failed to lower ")?;
        if picocom.ends()? {
            return Err(format!("picocom {option} ended well").into());
        }
    }
    Ok(())
}

fn minicom_terminal() -> Outcome {
    let bench = Bench::new()?;
    let captured = bench.folder().join("captured");
    let line = format!("{} -C {}", bench.recipe("minicom ")?, captured.display());
    let mut minicom = Typed::on_a_screen(&bench, &line)?;
    minicom.shows("Press CTRL-A Z for help")?;
    minicom.types(b"@01\r@0A500,9000\r@0P\r")?;
    minicom.shows("0001F4000000000000")?;
    // Leave without resetting the line, and confirm.
    minicom.types(b"\x01q")?;
    minicom.shows("without reset")?;
    minicom.types(b"\r")?;
    minicom.ends()?;
    match std::fs::read_to_string(&captured)?.trim_end() {
        "0000001F4000000000000" => Ok(()),
        other => Err(format!("it captured {other:?}").into()),
    }
}

fn screen_terminal() -> Outcome {
    let bench = Bench::new()?;
    let sockets = bench.folder().join("s");
    std::fs::create_dir(&sockets)?;
    std::fs::set_permissions(&sockets, std::os::unix::fs::PermissionsExt::from_mode(0o700))?;
    // As the guide has it, but without a terminal of its own.
    let line = bench.recipe("screen ")?.replacen("screen", "screen -DmS vimc4", 1);
    let _screen = Typed::at(bench.shell(&line).env("SCREENDIR", &sockets))?;
    let tell = |order: &[&str]| {
        let mut screen = bench.command("screen");
        screen.args(["-S", "vimc4", "-p0", "-X"]).args(order).env("SCREENDIR", &sockets);
        screen.output().is_ok_and(|output| output.status.success())
    };
    until("screen is there", || tell(&["stuff", "@01\r"]))?;
    let copy = bench.folder().join("copy");
    let shows = |text: &str| {
        let read = || std::fs::read_to_string(&copy).unwrap_or_default();
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

// --- DOS ---

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

/// A computer whose only program is the conversation.
fn qemu(recipe: &str) -> Outcome {
    let bench = Bench::new()?;
    assemble(&bench, "boot.img", &["BOOT=1"], "0x7c00")?;
    let computer = "-display none -nodefaults -no-reboot -m 1 -debugcon stdio \
                    -device isa-debug-exit,iobase=0xf4 -drive file=boot.img,format=raw,if=floppy";
    let line = bench.recipe(&format!("qemu-system-i386 … {recipe}"))?.replace('…', computer);
    let ended = bench.run(&mut bench.shell(&line))?;
    // `isa-debug-exit` never ends with 0.
    match ended.printed == CONVERSATION {
        true => Ok(()),
        false => Err(format!("{line}: {ended}").into()),
    }
}

fn qemu_terminal() -> Outcome {
    qemu("-chardev serial,")
}

fn qemu_tcp() -> Outcome {
    qemu("-serial tcp:")
}

/// What a program in DOSBox prints, with this line as its COM1.
fn dosbox(
    bench: &Bench,
    symbols: &[&str],
    serial: &str,
) -> Result<String, Box<dyn std::error::Error>> {
    assemble(bench, "SERIAL.COM", symbols, "0x100")?;
    let _ = std::fs::remove_file(bench.folder().join("OUT.TXT"));
    let folder = bench.folder().display();
    let settings = format!(
        "[mixer]\nnosound=true\n[midi]\nmididevice=none\n[serial]\n{serial}\n\
         [autoexec]\nmount c \"{folder}\"\nc:\nSERIAL > OUT.TXT\nexit\n"
    );
    write(bench, "dosbox.conf", &settings)?;
    let mut dosbox = bench.shell("dosbox -conf dosbox.conf");
    dosbox.env("SDL_VIDEODRIVER", "dummy").env("SDL_AUDIODRIVER", "dummy");
    let ended = bench.run(&mut dosbox)?;
    let printed = std::fs::read(bench.folder().join("OUT.TXT"));
    let printed = printed.map_err(|error| format!("OUT.TXT: {error}; {ended}"))?;
    Ok(String::from_utf8_lossy(&printed).into_owned())
}

fn is(printed: &str, expected: &str) -> Outcome {
    match printed == expected {
        true => Ok(()),
        false => Err(format!("{printed:?} instead of {expected:?}").into()),
    }
}

const DIRECT: &str = "serial1=directserial ";
const NULL_MODEM: &str = "serial1=nullmodem ";
const BIOS: &[&str] = &["BIOS=1"];

fn dosbox_8250_terminal() -> Outcome {
    let bench = Bench::new()?;
    let recipe = bench.recipe(DIRECT)?;
    is(&dosbox(&bench, &[], &recipe)?, CONVERSATION)?;
    // A path that does not begin in /dev is no port: the registers read 255.
    let absolute = recipe.replace("../", "/");
    is(&dosbox(&bench, &[], &absolute)?, &"\u{fffd}".repeat(CONVERSATION.len()))
}

fn dosbox_8250_tcp() -> Outcome {
    let bench = Bench::new()?;
    let recipe = bench.recipe(NULL_MODEM)?;
    is(&dosbox(&bench, &[], &recipe)?, CONVERSATION)?;
    // With `usedtr` nothing comes in, and without `transparent` the lines go as bytes of their
    // own: the first command is spoilt.
    is(&dosbox(&bench, &[], &format!("{recipe} usedtr:1"))?, "?")?;
    let printed = dosbox(&bench, &[], &recipe.replace(" transparent:1", ""))?;
    match printed.starts_with('0') {
        true => Err(format!("without transparent:1 it printed {printed}").into()),
        false => Ok(()),
    }
}

fn dosbox_bios_terminal() -> Outcome {
    let bench = Bench::new()?;
    is(&dosbox(&bench, BIOS, &bench.recipe(DIRECT)?)?, "!")
}

fn dosbox_bios_tcp() -> Outcome {
    let bench = Bench::new()?;
    is(&dosbox(&bench, BIOS, &bench.recipe(NULL_MODEM)?)?, CONVERSATION)
}

// --- Wine ---

/// A Windows of its own in the folder, ended with the test.
struct Wine<'b>(&'b Bench);

impl Drop for Wine<'_> {
    fn drop(&mut self) {
        let _ = self.shell("wineserver -k").status();
    }
}

impl Wine<'_> {
    fn new(bench: &Bench) -> Result<Wine<'_>, Box<dyn std::error::Error>> {
        let wine = Wine(bench);
        let mut compiler = bench.command("x86_64-w64-mingw32-gcc");
        compiler.args(["-O", "-o", "client.exe"]).arg(source("client.c"));
        for command in
            [&mut compiler, &mut wine.shell("wineboot -i"), &mut wine.shell("wineserver -w")]
        {
            let ended = bench.run(command)?;
            if !ended.success {
                return Err(ended.to_string().into());
            }
        }
        Ok(wine)
    }

    /// The prefix is `~/.wine`, as in the guide.
    fn shell(&self, line: &str) -> Command {
        let mut command = self.0.shell(line);
        command.env("WINEDEBUG", "-all").env("WINEARCH", "win64");
        command.env("WINEDLLOVERRIDES", "mscoree=;mshtml=").env_remove("WINEPREFIX");
        command
    }

    /// Runs a line, and ends Wine as the guide has it.
    fn cold(&self, line: &str) -> Outcome {
        let ended = self.0.run(&mut self.shell(line))?;
        if !ended.success {
            return Err(ended.to_string().into());
        }
        self.0.run(&mut self.shell("wineserver -k"))?;
        // There is no word for "it has ended" but that the next one is another.
        thread::sleep(Duration::from_secs(1));
        Ok(())
    }

    fn client(&self, arguments: &str) -> Run {
        self.0.anew()?;
        self.0.run(&mut self.shell(&format!("wine client.exe {arguments}")))
    }

    /// Where a COM port leads to.
    fn leads_to(&self, port: &str) -> String {
        let link = self.0.folder().join(".wine/dosdevices").join(port);
        std::fs::read_link(link).map(|to| to.display().to_string()).unwrap_or_default()
    }
}

fn wine_terminal() -> Outcome {
    let bench = Bench::new()?;
    let wine = Wine::new(&bench)?;
    let link = bench.link();
    // A link of a low number lasts until Wine starts anew, where the computer has a port.
    bench.run(&mut wine.shell(&format!("ln -sf {link} .wine/dosdevices/com1")))?;
    wine.cold("wine cmd /c ver")?;
    if std::path::Path::new("/dev/ttyS0").exists() {
        is(&wine.leads_to("com1"), "/dev/ttyS0")?;
    }
    // A high number stays.
    bench.run(&mut wine.shell(&bench.recipe("ln -sf ")?))?;
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
    // Without an emulator.
    std::fs::remove_file(&link)?;
    wine.client("com1")?.failed("", "GetCommState: error 1\n")?;
    wine.client("com50")?.failed("", "CreateFile: error 2\n")?;
    wine.client("com77")?.failed("", "CreateFile: error 2\n")
}
