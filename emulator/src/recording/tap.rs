//! `vimc4 record`: a tap between host software and a real controller.
//!
//! Each direction has a thread that reads, takes note and writes, so that neither waits for the other.
//! What is read is passed on as it was read: no byte is changed, held back or put together with
//! others.

use std::io;
use std::path::PathBuf;
use std::process::{self, ExitCode};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use super::bridge::{Tap, Tape};
use super::client;
use crate::answers;
use crate::completions;
use crate::endings::Endings;
use crate::failure::Failure;
use crate::here::here;
use crate::port::{Port, PortError};
use crate::values::size;

/// How often a device that is gone is looked for.
const LOOK: Duration = Duration::from_millis(300);
/// How long one wait for a byte of the device lasts.
const LISTEN: Duration = Duration::from_secs(3_600);

#[derive(clap::Args)]
#[command(
    long_about = concat!("\
Record what passes between host software and a real controller

It sits between the two: the host software ", here!("opens LINK or ", ""), "connects to ADDR, and every byte is passed on at
once and as it came, in both directions, and recorded with its time. Serial parameters are 8N1 at the
model's speed. A device that is unplugged is opened again when it is back; what is sent meanwhile is
lost, which the recording notes. Ctrl-C ends it.

`vimc4 replay FILE` then plays what was sent into the virtual controller, compares what it says, and names
the quirk that would explain a difference."),
    after_long_help = concat!(
        "Examples:\n",
        here!("  vimc4 record monday.jsonl --device /dev/ttyUSB0 --pty ./machine\n", ""),
        "  vimc4 record monday.jsonl.gz --device COM3 --model imc-s8 --tcp 127.0.0.1:4444\n",
        here!("  vimc4 record both.jsonl --device 127.0.0.1:4004 --pty ./machine\n", ""),
        "\nExit codes: 0 it was ended, 1 the recording is not complete, 2 it could not begin."
    )
)]
#[cfg_attr(unix, command(group = clap::ArgGroup::new("way in").required(true).multiple(true).args(["pty", "tcp"])))]
pub(crate) struct Arguments {
    /// The recording, a new file; .gz and .zst are compressed when it ends
    file: PathBuf,
    #[arg(long, value_name = "DEV", add = completions::ports(), help = here!(
        "The controller: a serial port, the link of a pseudo-terminal, or HOST:PORT",
        "The controller: a serial port, or HOST:PORT"
    ))]
    device: String,
    /// A pseudo-terminal for the host software, with a link of this name
    #[cfg(unix)]
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,
    /// Listen for the host software on this address; port 0 for a free one
    #[arg(long, value_name = "ADDR", required = cfg!(not(unix)))]
    tcp: Option<String>,
    /// The speed of a serial port; by default the model's
    #[arg(long, value_name = "RATE")]
    baud: Option<u32>,
    /// Which model the controller is: a name from `vimc4 models`, or a profile file
    #[arg(long, value_name = "NAME|FILE", default_value = "imc4", add = completions::models())]
    model: String,
    /// Which machine it moves: a name from `vimc4 machines`, or a profile file
    #[arg(long, value_name = "NAME|FILE", default_value = "bench", add = completions::machines())]
    machine: String,
    /// Begin another file of the recording, NAME.2.EXT, when one reaches this size, such as 64M
    #[arg(long, value_name = "SIZE", value_parser = size)]
    record_size: Option<u64>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let model = vimc4::model(&arguments.model)?;
    let machine = vimc4::machine(&arguments.machine)?;
    let baud = arguments.baud.unwrap_or(model.baud());
    let port = Port::open(&arguments.device, baud).map_err(Failure::usage)?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime =
        runtime.map_err(|error| Failure::usage(format!("cannot wait for events: {error}")))?;
    // From here on the program cannot be ended without its link being removed.
    let mut endings = runtime.block_on(async { Endings::listen() });
    let link = {
        #[cfg(unix)]
        {
            arguments.pty.as_deref().map(|path| client::Terminal::open(path, baud)).transpose()?
        }
        #[cfg(not(unix))]
        {
            None::<client::Terminal>
        }
    };
    let listener = arguments.tcp.as_deref().map(client::listen).transpose()?;
    let Arguments { file, record_size, device, .. } = arguments;
    let tape = Tape::begin(file, *record_size, device, &model, &machine)?;
    let tap = Arc::new(Tap::new(tape, port.writer()));
    let mut places = String::new();
    let failed = |error: io::Error| {
        Failure::usage(format!("cannot start a thread: {error}; end other programs"))
    };
    if let Some(terminal) = &link {
        places += &format!("pty {}\n", terminal.place().display());
        terminal.serve(&tap).map_err(failed)?;
    }
    if let Some(listener) = listener {
        let address = listener.local_addr().map_err(failed)?;
        places += &format!("tcp {address}\n");
        client::serve(listener, &tap).map_err(failed)?;
    }
    answers::say(&(places + "ready\n"));
    let (name, listening) = (arguments.device.clone(), Arc::clone(&tap));
    let listen = move || listen(&listening, port, &name, baud);
    thread::Builder::new().name("device".to_owned()).spawn(listen).map_err(failed)?;
    runtime.block_on(endings.told());
    let is_whole = tap.end();
    drop(link);
    // The other threads wait for bytes that will not be recorded any more.
    process::exit(i32::from(!is_whole))
}

/// Passes on what the device says, also when it has been gone.
fn listen(tap: &Tap, mut port: Port, name: &str, baud: u32) {
    loop {
        match port.next(Instant::now() + LISTEN) {
            Ok(Some((at, bytes))) => tap.device_says(at, bytes.into()),
            Ok(None) | Err(PortError::Interrupted) => {}
            Err(PortError::Gone(why)) => {
                tap.device(None);
                tap.note(&format!("{name} is gone: {why}; it is opened again when it is back"));
                drop(port);
                port = loop {
                    thread::sleep(LOOK);
                    if let Ok(port) = Port::open(name, baud) {
                        break port;
                    }
                };
                tap.device(port.writer());
                tap.note(&format!("{name} is back"));
            }
        }
    }
}
