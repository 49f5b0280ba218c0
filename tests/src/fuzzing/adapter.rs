//! A debug adapter and what a client says to it.

use std::ops::ControlFlow;

use serde_json::{Value, json};
use vimc4_dap::framing::{Decoder, Frame, framed};
use vimc4_dap::{Configuration, Incoming, Open, Opened, Outgoing, Refusal, Session};
use vimc4_debug::{Debugger, Feed, Piece, Source, Unit};
use vimc4_timeline::Progress;

/// So many messages are heeded.
const MOST: usize = 60;

/// What can be opened: a list of commands with a program that goes round, under this name.
const FILE: &str = "list.txt";

const LINES: [&str; 9] = [
    "@07",
    "@0A100,900,0,21,0,21,0,21",
    "@0Q",
    "@0i",
    "0100,9000,0,21,0,21,0,21",
    "0-100,9000,0,21,0,21,0,21",
    "30,-2",
    "9",
    "@0S",
];

struct Memory;

impl Open for Memory {
    fn open(
        &mut self,
        configuration: &Configuration,
        _: &mut Progress<'_>,
    ) -> Result<Vec<Opened>, Refusal> {
        let each = configuration.each();
        let open = |each: &Configuration| {
            if each.program.as_deref() != Some(FILE) {
                return Err(Refusal::new("there is no such file"));
            }
            let model = vimc4_catalogue::model("imc4").map_err(Refusal::new)?;
            let machine = vimc4_catalogue::machine("bench").map_err(Refusal::new)?;
            let controller = vimc4_catalogue::bare(&model, &machine, &[]).map_err(Refusal::new)?;
            let pieces = LINES.map(|line| Piece::Send(format!("{line}\r").into_bytes())).to_vec();
            Ok(Opened {
                name: each.name.clone().unwrap_or_default(),
                debugger: Debugger::new(controller)
                    .with_source(Source::of_lines(FILE, &LINES.join("\n")))
                    .with_feed(Feed::new(pieces)),
                stored: vec![5, 6, 7],
                is_file: each.machine.is_none(),
                statement: Unit::Line,
                live: None,
                said: String::new(),
            })
        };
        each.iter().take(3).map(open).collect()
    }

    fn attach(&mut self, _: &Configuration) -> Result<Vec<Opened>, Refusal> {
        Err(Refusal::new("nothing runs here"))
    }

    fn is_same_file(&self, one: &str, other: &str) -> bool {
        one == other
    }
}

/// Behind a `#` bytes as they come; else a request a line, as in `next {"threadId":1}`.
pub fn adapter(data: &[u8]) {
    let mut session = Session::new(Box::new(Memory));
    let bytes = match data.strip_prefix(b"#") {
        Some(bytes) => bytes.to_vec(),
        None => requests(data).into_bytes(),
    };
    let mut decoder = Decoder::new(1 << 16);
    let (mut rest, mut heeded) = (bytes.as_slice(), 0);
    while let Ok(Some(frame)) = decoder.decode(&mut rest) {
        heeded += 1;
        if heeded > MOST || session.is_over() {
            return;
        }
        heed(&mut session, frame);
    }
}

fn requests(data: &[u8]) -> String {
    let text = String::from_utf8_lossy(data);
    let message = |(line, seq): (&str, i64)| {
        let (command, arguments) = line.split_once(' ').unwrap_or((line, "null"));
        let arguments: Value = serde_json::from_str(arguments).unwrap_or_default();
        let message = json!({
            "seq": seq, "type": "request", "command": command, "arguments": arguments,
        });
        framed(&message.to_string())
    };
    text.lines().zip(1..).map(message).collect()
}

