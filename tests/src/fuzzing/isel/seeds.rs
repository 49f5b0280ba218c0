//! The inputs to begin with for the isel controllers: every command of every model with every
//! reply it can have, every signal, every stop.

use vimc4_isel::Model;
use vimc4_isel_wire::{CommandSpec, Dialect, Mode, Op, Reply, table};
use vimc4_plant::{End, PlantSignal};

use crate::fuzzing::operations::{Operation, Setup};
use crate::fuzzing::script::{Script, Seed};

/// All of them.
pub(in crate::fuzzing) fn seeds() -> Vec<Seed> {
    let mut seeds = Vec::new();
    let mut add = |target, name: String, data| seeds.push(Seed { target, name, data });
    for (number, name) in Model::names().into_iter().enumerate() {
        let Some(model) = Model::builtin(name) else { continue };
        let dialect = model.command_set.dialect();
        for (about, data) in controllers(number, dialect) {
            add("controller", format!("{name}-{about}"), data);
        }
        for end in ["end speeds=900,900,900,2000", "invalid", "line e1"] {
            let word = end.split(' ').next().unwrap_or_default();
            add("flash", format!("{name}-{word}"), flash_image(number, dialect, end));
        }
    }
    for (number, dialect) in Dialect::ALL.into_iter().enumerate() {
        for (which, mode) in Mode::ALL.into_iter().enumerate() {
            let name = format!("{dialect:?}-{mode:?}").to_lowercase();
            add("parser", name, lines(number, which, dialect, mode));
        }
    }
    add("lexer", "lines".into(), b"@07\r\n\r  \r@0A 5000,900\r\xFD@0\xFEP\r\xFF\n\r".into());
    add("lexer", "255-bytes".into(), [&[b'x'; 255], &b"\r"[..]].concat());
    add("lexer", "256-bytes".into(), [&[b' '; 256], &b"\r@0P\r"[..]].concat());
    seeds
}

// --- lines ---

/// What follows the letter of a command that can be executed with X, Y and Z configured.
fn fields(op: Op) -> &'static str {
    match op {
        Op::SetAxes | Op::Zero | Op::SimulateReference | Op::Reference => "7",
        Op::RelativeMove => "300,900,-20,900,10,900,-10,900",
        Op::AbsoluteMove => "300,900,2,900,3,900,0,900",
        Op::ReadPort | Op::DeviceNumber => "0",
        Op::WritePort => "2,1",
        Op::ReferenceSpeeds => "900,900,900",
        Op::Diagnosis => "S0",
        Op::Plane
        | Op::Free
        | Op::Brake
        | Op::InitDirections
        | Op::InitHardwareStatus
        | Op::InitIoOnly
        | Op::InitBaud9600
        | Op::TestMode
        | Op::Interpolation3d
        | Op::Delay => "1",
        Op::Direction => "-1",
        Op::InitReferences | Op::InitSwapLimits => "2",
        Op::InitRotaryL | Op::InitAxisTypes => "8",
        Op::InitDefaultSpeeds => "900,900,900,900",
        Op::InitFreeSteps => "1,2,3,4",
        Op::InitDefaultAcceleration | Op::Acceleration => "50",
        Op::InitDefaultStartStop | Op::StartStop => "200",
        Op::InitLimits => "13107",
        Op::InitAbort => "0,1,0",
        Op::InitErrorSignal => "0,1,1",
        Op::InitCover => "0,2,0",
        Op::InitEmergency => "0,4,0",
        Op::InitUserInfo => "a, b",
        Op::Helix => "400,2000,-50,100,0,-1,1,30",
        Op::Circle => "400,2000,-50,100,0,-1,1",
        Op::MoveUntil => "0,4,4,900,300,20,10",
        Op::SendSync => "42",
        Op::AwaitSync => "42,0",
        Op::Loop => "2,-1",
        Op::Until => "0,1,1",
        Op::SetPort => "0,3,1",
        Op::BranchIf => "0,3,1,0",
        Op::LimitStatus
        | Op::Status
        | Op::Store
        | Op::InitLoad
        | Op::InitWrite
        | Op::InitFactory
        | Op::Erase
        | Op::Position
        | Op::Start
        | Op::UserInfo
        | Op::Version
        | Op::SelfTest
        | Op::End => "",
    }
}

/// Where in its line a command has a speed.
fn speed_field(op: Op) -> usize {
    match op {
        Op::ReferenceSpeeds | Op::InitDefaultSpeeds | Op::InitDefaultStartStop | Op::StartStop => 0,
        Op::MoveUntil => 3,
        _ => 1,
    }
}

