//! TCP, end to end.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};

use vimc4_host::{Clients, Clock, LineEvent, Tcp, TcpError};

use crate::fake::{Diary, Fake, Running};

fn serve(clock: Clock, policy: Clients) -> (Running<Fake>, SocketAddr) {
    Running::with(Fake::new(b""), clock, move || {
        let tcp = Tcp::bind("127.0.0.1:0".parse().unwrap(), policy).unwrap();
        let address = tcp.address();
        (tcp, address)
    })
}

fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    stream
}

fn ask(stream: &mut TcpStream, line: &str, answer: usize) -> String {
    stream.write_all(line.as_bytes()).unwrap();
    let mut bytes = vec![0; answer];
    stream.read_exact(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

/// Whether the other side has closed, without having said anything.
fn is_closed(stream: &mut TcpStream) -> bool {
    match stream.read(&mut [0]) {
        Ok(0) => true,
        Err(error) => error.kind() == ErrorKind::ConnectionReset,
        Ok(_) => false,
    }
}

#[test]
fn a_client_converses() {
    let (running, address) = serve(Clock::Real, Clients::Refuse);
    let mut client = connect(address);
    assert_eq!(ask(&mut client, "ehello\r", 5), "hello");
    assert_eq!(ask(&mut client, "w5\r", 1), "0");
    // Raw bytes, Telnet's IAC included.
    client.write_all(b"e\xFF\xFD\x00\r").unwrap();
    let mut bytes = [0; 3];
    client.read_exact(&mut bytes).unwrap();
    assert_eq!(bytes, [0xFF, 0xFD, 0x00]);
    running.end().unwrap();
    assert!(is_closed(&mut client));
}

#[test]
fn a_second_client_is_refused_and_the_first_does_not_notice() {
    let diary = Diary::default();
    let (running, address) = serve(Clock::Real, Clients::Refuse);
    running.handle.watch(diary.clone()).wait().unwrap();
    let mut first = connect(address);
    assert_eq!(ask(&mut first, "eone\r", 3), "one");
    let began = Instant::now();
    let mut second = connect(address);
    second.write_all(b"etwo\r").unwrap();
    // The client reads the reason and a clean end, although nobody has read its bytes.
    let mut why = String::new();
    second.read_to_string(&mut why).unwrap();
    assert_eq!(why, format!("refused: {} has the line\r\n", first.local_addr().unwrap()));
    assert!(began.elapsed() >= Duration::from_millis(80), "{:?}", began.elapsed());
    assert_eq!(ask(&mut first, "eone\r", 3), "one");
    diary.wait_for("a refusal", |report| matches!(report.news(), Some(LineEvent::Refused { .. })));
    running.end().unwrap();
}

#[test]
fn who_closes_and_connects_again_is_never_refused() {
    let (running, address) = serve(Clock::Real, Clients::Refuse);
    for n in 0..200 {
        let mut client = connect(address);
        assert_eq!(ask(&mut client, &format!("e{n:03}\r"), 3), format!("{n:03}"));
    }
    // Also when the next one knocks before the last one has hung up.
    let mut last = connect(address);
    assert_eq!(ask(&mut last, "ex\r", 1), "x");
    for _ in 0..20 {
        let mut next = connect(address);
        next.write_all(b"ey\r").unwrap();
        std::thread::sleep(Duration::from_millis(5));
        drop(last);
        let mut answer = [0];
        next.read_exact(&mut answer).unwrap();
        assert_eq!(&answer, b"y");
        last = next;
    }
    running.end().unwrap();
}

#[test]
fn nothing_is_kept_for_the_next_client() {
    let diary = Diary::default();
    let (running, address) = serve(Clock::Manual, Clients::Refuse);
    running.handle.watch(diary.clone()).wait().unwrap();
    let mut first = connect(address);
    assert_eq!(ask(&mut first, "eone\rw10\r", 3), "one");
    running.handle.now().wait().unwrap();
    drop(first);
    // It might only have closed its own side and listen; sending shows that it does not.
    running.handle.advance(Duration::from_millis(10)).wait().unwrap();
    diary.wait_for("the end of the first", |report| {
        matches!(report.news(), Some(LineEvent::Closed { .. }))
    });
    diary.wait_for("the loss", |report| {
        matches!(report.news(), Some(LineEvent::Lost { bytes: 1, .. }))
    });
    let mut second = connect(address);
    assert_eq!(ask(&mut second, "etwo\r", 3), "two");
    running.end().unwrap();
}

#[test]
fn who_has_closed_its_side_hears_the_answer_that_is_due() {
    let (running, address) = serve(Clock::Manual, Clients::Refuse);
    let mut client = connect(address);
    client.write_all(b"w10\rebye\r").unwrap();
    client.shutdown(Shutdown::Write).unwrap();
    running.handle.advance(Duration::from_millis(10)).wait().unwrap();
    let mut answers = String::new();
    // And then the controller rests, so that nothing more can come.
    client.read_to_string(&mut answers).unwrap();
    assert_eq!(answers, "0bye");
    running.end().unwrap();
}

#[test]
fn who_has_closed_its_side_gives_way_to_the_next() {
    let (running, address) = serve(Clock::Manual, Clients::Refuse);
    let mut first = connect(address);
    first.write_all(b"w10\r").unwrap();
    first.shutdown(Shutdown::Write).unwrap();
    let mut second = connect(address);
    running.handle.advance(Duration::from_millis(10)).wait().unwrap();
    let mut answer = [0];
    second.read_exact(&mut answer).unwrap();
    assert!(is_closed(&mut first));
    running.end().unwrap();
}

#[test]
fn a_client_that_never_reads_stops_nobody() {
    let diary = Diary::default();
    let (running, address) = serve(Clock::Real, Clients::Refuse);
    running.handle.watch(diary.clone()).wait().unwrap();
    let mut lazy = connect(address);
    // More than the system keeps for it and more than the queue takes.
    for _ in 0..300 {
        lazy.write_all(b"s60000\r").unwrap();
    }
    diary.wait_for("a loss", |report| matches!(report.news(), Some(LineEvent::Lost { .. })));
    running.handle.now().wait().unwrap();
    drop(lazy);
    let mut next = connect(address);
    assert_eq!(ask(&mut next, "ehello\r", 5), "hello");
    running.end().unwrap();
}

#[test]
fn a_takeover_disconnects_the_first() {
    let (running, address) = serve(Clock::Real, Clients::Takeover);
    let mut first = connect(address);
    assert_eq!(ask(&mut first, "eone\r", 3), "one");
    let mut second = connect(address);
    assert_eq!(ask(&mut second, "etwo\r", 3), "two");
    assert!(is_closed(&mut first));
    running.end().unwrap();
}

#[test]
fn observers_listen_and_are_not_heard() {
    let (running, address) = serve(Clock::Real, Clients::Observe);
    let mut first = connect(address);
    assert_eq!(ask(&mut first, "eone\r", 3), "one");
    let mut observer = connect(address);
    observer.write_all(b"etwo\r").unwrap();
    running.handle.now().wait().unwrap();
    std::thread::sleep(Duration::from_millis(20));
    assert_eq!(ask(&mut first, "eabc\r", 3), "abc");
    let mut heard = [0; 3];
    observer.read_exact(&mut heard).unwrap();
    assert_eq!(&heard, b"abc");
    running.end().unwrap();
}

#[test]
fn a_taken_port_says_so() {
    let holder = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = holder.local_addr().unwrap();
    let (running, error) = Running::start(Fake::new(b""), Clock::Real, move |runner| {
        (runner, Tcp::bind(address, Clients::Refuse).unwrap_err())
    });
    assert!(matches!(error, TcpError::Taken(_)));
    assert!(error.to_string().contains(&format!("port {} at 127.0.0.1 is taken", address.port())));
    running.end().unwrap();
}
