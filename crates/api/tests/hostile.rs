//! Requests and frames that nobody sends who means well: none ends the server or a controller, none
//! makes it panic, and none makes it grow.
//!
//! 4,000 of them by default; the environment variable `VIMC4_CASES` says another number:
//!
//! ```text
//! VIMC4_CASES=1000000 cargo test -p vimc4-api --test hostile -- --nocapture
//! ```

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test, which tells its figures")]

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::panic;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use vimc4::{Clock, Emulator};
use vimc4_api::{Place, Server};

/// How often anything in this process has panicked.
static PANICS: AtomicUsize = AtomicUsize::new(0);

/// The same numbers every time.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 >> 11).unwrap() % limit
    }

    fn one_in(&mut self, times: usize) -> bool {
        self.below(times) == 0
    }

    fn of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }

    fn byte(&mut self) -> u8 {
        u8::try_from(self.below(256)).unwrap()
    }

    /// A text that may mean something somewhere, or nothing anywhere.
    fn text(&mut self) -> String {
        const WORDS: [&str; 36] = [
            "position",
            "press stop",
            "press start",
            "cover open",
            "cover",
            "help",
            "x > 100",
            "idle",
            "x > 99999999999999999999",
            "at 1s",
            "250ms",
            "9999999h",
            "-1",
            "8x",
            "0x",
            "instant",
            "real",
            "drop to-host once",
            "garble into ? to-host",
            "when x > 1: press stop",
            "end all",
            "command @A, once",
            "whenever x > 1: idle",
            "x > 1mm, never; then command @P, 2 to 1 times",
            "@07\r@0A500,900,0,900,0,900,0,900\r",
            "@0P\r",
            "@0i\r",
            "vimc4 flash 1\n",
            "imc4",
            "../../etc/passwd",
            "%2e%2e",
            "\u{0}",
            "ü€😀",
            "\"",
            "{}",
            "",
        ];
        match self.below(12) {
            0 => "(".repeat(self.below(4_000)),
            1 => "x > 1 and ".repeat(self.below(400)),
            2 => (0..self.below(60)).map(|_| char::from(self.byte())).collect(),
            3 => format!("{} {}", self.of(&WORDS), self.of(&WORDS)),
            _ => self.of(&WORDS).to_owned(),
        }
    }

    fn value(&mut self, depth: usize) -> Value {
        match self.below(if depth == 0 { 6 } else { 8 }) {
            0 => Value::Null,
            1 => json!(self.one_in(2)),
            2 => json!(self.of(&[0, 1, -1, i64::MAX, i64::MIN, 1 << 40])),
            3 => json!(1e300),
            4 | 5 => self.text().into(),
            6 => (0..self.below(4)).map(|_| self.value(depth - 1)).collect(),
            _ => (0..self.below(4)).map(|_| (self.text(), self.value(depth - 1))).collect(),
        }
    }

    /// Bytes with some damage.
    fn damage(&mut self, bytes: &mut Vec<u8>) {
        for _ in 0..=self.below(4) {
            let (place, byte) = (self.below(bytes.len().max(1)), self.byte());
            match self.below(4) {
                0 if place < bytes.len() => bytes[place] = byte,
                1 => bytes.insert(place.min(bytes.len()), byte),
                2 if place < bytes.len() => _ = bytes.remove(place),
                _ => bytes.truncate(place.max(1)),
            }
        }
    }
}

/// A route of the document: its method, its address, and an example of each field of its body.
struct Route {
    method: String,
    path: String,
    body: Vec<(String, Value)>,
}

fn routes(document: &Value) -> Vec<Route> {
    let mut routes = Vec::new();
    for (path, methods) in document["paths"].as_object().unwrap() {
        for (method, operation) in methods.as_object().unwrap() {
            let fields =
                &operation["requestBody"]["content"]["application/json"]["schema"]["properties"];
            let fields = fields.as_object().into_iter().flatten();
            let body = fields.map(|(name, schema)| (name.clone(), schema["examples"][0].clone()));
            let (method, body) = (method.to_uppercase(), body.collect());
            routes.push(Route { method, path: path.clone(), body });
        }
    }
    routes
}

/// What is sent by a connection, one behind the other.
#[derive(Default)]
struct Batch {
    bytes: Vec<u8>,
    count: usize,
    /// Nothing more can be said: what was cut off would be waited for.
    ends: bool,
    /// Something may be waited for that never comes.
    waits: bool,
}

