//! An editor with its debug adapter, which speaks the protocol by hand.

use std::io::{BufReader, Write};
use std::net::{Shutdown, TcpStream};
use std::process::Command;
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use serde_json::{Value, json};

use crate::process::limits::LIMIT;
use crate::process::{Process, VIMC4, connect, framed, read_message};

/// An editor with its debug adapter.
pub(crate) struct Editor {
    /// The adapter, if it is one of its own.
    pub(crate) adapter: Option<Process>,
    /// The way to one at a port.
    connection: Option<TcpStream>,
    pub(crate) from: Receiver<Value>,
    pub(crate) seq: i64,
    /// The number of the message that was heard last.
    pub(crate) heard: i64,
    /// Events that nobody has asked for yet.
    pub(crate) events: Vec<(String, Value)>,
}

impl Editor {
    /// An editor that has not said anything.
    pub(crate) fn silent() -> Editor {
        let mut adapter = Process::start(Command::new(VIMC4).arg("dap"));
        let from = adapter.messages();
        Editor {
            adapter: Some(adapter),
            connection: None,
            from,
            seq: 0,
            heard: 0,
            events: Vec::new(),
        }
    }

    /// An editor that has not said anything, at the port of an adapter.
    pub(crate) fn at_port(address: &str) -> Editor {
        let stream = connect(address);
        stream.set_read_timeout(None).unwrap();
        let mut output = BufReader::new(stream.try_clone().unwrap());
        let (said, from) = channel();
        thread::spawn(move || {
            while let Some(message) = read_message(&mut output) {
                if said.send(message).is_err() {
                    return;
                }
            }
        });
        let (connection, events) = (Some(stream), Vec::new());
        Editor { adapter: None, connection, from, seq: 0, heard: 0, events }
    }

    /// An editor that has said what it is.
    pub(crate) fn new() -> Editor {
        Editor::silent().introduced()
    }

    /// It says what it is.
    pub(crate) fn introduced(mut self) -> Editor {
        self.ask("initialize", json!({ "adapterID": "vimc4", "linesStartAt1": true }));
        self.event("initialized");
        self
    }

    /// An editor that stands at the first line of a program.
    pub(crate) fn at_entry(configuration: Value) -> Editor {
        let mut editor = Editor::new();
        let mut configuration = configuration;
        configuration["stopOnEntry"] = true.into();
        editor.ask("launch", configuration);
        editor.ask("configurationDone", json!({}));
        assert_eq!(editor.event("stopped")["reason"], "entry");
        editor
    }

    pub(crate) fn write(&mut self, bytes: &[u8]) {
        let own =
            self.adapter.as_mut().map(|adapter| adapter.input.as_mut().unwrap() as &mut dyn Write);
        let at_port = self.connection.as_mut().map(|stream| stream as &mut dyn Write);
        let to = own.or(at_port).unwrap();
        to.write_all(bytes).unwrap();
        to.flush().unwrap();
    }

    /// Sends a request, and says its number.
    pub(crate) fn send(&mut self, command: &str, arguments: Value) -> i64 {
        self.seq += 1;
        let message = json!({
            "seq": self.seq, "type": "request", "command": command, "arguments": arguments,
        });
        self.write(framed(&message).as_bytes());
        self.seq
    }

    pub(crate) fn hear(&mut self) -> Value {
        let message = self.from.recv_timeout(LIMIT).unwrap();
        // Messages are numbered one by one.
        self.heard += 1;
        assert_eq!(message["seq"], self.heard, "{message}");
        message
    }

    /// Hears until there is an answer to a request; other answers are not expected.
    pub(crate) fn answer(&mut self, seq: i64) -> Result<Value, String> {
        loop {
            let message = self.hear();
            if message["type"] == "event" {
                self.events.push((text(&message["event"]), message["body"].clone()));
                continue;
            }
            assert_eq!(message["type"], "response");
            assert_eq!(message["request_seq"], seq, "{message}");
            return match message["success"].as_bool().unwrap() {
                true => Ok(message["body"].clone()),
                false => {
                    assert_eq!(message["body"]["error"]["format"], message["message"]);
                    Err(text(&message["message"]))
                }
            };
        }
    }

    /// Hears until an event of this name comes, whatever else does.
    pub(crate) fn heard_of(&mut self, event: &str) -> Value {
        loop {
            let mut message = self.hear();
            if message["event"] == event {
                return message["body"].take();
            }
        }
    }

    /// Hears until a request is answered, whatever else comes.
    pub(crate) fn heard_answer(&mut self, request: i64) -> Value {
        loop {
            let message = self.hear();
            if message["request_seq"] == request {
                return message;
            }
        }
    }

