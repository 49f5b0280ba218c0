//! What becomes of jobs with a damaged line where errors are let pass: the tool's way is that of
//! the undamaged job, as a whole or up to that line.

use std::fs;

use libtest_mimic::{Failed, Trial};
use vimc4_ncp::Severity;
use vimc4_ncp::job::{self, Job, Options, Order, Step, Target};
use vimc4_ncp::language;
use vimc4_tests::jobs;

/// So many damages that are errors are looked at.
const DAMAGES: u32 = 1_000;

/// What a line may be damaged by.
const CHARACTERS: &[u8] = b"XYZAIJKNWMOVEABSREL0123456789.,;()-+= \t%Q";

pub(crate) fn trials() -> Vec<Trial> {
    vec![Trial::test("a damaged line takes the tool nowhere else", check)]
}

fn check() -> Result<(), Failed> {
    let machine = vimc4::machine("bench").map_err(|error| error.to_string())?;
    let mut dice = Dice(1);
    let (mut damages, mut left_out) = (0, 0);
    let mut jobs = Vec::new();
    for model in ["imc4", "imc-s8"] {
        let model = vimc4::model(model).map_err(|error| error.to_string())?;
        let target = jobs::target(&model, &machine)?;
        jobs.extend(texts()?.into_iter().map(|text| (text, target.clone())));
    }
    let ways: Vec<Option<Vec<Order>>> =
        jobs.iter().map(|(text, target)| valid(text, target)).collect();
    while damages < DAMAGES {
        // The last one is full of accessories, which are rare in the others.
        let place = match dice.below(4) {
            0 => jobs.len() - 1,
            _ => dice.below(jobs.len()),
        };
        let (Some((text, target)), Some(Some(way))) = (jobs.get(place), ways.get(place)) else {
            continue;
        };
        let (number, damaged) = dice.damage(text);
        let errors = errors_in(&damaged, target, number);
        if !errors {
            continue;
        }
        damages += 1;
        let found = movements(&damaged, target);
        let before: Vec<&Order> = way.iter().filter(|order| order.line < number).collect();
        let all_of_it = same(&found, way.iter());
        let up_to_it = same(&found, before.into_iter());
        left_out += u32::from(all_of_it && !up_to_it);
        if !all_of_it && !up_to_it {
            let line = language::lines(&damaged).nth(number as usize - 1).map(|line| line.text);
            return Err(format!("line {number}, {line:?}, changes the way of\n{text}").into());
        }
    }
    // Or it would be a test of nothing but ends.
    match left_out > DAMAGES / 50 {
        true => Ok(()),
        false => Err(format!("only {left_out} damaged lines were left out").into()),
    }
}

/// Files of posts, and every program of the fixtures that is more than a few lines.
fn texts() -> Result<Vec<String>, Failed> {
    let mut texts = Vec::new();
    for entry in fs::read_dir(jobs::folder().join("posts"))? {
        texts.push(fs::read_to_string(entry?.path())?);
    }
    let all = jobs::jobs()?.into_iter().filter(|job| job.model == "imc4" && !job.lenient);
    texts.extend(all.map(|job| language::decode(&job.program).into_owned()));
    texts.push(ACCESSORIES.to_owned());
    texts.retain(|text| text.lines().count() > 4);
    Ok(texts)
}

const ACCESSORIES: &str = "\
IMF_PBL_V1.0
TOOLDEF T1 L20000
REF XYZ
COOLANT ON
PUMP ON
WPCLAMP ON
SETPORT A1=5
MOVEABS X1000
SETBIT A1.3
LAMP ON
POPTION2 OFF
MOVEABS Y1000
RESBIT A1.3
COOLANT2 OFF
PUMP OFF
INITTOOL
MOVEABS Z1000
WPCLAMP OFF
LAMP OFF
PROGEND
";

/// What an undamaged job does; `None` if it has an error, or does very much.
fn valid(text: &str, target: &Target) -> Option<Vec<Order>> {
    let summary = job::check(text, target, Options::default(), &mut |_| {});
    let way = movements(text, target);
    (summary.errors == 0 && way.len() < MOST).then_some(way)
}

/// So many steps of a job are kept.
const MOST: usize = 20_000;

/// Everything that a job does, but for its outputs.
fn movements(text: &str, target: &Target) -> Vec<Order> {
    let mut job = Job::new(text, target, Options::default());
    let all = std::iter::from_fn(|| job.next(&mut |_| {}));
    all.filter(|order| !matches!(order.step, Step::Output(..))).take(MOST).collect()
}

fn same<'o>(found: &[Order], expected: impl Iterator<Item = &'o Order>) -> bool {
    found.iter().map(|order| &order.step).eq(expected.map(|order| &order.step))
}

/// Whether a line cannot be read or carried out.
fn errors_in(text: &str, target: &Target, number: u32) -> bool {
    let mut errors = false;
    job::check(text, target, Options::default(), &mut |diagnostic| {
        let severity = diagnostic.problem.severity();
        errors |= diagnostic.line == number && severity == Severity::Error;
    });
    errors
}

/// The same numbers each time, without a pattern that matters (Knuth's MMIX).
struct Dice(u64);

impl Dice {
    fn below(&mut self, most: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % most.max(1) as u64) as usize
    }

    /// A text with one line damaged, and its number.
    fn damage(&mut self, text: &str) -> (u32, String) {
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let place = self.below(lines.len());
        if let Some(line) = lines.get_mut(place) {
            let mut bytes: Vec<u8> = line.bytes().filter(u8::is_ascii).collect();
            for _ in 0..=self.below(3) {
                self.damage_line(&mut bytes);
            }
            *line = String::from_utf8_lossy(&bytes).into_owned();
        }
        (place as u32 + 1, lines.join("\n"))
    }

    fn damage_line(&mut self, line: &mut Vec<u8>) {
        let at = self.below(line.len() + 1);
        let character = CHARACTERS[self.below(CHARACTERS.len())];
        match self.below(6) {
            0 => line.insert(at, character),
            1 if at < line.len() => drop(line.remove(at)),
            2 if at < line.len() => line[at] = character,
            3 if at + 1 < line.len() => line.swap(at, at + 1),
            4 => line.truncate(at),
            _ => drop(line.drain(..at)),
        }
    }
}
