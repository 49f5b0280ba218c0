//! What is done to a controller besides commands is told, with who did it and what came of it.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use vimc4_device::{Condition, Time};
use vimc4_host::{
    Clients, Clock, ControlError, Deed, Effect, LineEvent, Memory, MemoryPort, ReportKind, Source,
    Tcp,
};

use crate::fake::{Diary, Fake, Running};

/// What was told of inputs, as who did it and what.
fn inputs(diary: &Diary) -> Vec<(Time, String)> {
    let reports = diary.0.lock().unwrap();
    let told = reports.iter().filter_map(|report| match report.news() {
        Some(LineEvent::Deed { by, deed }) => Some((report.at, format!("{by}: {deed}"))),
        Some(LineEvent::NoEffect { by, deed, why }) => {
            Some((report.at, format!("{by}: {deed}: nothing: {why:?}")))
        }
        _ => None,
    });
    told.collect()
}

fn watched() -> (Running<Fake>, MemoryPort, Diary) {
    let diary = Diary::default();
    let (running, port) = Running::in_memory(Fake::new(b""), Clock::Manual);
    running.handle.watch(diary.clone()).wait().unwrap();
    (running, port, diary)
}

#[test]
fn each_input_is_told_with_its_time_and_who_did_it() {
    let (running, mut port, diary) = watched();
    let handle = &running.handle;
    let person = handle.by("standard input");
    handle.press("start").wait().unwrap();
    person.advance(Duration::from_millis(5)).wait().unwrap();
    person.hold("estop").wait().unwrap();
    person.turn("key", "auto").wait().unwrap();
    person.set_input(0, 3, true).wait().unwrap();
    person.set("key", 1).wait().unwrap();
    let signals = vec![("start".to_owned(), 1), ("key".to_owned(), 1)];
    person.act(Deed::Several { what: "both".to_owned(), signals }).wait().unwrap();
    person.power(false).wait().unwrap();
    let state = person.state().wait().unwrap();
    handle.restore(state).wait().unwrap();
    port.write_all(b"ex\xFD\xFDyz").unwrap();
    handle.now().wait().unwrap();
    let five = Time::from_millis(5);
    let expected = [
        (Time::ZERO, "the library: press start"),
        (five, "standard input: hold estop"),
        (five, "standard input: key auto"),
        (five, "standard input: input 0.3 1"),
        (five, "standard input: set key 1"),
        (five, "standard input: both"),
        (five, "standard input: power off"),
        (five, "the library: restore"),
        (five, "memory: 253"),
        (five, "memory: 253: nothing: Some(\"the power is off\")"),
        (five, "memory: 253"),
        (five, "memory: 253: nothing: Some(\"the power is off\")"),
    ];
    assert_eq!(inputs(&diary), expected.map(|(at, text)| (at, text.to_owned())));
    running.end().unwrap();
}

#[test]
fn a_byte_that_is_urgent_is_told_where_it_was_in_the_stream() {
    let (running, mut port, diary) = watched();
    port.write_all(b"ea\r\xFDeb\r").unwrap();
    running.handle.now().wait().unwrap();
    let reports = diary.0.lock().unwrap();
    let order: Vec<_> = reports
        .iter()
        .filter_map(|report| match &report.what {
            ReportKind::Sent { bytes } => Some(String::from_utf8_lossy(bytes).into_owned()),
            ReportKind::News(LineEvent::Deed { deed, .. }) => Some(deed.to_string()),
            _ => None,
        })
        .collect();
    // The byte itself is a part of the fake's next line.
    assert_eq!(order, ["a", "253", "?"]);
    drop(reports);
    running.end().unwrap();
}

#[test]
fn what_changes_nothing_says_so() {
    let (running, _port, diary) = watched();
    let handle = &running.handle;
    let nothing = |why| Ok(Effect::Nothing { why });
    assert_eq!(handle.release("start").wait(), nothing(Some("it was so already")));
    assert_eq!(handle.power(true).wait(), nothing(Some("it was so already")));
    assert_eq!(handle.set_input(0, 3, false).wait(), nothing(Some("the fake knows why")));
    assert_eq!(handle.press("start").wait(), Ok(Effect::Something));
    assert_eq!(handle.power(false).wait(), Ok(Effect::Something));
    let told: Vec<_> = inputs(&diary).into_iter().map(|(_, text)| text).collect();
    assert_eq!(
        told,
        [
            "the library: release start",
            "the library: release start: nothing: Some(\"it was so already\")",
            "the library: power on",
            "the library: power on: nothing: Some(\"it was so already\")",
            "the library: input 0.3 0",
            "the library: input 0.3 0: nothing: Some(\"the fake knows why\")",
            "the library: press start",
            "the library: power off",
        ]
    );
    running.end().unwrap();
}

