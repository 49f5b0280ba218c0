//! The inputs to begin with for the LPKF controllers: every form of every command, right and
//! wrong, in every state a controller can be in; every signal; everything that breaks a motion
//! off and every way to go on.

use vimc4_device::{AXES, Device};
use vimc4_lpkf::language::{Dialect, Form, Kind, Op, forms};
use vimc4_lpkf::{Controller, Model};
use vimc4_plant::Machine;

use crate::fuzzing::operations::{Operation, Setup};
use crate::fuzzing::script::{Script, Seed};
use crate::fuzzing::twins::Family;

/// All of them.
pub(in crate::fuzzing) fn seeds() -> Vec<Seed> {
    let mut seeds = Vec::new();
    for (number, name) in Model::names().into_iter().enumerate() {
        let Some(model) = Model::builtin(name) else { continue };
        let dialect = model.command_set;
        for (about, script) in Scripts::of(number, dialect).all() {
            let data = script.data();
            seeds.push(Seed { target: "lpkf", name: format!("{name}-{about}"), data });
        }
    }
    for (number, dialect) in Dialect::ALL.into_iter().enumerate() {
        for (about, text) in texts() {
            // Whether bare pairs are moves, and what is written down.
            for habits in [0b100, 0b010] {
                let data = [&[b'0' | habits | number as u8], text.as_bytes()].concat();
                let pairs = if habits & 2 == 0 { "" } else { "-bare-pairs" };
                let name = format!("{dialect:?}-{about}{pairs}").to_lowercase();
                seeds.push(Seed { target: "language", name, data });
            }
        }
    }
    seeds
}

// --- lines ---

/// Lines for the language, all forms of all models among them.
fn texts() -> Vec<(&'static str, String)> {
    let all = |line: &dyn Fn(&Form) -> String| forms().iter().map(line).collect::<String>();
    vec![
        ("forms", all(&right)),
        ("without-parameters", all(&|form| line(form, 0, None))),
        ("one-too-few", all(&|form| line(form, form.parameters.len().saturating_sub(1), None))),
        ("one-too-many", all(&|form| line(form, form.parameters.len() + 1, None))),
        ("huge", all(&|form| line(form, form.parameters.len(), Some("-99999999999999999.5")))),
        ("tiny", all(&|form| line(form, form.parameters.len(), Some(".0000005")))),
        ("numbers", "1,2;+3-4.5.6;PR 7;8\r9,10;PA1,2,3,4VS.5!VU1\n2;-;.;PAPA;;".to_owned()),
        ("letters", "P;PAX1Y2;Q!Q!;!P!PH!PX;in;INin;!st!STA;A!1;O H;!".to_owned()),
        (
            "vectors",
            "!PH0,1\rX1X2\r;!PH0,1\r1\r;!PH0,1;!PH0,0\rX1;!PH1\rX;!PH0,2\rO2F\rZ\r!PH".to_owned(),
        ),
        ("channel", "!OC;!SV1\r!CC!OC 3!RM 5;!C!CCOS;!OCPA1,2;!!CC1;".to_owned()),
    ]
}

/// A form with all of its parameters, which suit any machine.
fn right(form: &Form) -> String {
    line(form, form.parameters.len(), None)
}

/// A form with so many parameters: its own or the same for all.
fn line(form: &Form, count: usize, value: Option<&str>) -> String {
    let kinds = form.parameters.iter().map(|parameter| parameter.kind);
    let usual = kinds.map(usual).chain(std::iter::repeat("1"));
    let values: Vec<&str> = usual.take(count).map(|usual| value.unwrap_or(usual)).collect();
    let mut text = format!("{} {}", form.letters(), values.join(","));
    if form.op == Op::FollowVectors {
        // A plane needs two axes.
        text = text.replace("1,1", "0,1");
        text.push_str("\rX50F9000\rX5Y5I0J5O1\rY50F-9000\r");
    }
    text.push(';');
    text
}