    pub(crate) fn try_to(&mut self, command: &str, arguments: Value) -> Result<Value, String> {
        let seq = self.send(command, arguments);
        self.answer(seq)
    }

    pub(crate) fn ask(&mut self, command: &str, arguments: Value) -> Value {
        self.try_to(command, arguments).unwrap_or_else(|error| panic!("{command}: {error}"))
    }

    pub(crate) fn refused(&mut self, command: &str, arguments: Value) -> String {
        self.try_to(command, arguments).expect_err(command)
    }

    /// The next event of a name; what comes before stays to be asked for.
    pub(crate) fn event(&mut self, name: &str) -> Value {
        loop {
            if let Some(place) = self.events.iter().position(|(event, _)| event == name) {
                return self.events.remove(place).1;
            }
            let message = self.hear();
            assert_eq!(message["type"], "event", "{message}");
            self.events.push((text(&message["event"]), message["body"].clone()));
        }
    }

    /// Does something that ends with a stop.
    pub(crate) fn walk(&mut self, command: &str) -> Value {
        self.ask(command, json!({ "threadId": 1 }));
        self.event("stopped")
    }

    pub(crate) fn steps(&mut self, command: &str, granularity: &str) -> Value {
        self.ask(command, json!({ "threadId": 1, "granularity": granularity }));
        self.event("stopped")
    }

    /// Line and name of what is under way, from inside to outside.
    pub(crate) fn stack(&mut self) -> Vec<(i64, String)> {
        let stack = self.ask("stackTrace", json!({ "threadId": 1 }));
        let frames = stack["stackFrames"].as_array().unwrap().iter();
        frames.map(|frame| (frame["line"].as_i64().unwrap(), text(&frame["name"]))).collect()
    }

    pub(crate) fn line(&mut self) -> i64 {
        self.stack()[0].0
    }

    pub(crate) fn value(&mut self, expression: &str) -> String {
        text(&self.ask("evaluate", json!({ "expression": expression }))["result"])
    }

    pub(crate) fn console(&mut self, line: &str) -> String {
        let arguments = json!({ "expression": line, "context": "repl" });
        text(&self.ask("evaluate", arguments)["result"])
    }

    pub(crate) fn set_lines(&mut self, file: &str, breakpoints: Value) -> Vec<Value> {
        self.set_lines_of(json!({ "path": file }), breakpoints)
    }

    pub(crate) fn set_lines_of(&mut self, source: Value, breakpoints: Value) -> Vec<Value> {
        let arguments = json!({ "source": source, "breakpoints": breakpoints });
        self.ask("setBreakpoints", arguments)["breakpoints"].as_array().unwrap().clone()
    }

    /// The variables of a scope, by their names.
    pub(crate) fn scope(&mut self, name: &str) -> i64 {
        let stack = self.ask("stackTrace", json!({ "threadId": 1 }));
        let frame = stack["stackFrames"][0]["id"].clone();
        let scopes = self.ask("scopes", json!({ "frameId": frame }));
        let scope = scopes["scopes"]
            .as_array()
            .unwrap()
            .iter()
            .find(|scope| scope["name"] == name)
            .cloned();
        scope.unwrap()["variablesReference"].as_i64().unwrap()
    }

    pub(crate) fn variables(&mut self, reference: i64) -> Vec<Value> {
        let found = self.ask("variables", json!({ "variablesReference": reference }));
        found["variables"].as_array().unwrap().clone()
    }

    /// Everything of a scope, as deep as it goes.
    pub(crate) fn all(&mut self, scope: &str) -> Vec<String> {
        let mut lines = Vec::new();
        let mut open = vec![self.scope(scope)];
        while let Some(reference) = open.pop() {
            for variable in self.variables(reference) {
                match variable["variablesReference"].as_i64().unwrap() {
                    0 => lines.push(format!(
                        "{} = {}",
                        text(&variable["evaluateName"]),
                        text(&variable["value"])
                    )),
                    inner => open.push(inner),
                }
            }
        }
        lines.sort();
        lines
    }

    /// How the adapter ends.
    pub(crate) fn leaves(&mut self) -> Option<i32> {
        self.adapter.as_mut().unwrap().ended().code()
    }

    pub(crate) fn disconnect(mut self) {
        self.ask("disconnect", json!({}));
        assert_eq!(self.leaves(), Some(0));
    }
}

pub(crate) fn text(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

impl Drop for Editor {
    fn drop(&mut self) {
        if let Some(connection) = &self.connection {
            let _ = connection.shutdown(Shutdown::Both);
        }
    }
}
