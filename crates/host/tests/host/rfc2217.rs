//! A serial port with its settings and lines over TCP, end to end.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use vimc4_host::{Clients, Clock, LineEvent, Tcp};

use crate::fake::{Diary, Fake, Running};

const IAC: u8 = 255;

/// What a client says that wants binary both ways and the port.
const AGREES: [u8; 9] = [IAC, 251, 0, IAC, 253, 0, IAC, 251, 44];

/// What it is offered and asked for, and then told of the lines: CTS and DSR are on.
const GREETING: &[u8] =
    b"\xff\xfb\x00\xff\xfb\x03\xff\xfd\x00\xff\xfd\x2c\xff\xfa\x2c\x6b\x30\xff\xf0";

fn serve(policy: Clients) -> (Running<Fake>, SocketAddr) {
    Running::with(Fake::new(b""), Clock::Real, move || {
        let tcp = Tcp::bind_rfc2217("127.0.0.1:0".parse().unwrap(), policy).unwrap();
        let address = tcp.address();
        (tcp, address)
    })
}

fn connect(address: SocketAddr) -> TcpStream {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    stream.write_all(&AGREES).unwrap();
    assert_eq!(read(&mut stream, GREETING.len()), GREETING);
    stream
}

fn read(stream: &mut TcpStream, count: usize) -> Vec<u8> {
    let mut bytes = vec![0; count];
    stream.read_exact(&mut bytes).unwrap();
    bytes
}

fn sub(text: &[u8]) -> Vec<u8> {
    [&[IAC, 250, 44], text, &[IAC, 240]].concat()
}

#[test]
fn what_the_client_does_to_its_port_is_told() {
    let diary = Diary::default();
    let (running, address) = serve(Clients::Refuse);
    running.handle.watch(diary.clone()).wait().unwrap();
    let mut client = connect(address);
    for (asked, answered) in [
        (&[1, 0, 0, 0x25, 0x81][..], &[101, 0, 0, 0x25, 0x81][..]),
        (&[2, 7], &[102, 7]),
        (&[3, 3], &[103, 3]),
        (&[5, 9], &[105, 9]),
        (&[5, 5], &[105, 5]),
        (&[12, 3], &[112, 3]),
    ] {
        client.write_all(&sub(asked)).unwrap();
        assert_eq!(read(&mut client, answered.len() + 5), sub(answered));
    }
    // Both bytes that have a meaning on the way come through, to the device and back.
    client.write_all(b"e\xff\xff\x01\r").unwrap();
    assert_eq!(read(&mut client, 3), b"\xff\xff\x01");
    let of = |wanted: fn(&LineEvent) -> bool| {
        diary.wait_for("news of the port", move |report| report.news().is_some_and(wanted));
    };
    of(|news| matches!(news, LineEvent::WrongSpeed { client: 9_601, .. }));
    of(|news| matches!(news, LineEvent::WrongDataBits { bits: 7, .. }));
    of(|news| matches!(news, LineEvent::WrongParity { parity, .. } if parity == "even"));
    of(|news| matches!(news, LineEvent::HostLine { line, on: false, .. } if line == "DTR"));
    of(|news| matches!(news, LineEvent::HostLine { line, on: true, .. } if line == "BREAK"));
    running.end().unwrap();
}

#[test]
fn a_client_that_wants_a_pause_gets_everything_behind_it() {
    let (running, address) = serve(Clients::Refuse);
    let mut client = connect(address);
    client.write_all(&sub(&[8])).unwrap();
    client.write_all(b"eone\retwo\r").unwrap();
    client.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
    assert!(client.read(&mut [0]).is_err(), "nothing comes");
    client.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    client.write_all(&sub(&[9])).unwrap();
    assert_eq!(read(&mut client, 6), b"onetwo");
    running.end().unwrap();
}

#[test]
fn an_observer_agrees_too_and_is_not_heard() {
    let diary = Diary::default();
    let (running, address) = serve(Clients::Observe);
    running.handle.watch(diary.clone()).wait().unwrap();
    let mut holder = connect(address);
    let mut observer = connect(address);
    holder.write_all(b"ehello\r").unwrap();
    assert_eq!(read(&mut holder, 5), b"hello");
    assert_eq!(read(&mut observer, 5), b"hello");
    observer.write_all(&sub(&[10, 1])).unwrap();
    assert_eq!(read(&mut observer, 7), sub(&[110, 1]));
    observer.write_all(b"eno\r").unwrap();
    diary.wait_for("it is not heard", |report| {
        matches!(report.news(), Some(LineEvent::Unheard { .. }))
    });
    running.end().unwrap();
}