/// A value that suits any machine.
fn usual(kind: Kind) -> &'static str {
    match kind {
        Kind::Coordinate => "30",
        Kind::Angle => "90.5",
        Kind::Speed => "3000",
        Kind::Acceleration => "500",
        Kind::Resolution => "7937.5",
        Kind::Time => "20",
        Kind::Axis | Kind::Switch | Kind::Mode | Kind::Port | Kind::Channel => "1",
        Kind::Nominal => "0",
        Kind::Actual => "100",
        Kind::Word => "255",
        Kind::Interface => "3",
    }
}

// --- controllers ---

/// Makes the lists of operations for a model.
struct Scripts {
    dialect: Dialect,
    /// On a table without ends.
    bench: Setup,
    /// On the machine that such a model usually has.
    usual: Setup,
}

/// What takes so long that something can happen meanwhile.
const LONG: [&str; 7] = [
    "PR9000,500,-20,9000,40,40;",
    "AR3000,-200,-400.5;",
    "!IS;",
    "OH;",
    "!TS500;PR99,99;!TS0;",
    "!TW300;",
    "PDPR3000,9PUPR5,5;",
];
/// The same for a MotionSystem alone.
const LONG_MOTION_SYSTEM: [&str; 5] = [
    "!MR5000,-300,200,10,7,1;",
    "!PH0,2\rX900F30000\rX500Y90I0J300O-1\rX900F-30000\r;",
    "!ZR5000,2;",
    "!IS2;",
    "OH1;",
];
/// What breaks a motion off.
const BREAKS: [(&str, &str); 6] = [
    ("stop", "!ES1;"),
    ("message 0", ""),
    ("message 1", ""),
    ("limit x+", ""),
    ("fault power-stage-fault-x", ""),
    ("fault sum-error", ""),
];
/// Ways to go on.
const GOING_ON: [&str; 9] =
    ["!GO", "!CS", "!GB!CS", "!GB!RC", "!RC", "!CB!GO", "!RP!GO", "OS;!ON0;!OA100;!GO", "IN;"];

impl Scripts {
    fn of(number: usize, dialect: Dialect) -> Scripts {
        let usual = match dialect {
            Dialect::Smcu => "board-plotter",
            Dialect::MotionSystem => "positioner",
        };
        let machine = Machine::names().iter().position(|name| *name == usual).unwrap_or(0);
        let (bench, usual) = (Setup::new(number, 0), Setup::new(number, machine));
        Scripts { dialect, bench, usual }
    }

    fn all(&self) -> Vec<(String, Script)> {
        let mut scripts = Vec::new();
        let mut add = |about: &str, script: Script| scripts.push((about.to_owned(), script));
        let lines = |text: &dyn Fn(&Form) -> String| self.forms().map(text).collect::<Vec<_>>();
        let rights = || lines(&right);
        let of_count = |count: &dyn Fn(usize) -> usize| {
            lines(&|form| line(form, count(form.parameters.len()), None))
        };
        let of_value =
            |value: &'static str| lines(&|form| line(form, form.parameters.len(), Some(value)));

        // Every form by itself.
        add("forms", each(self.ready(self.bench, ""), &rights()));
        add("forms-on-a-machine", each(self.ready(self.usual, "!IS;"), &rights()));
        add("forms-without-echo", each(self.ready(self.usual, "!CT0;"), &rights()));
        add("forms-without-parameters", each(self.ready(self.usual, ""), &of_count(&|_| 0)));
        add("forms-one-too-few", each(self.ready(self.usual, ""), &of_count(&|n| n.max(1) - 1)));
        add("forms-one-too-many", each(self.ready(self.usual, ""), &of_count(&|n| n + 1)));
        for value in ["0", "-1", "5", "9", "99999999999"] {
            add(&format!("forms-of-{value}"), each(self.ready(self.usual, ""), &of_value(value)));
        }
        let unknown =
            ["QQ;", "!Q;", "P;", "!;", "PX1,2;", "!OI 9;", "!RD 5;", "!WR 9,9;", "!RD 999;"];
        add("unknown", each(self.ready(self.usual, ""), &unknown.map(str::to_owned)));

        // Every form in every state.
        let moving = Script::new(self.usual).ask("!IS;").send("PA9000,9000;").wait();
        add("forms-while-moving", each(moving.then(Operation::Snapshot), &rights()));
        let stopped = Script::new(self.usual).ask("!ST");
        let going_on: Vec<String> = rights().iter().map(|line| format!("{line}!GO")).collect();
        add("forms-after-stop", each(stopped.then(Operation::Snapshot), &going_on));
        for (place, (signal, prepare)) in BREAKS.into_iter().enumerate() {
            let Some(broken) = self.broken(self.usual, "PR9000,9000;", signal, prepare) else {
                continue;
            };
            let about = format!("forms-when-broken-off-{place}");
            add(&about, each(broken.then(Operation::Snapshot), &going_on));
        }
        let frame = Script::new(self.usual).ask("!IS;IW5,5,90,90;").ask("PA50,50;PA500,50;");
        add("forms-at-the-border", each(frame.then(Operation::Snapshot), &going_on));
        let open = Script::new(self.usual).ask("!IS;!OI1;").then(Operation::Snapshot);
        let closing: Vec<String> = rights().iter().map(|line| format!("{line}!CI;OS;")).collect();
        add("forms-while-open", each(open, &closing));

        // Everything that breaks something off, and every way to go on.
        for (place, long) in self.long().enumerate() {
            let mut script = Script::new(self.usual).ask("!IS;").then(Operation::Snapshot);
            for (signal, prepare) in BREAKS {
                let Some(signal) = self.place(self.usual, signal) else { continue };
                for on in GOING_ON {
                    script = script.send(prepare).send(long).send("OS;").wait().wait();
                    script = script.then(Operation::Signal(signal, 1)).then(Operation::Rest);
                    script = script.then(Operation::Signal(signal, 0)).ask(on);
                    script = script.then(Operation::Restore);
                }
            }
            add(&format!("broken-off-{place}"), script);
        }
        scripts.extend(self.signals());
        scripts.extend(self.others());
        scripts
    }