/// The line of a command with these fields.
fn line(spec: &CommandSpec, fields: &str) -> String {
    match (spec.op, spec.mnemonic.strip_prefix('@')) {
        (Op::SetAxes, _) => format!("@0{fields}\r"),
        (_, Some(letters)) => format!("@0{letters}{fields}\r"),
        (_, None) => format!("{}{fields}\r", spec.mnemonic),
    }
}

/// A line of a command that is right.
fn right(spec: &CommandSpec) -> String {
    line(spec, fields(spec.op))
}

/// A line of a command that is answered with an error because of what is in it.
fn wrong(spec: &CommandSpec, reply: Reply) -> Option<String> {
    let with = |at: usize, field: &'static str| {
        let mut all: Vec<&str> = fields(spec.op).split(',').collect();
        *all.get_mut(at)? = field;
        Some(line(spec, &all.join(",")))
    };
    match (reply, spec.op) {
        (Reply::Number, Op::InitUserInfo) => Some(line(spec, &"long".repeat(9))),
        (Reply::Number, Op::SetAxes) => with(0, "7x"),
        (Reply::Number, _) => with(0, "x"),
        (Reply::Count, _) if fields(spec.op).is_empty() => Some(line(spec, "1")),
        (Reply::Count, _) => Some(line(spec, &format!("{},1,1", fields(spec.op)))),
        (Reply::Speed, op) => with(speed_field(op), "5"),
        (Reply::Axis, Op::SetAxes) => with(0, "0"),
        (Reply::Axis, _) => with(0, "8"),
        (Reply::Syntax, _) => Some(line(spec, "?")),
        _ => None,
    }
}

/// All lines of a table, right and wrong, for the parser.
fn lines(number: usize, which: usize, dialect: Dialect, mode: Mode) -> Vec<u8> {
    let mut data = vec![(number << 1 | which) as u8, 0x77, 0b1000];
    for spec in table(dialect, mode) {
        data.extend(right(spec).bytes());
        for reply in spec.replies {
            data.extend(wrong(spec, *reply).unwrap_or_default().bytes());
        }
    }
    data
}

// --- controllers ---

impl Script {
    fn signal(self, signal: PlantSignal, value: i8) -> Script {
        // Every signal but the inputs is listed under its number.
        self.then(Operation::Signal(signal.id().0 as u8, value))
    }

    fn press(self, signal: PlantSignal) -> Script {
        self.signal(signal, 1).signal(signal, 0).then(Operation::Rest)
    }
}

const X_LIMIT: PlantSignal = PlantSignal::Limit(0, End::Negative);
const X_OTHER_LIMIT: PlantSignal = PlantSignal::Limit(0, End::Positive);

