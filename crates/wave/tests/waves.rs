//! Waveforms read again by a reader of another author: edges, places and times are the controller's.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod bench;

use proptest::prelude::*;
use vimc4_device::{Device as _, Input, Time};

use crate::bench::{Bench, Format, Wave};

/// What is done to a controller.
#[derive(Clone, Debug)]
enum Deed {
    Say(String),
    Press(&'static str, i32),
    Wait(u64),
    Power(bool),
}

fn perform(bench: &mut Bench, deeds: &[Deed]) {
    for deed in deeds {
        match deed {
            Deed::Say(line) => bench.give(Input::Bytes(line.as_bytes())),
            Deed::Press(name, value) => bench.press(name, *value),
            Deed::Wait(micros) => bench.run_to(bench.now().after_nanos(micros * 1_000)),
            Deed::Power(on) => bench.give(Input::Power(*on)),
        }
    }
}

fn say(line: &str) -> Deed {
    Deed::Say(format!("{line}\r"))
}

/// The controller's own word for where it is, at many moments, against the waveform.
fn agrees(mut bench: Bench) {
    bench.settle();
    let (places, end) = (bench.places.clone(), bench.now());
    let (travelled, net) = (bench.travelled, bench.net);
    let names = bench.axes();
    let waves = bench.finish();
    for wave in &waves {
        for (axis, name) in names.iter().enumerate() {
            let steps = wave.edges(&format!("{name}.step"));
            let up = wave.bits(&format!("{name}.dir"));
            let positions = wave.numbers(&format!("{name}.position"));
            assert_eq!(steps.len() as u64, travelled[axis], "steps of {name}");
            assert!(steps.is_sorted_by(|one, next| one < next), "no two steps of {name} at once");
            for (at, place) in &places {
                assert_eq!(last(&positions, *at), Some(place[axis]), "{name} at {at}");
            }
            let goes_up = |at: &u64| last(&up, Time::from_nanos(*at)).unwrap();
            let way: i64 = steps.iter().map(|at| if goes_up(at) { 1 } else { -1 }).sum();
            assert_eq!(way, net[axis], "net of {name}");
        }
        assert!(wave.end() >= end.as_nanos());
        assert!(wave.end() <= end.as_nanos() + 1_000_000_000, "{} {end}", wave.end());
    }
    // Both formats have the same changes of the same signals.
    let (one, other) = (&waves[0], &waves[1]);
    for (name, changes) in &one.changes {
        assert_eq!(Some(changes), other.changes.get(name), "{name}");
    }
    assert_eq!(one.changes.len(), other.changes.len());
}

fn last<T: Clone>(changes: &[(u64, T)], at: Time) -> Option<T> {
    let place = changes.partition_point(|(time, _)| *time <= at.as_nanos());
    changes.get(place.checked_sub(1)?).map(|(_, value)| value.clone())
}

fn run(model: &str, machine: &str, deeds: &[Deed]) {
    let mut bench = Bench::new(model, machine, false);
    perform(&mut bench, deeds);
    agrees(bench);
}

#[test]
fn moves_arcs_and_ramps_of_isel_are_drawn_step_by_step() {
    run(
        "imc4",
        "mill",
        &[
            say("@07"),
            say("@0A 5000,900,-300,400,20,30,0,30"),
            Deed::Wait(8_000_000),
            say("@0f-1"),
            say("@0y 12566,1000,0,0,0,-2000,0"),
            Deed::Wait(3_000_000),
            say("@0a 0,9000,0,9000,0,900,0,900"),
            Deed::Wait(30_000_000),
        ],
    );
}

#[test]
fn a_stop_in_the_middle_and_the_rest_of_the_way_are_drawn() {
    run(
        "imc4",
        "mill",
        &[
            say("@07"),
            say("@0A 50000,9000,0,900,0,900,0,900"),
            Deed::Wait(2_000_123),
            Deed::Press("stop", 1),
            Deed::Wait(70_001),
            Deed::Press("stop", 0),
            Deed::Wait(1_000_000),
            say("@0S"),
            Deed::Wait(900_000),
            Deed::Press("estop", 1),
            Deed::Wait(500_000),
        ],
    );
}

#[test]
fn a_loss_of_power_in_the_middle_ends_the_steps() {
    for (model, machine, line) in [
        ("imc4", "mill", "@0A 50000,9000,0,900,0,900,0,900"),
        ("smcu", "board-plotter", "PA9000,700;"),
    ] {
        run(
            model,
            machine,
            &[
                say(if model == "imc4" { "@07" } else { "IN;" }),
                Deed::Wait(3_000_000),
                say(line),
                Deed::Wait(200_321),
                Deed::Power(false),
                Deed::Wait(500_000),
                Deed::Power(true),
                Deed::Wait(3_000_000),
            ],
        );
    }
}

#[test]
fn vectors_and_circles_of_lpkf_are_drawn_step_by_step() {
    run(
        "smcu",
        "board-plotter",
        &[
            say("IN;"),
            Deed::Wait(10_000_000),
            say("PA2000,100;PD;PA2100,300,2500,350,3000,900;PU;PA0,0;"),
            Deed::Wait(60_000_000),
        ],
    );
}

#[test]
fn a_reference_run_is_drawn_with_its_switches() {
    let mut bench = Bench::new("imc4", "mill", false);
    perform(&mut bench, &[say("@07"), say("@0R7"), Deed::Wait(600_000_000)]);
    let referenced = bench.harness.device().view(bench.now());
    assert!(referenced.axes[0].referenced);
    let wave = bench.finish().remove(0);
    let switch = wave.bits("x.limit_minus");
    assert!(switch.iter().any(|(_, active)| *active), "the switch is met: {switch:?}");
    assert!(!switch.last().unwrap().1, "and left again");
    let states: Vec<String> = wave.texts("state").into_iter().map(|(_, text)| text).collect();
    for state in ["reference-towards-switch", "reference-out-of-switch", "idle"] {
        assert!(states.iter().any(|seen| seen == state), "{states:?}");
    }
}

#[test]
fn time_that_is_cut_anywhere_gives_the_same_waveform() {
    let deeds = |cuts: &[u64]| {
        let mut deeds = vec![say("@07"), say("@0A 3000,900,2000,900,0,900,0,900")];
        deeds.extend(cuts.iter().map(|cut| Deed::Wait(*cut)));
        deeds
    };
    let drawn = |deeds: &[Deed]| {
        let mut bench = Bench::new("imc4", "mill", false);
        perform(&mut bench, deeds);
        bench.finish().remove(0).changes
    };
    let whole = drawn(&deeds(&[9_000_000]));
    assert_eq!(drawn(&deeds(&[1, 1_000, 3_333_333, 2, 5_665_664])), whole);
}

/// Reads the characters off a wire as a UART does: in the middle of each bit.
fn read_bits(bits: &[(u64, bool)], baud: u64) -> Vec<(u64, u8)> {
    let level = |at: u64| last(bits, Time::from_nanos(at)).unwrap();
    let (mut read, mut free) = (Vec::new(), 0);
    for (at, is_high) in bits {
        if *is_high || *at < free {
            continue;
        }
        let middle = |bit: u64| at + (2 * bit + 1) * 1_000_000_000 / (2 * baud);
        let byte = (0..8).fold(0, |byte, bit| byte | u8::from(level(middle(bit + 1))) << bit);
        assert!(level(middle(9)), "a stop bit");
        read.push((*at, byte));
        free = middle(9);
    }
    read
}

#[test]
fn a_uart_reads_what_was_sent_and_answered() {
    let mut bench = Bench::new("imc4", "mill", false);
    perform(&mut bench, &[say("@07"), Deed::Wait(50_000), say("@0P"), Deed::Wait(1_000_000)]);
    let (given, sent) = (bench.given.clone(), bench.sent.clone());
    let wave = bench.finish().remove(0);
    for (name, bytes) in [("line.rx", given), ("line.tx", sent)] {
        let read = read_bits(&wave.bits(name), 19_200);
        let (read, began): (Vec<u8>, Vec<u64>) =
            read.into_iter().map(|(at, byte)| (byte, at)).unzip();
        assert_eq!(read, bytes, "{name}");
        // Each character has ten bits, and none begins before the one before it has ended.
        assert!(began.is_sorted_by(|one, next| next - one >= 520_833));
        let texts = wave.texts(&format!("{name}_text"));
        for (at, byte) in began.iter().zip(&bytes) {
            let text = last(&texts, Time::from_nanos(at + 1)).unwrap();
            assert_eq!(text.as_bytes(), [*byte], "{name} at {at}");
        }
    }
    assert!(wave.texts("command").iter().any(|(_, text)| text == "@0P"));
}

#[test]
fn on_a_paced_line_characters_stand_where_the_line_has_them() {
    let mut bench = Bench::new("imc4", "mill", true);
    perform(
        &mut bench,
        &[
            say("@07"),
            Deed::Wait(50_000),
            say("@0A 900,900,0,900,0,900,0,900"),
            Deed::Wait(3_000_000),
        ],
    );
    let (sent, times, command) =
        (bench.sent.clone(), bench.sent_at.clone(), bench.commands.clone());
    let wave = bench.finish().remove(0);
    let read = read_bits(&wave.bits("line.tx"), 19_200);
    assert_eq!(read.iter().map(|(_, byte)| *byte).collect::<Vec<_>>(), sent);
    for ((began, _), left) in read.iter().zip(times) {
        assert_eq!(left.as_nanos().abs_diff(began + 520_834), 0, "a character leaves at its end");
    }
    // A command begins with the end of the stop bit of its CR.
    let heard = read_bits(&wave.bits("line.rx"), 19_200);
    let ends: Vec<u64> =
        heard.iter().filter(|(_, byte)| *byte == b'\r').map(|(at, _)| *at).collect();
    assert_eq!(ends.len(), command.len());
    for (began, command) in ends.iter().zip(command) {
        assert!(command.as_nanos().abs_diff(began + 520_833) <= 1, "{began} {command}");
    }
}

/// A few commands, cut by time, buttons and the mains switch.
fn deeds() -> impl Strategy<Value = Vec<Deed>> {
    let line = prop_oneof![
        (-3_000_i64..3_000, -3_000_i64..3_000, 200_u32..9_000)
            .prop_map(|(x, y, speed)| say(&format!("@0A {x},{speed},{y},{speed},0,900,0,900"))),
        (1_u32..5_000).prop_map(|steps| say(&format!("@0y {steps},900,0,0,0,-700,0"))),
        Just(say("@0P")),
        Just(say("@0S")),
    ];
    let deed = prop_oneof![
        4 => line,
        6 => (1_u64..900_000).prop_map(Deed::Wait),
        1 => prop::sample::select(vec![("stop", 1), ("stop", 0), ("start", 1), ("start", 0)])
            .prop_map(|(name, value)| Deed::Press(name, value)),
        1 => any::<bool>().prop_map(Deed::Power),
    ];
    prop::collection::vec(deed, 1..25).prop_map(|mut deeds| {
        deeds.insert(0, say("@07"));
        deeds
    })
}

/// A few commands of a plot, cut by time, the emergency stop and the mains switch.
fn plots() -> impl Strategy<Value = Vec<Deed>> {
    let line = prop_oneof![
        4 => (0_i64..4_000, 0_i64..4_000).prop_map(|(x, y)| say(&format!("PA{x},{y};"))),
        1 => prop::sample::select(vec!["PU;", "PD;", "!ST;", "!GO;"]).prop_map(say),
    ];
    let deed = prop_oneof![
        5 => line,
        5 => (1_u64..900_000).prop_map(Deed::Wait),
        1 => any::<bool>().prop_map(Deed::Power),
    ];
    prop::collection::vec(deed, 1..25).prop_map(|mut deeds| {
        deeds.splice(0..0, [say("IN;"), Deed::Wait(8_000_000)]);
        deeds
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn whatever_happens_is_drawn_as_it_was(deeds in deeds(), paced: bool) {
        let mut bench = Bench::new("imc4", "mill", paced);
        perform(&mut bench, &deeds);
        agrees(bench);
    }

    #[test]
    fn whatever_is_plotted_is_drawn_as_it_was(deeds in plots(), paced: bool) {
        let mut bench = Bench::new("smcu", "board-plotter", paced);
        perform(&mut bench, &deeds);
        agrees(bench);
    }

    #[test]
    fn time_never_goes_back(deeds in deeds()) {
        let mut bench = Bench::new("imc4", "mill", false);
        perform(&mut bench, &deeds);
        let text = bench.text(Format::Vcd);
        let times = text.lines().filter_map(|line| line.strip_prefix('#')?.parse::<u64>().ok());
        prop_assert!(times.is_sorted_by(|one, next| one < next));
        let table = bench.text(Format::Csv);
        let seconds = table.lines().skip(1).map(|line| line.split(',').next().unwrap().to_owned());
        let nanos = seconds.map(|seconds| seconds.replace('.', "").parse::<u64>().unwrap());
        prop_assert!(nanos.is_sorted());
    }
}

#[test]
fn a_table_says_what_happened() {
    let mut bench = Bench::new("imc4", "mill", false);
    perform(&mut bench, &[say("@07"), say("@0A 3,900,0,900,0,900,0,900"), Deed::Wait(1_000_000)]);
    let table = bench.text(Format::Csv);
    let rows: Vec<&str> = table.lines().collect();
    assert_eq!(rows[0], "seconds,signal,value");
    for row in ["0.000000000,command,@07", "0.000000000,x.enable,1"] {
        assert!(rows.contains(&row), "{row} in {table}");
    }
    // A signal has a first row whatever its value is, and a command that is answered is none any more.
    for signal in ["command", "answer", "note"] {
        let first = rows.iter().find(|row| row.contains(&format!(",{signal},")));
        assert_eq!(first, Some(&&*format!("0.000000000,{signal},")));
    }
    let last = rows.iter().rfind(|row| row.contains(",command,")).unwrap();
    assert!(last.ends_with(",command,") && !last.starts_with("0.0000"), "{last}");
    let places: Vec<&str> = rows
        .iter()
        .filter(|row| row.contains(",x.position,"))
        .map(|row| row.rsplit(',').next().unwrap())
        .collect();
    assert_eq!(places, ["0", "1", "2", "3"]);
    assert!(!table.contains("step") && !table.contains("rx"));
}

#[test]
fn a_trace_has_commands_motions_and_answers() {
    let mut bench = Bench::new("imc4", "mill", false);
    perform(&mut bench, &[say("@07"), say("@0A 900,900,0,900,0,900,0,900"), Deed::Wait(3_000_000)]);
    let trace: serde_json::Value = serde_json::from_str(&bench.text(Format::Trace)).unwrap();
    let events = trace["traceEvents"].as_array().unwrap();
    let named = |name: &str| events.iter().find(|event| event["name"] == name).unwrap();
    let command = named("@0A 900,900,0,900,0,900,0,900");
    let motion = named("line");
    assert_eq!((&command["ph"], &motion["ph"]), (&"X".into(), &"X".into()));
    assert_eq!(motion["args"]["steps"], 900);
    let began = motion["ts"].as_f64().unwrap();
    let (from, lasts) = (command["ts"].as_f64().unwrap(), command["dur"].as_f64().unwrap());
    assert!(from <= began && began + motion["dur"].as_f64().unwrap() <= from + lasts + 0.001);
}

#[test]
fn what_a_viewer_shows_first_is_in_the_waveform() {
    let bench = Bench::new("smcu", "board-plotter", false);
    let scene = bench.scene();
    let (gtkwave, surfer) =
        (vimc4_wave::layout::gtkwave(&scene, "out.vcd"), vimc4_wave::layout::surfer(&scene));
    let wave: Wave = bench.finish().remove(0);
    let shown: Vec<&str> = gtkwave.lines().filter(|line| line.starts_with("smcu.")).collect();
    let added: Vec<&str> =
        surfer.lines().filter_map(|line| line.strip_prefix("variable_add ")).collect();
    assert_eq!(shown.len(), added.len());
    for (shown, added) in shown.iter().zip(added) {
        assert_eq!(shown.trim_end_matches("[7:0]"), added);
        assert!(wave.changes.contains_key(added.trim_start_matches("smcu.")), "{added}");
    }
}

#[test]
fn what_is_lived_after_going_back_is_drawn_after_what_was_lived_before() {
    let lived = || {
        let mut bench = Bench::new("imc4", "mill", false);
        perform(&mut bench, &[say("@01"), Deed::Wait(100_000)]);
        let at_rest = bench.harness.device().state();
        perform(&mut bench, &[say("@0A900,900"), Deed::Wait(500_000)]);
        let under_way = bench.harness.device().state();
        perform(&mut bench, &[Deed::Wait(1_500_000)]);
        bench.put(at_rest, "a test");
        perform(&mut bench, &[say("@0A-300,900"), Deed::Wait(1_000_000)]);
        bench.put(under_way, "");
        perform(&mut bench, &[Deed::Wait(2_000_000)]);
        bench
    };
    let table = lived().text(Format::Csv);
    let rows: Vec<(&str, &str, &str)> = table
        .lines()
        .skip(1)
        .map(|row| row.split_once(',').unwrap())
        .map(|(at, rest)| (at, rest.split_once(',').unwrap()))
        .map(|(at, (signal, value))| (at, signal, value))
        .collect();
    assert!(rows.is_sorted_by_key(|(at, ..)| at.parse::<f64>().unwrap()));
    let of = |signal: &str| {
        let own = rows.iter().filter(|(_, own, _)| *own == signal);
        own.map(|(at, _, value)| (*at, *value)).collect::<Vec<_>>()
    };
    let notes = [
        ("0.000000000", ""),
        ("2.100000000", "put back by a test to 100ms"),
        ("3.100000000", "put back to 600ms"),
    ];
    assert_eq!(of("note"), notes);
    let commands: Vec<_> =
        of("command").into_iter().map(|(at, text)| (at, text.trim_matches('"'))).collect();
    assert_eq!(
        commands,
        [
            ("0.000000000", ""),
            ("0.000000000", "@01"),
            ("0.000000000", ""),
            ("0.100000000", "@0A900,900"),
            ("1.104000000", ""),
            ("2.100000000", "@0A-300,900"),
            ("2.437333334", ""),
        ]
    );
    let positions: Vec<(&str, i64)> =
        of("x.position").into_iter().map(|(at, value)| (at, value.parse().unwrap())).collect();
    // It comes to 900, is at 0 again, comes to -300, and is put into the middle of the first move.
    let jumps: Vec<_> = positions
        .windows(2)
        .filter(|pair| (pair[1].1 - pair[0].1).abs() > 1)
        .map(|pair| (pair[0].1, pair[1].0, pair[1].1))
        .collect();
    assert_eq!(jumps.len(), 2, "{jumps:?}");
    assert_eq!(jumps[0], (900, "2.100000000", 0));
    let (before, at, halfway) = jumps[1];
    assert_eq!((before, at), (-300, "3.100000000"));
    assert!((300..600).contains(&halfway), "{halfway}");
    assert_eq!(positions.last().unwrap().1, 900);
    for wave in lived().finish() {
        let steps = wave.edges("x.step");
        assert!(steps.is_sorted_by(|one, next| one < next));
        assert_eq!(steps.len() as i64, 900 + 300 + (900 - halfway));
    }
}

/// A client that polls without a pause, on a line without pacing, sends more than the line carries.
#[test]
fn a_flood_of_characters_is_drawn_only_as_far_as_the_line_carries_it() {
    let mut bench = Bench::new("imc4", "mill", false);
    for _ in 0..200 {
        perform(&mut bench, &[say(&["@0P"; 100].join("\r")), Deed::Wait(1)]);
    }
    let answered = bench.sent.len();
    assert_eq!(answered, 200 * 100 * 19);
    let wave = bench.finish().remove(0);
    // 200 commands a millisecond for 0.2 s: some 16,000 characters are drawn, at 1,920 a second.
    assert!(wave.end() < 10_000_000_000, "{}", wave.end());
    for name in ["line.rx", "line.tx"] {
        let drawn = read_bits(&wave.bits(name), 19_200).len();
        assert!((16_000..20_000).contains(&drawn), "{name}: {drawn}");
        let texts = wave.texts(&format!("{name}_text"));
        assert_eq!(texts.last().unwrap().1, "left out: faster than the line", "{name}");
    }
}

/// After a flush the files can be read as they are: the program may be killed.
#[test]
fn a_file_opens_up_to_the_last_flush() {
    let mut bench = Bench::new("imc4", "mill", false);
    let deeds = [say("@07"), say("@0A 900,900,-70,800,0,900,0,900"), Deed::Wait(300_000)];
    perform(&mut bench, &deeds);
    bench.flush();
    perform(&mut bench, &[Deed::Wait(200_000)]);
    let [vcd, fst] = bench.flush();
    let [vcd, cut] = [vcd, fst.clone()].map(Wave::read);
    assert!((440..=450).contains(&vcd.edges("x.step").len()));
    assert_eq!(vcd.changes, cut.changes);
    let trace = bench.written(Format::Trace);
    let trace: serde_json::Value = serde_json::from_str(&trace).unwrap();
    assert!(trace["traceEvents"].as_array().unwrap().len() > 20);
    assert!(bench.written(Format::Csv).ends_with('\n'));
    // Killed in the middle of the next section, at any byte of it.
    perform(&mut bench, &[Deed::Wait(100_000)]);
    let [_, more] = bench.flush();
    for size in [9, 50, 200] {
        let mut torn = [&fst[..], &[255, 0, 0, 0, 0, 0, 0, 0, 0]].concat();
        torn.extend_from_slice(&more[torn.len()..fst.len() + size]);
        assert_eq!(Wave::read(torn).changes, cut.changes, "torn after {size} bytes");
    }
    // It goes on to the end all the same.
    agrees(bench);
}