    /// Every signal, while everything that takes long is done.
    fn signals(&self) -> Vec<(String, Script)> {
        let mut scripts = Vec::new();
        let mut long = self.long().cycle();
        for (machine, setup) in [("", self.usual), ("-on-the-bench", self.bench)] {
            let signals = Controller::open(setup, b"").signals().len() as u8;
            let signals: Vec<u8> = (0..signals).collect();
            for (part, signals) in signals.chunks(40).enumerate() {
                let mut script = self.ready(setup, "!ES1;!OC;!RM9\r!CC");
                for signal in signals {
                    script = script.send(long.next().unwrap_or_default()).wait().wait();
                    script = script.then(Operation::Signal(*signal, 1)).wait();
                    script = script.then(Operation::Signal(*signal, 0)).ask("!GO");
                    script = script.then(Operation::Restore);
                }
                scripts.push((format!("signals-{part}{machine}"), script));
            }
        }
        scripts
    }

    /// What belongs to no list.
    fn others(&self) -> Vec<(String, Script)> {
        let mut scripts = vec![
            ("channel".to_owned(), self.channel()),
            ("trackball".to_owned(), self.trackball()),
            ("no-joystick".to_owned(), self.no_joystick()),
            ("full-buffer".to_owned(), self.full_buffer()),
            ("long-commands".to_owned(), self.long_commands()),
            ("values".to_owned(), self.values()),
            ("ends".to_owned(), self.ends()),
            ("far".to_owned(), self.far()),
            ("looks".to_owned(), self.looks()),
            ("power".to_owned(), self.power()),
        ];
        for bit in 0..7 {
            let script = Script::new(self.usual.with_quirks(1 << bit));
            let script = script.ask("QQ5,5;!TA1,2,3;PA1,1;2,2;PR1,1\n;2,2;VS0.005;!RS8;OS;OH:PA1;");
            let script =
                script.ask("PA50,50;CI9;EA60,60;ER5,5;!RD0;!IS9;IW0,0,9,9;PA99,99;PA1,1;!GO");
            let script = script.ask("!CT0;QQ;OH;IN;PA1,1;QQ;!CT1;QQ;");
            scripts.push((format!("quirk-{bit}"), script));
        }
        scripts
    }