/// The lists of operations for a model.
fn controllers(model: usize, dialect: Dialect) -> Vec<(String, Vec<u8>)> {
    let bench = Setup::new(model, 0);
    let direct = table(dialect, Mode::Direct);
    let stored = table(dialect, Mode::Stored);
    let mut scripts = Vec::new();
    let mut add = |about: &str, script: Script| scripts.push((about.to_owned(), script.data()));

    // What every command answers when there is nothing against it, and what before there are
    // axes; then what it answers to every kind of wrong line.
    let ready = |setup| Script::new(setup).ask("@07\r").then(Operation::Snapshot);
    let each = |script: Script, lines: &mut dyn Iterator<Item = String>| {
        lines.fold(script, |script, line| script.ask(line).then(Operation::Restore))
    };
    add(
        "direct",
        each(ready(bench).ask("@0R7\r").then(Operation::Snapshot), &mut direct.iter().map(right)),
    );
    let cold = Script::new(bench).then(Operation::Snapshot);
    add("direct-without-axes", each(cold, &mut direct.iter().map(right)));
    let of_reply = |specs: &'static [CommandSpec], reply| {
        specs
            .iter()
            .filter(move |spec| spec.replies.contains(&reply))
            .filter_map(move |spec| wrong(spec, reply))
    };
    for reply in [Reply::Number, Reply::Count, Reply::Speed, Reply::Axis] {
        let word = format!("{reply:?}").to_lowercase();
        add(&format!("direct-wrong-{word}"), each(ready(bench), &mut of_reply(direct, reply)));
        let storing = ready(bench).ask("@0i\r").then(Operation::Snapshot);
        add(&format!("stored-wrong-{word}"), each(storing, &mut of_reply(stored, reply)));
    }
    let unknown =
        ["@\r", "@x\r", "@0\r", "@0!\r", "0\r", "@0Dxx\r", "@1P\r", &"x".repeat(300), "\r"];
    add("direct-unknown", each(ready(bench), &mut unknown.map(str::to_owned).into_iter()));
    let refused =
        |reply: Reply| direct.iter().filter(move |spec| spec.replies.contains(&reply)).map(right);
    let off = ready(bench).ask("@0B3,0\r").then(Operation::Snapshot);
    add("direct-power-stage-off", each(off, &mut refused(Reply::Plant)));
    let open = ready(bench).signal(PlantSignal::Cover, 0).then(Operation::Snapshot);
    add("direct-cover-open", each(open, &mut refused(Reply::Cover)));
    let one_axis = Script::new(bench).ask("@01\r").then(Operation::Snapshot);
    add("direct-one-axis", each(one_axis, &mut refused(Reply::Axis)));
    add("direct-not-referenced", each(ready(bench), &mut refused(Reply::Reference)));
    // An axis that has left its limit switch wants a reference run.
    let freed = ready(bench).signal(X_LIMIT, 1).send("@0F1\r").wait().signal(X_LIMIT, 0);
    let freed = freed.then(Operation::Rest).then(Operation::Snapshot);
    add("direct-freed", each(freed, &mut refused(Reply::Reference)));
    let held = ready(bench).signal(X_LIMIT, 1).then(Operation::Snapshot);
    add("direct-on-limit-switch", each(held, &mut refused(Reply::LimitSwitch)));

    // Storing: every line, and when there is no room left.
    let storing = ready(bench).ask("@0i\r").then(Operation::Snapshot);
    let texts = stored.iter().map(right).chain(["?\r".to_owned(), "@0P\r".to_owned()]);
    add("stored", each(storing, &mut texts.clone()));
    let axis = Script::new(bench).ask("@01\r@0i\r").then(Operation::Snapshot);
    let arcs = stored.iter().filter(|spec| matches!(spec.op, Op::Circle | Op::Helix)).map(right);
    add("stored-one-axis", each(axis, &mut { arcs }));
    let full = ready(bench.with_quirks(128)).ask("@0i\r").ask("e1\r").then(Operation::Again(39));
    let full = full.then(Operation::Snapshot);
    add("stored-memory-full", each(full, &mut texts.clone()));

    // A program of every line, run to its end, stopped, run on.
    let mut program = String::from("@07\r@0i\r77\r");
    for spec in stored.iter().filter(|spec| spec.op != Op::End) {
        program.push_str(&right(spec));
    }
    program.push_str("9\r");
    let run = |setup| Script::new(setup).ask(&program).press(PlantSignal::Start).ask("*");
    add("program", run(bench).then(Operation::Restart).press(PlantSignal::Start).ask("*@0P\r"));
    let mut stopped = Script::new(bench).ask(&program).signal(PlantSignal::Start, 1);
    for _ in 0..20 {
        stopped = stopped.wait().press(PlantSignal::Stop).signal(PlantSignal::Start, 0);
        stopped = stopped.signal(PlantSignal::Start, 1).send("*");
    }
    add("program-stopped", stopped.then(Operation::Rest).ask("@0k\r@0P\r"));

    // Everything that ends a motion, and how the controller goes on.
    let motions = [
        "@0A3000,9000,2000,900,100,900,-100,900\r",
        "@0z1\r@0A3000,9000,2000,900,100,900,0,900\r",
        "@0y4000,9000,-250,500,0,-1,1\r",
        "@0R7\r",
        "@0Z0,4,4,900,3000,200,100\r",
        "@0?\r",
    ];
    let stops: [&[u8]; 4] = [&[253], &[255], &[254], &[253, 255, 253]];
    let mut script = ready(bench);
    for motion in motions {
        for stop in stops {
            script = script.send(motion).wait().ask(stop).ask("@0S\r@0P\r@0DS0\r");
            script = script.then(Operation::Restore);
        }
    }
    add("stops", script);
    for (place, motion) in motions.into_iter().enumerate() {
        let mut script =
            Script::new(Setup::new(model, place)).ask("@07\r").then(Operation::Snapshot);
        for signal in 0..35 {
            for value in [1, 0] {
                script = script.send(motion).wait().then(Operation::Signal(signal, value)).wait();
            }
            script = script.ask("@0P\r").then(Operation::Restore);
        }
        add(&format!("signals-{place}"), script);
    }

    let mut script = ready(bench).ask("@0R7\r").then(Operation::Snapshot);
    for text in refused(Reply::Stopped) {
        script = script.send(text).wait().ask([253]).ask("@0P\r@0S\r").then(Operation::Restore);
    }
    add("direct-stopped", script);
    add("start", start_replies(bench, dialect));
    let mut script = ready(bench).send("@0A30000,9000,0,900,0,900,0,900\r@0P\r");
    script = script.then(Operation::Again(200)).then(Operation::Look(0, 1_000)).wait();
    for way in [100, -100, 2_000, 0] {
        script =
            script.then(Operation::Look(0, way)).then(Operation::Snapshot).then(Operation::Next);
    }
    script = script.then(Operation::Power(false)).ask("@0P\r").then(Operation::Power(true));
    script = script.ask("@0k\r").then(Operation::Before(1)).then(Operation::Next).ask("@0P\r");
    script = script.signal(PlantSignal::EmergencyStop, 1).signal(PlantSignal::EmergencyStop, 0);
    script = script.signal(PlantSignal::Key, 0).signal(PlantSignal::Stop, 1).press(PlantSignal::On);
    script = script.signal(PlantSignal::Stop, 0).signal(PlantSignal::Start, 1);
    script = script.press(PlantSignal::On).ask("echo").then(Operation::Power(false));
    add("overflow-and-power", script.then(Operation::Power(true)).ask(b"echo\r\xFE").ask("@0P\r"));
    let far = "@0A8388607,20000,-8388608,20000,0,900,0,900\r";
    let invalid = ready(bench).ask("@0i\re0\rx\r@0IW\r").then(Operation::Snapshot);
    add("invalid-program", invalid.then(Operation::Restart).ask("@07\r@0S\r@0i\r"));
    add("position-wraps", ready(bench).ask(far).ask(far).ask("@0P\r").ask("@0n7\r").ask(far));
    let mut script = Script::new(Setup::new(model, 1)).ask("@0W\r").ask("@07\r@0R7\r@0h\r@0H\r");
    script = script.ask("@0A-500,900,0,900,0,900,0,900\r@0P\r@0F1\r@0A-5,900,0,900,0,900,0,900\r");
    script = script.ask("@0T1\r@0A-500,9000,0,900,0,900,0,900\r@0R7\r@0T0\r@07\r@0P\r");
    add("mill", script);
    scripts
}

