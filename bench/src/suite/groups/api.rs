//! What the control API costs the host: round trips of a controller at which fifty clients look, ten times
//! a second each, and of which ten follow every event, compared with one without the API.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use vimc4::Emulator;
use vimc4_api::{Place, Server};

use crate::suite::Bench;
use crate::suite::failure::{Doing, Failure, Outcome};
use crate::suite::port::{ISEL, Wire};
use crate::suite::report::{Figure, Section};
use crate::suite::stats::{ROUNDS, alternate};

/// The least share of the round trips that is left.
const LEAST: f64 = 0.9;

/// How many clients look, and how often.
const LOOKING: usize = 50;
const EVERY: Duration = Duration::from_millis(100);

/// How many follow what happens.
const FOLLOWING: usize = 10;

pub(super) fn measure(bench: &Bench) -> Outcome<Section> {
    let span = bench.either(Duration::from_millis(200), Duration::from_millis(30));
    let mut section = Section::default();
    let plain = [bench.cores.server.run(start)?];
    for (what, looking, following) in [
        ("the API is there and nobody uses it", 0, 0),
        ("fifty clients look and ten follow", LOOKING, FOLLOWING),
    ] {
        let (served, server) = bench.cores.server.run(|| {
            let served = [start()?];
            let server = serve(&served)?;
            Ok((served, server))
        })?;
        let (mut without, mut with) = (connect(&plain[0])?, connect(&served[0])?);
        let over = AtomicBool::new(false);
        let rates = bench.cores.client.run(|| {
            thread::scope(|scope| {
                let (address, over) = (server.address(), &over);
                scope.spawn(move || look(address, looking, over));
                for _ in 0..following {
                    scope.spawn(move || follow(address, over));
                }
                let rates =
                    alternate(5 * ROUNDS, || without.ping(ISEL, span), || with.ping(ISEL, span));
                over.store(true, Ordering::Relaxed);
                rates
            })
        })?;
        section.add(Figure::rates(format!("round trips over TCP, {what}"), rates, LEAST));
    }
    section.note(
        "Controllers and API are on one core and all clients on another; the clients go on while the \
         baseline is measured. Each of the fifty asks for the view ten times a second, and the ten take \
         everything that is told of every command.",
    );
    Ok(section)
}

fn start() -> Outcome<Emulator> {
    let builder = Emulator::builder().record(false).tcp("127.0.0.1:0");
    builder.start().doing("start an emulator")
}

fn serve(emulators: &[Emulator]) -> Outcome<Server> {
    let place = Place::take("127.0.0.1:0", None).doing("listen")?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.doing("wait for events")?;
    runtime.block_on(Server::start(place, emulators, None)).doing("serve")
}

fn connect(emulator: &Emulator) -> Outcome<Wire> {
    let address = emulator.tcp_addr().ok_or_else(|| Failure::new("the emulator has no TCP"))?;
    Wire::connect(address)
}

/// So many clients ask for the view, one after the other, until it is over.
fn look(address: SocketAddr, count: usize, over: &AtomicBool) {
    let clients = (0..count).filter_map(|_| TcpStream::connect(address).ok());
    let mut clients: Vec<_> = clients.map(BufReader::new).collect();
    while !over.load(Ordering::Relaxed) {
        let next = Instant::now() + EVERY;
        for client in &mut clients {
            // One that gets no answer is one less.
            let _ = ask(client, address);
        }
        thread::sleep(next.saturating_duration_since(Instant::now()));
    }
}

fn ask(client: &mut BufReader<TcpStream>, address: SocketAddr) -> std::io::Result<()> {
    let stream = client.get_mut();
    stream.write_all(
        format!("GET /v1/controllers/1/view HTTP/1.1\r\nHost: {address}\r\n\r\n").as_bytes(),
    )?;
    let (mut length, mut line) = (0, String::new());
    while line != "\r\n" {
        line.clear();
        if client.read_line(&mut line)? == 0 {
            return Ok(());
        }
        if let Some(said) = line.strip_prefix("content-length:") {
            length = said.trim().parse().unwrap_or(0);
        }
    }
    client.read_exact(&mut vec![0; length])
}

/// One client follows all events, and reads whatever comes until it is over.
fn follow(address: SocketAddr, over: &AtomicBool) {
    let Ok(mut stream) = TcpStream::connect(address) else { return };
    // So that it looks whether it is over.
    let _ = stream.set_read_timeout(Some(EVERY));
    let opening = format!(
        "GET /v1/events HTTP/1.1\r\nHost: {address}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    );
    let wish = b"{\"positions\":30}";
    // Masked with zeros.
    let mut frame = vec![0x81, 0x80 | 16, 0, 0, 0, 0];
    frame.extend(wish);
    let _ = stream.write_all(opening.as_bytes()).and_then(|()| stream.write_all(&frame));
    let mut buffer = vec![0; 1 << 16];
    while !over.load(Ordering::Relaxed) {
        let _ = stream.read(&mut buffer);
    }
}
