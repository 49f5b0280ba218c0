//! `vimc4 serve --line-physics`: a client at the wrong speed reads and sends what the bits on the line
//! make of it. The client is pyserial.
#![cfg(unix)]
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::process::Command;

use vimc4_device::Harness;

#[expect(dead_code, reason = "each test uses its part of it")]
mod process;

use process::limits::{InTime, LIMIT};
use process::{Process, vimc4};

/// What a receiver reads that samples the line sixteen times a bit, sample by sample.
fn uart(bytes: &[u8], sent: u64, read: u64) -> Vec<u8> {
    let bits: Vec<bool> = bytes
        .iter()
        .flat_map(|byte| {
            let data = (0..8).map(move |bit| byte >> bit & 1 == 1);
            [false].into_iter().chain(data).chain([true])
        })
        .collect();
    let level = |sample: u64| {
        let bit = usize::try_from(sample * sent / (16 * read)).unwrap();
        bits.get(bit).copied().unwrap_or(true)
    };
    let length = bits.len() as u64 * 16 * read / sent + 200;
    let (mut heard, mut sample) = (Vec::new(), 0);
    while sample < length {
        if level(sample) {
            sample += 1;
        } else if level(sample + 8) {
            sample += 8;
        } else {
            let data =
                (0..8).fold(0, |data, bit| data | u8::from(level(sample + 24 + 16 * bit)) << bit);
            heard.push(data);
            sample += 8 + 16 * 9;
            while sample < length && !level(sample) {
                sample += 1;
            }
        }
    }
    heard
}

/// Opens a port at a speed, sends bytes and prints what comes, and then once more at the right speed.
const CLIENT: &str = r#"
import serial, sys
url, baud, sent, count = sys.argv[1], int(sys.argv[2]), bytes.fromhex(sys.argv[3]), int(sys.argv[4])
port = serial.serial_for_url(url, baudrate=baud, timeout=60)
port.write(sent)
print(port.read(count).hex())
port.baudrate = 19200
port.write(b"@07\r")
print(port.read(1).hex())
port.close()
"#;

fn client(url: &str, baud: u64, sent: &[u8], count: usize) -> Vec<String> {
    let hex: String = sent.iter().map(|byte| format!("{byte:02x}")).collect();
    let arguments = [url.to_owned(), baud.to_string(), hex, count.to_string()];
    let client =
        Command::new("python3").args(["-c", CLIENT]).args(arguments).output_in_time().unwrap();
    assert!(client.status.success(), "{}", String::from_utf8_lossy(&client.stderr));
    String::from_utf8(client.stdout).unwrap().lines().map(str::to_owned).collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn has_pyserial() -> bool {
    let has = Command::new("python3").args(["-c", "import serial"]).output_in_time();
    let has = has.is_ok_and(|output| output.status.success());
    assert!(has || std::env::var_os("VIMC4_REQUIRE_TOOLS").is_none(), "python3-serial is missing");
    has
}

#[test]
fn a_client_at_the_wrong_speed_reads_and_sends_what_the_bits_are() {
    if !has_pyserial() {
        return;
    }
    // At twice the speed these four bytes are a word and the end of a line to the controller.
    let sent = [0x00, 0x14, 0x44, 0x00];
    assert_eq!(uart(&sent, 38_400, 19_200), b"h\r");
    let (model, machine) = (vimc4::model("imc4").unwrap(), vimc4::machine("bench").unwrap());
    let mut imc4 = Harness::new(vimc4::bare(&model, &machine, b"").unwrap());
    let answer = imc4.ask(b"h\r").unwrap();
    let heard = uart(&answer, 19_200, 38_400);
    assert!(!heard.is_empty() && heard != answer, "{answer:?} {heard:?}");
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["serve", "--line-physics", "--tcp", "none", "--rfc2217", "127.0.0.1:0"];
    let mut serve = Process::start(vimc4(folder.path(), &arguments).arg("-v"));
    let pty = serve.line().strip_prefix("pty ").unwrap().to_owned();
    let rfc2217 = format!("rfc2217://{}", serve.line().strip_prefix("rfc2217 ").unwrap());
    assert_eq!(serve.line(), "ready");
    for url in [&pty, &rfc2217, &pty] {
        let printed = client(url, 38_400, &sent, heard.len());
        assert_eq!(printed, [hex(&heard), hex(b"0")], "{url}");
        // It is gone, and its speed with it.
        let printed = client(url, 19_200, b"@07\r", 1);
        assert_eq!(printed, [hex(b"0"), hex(b"0")], "{url}");
    }
    assert_eq!(serve.order("faults"), "nothing is wrong");
    assert_eq!(serve.order("quit"), "");
}

/// Without it every client is understood.
#[test]
fn by_default_a_wrong_speed_is_only_a_warning() {
    if !has_pyserial() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["serve", "--line-pacing", "--tcp", "none"];
    let mut serve = Process::start(&mut vimc4(folder.path(), &arguments));
    let errors = serve.errors();
    let pty = serve.line().strip_prefix("pty ").unwrap().to_owned();
    assert_eq!(serve.line(), "ready");
    assert_eq!(client(&pty, 9_600, b"@07\r", 1), [hex(b"0"), hex(b"0")]);
    let mut lines = std::iter::from_fn(|| errors.recv_timeout(LIMIT).ok());
    let warned = lines.find(|line| line.contains("a real one would hear noise"));
    assert!(warned.is_some_and(|line| line.contains("9600 baud")));
    assert_eq!(serve.order("faults"), "nothing is wrong");
}
