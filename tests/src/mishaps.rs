//! Random sessions of both families in which much goes wrong with the machine.

use std::time::Duration;

use vimc4_plant::Machine;

/// Random numbers that are the same everywhere (splitmix64). A failing case names its seed.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// Any number.
    pub fn number(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number from `low` up to and including `high`.
    pub fn range(&mut self, low: i64, high: i64) -> i64 {
        low + (self.number() % (high - low + 1) as u64) as i64
    }

    /// One of several.
    pub fn pick<'a>(&mut self, items: &[&'a str]) -> &'a str {
        items[(self.number() % items.len() as u64) as usize]
    }
}

/// A machine with ends, switches and motors that cannot everything.
fn any_machine(random: &mut Random) -> String {
    let mut text = Machine::builtin_toml("mill-4axis").unwrap_or_default().to_owned();
    for axis in ["x", "y", "z"] {
        let mut keys = String::new();
        if random.number().is_multiple_of(2) {
            keys += &format!("backlash = {}\n", random.range(0, 30));
        }
        if random.number().is_multiple_of(2) {
            keys += &format!("hysteresis = {}\n", random.range(0, 30));
        }
        if random.number().is_multiple_of(2) {
            let (slow, fast) = (random.range(200, 4_000), random.range(4_001, 20_000));
            keys += &format!("motor = {{ pull = [[{slow}, 300], [{fast}, 20]], start = 900 }}\n");
        }
        let table = format!("[axes.{axis}]\n");
        text = text.replacen(&table, &(table.clone() + &keys), 1);
    }
    text
}

fn any_fault(random: &mut Random, model: &str, inputs: &[&str]) -> String {
    let third = if model == "motionsystem" { "z0" } else { "z" };
    let axis = random.pick(&["x", "y", third]);
    let end = random.pick(&["-", "+"]);
    let place = random.range(-1_500, 1_500);
    let fault = match random.range(0, 10) {
        0 => format!("switch {axis}{end} {}", random.pick(&["pressed", "released", "missing"])),
        1 => format!("switch {axis}{end} late {}", random.range(0, 60)),
        2 => format!("switch {axis} swapped"),
        3 => format!("backlash {axis} {}", random.range(0, 60)),
        4 => format!("load {axis} {}", random.range(0, 300)),
        5 => format!("jam {axis}"),
        6 => format!("push {axis} {place}"),
        7 => format!("hold {}", random.pick(inputs)),
        8 => {
            format!("bounce limit {axis}{end} {} {}us", random.range(1, 5), random.range(1, 9_000))
        }
        9 => format!(
            "bounce {} {} {}us",
            random.pick(inputs),
            random.range(1, 5),
            random.range(1, 900)
        ),
        _ => "power-off".to_owned(),
    };
    let lasts = match random.range(0, 2) {
        0 => format!(" for {}ms", random.range(1, 900)),
        _ => String::new(),
    };
    let sense = random.pick(&["<", ">"]);
    let when = match random.range(0, 3) {
        0 => format!(" after {axis} {sense} {place}"),
        1 => format!(" while {axis} {sense} {place}"),
        2 => format!(" after at {}ms", random.range(0, 3_000)),
        _ => String::new(),
    };
    fault + &lasts + &when
}

/// What is done to a controller, one thing after the other.
#[derive(Clone, Debug)]
pub enum Act {
    /// A line is sent.
    Send(String),
    /// A fault begins or ends, in the words of an order.
    Fault(String),
    /// An input of a name takes a value.
    Set(String, i32),
    /// Time passes.
    Advance(Duration),
}

/// A random session.
#[derive(Clone, Debug)]
pub struct Session {
    /// The name of the model.
    pub model: &'static str,
    /// The machine, in TOML.
    pub machine: String,
    /// What happens.
    pub acts: Vec<Act>,
}

/// A session of either family: commands, the panel, and faults of the machine.
pub fn any_session(random: &mut Random) -> Session {
    let machine = any_machine(random);
    let model = random.pick(&["imc-s8", "imc4", "motionsystem", "smcu"]);
    let inputs: &[&str] = match model {
        "motionsystem" | "smcu" => &["stop", "limit x+", "limit y-"],
        _ => &["stop", "start", "estop", "power-ok", "overtemperature", "cover", "limit x+"],
    };
    let acts = acts(random, model, inputs);
    Session { model, machine, acts }
}

fn acts(random: &mut Random, model: &str, inputs: &[&str]) -> Vec<Act> {
    let is_lpkf = model == "motionsystem" || model == "smcu";
    let mut acts = vec![Act::Send(match is_lpkf {
        true => "!ES1;!VU90000;!AS900;".to_owned(),
        false => "@07\r".to_owned(),
    })];
    for _ in 0..random.range(3, 14) {
        let mut way = || random.range(-2_000, 2_000);
        let (x, y, z) = (way(), way(), way());
        let speed = random.range(50, 15_000);
        acts.push(match random.range(0, 8) {
            0 | 1 if is_lpkf => Act::Send(format!("PR{x},{y};")),
            0 | 1 => Act::Send(format!("@0A{x},{speed},{y},{speed},{z},{speed},0,300\r")),
            2 if is_lpkf => Act::Send(format!("AR{},0,{};", x / 5, y / 3)),
            2 => Act::Send(format!("@0y{},{speed},{},{},0,1,1\r", x.abs(), -y.abs() / 6, y / 3)),
            3 if is_lpkf => Act::Send("!GO;!IS;".to_owned()),
            3 => Act::Send("@0R7\r".to_owned()),
            4 | 5 => Act::Fault(any_fault(random, model, inputs)),
            8 if !is_lpkf => Act::Send(format!(
                "@0i\r0{x},{speed},{y},{speed},{z},{speed},0,300\r33,-1\r9\r@0S\r"
            )),
            6 if random.number().is_multiple_of(2) => {
                Act::Fault(format!("end {}", random.range(1, 4)))
            }
            6 => Act::Set(random.pick(inputs).to_owned(), random.range(0, 1) as i32),
            _ => Act::Advance(Duration::from_micros(random.range(0, 900_000) as u64)),
        });
    }
    acts
}
