//! Recordings of a small device: a cart on a rail.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

#[path = "../../device/tests/cart/mod.rs"]
mod cart;

use std::sync::Arc;

use bytes::Bytes;
use cart::Cart;
use proptest::prelude::*;
use serde_json::{Value, json};
use vimc4_device::{Device, Time};
use vimc4_timeline::recording::{
    Aside, Entry, Given, Head, LineSort, Player, Recording, Tolerance, What, check, cut,
    given_apart, minimise, part, rerecord, said_apart, say_otherwise,
};

fn ms(millis: u64) -> Time {
    Time::from_millis(millis)
}

fn head() -> Head {
    Head {
        recording: 1,
        program: "a test".to_owned(),
        family: "cart".to_owned(),
        model: json!({}),
        machine: json!({}),
        clock: "instant".to_owned(),
        line: LineSort::Ideal,
        seed: None,
        from: "a test".to_owned(),
        controller: String::new(),
        part: 1,
        began: None,
    }
}

fn given(at: u64, given: Given) -> Entry {
    Entry::new(ms(at), What::Given { by: Arc::from("a test"), given })
}

fn sent(at: u64, text: &'static str) -> Entry {
    given(at, Given::Bytes(Bytes::from_static(text.as_bytes())))
}

fn stop(at: u64, value: i32) -> Entry {
    given(at, Given::Signal { name: "stop".to_owned(), value })
}

fn said(at: u64, text: &'static str) -> Entry {
    Entry::new(ms(at), What::Sent(Bytes::from_static(text.as_bytes())))
}

fn state(at: u64, device: &Cart) -> Entry {
    let state = serde_json::to_value(device.state()).unwrap();
    Entry::new(ms(at), What::State { by: None, state })
}

const ASIDE: Aside<'static, Cart> = Aside { values: &[], is_same: &|one, other| one == other };

fn read(state: &Value) -> Result<cart::State, String> {
    serde_json::from_value(state.clone()).map_err(|error| error.to_string())
}

fn recording(entries: impl IntoIterator<Item = Entry>) -> Recording {
    let first = state(0, &Cart::default());
    Recording { head: head(), entries: std::iter::once(first).chain(entries).collect(), torn: None }
}

/// A cart that goes five steps, is stopped on its way further, and says where it is.
fn drive() -> Recording {
    recording([
        sent(0, "m5\r"),
        said(5, "0"),
        sent(50, "m1"),
        sent(60, "00\r"),
        stop(80, 1),
        said(80, "stopped"),
        stop(90, 0),
        sent(100, "p\r"),
        said(100, "25"),
        Entry::new(ms(200), What::End("the end".to_owned())),
    ])
}

fn checked(recording: &Recording) -> Option<vimc4_timeline::recording::Difference> {
    let player = Player::new(Cart::default());
    check(recording, player, Tolerance::Exact, &read, &mut |_| {}).unwrap().difference
}

#[test]
fn what_was_recorded_happens_again() {
    assert_eq!(checked(&drive()), None);
}

#[test]
fn how_far_a_comparison_has_come_is_told_as_it_goes() {
    let recording = drive();
    let mut told = Vec::new();
    let player = Player::new(Cart::default());
    let played = check(&recording, player, Tolerance::Exact, &read, &mut |so_far| {
        assert!(so_far.said.is_none() && so_far.field.is_none(), "{so_far:?}");
        told.push((so_far.at, so_far.inputs, so_far.bytes));
    });
    let played = played.unwrap();
    assert!(told.is_sorted(), "{told:?}");
    let (at, inputs, _) = *told.last().unwrap();
    assert_eq!((at, inputs), (played.end, played.inputs));
    // On the way from one line of the recording to the next, too.
    assert!(told.len() > recording.entries.len(), "{told:?}");
    let [one, two] = [Cart::default(), Cart::default()].map(Player::new);
    let mut told = Vec::new();
    let read: [&dyn Fn(&Value) -> _; 2] = [&read, &read];
    part(&recording, one, two, &ASIDE, read, &mut |so_far| told.push(so_far.at)).unwrap();
    assert_eq!(told.last(), Some(&played.end));
}

