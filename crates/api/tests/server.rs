//! The server, asked through raw sockets.

#![expect(clippy::cognitive_complexity, clippy::too_many_lines, reason = "one test is one story")]
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails where anything does")]

use std::cmp::Reverse;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::time::Duration;

use serde_json::{Map, Value, json};
use vimc4::{Clock, Emulator};
use vimc4_api::{Place, Server, ServerError, Token};

/// A server with its controllers.
struct Served {
    address: SocketAddr,
    emulators: Vec<Emulator>,
    _server: Server,
}

const TOKEN: &str = "0123456789abcdef";

fn serve(clock: Clock, count: usize, token: Option<&str>) -> Served {
    let builder = || Emulator::builder().machine("mill").time(clock).record(false);
    let emulators: Vec<Emulator> = (0..count).map(|_| builder().start().unwrap()).collect();
    let token = token.map(|token| Token::new(token).unwrap());
    let place = Place::take("127.0.0.1:0", token).unwrap();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let server = runtime.block_on(Server::start(place, &emulators, None)).unwrap();
    Served { address: server.address(), emulators, _server: server }
}

/// An answer, taken apart.
#[derive(Debug)]
struct Answer {
    status: u16,
    headers: Vec<(String, String)>,
    body: String,
}

impl Answer {
    fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|error| panic!("{error}: {}", self.body))
    }

    fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(own, _)| own == name).map(|(_, value)| value.as_str())
    }
}

fn read(reader: &mut impl BufRead) -> Answer {
    let line = |reader: &mut dyn BufRead| {
        let mut line = String::new();
        reader.read_line(&mut line).unwrap();
        line.trim_end().to_owned()
    };
    let first = line(reader);
    let status = first.split(' ').nth(1).unwrap_or_else(|| panic!("{first:?}")).parse().unwrap();
    let mut headers = Vec::new();
    loop {
        let header = line(reader);
        let Some((name, value)) = header.split_once(':') else { break };
        headers.push((name.to_lowercase(), value.trim().to_owned()));
    }
    let length = headers.iter().find(|(name, _)| name == "content-length");
    let mut body = vec![0; length.map_or(0, |(_, length)| length.parse().unwrap())];
    reader.read_exact(&mut body).unwrap();
    Answer { status, headers, body: String::from_utf8(body).unwrap() }
}

impl Served {
    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        stream
    }

    /// A request as it is sent, with a host and the length of its body.
    fn raw(&self, method: &str, path: &str, headers: &str, body: &str) -> Answer {
        let mut stream = self.connect();
        let host = match headers.contains("Host:") {
            true => String::new(),
            false => format!("Host: {}\r\n", self.address),
        };
        let length = match body.is_empty() {
            true => String::new(),
            false => format!("Content-Length: {}\r\n", body.len()),
        };
        write!(stream, "{method} {path} HTTP/1.1\r\n{host}{headers}{length}\r\n{body}").unwrap();
        read(&mut BufReader::new(stream))
    }

    fn get(&self, path: &str) -> Answer {
        self.raw("GET", path, "", "")
    }

    fn send(&self, method: &str, path: &str, body: &Value) -> Answer {
        let body = if body.is_null() { String::new() } else { body.to_string() };
        self.raw(method, path, "Content-Type: application/json\r\n", &body)
    }

    fn watch(&self, headers: &str) -> Watcher {
        let mut stream = self.connect();
        write!(
            stream,
            "GET /v1/events HTTP/1.1\r\nHost: {}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\
             {headers}\r\n",
            self.address
        )
        .unwrap();
        let mut reader = BufReader::new(stream.try_clone().unwrap());
        let answer = read(&mut reader);
        assert_eq!(answer.status, 101, "{answer:?}");
        assert_eq!(answer.header("sec-websocket-accept"), Some("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="));
        Watcher { stream, reader }
    }
}

/// The far end of a WebSocket.
struct Watcher {
    stream: TcpStream,
    reader: BufReader<TcpStream>,
}

impl Watcher {
    fn frame(&mut self, first: u8, bytes: &[u8]) {
        let mut frame = vec![first];
        match bytes.len() {
            length @ 0..126 => frame.push(0x80 | u8::try_from(length).unwrap()),
            length => {
                frame.push(0x80 | 126);
                frame.extend(u16::try_from(length).unwrap().to_be_bytes());
            }
        }
        // A mask of zeros leaves everything as it is.
        frame.extend([0; 4]);
        frame.extend(bytes);
        self.stream.write_all(&frame).unwrap();
    }

    fn say(&mut self, wish: &Value) {
        self.frame(0x81, wish.to_string().as_bytes());
    }

    /// The next message; `None` when it was closed.
    fn next(&mut self) -> Option<Value> {
        let mut head = [0; 2];
        self.reader.read_exact(&mut head).ok()?;
        let length = match head[1] {
            126 => {
                let mut length = [0; 2];
                self.reader.read_exact(&mut length).unwrap();
                u64::from(u16::from_be_bytes(length))
            }
            127 => {
                let mut length = [0; 8];
                self.reader.read_exact(&mut length).unwrap();
                u64::from_be_bytes(length)
            }
            length => u64::from(length),
        };
        let mut bytes = vec![0; usize::try_from(length).unwrap()];
        self.reader.read_exact(&mut bytes).unwrap();
        (head[0] == 0x81).then(|| serde_json::from_slice(&bytes).unwrap())
    }

    /// Why it is closed: the code in the last frame.
    fn closing(mut self) -> Option<u16> {
        let mut sent = Vec::new();
        let _ = self.reader.read_to_end(&mut sent);
        let mut rest = &sent[..];
        while let [first, length, ..] = *rest {
            let (begin, length) = match length {
                126 => (4, usize::from(u16::from_be_bytes([rest[2], rest[3]]))),
                length => (2, usize::from(length)),
            };
            let (frame, behind) = rest.split_at(begin + length);
            if first == 0x88 {
                let code = frame.get(2..4).map(|code| u16::from_be_bytes([code[0], code[1]]));
                return Some(code.unwrap_or(1005));
            }
            rest = behind;
        }
        None
    }

    /// The next message of this type.
    fn next_of(&mut self, kind: &str) -> Value {
        loop {
            let message = self.next().unwrap_or_else(|| panic!("closed before {kind}"));
            if message["type"] == kind {
                return message;
            }
        }
    }

    /// The next entries, until one is of this kind.
    fn entries_until(&mut self, kind: &str) -> Vec<Value> {
        let mut entries = Vec::new();
        while !entries.iter().any(|entry: &Value| entry["kind"] == kind) {
            entries.extend(self.next_of("events")["entries"].as_array().unwrap().iter().cloned());
        }
        entries
    }
}

fn host_says(emulator: &Emulator, commands: &str) {
    let mut port = emulator.connect().unwrap();
    port.write_all(commands.as_bytes()).unwrap();
    emulator.now().unwrap();
}

// --- what it can do ---