/// Every message has one answer, which names it, and everything that is said is a message.
fn heed(session: &mut Session, frame: Frame) {
    let message = Incoming::read(frame);
    let (seq, command) = match &message {
        Incoming::Request(request) => (request.seq, request.command.clone()),
        Incoming::Unreadable { seq, command, .. } => (*seq, command.clone()),
    };
    let mut looks = 0;
    session.receive(message, &mut |_| {
        looks += 1;
        if looks > 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let said = session.drain();
    let answers: Vec<_> = said
        .iter()
        .filter_map(|said| match said {
            Outgoing::Answer { to, command, .. } => Some((*to, command.clone())),
            Outgoing::Event { .. } => None,
        })
        .collect();
    assert_eq!(answers, [(seq, command)], "one answer to each");
    check(&said);
    // A while, and whatever still runs then is on its way.
    for _ in 0..3 {
        if session.running().is_none() {
            break;
        }
        let mut looks = 0;
        session.run(&mut |_| {
            looks += 1;
            if looks > 1 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let said = session.drain();
        assert!(said.iter().all(|said| matches!(said, Outgoing::Event { .. })));
        check(&said);
    }
}

fn check(said: &[Outgoing]) {
    for (said, seq) in said.iter().zip(1..) {
        let text = said.text(seq);
        let message: Result<Value, _> = serde_json::from_str(&text);
        assert!(message.is_ok_and(|message| message["seq"] == seq), "{text}");
    }
}

/// A session as editors have it, what else there is, and what is not a message.
pub(super) fn sessions() -> Vec<Vec<u8>> {
    let begin = "initialize {}\nlaunch {\"program\":\"list.txt\",\"stopOnEntry\":true}\n\
        setExceptionBreakpoints {\"filters\":[\"errors\"]}\nconfigurationDone {}\n";
    let look = "threads\nstackTrace {\"threadId\":1}\nscopes {\"frameId\":1}\n\
        variables {\"variablesReference\":1}\nvariables {\"variablesReference\":5,\"count\":3}\n";
    let sessions = [
        format!("{begin}{look}continue {{\"threadId\":1}}\nexceptionInfo {{\"threadId\":1}}\n\
            continue {{\"threadId\":1}}\nthreads\npause {{\"threadId\":1}}\n{look}\
            reverseContinue {{\"threadId\":1}}\ndisconnect\n"),
        format!("{begin}next {{\"threadId\":1}}\nstepIn {{\"threadId\":1,\"granularity\":\"instruction\"}}\n\
            stepOut {{\"threadId\":1}}\nstepBack {{\"threadId\":1,\"granularity\":\"line\"}}\n\
            restart {{}}\nterminate\ncancel {{\"progressId\":\"1\"}}\n"),
        format!("{begin}setBreakpoints {{\"source\":{{\"path\":\"list.txt\"}},\"breakpoints\":[{{\"line\":5,\"condition\":\"x > 5\",\"hitCondition\":\"% 2\"}},{{\"line\":9,\"logMessage\":\"{{x}}\"}}]}}\n\
            setFunctionBreakpoints {{\"breakpoints\":[{{\"name\":\"@0A\"}},{{\"name\":\"x = 50\"}}]}}\n\
            dataBreakpointInfo {{\"name\":\"signals.stop\"}}\n\
            setDataBreakpoints {{\"breakpoints\":[{{\"dataId\":\"0:x\"}}]}}\n\
            breakpointLocations {{\"source\":{{\"path\":\"list.txt\"}},\"line\":1,\"endLine\":20}}\n\
            continue {{\"threadId\":1}}\n{look}"),
        format!("{begin}{look}setVariable {{\"variablesReference\":2,\"name\":\"stop\",\"value\":\"1\"}}\n\
            setExpression {{\"expression\":\"x\",\"value\":\"7\"}}\n\
            evaluate {{\"expression\":\"next x = 9\",\"context\":\"repl\"}}\n\
            evaluate {{\"expression\":\"x + y\",\"context\":\"watch\"}}\n\
            completions {{\"text\":\"ste\",\"column\":4}}\n\
            gotoTargets {{\"source\":{{\"path\":\"list.txt\"}},\"line\":2}}\ngoto {{\"threadId\":1,\"targetId\":2}}\n\
            stackTrace {{\"threadId\":1}}\nrestartFrame {{\"frameId\":1}}\n\
            disassemble {{\"memoryReference\":\"0x1000000\",\"instructionOffset\":-1,\"instructionCount\":4}}\n\
            loadedSources\nsource {{\"sourceReference\":1}}\n"),
        "initialize {}\nattach {\"recording\":\"x\"}\nlaunch {\"controllers\":[{\"program\":\"list.txt\"},\
            {\"program\":\"list.txt\",\"machine\":\"m\"}]}\nconfigurationDone\npause {\"threadId\":2}\n".to_owned(),
        "#Content-Length: 5\r\n\r\n[1,2]Content-Length: x\r\n\r\n\r\nContent-Length: 70000\r\n\r\n".to_owned(),
        format!("#{}", framed("{\"seq\":1,\"type\":\"request\",\"command\":\"initialize\"}")),
    ];
    sessions.into_iter().map(String::into_bytes).collect()
}