#[test]
fn the_first_byte_that_differs_is_found_with_its_command() {
    let mut wrong = drive();
    wrong.entries[9] = said(100, "26");
    let found = checked(&wrong).unwrap().said.unwrap();
    assert_eq!((found.before, found.one.unwrap().byte, found.other.unwrap().byte), (9, b'6', b'5'));
    assert_eq!(found.rest, [b"6".to_vec(), b"5".to_vec()]);
    assert_eq!(found.command.unwrap().means, "p");

    // A byte too late, one too many, and one that is missing.
    let mut wrong = drive();
    wrong.entries[2] = said(6, "0");
    let found = checked(&wrong).unwrap().said.unwrap();
    assert_eq!((found.before, found.one.unwrap().at, found.other.unwrap().at), (0, ms(6), ms(5)));
    let mut wrong = drive();
    wrong.entries[9] = said(100, "2");
    let found = checked(&wrong).unwrap().said.unwrap();
    assert_eq!((found.one, found.other.unwrap().byte), (None, b'5'));
    let mut wrong = drive();
    wrong.entries[9] = said(100, "251");
    let found = checked(&wrong).unwrap().said.unwrap();
    assert_eq!((found.one.unwrap().byte, found.other), (b'1', None));
}

#[test]
fn what_was_broken_off_may_lack_what_came_of_its_last_input() {
    let mut killed = drive();
    killed.entries.truncate(9);
    assert!(!killed.is_whole());
    assert_eq!(checked(&killed), None);
    killed.entries.push(Entry::new(ms(200), What::End("the end".to_owned())));
    assert_eq!(checked(&killed).unwrap().said.unwrap().before, 8);
}

#[test]
fn the_first_field_of_a_recorded_state_that_differs_is_found() {
    let mut cart = Cart::default();
    cart.handle(vimc4_device::Input::Bytes(b"m4\r"), Time::ZERO);
    cart.handle(vimc4_device::Input::Wake, ms(20));
    let mut wrong = drive();
    wrong.entries.insert(3, state(20, &cart));
    let found = checked(&wrong).unwrap();
    assert_eq!(found.said, None);
    let field = found.field.unwrap();
    assert_eq!((field.field.as_str(), field.one, field.other), ("place", json!(4), json!(5)));
    assert_eq!(field.at, ms(20));
}

#[test]
fn another_controller_parts_where_it_does_something_else() {
    let mut further = Cart::default();
    further.handle(vimc4_device::Input::Bytes(b"m3\r"), Time::ZERO);
    further.handle(vimc4_device::Input::Wake, ms(3));
    while further.poll_output().is_some() {}
    let mut began = serde_json::to_value(further.state()).unwrap();
    began["now"] = json!(0);
    let other = move |_: &Value| read(&began);
    let players = || (Player::new(Cart::default()), Player::new(Cart::default()));
    let (one, two) = players();
    let found =
        part(&drive(), one, two, &ASIDE, [&read, &other], &mut |_| {}).unwrap().difference.unwrap();
    // What is known to be the same is not compared field by field, and nothing else comes of it.
    let (one, two) = players();
    let looked_at = Aside { values: &[], is_same: &|_, _| false };
    let slowly =
        part(&drive(), one, two, &looked_at, [&read, &other], &mut |_| {}).unwrap().difference;
    assert_eq!(slowly.as_ref(), Some(&found));
    let field = found.field.unwrap();
    assert_eq!((field.field.as_str(), field.at), ("latest", ms(0)));
    // Where it is has been asked in the end: 25 steps, and 28.
    let said = found.said.unwrap();
    assert_eq!((said.before, said.rest), (9, [b"5".to_vec(), b"8".to_vec()]));
    assert!(!found.one.told.is_empty() && !found.other.told.is_empty());
    let (one, two) = players();
    assert_eq!(
        part(&drive(), one, two, &ASIDE, [&read, &read], &mut |_| {}).unwrap().difference,
        None
    );
    // The same, where it is only asked whether they do.
    for (one_other, is_otherwise) in [(&other as &dyn Fn(&Value) -> _, true), (&read, false)] {
        let (one, two) = players();
        let said = say_otherwise(&drive(), one, two, [&read, one_other]).unwrap();
        assert_eq!(said, is_otherwise);
    }
}