/// The printed address ends with a slash, and a path begins with one.
#[test]
fn two_slashes_at_the_beginning_are_one() {
    let served = serve(Clock::Manual, 1, Some("0123456789abcdef"));
    assert_eq!(served.get("//v1/docs").status, 200);
    assert_eq!(served.get("//").status, 200);
    // And ask for the token where one does.
    assert_eq!(served.get("//v1/controllers").status, 401);
    let own = "Authorization: Bearer 0123456789abcdef\r\n";
    assert_eq!(served.raw("GET", "//v1/controllers?x=1", own, "").status, 400);
    assert_eq!(served.raw("GET", "///v1/controllers", own, "").status, 200);
    assert_eq!(served.raw("GET", "/v1//controllers", own, "").status, 404);
}

#[test]
fn orders_are_those_of_standard_input() {
    let served = serve(Clock::Manual, 2, None);
    let order = |number: usize, order: &str| {
        served.send("POST", &format!("/v1/controllers/{number}/orders"), &json!({ "order": order }))
    };
    assert_eq!(order(1, "cover open").json(), json!({ "text": "ok" }));
    assert_eq!(served.emulators[0].view().unwrap().signal("cover"), Some(0));
    assert_eq!(served.emulators[1].view().unwrap().signal("cover"), Some(1));
    assert_eq!(order(1, "cover closed").status, 200);
    let wrong = order(1, "cover shut");
    assert_eq!(wrong.status, 422);
    assert_eq!(wrong.header("content-type"), Some("application/problem+json"));
    assert_eq!(
        wrong.json(),
        json!({
            "type": "/v1/docs#not-understood",
            "title": "The words, the name or the value mean nothing to this controller",
            "status": 422,
            "detail": "`cover shut` is wrong at `shut`: `cover` cannot be `shut`",
            "remedy": "it can be open or closed",
        })
    );
    host_says(&served.emulators[0], "@07\r@0A5000,900,0,900,0,900,0,900\r");
    assert_eq!(
        order(1, "run until x 2500").json()["text"].as_str().unwrap().split(' ').next(),
        Some("there")
    );
    assert_eq!(order(1, "position").json()["text"], "X 2500 Y 0 Z 0 A 0");
    assert_eq!(order(3, "position").status, 404);
    assert_eq!(order(1, "").json(), json!({ "text": "" }));
}

#[test]
fn time_is_led() {
    let served = serve(Clock::Manual, 1, None);
    let post =
        |path: &str, body: Value| served.send("POST", &format!("/v1/controllers/1{path}"), &body);
    assert_eq!(
        post("/clock/advance", json!({ "span": "250ms" })).json(),
        json!({ "now": 250_000_000 })
    );
    assert_eq!(post("/clock/run-until", json!({ "condition": "x > 1" })).status, 409);
    assert_eq!(post("/clock/run-until", json!({ "condition": "x >" })).status, 422);
    assert_eq!(
        post("/line", json!({ "send": "@07\r@0A5000,900,0,900,0,900,0,900\r" })).status,
        200
    );
    assert_eq!(post("/clock/run-until", json!({ "condition": "x > 100" })).status, 200);
    let position = served.get("/v1/controllers/1/position").json();
    assert_eq!(position["axes"]["X"], 101);
    assert_eq!(post("/clock/run-until", json!({ "condition": "idle" })).status, 200);
    assert_eq!(served.emulators[0].position().unwrap(), [5_000, 0, 0, 0]);
    // What does not run by itself has no speed.
    let speed = served.send("PUT", "/v1/controllers/1/clock", &json!({ "clock": "8x" }));
    assert_eq!(speed.status, 409);
    let none = served.send("PUT", "/v1/controllers/1/clock", &json!({ "clock": "0x" }));
    assert_eq!(none.status, 422);
    assert!(none.json()["remedy"].as_str().is_some_and(|it| it.starts_with("leave this one")));
    // Time stands still by itself here, and a step is for a controller whose time is paused.
    let step = post("/clock/step", Value::Null);
    assert_eq!((step.status, &step.json()["detail"]), (409, &json!("time is not paused")));
    assert_eq!(step.json()["remedy"], "POST to clock/pause before it");
    assert_eq!(post("/clock/pause", Value::Null).status, 200);
    assert_eq!(post("/clock/step", Value::Null).json()["step"], "rest");

    let served = serve(Clock::Real, 1, None);
    let post = |path: &str| served.send("POST", &format!("/v1/controllers/1{path}"), &Value::Null);
    let clock = || served.get("/v1/controllers/1/clock").json();
    let speed = served.send("PUT", "/v1/controllers/1/clock", &json!({ "clock": "1000x" }));
    assert_eq!(speed.json()["clock"], "1000x");
    // The remedy has only what one that runs by itself can change to.
    let wrong = served.send("PUT", "/v1/controllers/1/clock", &json!({ "clock": "0x" }));
    assert_eq!((wrong.status, &wrong.json()["detail"]), (422, &json!("`0x` is not a clock")));
    assert_eq!(
        wrong.json()["remedy"],
        "send real, or a factor from 0.001x to 1000000x such as 8x or 0.5x"
    );
    assert_eq!(clock()["paused"], Value::Null);
    assert_eq!(post("/clock/pause").status, 200);
    let paused = clock();
    assert_eq!(paused["paused"]["by"], "the API");
    assert_eq!(paused["now"], clock()["now"]);
    assert_eq!(post("/clock/step").json()["step"], "rest");
    assert_eq!(post("/clock/resume").status, 200);
    assert_eq!(clock()["paused"], Value::Null);
    // A journey that nobody waits for any more is given up: there is room for more than are let in.
    for _ in 0..150 {
        let mut stream = served.connect();
        let body = json!({ "condition": "x > 5" }).to_string();
        write!(
            stream,
            "POST /v1/controllers/1/clock/run-until HTTP/1.1\r\nHost: {}\r\nContent-Type: \
             application/json\r\nContent-Length: {}\r\n\r\n{body}",
            served.address,
            body.len()
        )
        .unwrap();
    }
    let idle = json!({ "condition": "idle" });
    let has_room = |_| {
        std::thread::sleep(Duration::from_millis(50));
        served.send("POST", "/v1/controllers/1/clock/run-until", &idle).status == 200
    };
    assert!((0..600).any(has_room));
}