    /// The spindle unit on the second channel, in order and not.
    fn channel(&self) -> Script {
        let script = Script::new(self.usual).send("!OC;!SV1\r!SM1;!RM9000\r!WR1,1\r");
        let script = script.wait().send("!CCOS;").wait().ask("!OC;!RM9000\r!RM0\r!CC");
        let script = self.signal(script, "spindle-fault", 1).ask("!OC 2;!RM1\r!CC 2;IN");
        self.signal(script, "spindle-fault", 2).ask("!OC;!RM-1;!R!CC")
    }

    fn trackball(&self) -> Script {
        let mut script = self.ready(self.usual, "!IS;!OI1;");
        for (axis, way) in [(0, 100), (1, -100), (2, 50), (5, 9)] {
            let turned = |script| {
                let script = self.signal(script, "ball x", way);
                self.signal(script, "ball y", way)
            };
            script = self.signal(script, "ball axis", axis);
            script = turned(self.signal(script, "ball x", way).wait());
            script = script.then(Operation::Next).then(Operation::Next).ask("!CI;!OI3;");
            script = turned(script).ask("!CI;!OI2;");
            script = self.signal(script, "ball x", way).ask("!CI;!ON0;").then(Operation::Restore);
        }
        script
    }

    fn no_joystick(&self) -> Script {
        let missing = "fault joystick-not-connected";
        let script = self.signal(Script::new(self.usual), missing, 1).ask("!OI1;");
        let script = self.signal(script, missing, 0).ask("!OI1;");
        self.signal(script, missing, 1).ask("!CI;")
    }

    /// More commands, repetitions and bytes for the channel than there is room for.
    fn full_buffer(&self) -> Script {
        let script = Script::new(self.usual.with_quirks(128)).ask("OS;");
        let script = script.send("!TW3000;PA1,1;PA2,2;PR1,1;").wait().then(Operation::Again(9));
        let script = script.send("!RP!RP!RP").then(Operation::Again(30)).then(Operation::Snapshot);
        let script = script.ask("OS;").ask("!OC;").send("!RM5\r").then(Operation::Again(20));
        script.ask("!CC").ask("PA1,1,2,2,3,3,4,4,5,5,6,6,7,7,8,8,9,9,1,1,2,2,3,3,4,4,5,5;")
    }

    fn long_commands(&self) -> Script {
        let script = Script::new(self.bench).ask("PA").send("1,23 ".repeat(25));
        let script = script.then(Operation::Again(90)).ask(";OS;!PH0,1");
        script.send("\rX1Y1\rX1F1Y1").then(Operation::Again(40)).ask(";OS;")
    }

    /// Values too low and too high.
    fn values(&self) -> Script {
        Script::new(self.usual)
            .ask("!AS99999,1;!AS99999;!AS0,1;!AS0;!RS9999999,1;!RS9999999;!RS0,1;!RS0;")
            .ask("VS9999999;VS0;!VZ9999999,1;!VZ9999999;!VZ0,1;!VZ0;!IS3;")
            .ask("!PH0,1\rX1X1\r;!PH0,1\rX1F-1\r;!PH0,1\rX1;")
    }

    /// Every range and every limit switch on either side.
    fn ends(&self) -> Script {
        let mut script = self.ready(self.bench, "");
        for axis in 0..AXES {
            for way in [-900, 900] {
                let range = format!("!SR -5,5,{axis};!ZR{way},{axis};");
                script = script.ask(range).ask("!CS!GO").then(Operation::Restore);
            }
        }
        let along_all_axes = match self.dialect {
            Dialect::Smcu => "PR+9000,+9000;!ZR+9000;",
            Dialect::MotionSystem => "!MR+9000,+9000,+9000,+9000,+9000,+9000;",
        };
        for (place, listed) in Controller::open(self.bench, b"").signals().iter().enumerate() {
            let limit = listed.name.starts_with("limit");
            for way in ["", "-"].into_iter().filter(|_| limit) {
                script = script.send(along_all_axes.replace('+', way)).wait();
                script = script.then(Operation::Signal(place as u8, 1)).ask("!CS").ask("!GO");
                script = script.then(Operation::Restore);
            }
        }
        script
    }