/// Requests, mostly such as could be right. The last one may be damaged, and says that it is the last.
fn requests(random: &mut Random, routes: &[Route], host: SocketAddr) -> Batch {
    let mut batch = Batch::default();
    let together = 1 + random.below(20);
    while batch.count < together && !batch.waits {
        let route = &routes[random.below(routes.len())];
        batch.waits = route.path.ends_with("/wait") || route.path.ends_with("/run-until");
        batch.count += 1;
        let is_last = batch.count == together || batch.waits;
        let mut bytes = request(random, route, host, is_last);
        if is_last && random.one_in(2) {
            random.damage(&mut bytes);
            batch.ends = true;
        }
        batch.bytes.extend(bytes);
    }
    batch
}

/// Frames of a client on a WebSocket, damaged or not.
fn frames(random: &mut Random, upgrade: &str) -> Batch {
    let count = 1 + random.below(40);
    let mut bytes = upgrade.as_bytes().to_vec();
    (0..count).for_each(|_| bytes.extend(frame(random)));
    Batch { bytes, count, ends: true, waits: false }
}

fn request(random: &mut Random, route: &Route, host: SocketAddr, is_last: bool) -> Vec<u8> {
    let mut path = String::new();
    for part in route.path.split('/').skip(1) {
        path.push('/');
        match part {
            "{n}" if !random.one_in(20) => path.push_str(random.of(&["1", "2"])),
            "{id}" | "{number}" | "{scenario}" if !random.one_in(10) => {
                path.push_str(&random.below(30).to_string());
            }
            "{name}" if random.one_in(2) => path.push_str(random.of(&["cover", "imc4", "mill"])),
            part if part.starts_with('{') => {
                let escaped = random.text().into_bytes().into_iter().take(200);
                escaped.for_each(|byte| path.push_str(&format!("%{byte:02X}")));
            }
            part => path.push_str(part),
        }
    }
    if random.one_in(6) {
        path.push_str(random.of(&[
            "?after=3&limit=5",
            "?kinds=command,motion",
            "?line=p",
            "?a",
            "?&&=%",
        ]));
    }
    let mut fields: BTreeMap<String, Value> = route.body.iter().cloned().collect();
    for value in fields.values_mut() {
        match random.below(12) {
            0..4 => {}
            4..6 => *value = random.value(2),
            _ => *value = random.text().into(),
        }
    }
    if random.one_in(12) {
        fields.insert(random.text(), random.value(3));
    }
    let body = match random.below(20) {
        0 => "[".repeat(random.below(60_000)),
        1 => random.value(3).to_string(),
        _ if fields.is_empty() => String::new(),
        _ => json!(fields).to_string(),
    };
    let kind = if random.one_in(20) { "text/plain" } else { "application/json" };
    let origin = if random.one_in(20) { "Origin: http://elsewhere.example\r\n" } else { "" };
    let end = if is_last { "Connection: close\r\n" } else { "" };
    format!(
        "{} {path} HTTP/1.1\r\nHost: {host}\r\nContent-Type: {kind}\r\n{origin}{end}\
         Content-Length: {}\r\n\r\n{body}",
        route.method,
        body.len()
    )
    .into_bytes()
}

/// A frame of a client on a WebSocket.
fn frame(random: &mut Random) -> Vec<u8> {
    let wish = match random.below(4) {
        0 => random.value(3).to_string(),
        1 => random.text(),
        2 => json!({ "after": { "1": random.below(9) }, "kinds": ["command"] }).to_string(),
        _ => json!({ "positions": random.below(99), "controllers": [1 + random.below(3)] })
            .to_string(),
    };
    let mut wish = wish.into_bytes();
    wish.truncate(usize::from(u16::MAX));
    let mut frame = vec![if random.one_in(8) { random.byte() } else { 0x81 }];
    match u8::try_from(wish.len()) {
        Ok(length @ 0..126) => frame.push(0x80 | length),
        _ => {
            frame.push(0x80 | 126);
            frame.extend(u16::try_from(wish.len()).unwrap().to_be_bytes());
        }
    }
    frame.extend([0; 4]);
    frame.extend(wish);
    if random.one_in(8) {
        random.damage(&mut frame);
    }
    frame
}

/// How much memory this process has, bytes; 0 where that is not told.
fn memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}