#[test]
fn states_faults_rules_and_breakpoints_come_and_go() {
    let served = serve(Clock::Manual, 1, None);
    let at = |path: &str| format!("/v1/controllers/1{path}");
    let post = |path: &str, body: Value| served.send("POST", &at(path), &body);
    let delete = |path: &str| served.send("DELETE", &at(path), &Value::Null);
    let list = |path: &str| served.get(&at(path)).json();

    let kept = post("/snapshots", json!({ "name": "before" })).json();
    assert_eq!(kept, json!({ "id": 1, "name": "before", "at": 0 }));
    assert_eq!(post("/clock/advance", json!({ "span": "1s" })).status, 200);
    assert_eq!(post("/snapshots/1/restore", Value::Null).json(), json!({ "now": 0 }));
    assert_eq!(list("/snapshots"), json!([kept]));
    assert_eq!(delete("/snapshots/1").json(), json!({ "effect": "something" }));
    assert_eq!(delete("/snapshots/1").status, 404);
    assert_eq!(post("/snapshots/x/restore", Value::Null).status, 404);

    assert_eq!(
        post("/faults", json!({ "fault": "drop to-host once" })).json(),
        json!({ "number": 1 })
    );
    assert_eq!(list("/faults")[0]["fault"], "drop to-host once");
    assert_eq!(delete("/faults/1").status, 200);
    assert_eq!((list("/faults"), delete("/faults/1").status), (json!([]), 404));
    assert_eq!(post("/faults", json!({ "fault": "drop everything" })).status, 422);

    let rules = json!({ "rules": "when x > 1000: press stop\nat 2s: power off" });
    assert_eq!(post("/rules", rules).json(), json!({ "scenario": 1 }));
    assert_eq!(list("/rules").as_array().unwrap().len(), 2);
    assert_eq!(list("/rules")[0]["rule"], "when x > 1000: press stop");
    assert_eq!(delete("/rules/1").status, 200);
    assert_eq!(post("/rules", json!({ "rules": "\n" })).status, 422);
    assert_eq!(post("/reset", Value::Null).status, 200);

    let id = post("/breakpoints", json!({ "condition": "x = 100" })).json()["id"].clone();
    assert_eq!(list("/breakpoints"), json!([{ "id": id, "condition": "x = 100", "met": 0 }]));
    host_says(&served.emulators[0], "@07\r@0A5000,900,0,900,0,900,0,900\r");
    let met = post("/clock/advance", json!({ "span": "10s" })).json();
    assert_eq!(met["paused"], list("/clock")["paused"]);
    assert_eq!(post("/clock/advance", json!({ "span": "10s" })).status, 409);
    assert_eq!(list("/clock")["paused"]["breakpoints"], json!([id]));
    assert_eq!(served.emulators[0].position().unwrap()[0], 100);
    assert_eq!(delete(&format!("/breakpoints/{id}")).status, 200);
    assert_eq!(delete(&format!("/breakpoints/{id}")).status, 404);
    assert_eq!(post("/clock/resume", Value::Null).status, 200);

    let signal = |name: &str, value: Value| {
        served.send("PUT", &at(&format!("/signals/{name}")), &json!({ "value": value }))
    };
    assert_eq!(signal("cover", json!("open")).json(), json!({ "effect": "something" }));
    assert_eq!(signal("cover", json!(0)).json()["effect"], "nothing");
    assert_eq!(signal("limit%20x+", json!(1)).status, 200);
    assert_eq!(signal("cover", json!("shut")).status, 422);
    assert_eq!(signal("lid", json!(1)).status, 404);
    let cover = list("/signals");
    let cover = cover.as_array().unwrap().iter().find(|signal| signal["name"] == "cover");
    assert_eq!(cover.unwrap()["value"], 0);
}

// --- what is expected ---

const MOVE: &str = "@07\r@0A5000,900,0,900,0,900,0,900\r";

#[test]
fn what_is_expected_is_followed_and_a_near_miss_is_told() {
    let served = serve(Clock::Manual, 2, None);
    let at = |path: &str| format!("/v1/controllers/1/expectations{path}");
    let post = |path: &str, body: Value| served.send("POST", &at(path), &body);
    let expect = |sentence: &str| post("", json!({ "expect": sentence }));
    let state = |id: u64| served.get(&at(&format!("/{id}"))).json()["state"].clone();

    let moved = expect("command @A answered 0, once; then command @P, once").json();
    let open = json!({
        "id": 1,
        "expected": "command @A answered 0, once; then command @P, once",
        "state": "open",
        "failure": null,
    });
    assert_eq!(moved, open);
    assert_eq!(served.get(&at("")).json(), json!([open]));
    assert_eq!(expect("x > 20mm, never").json()["state"], "met");
    assert_eq!(expect("x > 50mm, never").json()["id"], 3);
    assert_eq!(expect("whenever x > 0: command @P within 1 s").json()["state"], "open");
    host_says(&served.emulators[0], MOVE);
    assert_eq!((state(1), state(2)), (json!("open"), json!("met")));
    served.emulators[0].run_until_idle().unwrap();

    // 5,000 steps are 62.5 mm: what cannot be met any more is known at that step.
    let failed = served.get(&at("/3")).json();
    assert_eq!(
        (&failed["state"], &failed["failure"]["reason"]),
        (&json!("failed"), &json!("too-often"))
    );
    let text = failed["failure"]["text"].as_str().unwrap();
    assert!(text.starts_with("expected x > 4000, never\n  but it came at "), "{text}");
    assert_eq!(
        failed["failure"]["at"].as_u64(),
        served.get(&at("/3")).json()["failure"]["at"].as_u64()
    );

    host_says(&served.emulators[0], "@0P\r");
    assert_eq!(state(1), "met");
    assert_eq!(post("/1/wait", Value::Null).json()["state"], "met");
    let met = post("/1/check", Value::Null);
    assert_eq!((met.status, &met.json()["state"]), (200, &json!("met")));
    for path in ["/1/check", "/1/wait", "/x/check"] {
        assert_eq!(post(path, Value::Null).status, 404, "{path}");
    }
    for id in [3, 4] {
        let unmet = post(&format!("/{id}/check"), Value::Null);
        assert_eq!((unmet.status, &unmet.json()["type"]), (409, &json!("/v1/docs#unmet")));
        let detail = unmet.json()["detail"].as_str().unwrap().to_owned();
        assert!(detail.contains("what happened around it:"), "{detail}");
        assert_eq!(unmet.json()["failure"]["text"], *detail);
    }
    let delete = |path: &str| served.send("DELETE", &at(path), &Value::Null).status;
    assert_eq!((delete("/2"), delete("/2")), (200, 404));
    assert_eq!(served.get(&at("")).json(), json!([]));

    let wrong = expect("command @A");
    assert_eq!(wrong.status, 422);
    assert_eq!(wrong.json()["remedy"], "say how often, as in `command @A, once`");
    assert_eq!(expect("x > 1, at least 0 times").status, 422);
    // No axis is meant, and that there are some is no remedy.
    let rubbish = expect("foo, once").json();
    assert_eq!(rubbish["detail"], "this cannot be expected: `foo` is wrong");
    assert!(rubbish["remedy"].as_str().unwrap().starts_with("a condition, such as"), "{rubbish}");
    for _ in 0..100 {
        assert_eq!(expect("x > 9999999, never").status, 200);
    }
    assert_eq!(expect("x > 9999999, never").status, 429);
    // The other controller has its own.
    assert_eq!(served.get("/v1/controllers/2/expectations").json(), json!([]));
}