    /// To the ends of the counters, and a little further.
    fn far(&self) -> Script {
        let mut script = Script::new(self.bench);
        for text in [
            "PA2147483647,-2147483648;PR1,0;",
            "!GO;PR0,-1;",
            "!GO;!MR9,-9,2147483647,2147483647,-2147483648,-2147483648;",
            "!GO;!MR1,1,9,9,-9,-9;",
            "!GO;!ZR2147483647;!ZR1;",
            "!GO;AR0,100,90;",
            "!GO;!IS;",
        ] {
            script = script.send(text);
            for _ in 0..5 {
                script = script.then(Operation::Next);
            }
        }
        // The carriages know of ways that the counters have forgotten.
        for text in ["PA2147483647,0;", "PA2147483647,0;", "!IS;"] {
            script = script.then(Operation::Power(false)).then(Operation::Power(true)).send(text);
            script = script.then(Operation::Next).then(Operation::Next);
        }
        script.ask("!GO;!ON0;OH;")
    }

    /// What is forecast while everything that takes long is done.
    fn looks(&self) -> Script {
        let mut script = self.ready(self.bench, "PA-100,50;");
        for (place, long) in self.long().chain(["PR-9000,-700;", "PR-300,9000;"]).enumerate() {
            script = script.send(long).wait();
            for way in [1, -1, 40, -40, 300, -300] {
                script = script.then(Operation::Look(place as u8, way)).wait();
            }
            script = script.then(Operation::Restore);
        }
        script
    }

    /// The power fails and comes back while something moves and more waits; likewise `IN`, and
    /// another process.
    fn power(&self) -> Script {
        let script = Script::new(self.usual).ask("!IS;").send("PR9000,900;PR1,1;!TW9;OS;").wait();
        let script = script.then(Operation::Look(0, 1_000)).then(Operation::Look(1, -3));
        let script = script.wait().then(Operation::Look(0, -100)).then(Operation::Snapshot);
        let script = script.then(Operation::Before(1)).then(Operation::Next).then(Operation::Next);
        let script = script.then(Operation::Restore).ask("IN;OS;").then(Operation::Restore);
        let script = script.then(Operation::Power(false)).ask("OS;").then(Operation::Power(true));
        let script = script.ask("OS;!ON0;").then(Operation::Restore).then(Operation::Restart);
        script.ask("OS;!ON0;")
    }

    // --- parts ---

    /// A controller to which something is sent, and whose state is kept then.
    fn ready(&self, setup: Setup, text: &str) -> Script {
        Script::new(setup).ask(text).then(Operation::Snapshot)
    }

    /// A controller in which a signal breaks off what was sent; `None` without such a signal.
    fn broken(&self, setup: Setup, text: &str, signal: &str, prepare: &str) -> Option<Script> {
        let signal = self.place(setup, signal)?;
        let script = Script::new(setup).ask("!IS;").ask(prepare).send(text).wait().wait();
        let script = script.then(Operation::Signal(signal, 1)).then(Operation::Rest);
        Some(script.then(Operation::Signal(signal, 0)).send("PR1,1;"))
    }

    /// Sets a signal, if there is such a one.
    fn signal(&self, script: Script, name: &str, value: i8) -> Script {
        match self.place(self.usual, name) {
            Some(place) => script.then(Operation::Signal(place, value)),
            None => script,
        }
    }

    /// The place of a signal in the list.
    fn place(&self, setup: Setup, name: &str) -> Option<u8> {
        let signals = Controller::open(setup, b"").signals();
        signals.iter().position(|signal| signal.name == name).map(|place| place as u8)
    }

    fn forms(&self) -> impl Iterator<Item = &'static Form> + use<> {
        let dialect = self.dialect;
        forms().iter().filter(move |form| form.known_to(dialect))
    }

    fn long(&self) -> impl Iterator<Item = &'static str> + Clone + use<> {
        let own = match self.dialect {
            Dialect::Smcu => &[][..],
            Dialect::MotionSystem => &LONG_MOTION_SYSTEM,
        };
        LONG.into_iter().chain(own.iter().copied())
    }
}

/// Sends every line to a controller as it was when it was kept.
fn each(script: Script, lines: &[String]) -> Script {
    lines.iter().fold(script, |script, line| script.ask(line).then(Operation::Restore))
}