/// Sends all of it, and reads what comes.
fn talk(address: SocketAddr, Batch { bytes, ends, waits, .. }: &Batch) -> Vec<u8> {
    let mut stream = TcpStream::connect(address).unwrap();
    let patience = Duration::from_millis(if *waits { 30 } else { 20_000 });
    stream.set_read_timeout(Some(patience)).unwrap();
    let mut answer = Vec::new();
    std::thread::scope(|scope| {
        // Whoever does not read what is answered could not write for ever.
        let (mut writer, ends) = (stream.try_clone().unwrap(), *ends);
        scope.spawn(move || {
            // It may have been closed before all of it is written.
            let _ = writer.write_all(bytes);
            if ends {
                let _ = writer.shutdown(Shutdown::Write);
            }
        });
        let _ = stream.read_to_end(&mut answer);
        let _ = stream.shutdown(Shutdown::Both);
    });
    answer
}

fn get(address: SocketAddr, path: &str) -> String {
    let request = format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
    // The requests before may have used up what passes in a second.
    loop {
        let bytes = request.clone().into_bytes();
        let answer = talk(address, &Batch { bytes, ..Batch::default() });
        let answer = String::from_utf8(answer).unwrap();
        if !answer.starts_with("HTTP/1.1 429") && !answer.is_empty() {
            return answer;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn nothing_that_is_sent_does_harm() {
    let usual = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        PANICS.fetch_add(1, Ordering::Relaxed);
        usual(info);
    }));
    let count = std::env::var("VIMC4_CASES").map_or(4_000, |count| count.parse().unwrap());
    let builder = || Emulator::builder().machine("mill").time(Clock::Instant).record(false);
    let emulators = [builder().start().unwrap(), builder().start().unwrap()];
    let place = Place::take("127.0.0.1:0", None).unwrap();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let server = runtime.block_on(Server::start(place, &emulators, None)).unwrap();
    let address = server.address();
    let document = get(address, "/v1/openapi.json");
    let routes = routes(&serde_json::from_str(document.split_once("\r\n\r\n").unwrap().1).unwrap());
    assert!(routes.len() > 50, "{}", routes.len());

    let upgrade = format!(
        "GET /v1/events HTTP/1.1\r\nHost: {address}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    );
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let (begun, mut sent, mut early) = (Instant::now(), 0, None);
    let mut answers: BTreeMap<String, u64> = BTreeMap::new();
    while sent < count {
        let batch = match random.one_in(3) {
            true => frames(&mut random, &upgrade),
            false => requests(&mut random, &routes, address),
        };
        sent += batch.count;
        let answer = talk(address, &batch);
        let mut is_limited = false;
        // One answer follows the other without a line end.
        for answer in String::from_utf8_lossy(&answer).split("HTTP/1.1 ").skip(1) {
            let status: String = answer.chars().take_while(char::is_ascii_digit).collect();
            is_limited |= status == "429";
            *answers.entry(status).or_default() += 1;
        }
        if is_limited {
            std::thread::sleep(Duration::from_millis(100));
        }
        assert_eq!(PANICS.load(Ordering::Relaxed), 0, "{}", batch.bytes.escape_ascii());
        if early.is_none() && sent * 5 >= count {
            early = Some(memory());
        }
    }
    let (early, late) = (early.unwrap(), memory());
    println!(
        "{sent} in {:.0} s, {} MiB after a fifth and {} MiB at the end, answered {answers:?}",
        begun.elapsed().as_secs_f64(),
        early >> 20,
        late >> 20
    );
    // All that it keeps has a limit.
    assert!(late < early + (200 << 20), "from {early} to {late} bytes");
    let known =
        ["101", "200", "400", "403", "404", "405", "409", "413", "415", "422", "429", "431"];
    let strange: Vec<_> =
        answers.keys().filter(|status| !known.contains(&status.as_str())).collect();
    assert!(strange.is_empty(), "{strange:?}");
    assert!(
        ["101", "200", "400", "404", "409", "422"]
            .iter()
            .all(|status| answers.contains_key(*status)),
        "{answers:?}"
    );
    for path in ["/v1", "/v1/controllers/1/view", "/v1/controllers/2/journal"] {
        assert!(get(address, path).starts_with("HTTP/1.1 200"), "{path}");
    }
    // Nobody keeps a place who has left.
    let bytes = upgrade.into_bytes();
    let batch = Batch { bytes, ends: true, ..Batch::default() };
    // Whoever has ended already when it is looked at is not answered, nor is one request too many in a second.
    let is_let_in = (0..100).any(|_| {
        let answer = talk(address, &batch);
        std::thread::sleep(Duration::from_millis(20));
        answer.starts_with(b"HTTP/1.1 101")
    });
    assert!(is_let_in);
}