#[test]
fn who_waits_for_an_expectation_hears_of_it_as_it_happens() {
    let served = serve(Clock::Manual, 1, None);
    let at = |path: &str| format!("/v1/controllers/1/expectations{path}");
    let expect = json!({ "expect": "command @P answered, once" });
    for (id, says, state) in [(1, "@07\r@0P\r", "met"), (2, "@0P\r@0P\r", "failed")] {
        assert_eq!(served.send("POST", &at(""), &expect).status, 200);
        let mut stream = served.connect();
        let path = at(&format!("/{id}/wait"));
        write!(stream, "POST {path} HTTP/1.1\r\nHost: {}\r\n\r\n", served.address).unwrap();
        // It has been taken in when a later request is answered.
        assert_eq!(served.get(&at("")).status, 200);
        host_says(&served.emulators[0], says);
        let answer = read(&mut BufReader::new(stream)).json();
        let now = served.get(&at(&format!("/{id}"))).json();
        assert!(answer["state"] == "met" || answer["state"] == state, "{answer}");
        assert_eq!(now["state"], state, "{now}");
    }
    // One that is deleted meanwhile is waited for in vain.
    assert_eq!(served.send("POST", &at(""), &expect).status, 200);
    let mut stream = served.connect();
    let path = at("/3/wait");
    write!(stream, "POST {path} HTTP/1.1\r\nHost: {}\r\n\r\n", served.address).unwrap();
    assert_eq!(served.get(&at("")).status, 200);
    assert_eq!(served.send("DELETE", &at("/3"), &Value::Null).status, 200);
    assert_eq!(read(&mut BufReader::new(stream)).status, 404);
}

#[test]
fn the_journal_is_held_against_a_sentence() {
    let served = serve(Clock::Instant, 1, None);
    let so_far = |sentence: &str| {
        let body = json!({ "expect": sentence });
        served.send("POST", "/v1/controllers/1/journal/expect", &body)
    };
    host_says(&served.emulators[0], MOVE);
    served.emulators[0].run_until_idle().unwrap();
    let met = so_far("command @A answered 0, once; then command @P, never");
    assert_eq!(
        met.json(),
        json!({ "expected": "command @A answered 0, once; then command @P, never", "state": "met" })
    );
    let unmet = so_far("x > 63mm, once");
    assert_eq!((unmet.status, &unmet.json()["failure"]["reason"]), (409, &json!("missing")));
    let closest = &unmet.json()["failure"]["closest"][0];
    assert_eq!(closest, "X came to 5,000 (62.5 mm), 41 steps short of it");
    assert_eq!(so_far("x >").status, 422);
    // What is not kept any more could have been anything, and where it led to is known.
    for _ in 0..6 {
        host_says(&served.emulators[0], &"@0P\r".repeat(2_000));
    }
    let unknown = so_far("x = 5000, at least once");
    assert_eq!(unknown.status, 409);
    assert!(unknown.json()["detail"].as_str().unwrap().starts_with("nobody knows"), "{unknown:?}");
    assert!(
        so_far("x = 4000, once").json()["detail"].as_str().unwrap().contains("but it never came")
    );
}

// --- what is kept ---