#[test]
fn two_recordings_differ_in_what_was_given_and_what_was_said() {
    let one = drive();
    assert_eq!(given_apart(&one, &one), None);
    assert_eq!(said_apart(&one, &one), None);
    let mut other = drive();
    other.entries[5] = stop(81, 1);
    other.entries[6] = said(81, "stopped");
    let [a, b] = given_apart(&one, &other).unwrap();
    assert_eq!((a.unwrap().at, b.unwrap().at), (ms(80), ms(81)));
    assert_eq!(said_apart(&one, &other).unwrap().before, 1);
    other.entries.truncate(5);
    assert_eq!(given_apart(&one, &other).unwrap()[1], None);
}

#[test]
fn a_part_plays_by_itself_wherever_it_is_cut() {
    let whole = rerecord(&drive(), Player::new(Cart::default()), &read).unwrap();
    for from in 0..120 {
        for to in [from, from + 1, from + 30, 500] {
            let part = cut(&whole, Player::new(Cart::default()), ms(from), ms(to), &read).unwrap();
            let found = checked(&part);
            assert_eq!(found, None, "{from} to {to}: {}", String::from_utf8_lossy(&part.write()));
        }
    }
}

/// How a cart is after these lines, at a time.
fn cart_at(at: u64, lines: &[(u64, &'static str)]) -> Cart {
    let mut player = Player::new(Cart::default());
    for (at, text) in lines {
        player.play(&sent(*at, text), &read).unwrap();
    }
    player.run_to(ms(at));
    player.device().clone()
}

/// Somebody puts a cart into the state of another one.
fn put(at: u64, device: &Cart) -> Entry {
    let state = serde_json::to_value(device.state()).unwrap();
    Entry::new(ms(at), What::State { by: Some(Arc::from("a test")), state })
}

fn stands(at: u64, causes: Option<u32>) -> Entry {
    Entry::new(ms(at), What::Stands(causes))
}

/// A cart that is led back twice and then far forward: from 60 ms to 20 ms, where it stands for a
/// while, from 50 ms to 10 ms, and from 90 ms to 150 ms.
fn back_and_forth() -> Recording {
    let begun = [(2, "m40\r")];
    let (far, near) = (cart_at(20, &begun), cart_at(10, &begun));
    let later = cart_at(150, &[(2, "m40\r"), (140, "m30\rp")]);
    let entries = recording([
        sent(2, "m40\r"),
        sent(45, "p\r"),
        sent(55, "m9\r"),
        stands(60, Some(0)),
        put(60, &far),
        stands(20, Some(0)),
        stop(20, 1),
        stands(20, None),
        stop(20, 0),
        stands(30, Some(1)),
        sent(30, "p\rm30\r"),
        stands(40, Some(1)),
        stands(40, None),
        Entry::new(ms(40), What::Goes),
        put(50, &near),
        stop(15, 1),
        sent(70, "p\rp"),
        Entry::new(ms(80), What::Mark("here".to_owned())),
        put(90, &later),
        stop(155, 1),
        sent(160, "\rp\r"),
        Entry::new(ms(200), What::End("the end".to_owned())),
    ]);
    rerecord(&entries, Player::new(Cart::default()), &read).unwrap()
}

/// What went in, and where somebody went back.
fn acts(recording: &Recording) -> Vec<(Time, What)> {
    let is_act =
        |entry: &&Entry| matches!(entry.what, What::Given { .. } | What::State { by: Some(_), .. });
    recording.entries.iter().filter(is_act).map(|entry| (entry.at, entry.what.clone())).collect()
}

#[test]
fn a_part_across_a_going_back_has_all_of_it_and_plays_by_itself() {
    let whole = back_and_forth();
    assert_eq!(checked(&whole), None, "{}", String::from_utf8_lossy(&whole.write()));
    let part = |from, to| {
        let part = cut(&whole, Player::new(Cart::default()), ms(from), ms(to), &read).unwrap();
        let text = part.write();
        let found = checked(&part);
        assert_eq!(found, None, "{from} to {to}: {}", String::from_utf8_lossy(&text));
        assert_eq!(Recording::read(&text).map(|read| read.write()), Ok(text), "{from} to {to}");
        // Nothing is missing in the middle of it.
        let (all, acts) = (acts(&whole), acts(&part));
        assert!(
            acts.is_empty() || all.windows(acts.len()).any(|some| some == acts),
            "{from} to {to}: {acts:?}"
        );
        acts
    };
    for from in 0..210 {
        for to in [from, from + 1, from + 30, 500] {
            part(from, to);
        }
    }
    // Time is at 50 ms the first time before anybody has gone back.
    assert_eq!(part(50, 58), acts(&whole)[2..3]);
    // It goes past 65 ms only after both.
    assert_eq!(part(50, 65), acts(&whole)[2..9]);
    assert_eq!(part(65, 69), []);
    // It has never been at 120 ms: there is only what is before it, or what comes after it.
    assert_eq!(part(80, 120), []);
    assert_eq!(part(120, 500), acts(&whole)[11..]);
    assert_eq!(part(0, 500), acts(&whole));

    // A part of a part begins where that begins.
    let later = cut(&whole, Player::new(Cart::default()), ms(50), ms(500), &read).unwrap();
    let again = cut(&later, Player::new(Cart::default()), ms(0), ms(500), &read).unwrap();
    assert_eq!(acts(&again), acts(&later));
    assert_eq!(checked(&again), None);
}

#[test]
fn what_is_left_of_going_back_is_in_order() {
    let begun = [(2, "m40\r")];
    // A line comes in two pieces, with something else between them.
    let entries = recording([
        sent(2, "m40\r"),
        sent(55, "p\r"),
        put(60, &cart_at(20, &begun)),
        sent(21, "p"),
        stop(22, 1),
        stop(23, 0),
        sent(24, "\rp\r"),
        sent(28, "m3\r"),
        sent(35, "p\r"),
        Entry::new(ms(50), What::End("the end".to_owned())),
    ]);
    let player = || Player::new(Cart::default());
    let whole = rerecord(&entries, player(), &read).unwrap();
    assert_eq!(checked(&whole), None);
    for wanted in ["40", "20", "23"] {
        let short = minimise(&whole, b"\r", |short| {
            assert!(Recording::read(&short.write()).is_ok());
            let played = rerecord(short, player(), &read).unwrap();
            played.entries.iter().any(|entry| {
                matches!(&entry.what, What::Sent(bytes) if bytes.ends_with(wanted.as_bytes()))
            })
        });
        let short = rerecord(&short, player(), &read).unwrap();
        assert!(Recording::read(&short.write()).is_ok(), "{wanted}");
        assert_eq!(checked(&short), None, "{wanted}");
        assert!(acts(&short).len() < acts(&whole).len(), "{wanted}");
    }
}

#[test]
fn what_is_left_is_what_is_needed() {
    let mut entries: Vec<Entry> = (0..40).map(|time| sent(time, "p\r")).collect();
    entries.insert(20, sent(20, "m7\rp\rm9\r"));
    entries.push(sent(100, "p\r"));
    entries.push(Entry::new(ms(200), What::End("the end".to_owned())));
    let whole = recording(entries);
    let player = || Player::new(Cart::default());
    // Somebody says that it is at 16.
    let shows = |recording: &Recording| {
        let played = rerecord(recording, player(), &read).unwrap();
        let says =
            |entry: &Entry| matches!(&entry.what, What::Sent(bytes) if bytes.ends_with(b"16"));
        played.entries.iter().any(says)
    };
    assert!(shows(&whole));
    let short = minimise(&whole, b"\r", shows);
    let lines: Vec<_> = short
        .entries
        .iter()
        .filter_map(|entry| match &entry.what {
            What::Given { given: Given::Bytes(bytes), .. } => Some(&bytes[..]),
            _ => None,
        })
        .collect();
    assert_eq!(lines, [&b"m7\r"[..], b"m9\r", b"p\r"]);
    assert_eq!(checked(&rerecord(&short, player(), &read).unwrap()), None);
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    let text = String::from_utf8(drive().write()).unwrap();
    let with = |line: usize, new: &str| {
        let mut lines: Vec<&str> = text.lines().collect();
        lines[line - 1] = new;
        let error = Recording::read((lines.join("\n") + "\n").as_bytes()).unwrap_err();
        (error.line, error.message)
    };
    for (line, new, message) in [
        (1, "{}", "this is not a recording"),
        (1, "not JSON", "this is not a recording"),
        (1, r#"{"recording":2,"whatever":3}"#, "it is a recording of version 2"),
        (1, r#"{"recording":"one"}"#, "it is a recording of version \"one\""),
        (1, r#"{"recording":1}"#, "missing field"),
        (4, r#"{"at":5000000,"in":"m1""#, "EOF"),
        (4, r#"{"at":5000000,"in":"m1","out":"0"}"#, "it does not say one thing"),
        (4, r#"{"at":5000000}"#, "it does not say one thing"),
        (4, r#"{"at":5000000,"wait":false}"#, "it does not say one thing"),
        (4, r#"{"at":5000000,"out":"0","by":"me"}"#, "it does not say one thing"),
        (4, r#"{"at":5000000,"signal":"stop"}"#, "stand together"),
        (4, r#"{"at":5000000,"inn":"m1"}"#, "unknown field `inn`"),
        (4, r#"{"at":-1,"in":"m1"}"#, "invalid value"),
        (4, r#"{"at":5000000,"in":"\u2192"}"#, "'→', which is not a byte"),
        (
            9,
            r#"{"at":7,"signal":"stop","value":0}"#,
            "its time, 7, is before that of line 7, 80000000",
        ),
    ] {
        let (found, said) = with(line, new);
        assert_eq!(found as usize, line, "{new}: {said}");
        assert!(said.contains(message), "{new}: {said}");
    }
    assert_eq!(Recording::read(b"").unwrap_err().line, 1);
}

#[test]
fn no_line_is_before_one_before_it() {
    let mut whole = drive();
    let mark = Entry::new(ms(100), What::Mark("here".to_owned()));
    let news = Entry::new(ms(100), What::News(json!({})));
    let [stands, goes] = [What::Stands(Some(0)), What::Goes].map(|what| Entry::new(ms(100), what));
    let here = state(100, &Cart::default());
    whole.entries.splice(10..10, [mark, news, stands, here, goes]);
    assert!(Recording::read(&whole.write()).is_ok());
    let moved = |place: usize, at: Time, clock: &str| {
        let mut moved = whole.clone();
        moved.entries[place].at = at;
        moved.head.clock = clock.to_owned();
        Recording::read(&moved.write()).map_err(|error| (error.line as usize, error.message))
    };
    let lines = 2..whole.entries.len() + 2;
    for (place, line) in lines.clone().enumerate() {
        let what = &whole.entries[place].what;
        // Time goes back to a line, and from one.
        if whole.entries[place].at > ms(5) {
            let (found, said) = moved(place, ms(4), "instant").unwrap_err();
            assert_eq!(found, line, "{what:?}");
            assert!(said.starts_with("its time, 4000000, is before that of line "), "{said}");
        }
        let ahead = moved(place, Time::from_secs(9), "instant");
        let is_clients = matches!(what, What::News(_));
        match is_clients || line + 1 == lines.end {
            true => assert!(ahead.is_ok(), "{what:?}"),
            false => {
                // News do not go by the controller's time, but neither are they before it.
                let told = format!("is before that of line {line}, 9000000000");
                let (found, said) = ahead.unwrap_err();
                assert_eq!(found, line + 1, "{what:?}");
                assert!(said.contains(&told), "{said}");
            }
        }
        // What a real controller says may have been on its way.
        if let What::Sent(_) = what {
            assert!(moved(place, Time::ZERO, "wall").is_ok());
            assert!(moved(place, Time::from_secs(9), "wall").is_err());
        }
    }
}

#[test]
fn a_torn_last_line_is_said_and_left_out() {
    let whole = drive();
    let text = whole.write();
    let head = text.iter().position(|byte| *byte == b'\n').unwrap();
    for end in head + 1..text.len() {
        let torn = Recording::read(&text[..end]).unwrap();
        let lines = text[..end].iter().filter(|byte| **byte == b'\n').count();
        let left = torn.entries.len();
        assert_eq!(
            torn.entries.iter().map(|entry| &entry.what).collect::<Vec<_>>(),
            whole.entries[..left].iter().map(|entry| &entry.what).collect::<Vec<_>>()
        );
        match torn.torn {
            Some(line) => assert_eq!((line as usize, left), (lines + 1, lines - 1)),
            // All but its end may be there.
            None => assert!(left == lines - 1 || left == lines, "{end}"),
        }
        // Played as far as it goes, it says what was recorded.
        assert_eq!(checked(&torn), None, "{end}");
    }
}

fn any_bytes() -> impl Strategy<Value = Bytes> {
    prop::collection::vec(any::<u8>(), 0..40).prop_map(Bytes::from)
}

fn any_what() -> impl Strategy<Value = What> {
    let given = prop_oneof![
        any_bytes().prop_map(Given::Bytes),
        (".{0,20}", any::<i32>()).prop_map(|(name, value)| Given::Signal { name, value }),
        any::<bool>().prop_map(Given::Power),
        ".{0,20}".prop_map(Given::Fault),
        Just(Given::Wait),
    ];
    prop_oneof![
        (".{0,20}", given).prop_map(|(by, given)| What::Given { by: Arc::from(by), given }),
        any_bytes().prop_map(What::Sent),
        (any::<bool>(), any::<u64>()).prop_map(|(done, state)| What::State {
            by: done.then(|| Arc::from("me")),
            state: json!({ "a": [state, null] }),
        }),
        any::<Option<u32>>().prop_map(What::Stands),
        Just(What::Goes),
        ".{0,20}".prop_map(|news| What::News(json!({ "news": news }))),
        ".{0,20}".prop_map(What::Mark),
        ".{0,20}".prop_map(What::End),
    ]
}

proptest! {
    #[test]
    fn what_is_written_is_read_again(whats in prop::collection::vec((0u64..1000, any_what()), 0..30)) {
        let mut at = 0;
        let mut entries: Vec<Entry> = whats.into_iter().map(|(more, what)| {
            at += more;
            Entry::new(Time::from_nanos(at), what)
        }).collect();
        // Nothing comes after the end.
        let end = entries.iter().position(|entry| matches!(entry.what, What::End(_)));
        entries.truncate(end.map_or(usize::MAX, |end| end + 1));
        let written = Recording { head: head(), entries, torn: None };
        let text = written.write();
        prop_assert!(text.is_ascii() || written.entries.iter().any(|entry| !matches!(entry.what, What::Sent(_))));
        let read = Recording::read(&text).unwrap();
        prop_assert_eq!(read.write(), text);
        for (line, (one, other)) in (2..).zip(written.entries.iter().zip(&read.entries)) {
            prop_assert_eq!((other.at, &other.what, other.line), (one.at, &one.what, line));
        }
    }
}