#[test]
fn what_was_done_can_be_kept_and_read_again() {
    let by = Source::Client { transport: "tcp".into(), client: Some("me".into()) };
    let deeds = [
        Deed::Byte(253),
        Deed::Press("start".to_owned()),
        Deed::Turn("key".to_owned(), "auto".to_owned()),
        Deed::Input { port: 0, bit: 3, level: true },
        Deed::Set("input 0.3".to_owned(), 1),
        Deed::Several { what: "erase".to_owned(), signals: vec![("stop".to_owned(), 1)] },
        Deed::Power(false),
        Deed::Restore,
    ];
    let text = serde_json::to_string(&(&by, &deeds)).unwrap();
    assert_eq!(serde_json::from_str::<(Source, [Deed; 8])>(&text).unwrap(), (by, deeds));
}

#[test]
fn of_several_clients_it_is_said_who_speaks() {
    let diary = Diary::default();
    let told = diary.clone();
    let (running, ports) = Running::start(Fake::new(b""), Clock::Real, move |mut runner| {
        let (memory, port) = Memory::pair();
        let tcp = ["127.0.0.1:0", "127.0.0.1:0"]
            .map(|address| Tcp::bind(address.parse().unwrap(), Clients::Refuse).unwrap());
        let places = [tcp[0].address(), tcp[1].address()];
        for tcp in tcp {
            runner.attach(Box::new(tcp));
        }
        runner.attach(Box::new(memory));
        runner.watch(Box::new(told));
        (runner, (places, port))
    });
    let (places, _port) = ports;
    let mut clients = places.map(|place| {
        let client = TcpStream::connect(place).unwrap();
        client.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let own = client.local_addr().unwrap().to_string();
        diary.wait_for(
            "a client",
            |report| matches!(report.news(), Some(LineEvent::Opened { client, .. }) if *client == own),
        );
        client
    });
    for (speaker, listener) in [(0, 1), (0, 1), (1, 0)] {
        clients[speaker].write_all(b"ea\r").unwrap();
        for client in [speaker, listener] {
            clients[client].read_exact(&mut [0]).unwrap();
        }
    }
    clients[1].write_all(b"\xFD").unwrap();
    let own = clients.each_ref().map(|client| client.local_addr().unwrap().to_string());
    let by = Source::Client {
        transport: format!("tcp {}", places[1]).into(),
        client: Some(own[1].as_str().into()),
    };
    diary.wait_for("the stop", |report| {
        report.news() == Some(&LineEvent::Deed { by: by.clone(), deed: Deed::Byte(253) })
    });
    let reports = diary.0.lock().unwrap();
    let speakers: Vec<_> = reports
        .iter()
        .filter_map(|report| match report.news() {
            Some(LineEvent::Speaks { client, .. }) => Some(client.clone()),
            _ => None,
        })
        .collect();
    assert_eq!(speakers, own);
    drop(reports);
    running.end().unwrap();
}

#[test]
fn in_real_time_what_never_happens_is_said_too() {
    let (running, mut port) = Running::in_memory(Fake::new(b""), Clock::Real);
    let handle = &running.handle;
    let at = |position| Condition::AxisAt { axis: 0, position };
    // Nothing moves.
    assert_eq!(handle.run_until(at(5)).wait(), Err(ControlError::Never));
    assert!(handle.run_until(at(0)).wait().is_ok());
    // Something moves, but not there; an hour is not waited for.
    port.write_all(b"w3600000\r").unwrap();
    assert_eq!(handle.run_until(at(3_600_001)).wait(), Err(ControlError::Never));
    let there = handle.run_until(at(3_000_000));
    assert!(handle.run_until(at(20)).wait().is_ok());
    // What would have happened is made impossible.
    let state = Fake::new(b"");
    handle.restore(vimc4_device::Device::state(&state).clone()).wait().unwrap();
    assert_eq!(there.wait(), Err(ControlError::Never));
    // What does not rest may come yet.
    port.write_all(b"l\r").unwrap();
    handle.now().wait().unwrap();
    let waits = handle.run_until(at(20));
    port.write_all(b"w30\r").unwrap();
    assert!(waits.wait().is_ok());
    running.end().unwrap();
}