/// Everything that `S` can be answered with.
fn start_replies(setup: Setup, dialect: Dialect) -> Script {
    let store = |script: Script, lines: &str| {
        script.then(Operation::Restore).ask("@07\r@0i\r").ask(lines).ask("9\r")
    };
    let far = "@0A3000,9000,0,900,0,900,0,900\r";
    let script = Script::new(setup).then(Operation::Snapshot);
    // Going on with a stopped motion, which is stopped again, runs onto a limit switch, ends.
    let script = script.ask("@07\r").send(far).wait().ask([253]).send("@0S\r").wait().ask([253]);
    let script = script.send("@0S\r").wait().signal(X_LIMIT, 1).then(Operation::Rest);
    let script = script.then(Operation::Restore).ask("@07\r").send(far).wait().ask([253]);
    let script = script.ask("@0S\r@0S\r@0i\r9\r@0i\r");
    // An axis that leaves one switch and runs onto the other; a reference run that is broken off.
    let script = script.then(Operation::Restore).ask("@07\r").signal(X_LIMIT, 1).send("@0F1\r");
    let script = script.wait().signal(X_OTHER_LIMIT, 1).then(Operation::Rest);
    let script = script.then(Operation::Restore).ask("@07\r@0A500,900,0,900,0,900,0,900\r");
    let script = script.send("@0R7\r").wait().ask([255]);
    let mut script = script.then(Operation::Restore).ask("@07\r").send("@0k\r");
    script = script.signal(PlantSignal::EmergencyStop, 1).then(Operation::Rest);
    // A program that START began and that was stopped ends with an error.
    let lines = "@03\r@0i\re1\r03000,9000,0,900\ry400,900,0,100,0,-1,1\r9\r";
    script = script.then(Operation::Restore).ask(lines).signal(PlantSignal::Start, 1).wait();
    script = script.ask([253]).ask("@0S\r");
    if dialect == Dialect::ImcXx {
        // A program that is started, stopped, goes on; ends well or with what went wrong.
        script = store(script, "03000,9000,0,900,0,900,0,900\r").send("@0S\r").wait().ask([253]);
        script = script.ask("@0S\r@0S\r");
        script = store(script, "m1,900,0,900,0,900,0,900\r").ask("@0S\r");
        let circle = "@03\r@0i\re1\ry400,900,0,100,0,-1,1\r9\r@0S\r";
        script = script.then(Operation::Restore).ask(circle);
        script = store(script, "o0,0,0,-1\r").send("@0S\r").wait();
        script = script.signal(PlantSignal::EmergencyStop, 1).then(Operation::Rest);
    }
    script
}

/// The image of a flash memory with a program of every line, and a last line.
fn flash_image(model: usize, dialect: Dialect, end: &str) -> Vec<u8> {
    let mut image = Setup::new(model, 0).encode();
    image.extend(b"vimc4 flash 1\nsettings directions=1 start_stop=200 abort=0,1,0 user_info=61\n");
    image.extend(b"program axes=7 speeds=900,900,900,2000\n");
    for spec in table(dialect, Mode::Stored).iter().filter(|spec| spec.op != Op::End) {
        image.extend(format!("line {}\n", right(spec).trim_end()).bytes());
    }
    image.extend(end.bytes());
    image.push(b'\n');
    image
}