#[test]
fn the_memory_is_read_and_changed() {
    let served = serve(Clock::Manual, 2, None);
    let path = |number: usize| format!("/v1/controllers/{number}/flash");
    let put =
        |number: usize, image: &str| served.send("PUT", &path(number), &json!({ "image": image }));
    assert_eq!(served.get(&path(1)).body, "vimc4 flash 1\n");
    host_says(&served.emulators[0], "@01\r@0i\r0 500,900\r9\r");
    let image = served.get(&path(1)).body;
    assert!(image.starts_with("vimc4 flash 1\nprogram axes=1 "), "{image}");
    // The same program in another one, which START runs.
    assert_eq!(put(2, &image).json(), json!({ "effect": "something" }));
    assert_eq!(served.get(&path(2)).body, image);
    served.send("POST", "/v1/controllers/2/orders", &json!({ "order": "press start" }));
    let busy = put(2, "vimc4 flash 1\n");
    assert_eq!((busy.status, &busy.json()["type"]), (409, &json!("/v1/docs#not-now")));
    served.emulators[1].run_until_idle().unwrap();
    assert_eq!(served.emulators[1].position().unwrap(), [500, 0, 0, 0]);
    // What is empty is no image: most often a file was not read.
    let kept = served.get(&path(2)).body;
    let empty = put(2, "").json();
    assert_eq!((&empty["status"], &empty["detail"]), (&json!(400), &json!("the image is empty")));
    assert!(empty["remedy"].as_str().unwrap().contains(r#"send "vimc4 flash 1\n""#), "{empty}");
    assert_eq!(served.get(&path(2)).body, kept);
    assert_eq!(put(2, "vimc4 flash 1\n").status, 200);
    assert_eq!(served.get(&path(2)).body, "vimc4 flash 1\n");
    let wrong = put(2, "vimc4 flash 1\nprogramme\n");
    assert_eq!(wrong.status, 422);
    assert!(
        wrong.json()["detail"].as_str().unwrap().starts_with("line 2 of the flash"),
        "{wrong:?}"
    );
    assert_eq!(put(2, "text").status, 422);
    // Whatever is wrong with it, nobody is told to send what erases the memory.
    let wrong = [
        wrong,
        put(2, "vimc4 flash 9\n"),
        served.send("PUT", &path(2), &json!({})),
        served.send("PUT", &path(2), &json!({ "image": 5 })),
        served.raw("PUT", &path(2), "Content-Type: application/json\r\n", "foo"),
    ];
    for wrong in wrong {
        assert_eq!(wrong.json()["remedy"], empty["remedy"], "{wrong:?}");
    }
    // The bytes themselves will do.
    let bytes = |kind: &str, image: &str| {
        served.raw("PUT", &path(2), &format!("Content-Type: {kind}\r\n"), image)
    };
    assert_eq!(bytes("application/octet-stream", &image).status, 200);
    assert_eq!(served.get(&path(2)).body, image);
    assert_eq!(bytes("Application/Octet-Stream; x=y", "text").status, 422);
    let other = bytes("text/plain", &image);
    assert_eq!(other.status, 415);
    assert!(other.body.contains("or of its bytes application/octet-stream"), "{}", other.body);
    assert_eq!(bytes("application/octet-stream", "").status, 400);
    assert_eq!(served.get(&path(2)).body, image);
    let elsewhere = "Content-Type: application/octet-stream\r\n";
    let order = served.raw("POST", "/v1/controllers/2/orders", elsewhere, "press stop");
    assert_eq!(order.status, 415, "{}", order.body);
    // An image may be larger than other bodies.
    let line = "line 0 500,900\n".repeat(5_000);
    let large = image.replacen("line ", &format!("{line}line "), 1);
    assert!(large.len() > 64 * 1024);
    assert_eq!(put(2, &large).status, 200);
    let length = "Content-Type: application/json\r\nContent-Length: 5000000\r\n";
    assert_eq!(served.raw("PUT", &path(2), length, "").status, 413);
}

#[test]
fn a_recording_is_read_while_it_goes_on() {
    let served = serve(Clock::Manual, 1, None);
    let path = "/v1/controllers/1/recording";
    let change = |method: &str| served.send(method, path, &Value::Null).status;
    assert_eq!((served.get(path).status, change("DELETE")), (404, 404));
    host_says(&served.emulators[0], "@07\r");
    assert_eq!((change("POST"), change("POST")), (200, 409));
    host_says(&served.emulators[0], "@0A50,900,0,900,0,900,0,900\r");
    served.emulators[0].run_until_idle().unwrap();
    let first = served.get(path);
    assert_eq!(first.header("content-type"), Some("application/x-ndjson"));
    let lines: Vec<Value> =
        first.body.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((&lines[0]["recording"], &lines[0]["clock"]), (&json!(1), &json!("manual")));
    assert_eq!(lines[0]["from"], "the API");
    assert!(lines[1]["state"].is_object() && lines[1]["by"].is_null());
    assert!(lines.iter().any(|line| line["in"] == "@0A50,900,0,900,0,900,0,900\r"));
    assert!(lines.iter().any(|line| line["out"] == "0"), "{}", first.body);
    host_says(&served.emulators[0], &"@0P\r".repeat(2_000));
    let second = served.get(path).body;
    assert!(second.starts_with(&first.body) && second.len() > 100_000 && second.ends_with("}\n"));
    assert_eq!((change("DELETE"), served.get(path).status), (200, 404));
    assert_eq!(change("POST"), 200);
    assert!(served.get(path).body.len() < second.len());
}

#[test]
fn a_viewer_knows_a_server_that_it_has_seen() {
    let (one, other) = (serve(Clock::Manual, 1, None), serve(Clock::Manual, 1, None));
    let instance = one.get("/v1").json()["instance"].clone();
    assert!(instance.is_string());
    assert_eq!(one.get("/v1").json()["instance"], instance);
    assert_ne!(other.get("/v1").json()["instance"], instance);
    let mut watcher = one.watch("");
    watcher.say(&json!({}));
    assert_eq!(watcher.next_of("hello")["instance"], instance);
}

// --- what happened ---

#[test]
fn the_journal_is_read_in_pages() {
    let served = serve(Clock::Instant, 1, None);
    host_says(&served.emulators[0], "@07\r@0A5000,900,0,900,0,900,0,900\r@0x\r");
    served.emulators[0].run_until_idle().unwrap();
    let page = |query: &str| served.get(&format!("/v1/controllers/1/journal{query}"));
    let all = page("").json();
    let entries = all["entries"].as_array().unwrap();
    let numbers: Vec<u64> = entries.iter().map(|entry| entry["number"].as_u64().unwrap()).collect();
    assert_eq!(numbers, (1..=all["last"].as_u64().unwrap()).collect::<Vec<_>>());
    let of = |kind: &str| entries.iter().filter(|entry| entry["kind"] == kind).collect::<Vec<_>>();
    assert_eq!(of("command")[1]["bytes"], "@0A5000,900,0,900,0,900,0,900");
    assert_eq!(of("command")[1]["command"], of("answer")[1]["command"]);
    assert_eq!(of("answer")[1]["text"], "0  after 5.6 s");
    let motions = of("motion");
    assert_eq!(motions[0]["motion"], "begins");
    assert_eq!(motions[0]["mnemonic"], "@A");
    assert_eq!(motions[0]["points"][1][0], 5_000);
    assert_eq!((&motions[1]["motion"], &motions[1]["to"][0]), (&json!("ends"), &json!(5_000)));

    let first = page("?limit=2").json();
    assert_eq!((first["entries"].as_array().unwrap().len(), &first["next"]), (2, &json!(2)));
    assert_eq!(page("?after=2&limit=1").json()["entries"][0], entries[2]);
    let commands = page("?kinds=command&search=RELATIVE").json();
    assert_eq!(commands["entries"].as_array().unwrap().len(), 1);
    assert_eq!((page("?kinds=comand").status, page("?limit=x").status), (422, 400));
    assert_eq!(page("?page=2").status, 400);
    // Whoever pages by `next` misses nothing, and is never sent what has been seen.
    for after in ["99999999", "18446744073709551615"] {
        let beyond = page(&format!("?after={after}")).json();
        assert_eq!((&beyond["entries"], &beyond["next"]), (&json!([]), &all["last"]));
    }
    // A client that pages with no entries would never end.
    let none = page("?after=3&limit=0");
    assert_eq!(
        (none.status, &none.json()["detail"]),
        (400, &json!("`limit=0` asks for no entries"))
    );
    assert_eq!(none.json()["remedy"], "write a number from 1 to 1000, as in limit=200");
}

#[test]
fn what_was_missed_is_sent_again_and_what_is_gone_is_a_gap() {
    let served = serve(Clock::Instant, 2, None);
    let mut watcher = served.watch("");
    watcher.say(&json!({}));
    assert_eq!(
        watcher.next_of("hello")["controllers"][1],
        json!({ "number": 2, "first": 1, "last": 0 })
    );
    host_says(&served.emulators[1], "@07\r");
    let entries = watcher.entries_until("answer");
    assert!(entries.iter().any(|entry| entry["kind"] == "command"));
    let last = entries.iter().filter_map(|entry| entry["number"].as_u64()).max().unwrap();
    drop(watcher);

    host_says(&served.emulators[1], "@0R1\r");
    served.emulators[1].run_until_idle().unwrap();
    let mut again = served.watch("");
    again.say(&json!({ "controllers": [2], "kinds": ["command"], "after": { "2": last } }));
    let entries = again.entries_until("command");
    assert_eq!(entries.iter().map(|entry| &entry["mnemonic"]).collect::<Vec<_>>(), ["@R"]);

    // Another wish of the same client: all, from the beginning, of which the oldest are gone.
    for _ in 0..4 {
        host_says(&served.emulators[1], &"@0P\r".repeat(2_000));
    }
    again.say(&json!({ "after": { "2": 0 } }));
    let gap = again.next_of("gap");
    let next = again.next_of("events")["entries"][0]["number"].clone();
    assert_eq!(gap["from"], 1);
    assert_eq!(gap["to"].as_u64().unwrap() + 1, next.as_u64().unwrap());
}

#[test]
fn positions_are_the_latest() {
    let served = serve(Clock::Manual, 1, None);
    let mut watcher = served.watch("");
    watcher.say(&json!({ "kinds": [], "positions": 1000 }));
    assert_eq!(watcher.next_of("position")["positions"], json!([0, 0, 0, 0]));
    host_says(&served.emulators[0], "@07\r@0A5000,900,0,900,0,900,0,900\r");
    served.emulators[0].run_until(&vimc4::Condition::AxisAt { axis: 0, position: 2_500 }).unwrap();
    loop {
        let position = watcher.next_of("position");
        if position["positions"][0] == 2_500 {
            assert_eq!(
                (&position["moving"], &position["activity"]),
                (&json!(true), &json!("move"))
            );
            break;
        }
    }
    served.emulators[0].run_until_idle().unwrap();
    while watcher.next_of("position")["positions"][0] != 5_000 {}
}

#[test]
fn wrong_wishes_are_answered_and_end_it() {
    let served = serve(Clock::Manual, 1, None);
    for wish in [
        json!({ "controlers": [1] }),
        json!({ "controllers": [2] }),
        json!({ "controllers": [0] }),
        json!({ "kinds": ["comand"] }),
        json!({ "after": { "2": 1 } }),
        json!([]),
        json!("text"),
    ] {
        let mut watcher = served.watch("");
        watcher.say(&wish);
        let problem = watcher.next().unwrap_or_else(|| panic!("no answer to {wish}"));
        assert_eq!(problem["type"], "problem", "{wish}");
        assert!(problem["remedy"].is_string(), "{problem}");
        assert_eq!(watcher.next(), None);
    }
    assert_eq!(served.get("/v1").status, 200);
}

#[test]
fn a_web_socket_is_closed_as_it_should_be() {
    let served = serve(Clock::Manual, 1, None);
    for (frame, bytes, code) in [
        (0x88, &b"\x03\xE8"[..], 1000),
        (0x88, b"", 1005),
        (0x82, b"{}", 1008),
        (0x80, b"{}", 1002),
        (0x83, b"{}", 1002),
        (0xFF, b"{}", 1002),
        (0x81, b"\xFF", 1007),
        (0x81, &[b'['; 60_000], 1009),
    ] {
        let mut watcher = served.watch("");
        watcher.frame(frame, bytes);
        if frame != 0x88 {
            // The client hears that it is over, and hangs up.
            watcher.stream.shutdown(Shutdown::Write).unwrap();
        }
        assert_eq!(watcher.closing(), Some(code), "{frame:x} {}", bytes.len());
    }
    let mut unmasked = served.watch("");
    unmasked.stream.write_all(b"\x81\x02{}").unwrap();
    unmasked.stream.shutdown(Shutdown::Write).unwrap();
    assert_eq!(unmasked.closing(), Some(1002));
}

#[test]
fn who_is_told_to_leave_keeps_nobody_out() {
    let served = serve(Clock::Manual, 1, None);
    let stays: Vec<Watcher> = (0..64)
        .map(|_| {
            let mut watcher = served.watch("");
            watcher.frame(0x81, b"zz");
            watcher.next_of("problem");
            watcher.next();
            watcher
        })
        .collect();
    let mut another = served.watch("");
    another.say(&json!({}));
    another.next_of("hello");
    drop(stays);
}

/// Answers to its pings would pile up for it, without end.
#[test]
fn who_takes_no_answers_is_not_heard_until_it_does() {
    const PINGS: usize = 1 << 16;
    let served = serve(Clock::Manual, 1, None);
    let mut watcher = served.watch("");
    watcher.say(&json!({ "kinds": ["command"] }));
    watcher.next_of("hello");
    watcher.stream.set_write_timeout(Some(Duration::from_secs(1))).unwrap();
    let pings = [&[0x89, 0xFD, 0, 0, 0, 0][..], &[7; 125]].concat().repeat(PINGS);
    let mut taken = 0;
    // Systems keep some of it.
    while taken < 64 << 20 {
        match watcher.stream.write(&pings[taken % 131..]) {
            Ok(count) => taken += count,
            Err(_) => break,
        }
    }
    assert!(taken < 64 << 20, "{taken}");
    assert_eq!(served.get("/v1").status, 200);
    let whole = taken / 131;
    let rest = pings[taken % 131..131].to_vec();
    let mut stream = watcher.stream.try_clone().unwrap();
    stream.set_write_timeout(None).unwrap();
    let ends = std::thread::spawn(move || {
        if rest.len() < 131 {
            stream.write_all(&rest).unwrap();
        }
        stream.write_all(b"\x81\x82\0\0\0\0{}").unwrap();
    });
    let mut pong = [0; 127];
    for _ in 0..whole {
        watcher.reader.read_exact(&mut pong).unwrap();
        assert_eq!(pong, *[&[0x8A, 125][..], &[7; 125]].concat());
    }
    ends.join().unwrap();
}

// --- who may ---

#[test]
fn no_other_page_reads_or_drives() {
    let served = serve(Clock::Manual, 1, None);
    let own = served.address;
    let order = json!({ "order": "cover open" }).to_string();
    let json = "Content-Type: application/json\r\n";
    for headers in [
        "Host: rebind.example\r\n".to_owned(),
        format!("Host: rebind.example:{}\r\n", own.port()),
        "Origin: http://elsewhere.example\r\n".to_owned(),
        format!("Origin: http://localhost:{}\r\n", own.port()),
        "Origin: null\r\n".to_owned(),
        "Sec-Fetch-Site: cross-site\r\n".to_owned(),
        "Sec-Fetch-Site: same-site\r\n".to_owned(),
    ] {
        let answer = served.raw("GET", "/v1/controllers/1/view", &headers, "");
        assert_eq!(answer.status, 403, "{headers}");
        let path = "/v1/controllers/1/orders";
        let answer = served.raw("POST", path, &format!("{headers}{json}"), &order);
        assert_eq!(answer.status, 403, "{headers}");
        assert!(answer.json()["remedy"].is_string());
        let answer = served.raw(
            "GET",
            "/v1/events",
            &format!(
                "{headers}Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                 Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
            ),
            "",
        );
        assert_eq!(answer.status, 403, "{headers}");
        assert!(!answer.headers.iter().any(|(name, _)| name.starts_with("access-control")));
    }
    // A form can be sent without a script; it cannot say that it is JSON.
    let form = "Content-Type: application/x-www-form-urlencoded\r\n";
    assert_eq!(served.raw("POST", "/v1/controllers/1/orders", form, &order).status, 415);
    assert_eq!(served.emulators[0].view().unwrap().signal("cover"), Some(1));
    let own = format!("Origin: http://{own}\r\nSec-Fetch-Site: same-origin\r\n{json}");
    assert_eq!(served.raw("POST", "/v1/controllers/1/orders", &own, &order).status, 200);
    assert_eq!(served.raw("OPTIONS", "/v1", "", "").status, 405);
}

#[test]
fn nobody_gets_in_without_the_token() {
    let served = serve(Clock::Manual, 1, Some(TOKEN));
    let get = |headers: &str| served.raw("GET", "/v1/controllers", headers, "");
    let refused = get("");
    assert_eq!(refused.status, 401);
    assert_eq!(refused.header("www-authenticate"), Some("Bearer"));
    assert_eq!(get("Authorization: Bearer 0123456789abcdeg\r\n").status, 401);
    assert_eq!(served.get(&format!("/v1/controllers?token={TOKEN}")).status, 401);
    assert_eq!(get(&format!("Authorization: Bearer {TOKEN}\r\n")).status, 200);
    assert_eq!(served.get("/v1/quit").status, 401);
    // What says how to ask is for everybody.
    for path in ["/", "/v1/docs", "/v1/openapi.json"] {
        assert_eq!(served.get(path).status, 200, "{path}");
    }
    let wish = |headers: &str, token: Option<&str>| {
        let mut watcher = served.watch(headers);
        watcher.say(&json!({ "token": token }));
        watcher.next().unwrap()["type"].clone()
    };
    assert_eq!(wish("", None), "problem");
    assert_eq!(wish("", Some("0123456789abcdeg")), "problem");
    assert_eq!(wish("", Some(TOKEN)), "hello");
    assert_eq!(wish(&format!("Authorization: Bearer {TOKEN}\r\n"), None), "hello");

    let open = Place::take("0.0.0.0:0", None).err();
    assert!(matches!(open, Some(ServerError::Open(_))), "{open:?}");
    assert!(Place::take("0.0.0.0:0", Token::new(TOKEN).ok()).is_ok());
    assert!(Place::take("nowhere", None).is_err());
}

#[test]
fn too_much_is_refused_and_nonsense_does_no_harm() {
    let served = serve(Clock::Manual, 1, None);
    let large = format!("{{\"order\":\"{}\"}}", "x".repeat(70_000));
    let answer = served.raw(
        "POST",
        "/v1/controllers/1/orders",
        "Content-Type: application/json\r\n",
        &large,
    );
    assert_eq!(answer.status, 413);
    for body in
        ["", "{", "[]", "null", "{\"order\":1}", "{\"order\":\"position\",\"x\":1}", "\u{0}"]
    {
        let answer = served.raw(
            "POST",
            "/v1/controllers/1/orders",
            "Content-Type: application/json\r\n",
            body,
        );
        assert_eq!(answer.status, 400, "{body}");
        assert!(answer.json()["remedy"].as_str().unwrap().contains("press stop"), "{answer:?}");
    }
    for (method, path, status) in [
        ("GET", "/nothing", 404),
        ("GET", "/v1/../v1", 404),
        ("GET", "/v1/controllers/0", 404),
        ("GET", "/v1/controllers/99999999999999999999999", 404),
        ("GET", "/v1/controllers/01", 404),
        ("GET", "/v1/controllers/+1", 404),
        ("GET", "/v1/controllers/1/journal?after=1&after=2", 400),
        ("GET", "/v1/controllers/%FF", 400),
        ("GET", "/v1/controllers/1/completions", 400),
        ("GET", "/v1/models/..%2F..%2Fetc%2Fpasswd", 404),
        ("GET", "/v1/machines/%2Fetc%2Fpasswd", 404),
        ("DELETE", "/v1/controllers", 405),
        ("POST", "/v1/controllers/1/view", 405),
        ("GET", "/v1/events", 400),
        ("HEAD", "/v1", 200),
    ] {
        let mut stream = served.connect();
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n",
            served.address
        )
        .unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{method} {path}: {answer}");
        assert!(
            status == 200 || answer.contains("application/problem+json"),
            "{method} {path}: {answer}"
        );
    }
    for nonsense in
        [&b"\0\0\0\0"[..], b"GET", b"\x16\x03\x01\x02\x00", b"GET / HTTP/9.9\r\n\r\n", b"\r\n\r\n"]
    {
        let mut stream = served.connect();
        stream.write_all(nonsense).unwrap();
        let _ = stream.shutdown(Shutdown::Write);
        let _ = stream.read_to_end(&mut Vec::new());
    }
    assert_eq!(served.get("/v1").status, 200);
}

#[test]
fn every_refusal_says_what_would_be_right() {
    let served = serve(Clock::Manual, 1, None);
    let refused = |path: &str, body: Value, status: u16| {
        let answer = served.send("POST", &format!("/v1/controllers/1/{path}"), &body);
        assert_eq!(answer.status, status, "{path} {body}: {answer:?}");
        let problem = answer.json();
        assert!(problem["remedy"].as_str().is_some_and(|it| !it.is_empty()), "{problem}");
        problem["detail"].as_str().unwrap().to_owned()
    };
    for span in ["-1s", "1", "x", "0.1ns", "99999999999h", ""] {
        let detail = refused("clock/advance", json!({ "span": span }), 422);
        assert!(detail.contains(&format!("`{span}`")), "{detail}");
    }
    for words in ["", "bogus", "drop", "drop to-nobody", "x >", "x > y", "1 = 1", "every"] {
        refused("clock/run-until", json!({ "condition": words }), 422);
        refused("breakpoints", json!({ "condition": words }), 422);
        refused("faults", json!({ "fault": words }), 422);
        refused("rules", json!({ "rules": words }), 422);
    }
    let foreign = served.get("/v1/models/x").json();
    assert_eq!(foreign["detail"], "there is no model `x`");
    // Time ends after 584 years.
    let advance = |span: &str| {
        served.send("POST", "/v1/controllers/1/clock/advance", &json!({ "span": span }))
    };
    let too_long = advance("10000000h").json();
    assert!(too_long["remedy"].as_str().unwrap().contains("5124095h"), "{too_long}");
    for span in ["5124095h", "5000000h"] {
        assert_ne!(advance(span).status, 422, "it is not too long");
    }
    let detail = refused("clock/advance", json!({ "span": "1s" }), 409);
    assert_eq!(detail, "time has come to its end");
}

/// A name in the path, or a number of something, has one answer if nothing has it.
#[test]
fn what_is_missing_is_answered_in_one_way() {
    let served = serve(Clock::Manual, 1, None);
    let one = json!({ "value": 1 });
    for (method, path, body) in [
        ("PUT", "signals/foo", &one),
        ("DELETE", "faults/9", &Value::Null),
        ("DELETE", "rules/9", &Value::Null),
        ("DELETE", "breakpoints/9", &Value::Null),
        ("POST", "snapshots/9/restore", &Value::Null),
        ("POST", "expectations/9/check", &Value::Null),
    ] {
        let answer = served.send(method, &format!("/v1/controllers/1/{path}"), body);
        assert_eq!(answer.status, 404, "{path}: {answer:?}");
        let problem = answer.json();
        assert!(problem["detail"].as_str().unwrap().starts_with("there is no "), "{problem}");
        assert!(problem["remedy"].as_str().is_some_and(|it| !it.is_empty()), "{problem}");
    }
    // Words that are typed are another thing.
    let typed = served.send("POST", "/v1/controllers/1/orders", &json!({ "order": "press foo" }));
    assert_eq!(typed.status, 422);
}

/// Nothing was sent, so nothing has happened.
#[test]
fn bytes_that_are_none_have_no_effect() {
    let served = serve(Clock::Manual, 1, None);
    let answer = served.send("POST", "/v1/controllers/1/line", &json!({ "send": "" }));
    let nothing = json!({ "effect": "nothing", "why": "there are no bytes to send" });
    assert_eq!((answer.status, answer.json()), (200, nothing));
    let nobody = served.send("POST", "/v1/controllers/2/line", &json!({ "send": "" }));
    assert_eq!(nobody.status, 404);
}

/// As many connections as there may be, of which nothing or only half a request comes.
#[test]
fn silent_clients_make_room() {
    let served = serve(Clock::Manual, 1, None);
    let head = format!("POST /v1/quit HTTP/1.1\r\nHost: {}\r\n", served.address);
    let halves = ["", &head, &format!("{head}Content-Length: 9\r\n\r\n{{")];
    let silent: Vec<TcpStream> = (0..256)
        .map(|number| {
            let mut stream = served.connect();
            stream.write_all(halves[number % 3].as_bytes()).unwrap();
            stream
        })
        .collect();
    assert_eq!(served.get("/v1").status, 200);
    let late = read(&mut BufReader::new(&silent[2]));
    assert_eq!(late.status, 408);
    assert!(late.body.contains("not whole within 10 s"), "{late:?}");
    let large = served.raw("POST", "/v1/quit", "Content-Length: 99999999999\r\n", "");
    assert_eq!(large.status, 413);
}

// --- what it says of itself ---

/// Whether a value is what a schema says, as far as the schemas of this document go.
fn fits(value: &Value, schema: &Value, all: &Value, place: &str) {
    if let Some(name) = schema["$ref"].as_str() {
        let name = name.strip_prefix("#/components/schemas/").unwrap();
        return fits(value, &all[name], all, place);
    }
    if let Some(ways) = schema["anyOf"].as_array() {
        let way = ways.iter().find(|way| value.is_null() == (way["type"] == "null"));
        return fits(value, way.unwrap_or_else(|| panic!("{place} is {value}")), all, place);
    }
    let is = |kind: &str| match kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "integer" => value.is_i64() || value.is_u64(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        other => panic!("{place}: {other}"),
    };
    let right = match &schema["type"] {
        Value::String(kind) => is(kind),
        Value::Array(kinds) => kinds.iter().any(|kind| is(kind.as_str().unwrap())),
        other => panic!("{place}: {other}"),
    };
    assert!(right, "{place} is {value}, and not {}", schema["type"]);
    if let Some(words) = schema["enum"].as_array() {
        assert!(words.contains(value), "{place} is {value}");
    }
    for name in schema["required"].as_array().into_iter().flatten() {
        assert!(
            value.is_null() || value.get(name.as_str().unwrap()).is_some(),
            "{place}: no {name}"
        );
    }
    for (name, own) in value.as_object().into_iter().flatten() {
        let place = format!("{place}.{name}");
        if let Some(schema) = schema["properties"].get(name) {
            fits(own, schema, all, &place);
        } else if schema["additionalProperties"].is_object() {
            fits(own, &schema["additionalProperties"], all, &place);
        } else if schema["properties"].is_object() && !place.contains("entries") {
            panic!("{place} is in no schema");
        }
    }
    if let Some(schema) = schema.get("items") {
        for (number, own) in value.as_array().into_iter().flatten().enumerate() {
            fits(own, schema, all, &format!("{place}[{number}]"));
        }
    }
}

/// A value that a schema gives as an example.
fn example(schema: &Value) -> Value {
    schema["examples"][0].clone()
}

/// Every route of the document is there, takes what the document says and no other field, and answers what
/// the document says.
#[test]
fn the_document_says_what_is_so() {
    let served = serve(Clock::Instant, 1, None);
    host_says(&served.emulators[0], "@07\r@0A50,900,0,900,0,900,0,900\r");
    let document = served.get("/v1/openapi.json").json();
    assert_eq!(document["openapi"], "3.1.0");
    let all = &document["components"]["schemas"];
    let page = served.get("/v1/docs").body;
    // What has to be there before it can be asked for or ended.
    served.send("POST", "/v1/controllers/1/faults", &json!({ "fault": "drop to-host once" }));
    served.send("POST", "/v1/controllers/1/rules", &json!({ "rules": "at 1h: press stop" }));
    served.send("POST", "/v1/controllers/1/snapshots", &json!({}));
    let point = json!({ "condition": "x > 5000000" });
    let id = served.send("POST", "/v1/controllers/1/breakpoints", &point).json()["id"].clone();
    let met = json!({ "expect": "x < 5000000, at least once" });
    served.send("POST", "/v1/controllers/1/expectations", &met);
    served.send("POST", "/v1/controllers/1/recording", &Value::Null);
    let mut operations = Vec::new();
    for (path, methods) in document["paths"].as_object().unwrap() {
        for (method, operation) in methods.as_object().unwrap() {
            operations.push((path.as_str(), method.to_uppercase(), operation));
        }
    }
    // What there is is ended last, one before all.
    operations.sort_by_key(|(path, method, _)| {
        let ends = method == "DELETE";
        (
            ends,
            ends.then_some(Reverse(path.len())),
            path.ends_with("/step") || path.ends_with("/check"),
        )
    });
    for (path, method, operation) in operations {
        // Its debugger is that of the program, and tried there.
        if path == "/v1/quit" || path.contains("/debugger") || path.contains("/history/") {
            continue;
        }
        let name = match path {
            "/v1/models/{name}" => "imc4",
            "/v1/machines/{name}" => "mill",
            _ => "cover",
        };
        let id = match path {
            _ if path.contains("breakpoints") => id.to_string(),
            // That of the example, which is not met.
            _ if path.ends_with("/check") => "2".to_owned(),
            _ => "1".to_owned(),
        };
        let address = path.replace("{n}", "1").replace("{name}", name).replace("{id}", &id);
        let mut address = address.replace("{number}", "1").replace("{scenario}", "1");
        assert!(page.contains(&format!("<code>{path}</code>")), "{path}");
        for parameter in operation["parameters"].as_array().unwrap() {
            if parameter["in"] == "query" && parameter["required"] == true {
                address.push_str(&format!("?{}=x", parameter["name"].as_str().unwrap()));
            }
        }
        let schema = &operation["requestBody"]["content"]["application/json"]["schema"];
        let fields = schema["properties"].as_object();
        let mut body: Map<String, Value> = fields
            .into_iter()
            .flatten()
            .map(|(name, schema)| (name.clone(), example(schema)))
            .collect();
        if path.ends_with("run-until") {
            body.insert("condition".to_owned(), json!("idle"));
        }
        if method != "GET" {
            let mut wrong = body.clone();
            wrong.insert("else".to_owned(), json!(1));
            assert_eq!(
                served.send(&method, &address, &wrong.into()).status,
                400,
                "{method} {path}"
            );
            for name in schema["required"].as_array().into_iter().flatten() {
                let mut wrong = body.clone();
                wrong.remove(name.as_str().unwrap());
                assert_eq!(
                    served.send(&method, &address, &wrong.into()).status,
                    400,
                    "{method} {path}"
                );
            }
        }
        let paused = path.ends_with("/step") || path.ends_with("/resume");
        if paused {
            served.send("POST", "/v1/controllers/1/clock/pause", &Value::Null);
        }
        let body = if body.is_empty() { Value::Null } else { body.into() };
        let answer = served.send(&method, &address, &body);
        let place = format!("{method} {path}");
        if (path.ends_with("/clock") && method == "PUT") || answer.status == 409 && !paused {
            // An instant clock has no speed.
            assert_eq!(answer.status, 409, "{place}: {answer:?}");
            fits(&answer.json(), &all["Problem"], all, &place);
            continue;
        }
        assert_eq!(answer.status, 200, "{place}: {answer:?}");
        let content = operation["responses"]["200"]["content"].as_object().unwrap();
        let (kind, content) = content.iter().next().unwrap();
        assert!(answer.header("content-type").unwrap().starts_with(kind.as_str()), "{place}");
        if kind == "application/json" {
            fits(&answer.json(), &content["schema"], all, &place);
        }
        if path.ends_with("/clock/pause") {
            served.send("POST", "/v1/controllers/1/clock/resume", &Value::Null);
        }
    }
    assert!(!page.contains("src=\"http") && !page.contains("href=\"http"));
}
