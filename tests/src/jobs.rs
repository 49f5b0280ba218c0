//! The jobs below `fixtures/ncp`: programs in the NC format, and what must become of each.
//!
//! `fixtures/README.md` explains every key.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;
use toml::{Table, Value};
use vimc4::{Family, Machine, Model};
use vimc4_conform::format::merge;
use vimc4_conform::source::{Source, with_manual};
use vimc4_conform::workshop;
use vimc4_device::parse_duration;
use vimc4_ncp::job::{NoZero, Options, Register, Target, Zero};
pub use vimc4_script::target;

/// Names that stand for several models.
const GROUPS: [(&str, &[&str]); 2] =
    [("classic", &["imc4", "imc4-m"]), ("imc-xx", &["imc-m", "imc-mp", "imc-s8"])];

/// A program on a model, and what must become of it.
#[derive(Clone, Debug)]
pub struct JobCase {
    /// Topic, file and name, and the number of its row if it has several: `arcs/planes/planes/3`.
    pub id: String,
    /// What it shows, in one sentence.
    pub title: String,
    /// What says so, and how certain that is.
    pub source: Source,
    /// The name of the model.
    pub model: &'static str,
    /// The bytes of the file.
    pub program: Vec<u8>,
    /// How it is read.
    pub options: Options,
    /// Where the work-piece zero is at first.
    pub zero: Zero,
    /// What is in registers at first.
    pub registers: Vec<Register>,
    /// Whether it is run in spite of its errors.
    pub lenient: bool,
    /// What the operator says at each WPTEACH, line by line.
    pub answers: Vec<String>,
    /// What happens outside meanwhile, in order.
    pub inputs: Vec<Change>,
    /// What is said about it, `severity line:column code` each.
    pub diagnostics: Vec<String>,
    /// What is done, step by step, if the file says so.
    pub commands: Option<Vec<String>>,
    /// What no command begins with.
    pub never: Vec<String>,
    /// The counters at its end, by axis.
    pub end: Vec<(usize, i64)>,
    /// How long it takes, in ns.
    pub time: Option<u64>,
    /// How long it takes at least, in ns.
    pub at_least: Option<u64>,
    /// The circle that its arcs lie on.
    pub arc: Option<Circle>,
    /// The data field that it becomes.
    pub field: Option<Vec<String>>,
    /// What is said about it where it is to become a data field.
    pub field_diagnostics: Option<Vec<String>>,
    profile: Table,
    machine: MachineTable,
}

/// A signal takes a value.
#[derive(Clone, Debug)]
pub struct Change {
    /// When, in ns from the start.
    pub at: u64,
    /// The name of the signal, or port and bit as in `0.2`.
    pub signal: String,
    /// The value.
    pub value: i32,
}

/// Where the arcs of a job lie.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Circle {
    /// `xy`, `xz` or `yz`.
    pub plane: String,
    /// The centre, in µm.
    pub centre: [Number; 2],
    /// The radius, in µm.
    pub radius: Number,
    /// From where to where the third axis goes in one turn of a helix, in µm.
    pub rise: Option<[Number; 2]>,
    /// Which way round a helix goes, `cw` or `ccw`.
    pub turn: Option<String>,
}

/// A number, or the text of one that a row has filled in.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(try_from = "RawNumber")]
pub struct Number(pub f64);

#[derive(Deserialize)]
#[serde(untagged)]
enum RawNumber {
    Number(f64),
    Text(String),
}

impl TryFrom<RawNumber> for Number {
    type Error = String;

    fn try_from(raw: RawNumber) -> Result<Number, String> {
        match raw {
            RawNumber::Number(number) => Ok(Number(number)),
            RawNumber::Text(text) => {
                text.parse().map(Number).map_err(|_| format!("{text:?} is not a number"))
            }
        }
    }
}

/// A file as it is written. What stands before the first `[[job]]` holds for all of them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFile {
    models: Option<RawModels>,
    evidence: Option<String>,
    source: Option<String>,
    machine: Option<RawMachine>,
    opening: Option<String>,
    job: Vec<Table>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawJob {
    name: String,
    title: String,
    models: Option<RawModels>,
    evidence: Option<String>,
    source: Option<String>,
    machine: Option<RawMachine>,
    #[serde(default)]
    profile: Table,
    opening: Option<String>,
    program: String,
    #[serde(default)]
    latin1: bool,
    #[serde(default)]
    lenient: bool,
    #[serde(default)]
    no_ref: bool,
    #[serde(default)]
    leave_out_tool_changes: bool,
    drilldef_unit: Option<String>,
    zero: Option<String>,
    #[serde(default)]
    wpreg: Vec<String>,
    #[serde(default)]
    answers: Vec<String>,
    #[serde(default)]
    inputs: Vec<String>,
    #[serde(default)]
    diagnostics: String,
    #[serde(default)]
    diagnostics_on: BTreeMap<String, String>,
    commands: Option<String>,
    #[serde(default)]
    commands_on: BTreeMap<String, String>,
    #[serde(default)]
    never: Vec<String>,
    #[serde(default)]
    end: BTreeMap<String, Number>,
    time: Option<String>,
    at_least: Option<String>,
    arc: Option<Circle>,
    field: Option<String>,
    field_diagnostics: Option<String>,
}

#[derive(Clone, Deserialize)]
#[serde(untagged)]
enum RawModels {
    One(String),
    Many(Vec<String>),
}

#[derive(Clone, Deserialize)]
#[serde(untagged)]
enum RawMachine {
    Name(String),
    Profile(Table),
}

/// A machine as jobs name it.
#[derive(Clone, Debug)]
struct MachineTable {
    like: String,
    without: Vec<String>,
    differs: Table,
}

/// Where the jobs are.
#[must_use]
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fixtures/ncp")
}

/// Reads every job, in the order of topics, files and lines, each once for every model.
///
/// # Errors
///
/// The first mistake in a file, with its place.
pub fn jobs() -> Result<Vec<JobCase>, String> {
    let mut jobs = Vec::new();
    for topic in entries(&folder())?.iter().filter(|path| path.is_dir()) {
        let files = entries(topic)?;
        let is_toml =
            |path: &&PathBuf| path.extension().is_some_and(|extension| extension == "toml");
        for file in files.iter().filter(is_toml) {
            let error = |message: String| format!("{}: {message}", file.display());
            let text = fs::read_to_string(file).map_err(|e| error(e.to_string()))?;
            let name = format!("{}/{}", stem(topic), stem(file));
            jobs.extend(parse(&name, &text).map_err(error)?);
        }
    }
    Ok(jobs)
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let error = |e: std::io::Error| format!("{}: {e}", folder.display());
    let entries = fs::read_dir(folder).map_err(error)?;
    let mut paths = entries
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<Vec<_>, _>>()
        .map_err(error)?;
    paths.sort();
    Ok(paths)
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// The jobs of a file.
fn parse(file: &str, text: &str) -> Result<Vec<JobCase>, String> {
    let raw: RawFile = toml::from_str(text).map_err(|error| error.to_string())?;
    let mut jobs: Vec<JobCase> = Vec::new();
    for table in &raw.job {
        let name = table.get("name").and_then(Value::as_str).unwrap_or_default();
        let error = |message: String| format!("{name:?}: {message}");
        let rows = rows(table).map_err(error)?;
        let alone = rows.len() == 1;
        for (index, row) in rows.iter().enumerate() {
            let job = RawJob::deserialize(row.clone()).map_err(|e| error(e.to_string()))?;
            let row = if alone { String::new() } else { format!("/{}", index + 1) };
            let id = format!("{file}/{}{row}", job.name);
            if jobs.iter().any(|earlier| earlier.id == id) {
                return Err(error("a second job of this name; give it a name of its own".into()));
            }
            jobs.extend(job.on_its_models(&raw, &id).map_err(error)?);
        }
    }
    Ok(jobs)
}

/// The job with the values of each row of its table `each` filled in; without a table, as it is.
fn rows(job: &Table) -> Result<Vec<Table>, String> {
    let mut job = job.clone();
    let Some(each) = job.remove("each") else { return Ok(vec![job]) };
    let cells = |line: &str| line.split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    let mut lines = each.as_str().unwrap_or_default().lines();
    let names = cells(lines.next().unwrap_or_default());
    let fill = |line: &str| {
        let values = cells(line);
        if values.len() != names.len() {
            return Err(format!("{line:?} has {} values, not {}", values.len(), names.len()));
        }
        let filled = filled(&Value::Table(job.clone()), &names, &values);
        filled.try_into::<Table>().map_err(|error| error.to_string())
    };
    lines.map(fill).collect()
}

/// The value with `{name}` replaced in all its texts.
fn filled(value: &Value, names: &[String], values: &[String]) -> Value {
    match value {
        Value::String(text) => {
            let fill = |text: String, (name, value): (&String, &String)| {
                text.replace(&format!("{{{name}}}"), value)
            };
            Value::String(names.iter().zip(values).fold(text.clone(), fill))
        }
        Value::Array(inner) => {
            Value::Array(inner.iter().map(|value| filled(value, names, values)).collect())
        }
        Value::Table(inner) => {
            let fill =
                |(key, value): (&String, &Value)| (key.clone(), filled(value, names, values));
            Value::Table(inner.iter().map(fill).collect())
        }
        other => other.clone(),
    }
}

impl RawJob {
    fn on_its_models(&self, file: &RawFile, id: &str) -> Result<Vec<JobCase>, String> {
        let models = self.models.as_ref().or(file.models.as_ref());
        let names = match models {
            None => vec!["isel".to_owned()],
            Some(RawModels::One(name)) => vec![name.clone()],
            Some(RawModels::Many(names)) => names.clone(),
        };
        if let Some(unknown) = names.iter().find(|name| members(name).is_empty()) {
            return Err(format!("{unknown:?} is not a model of isel's and no group of them"));
        }
        let named = |model: &&str| names.iter().any(|name| members(name).contains(model));
        Family::Isel
            .models()
            .into_iter()
            .filter(named)
            .map(|model| self.on(model, file, id))
            .collect()
    }

    /// Where it is known from.
    fn source(&self, file: &RawFile) -> Result<Source, String> {
        let evidence = self.evidence.as_ref().or(file.evidence.as_ref()).ok_or("no evidence")?;
        let source = self.source.as_ref().or(file.source.as_ref()).ok_or("no source")?;
        Source::parse(source, evidence)
    }

    fn on(&self, model: &'static str, file: &RawFile, id: &str) -> Result<JobCase, String> {
        let on = |texts: &BTreeMap<String, String>| {
            texts
                .iter()
                .find(|(name, _)| members(name).contains(&model))
                .map(|(_, text)| text.clone())
        };
        let opening = self.opening.as_ref().or(file.opening.as_ref());
        let commands = on(&self.commands_on).or(self.commands.clone());
        let commands = commands
            .map(|commands| lines(&format!("{}\n{commands}", opening.map_or("", String::as_str))));
        let drill_in_mm = match self.drilldef_unit.as_deref() {
            None | Some("um") => false,
            Some("mm") => true,
            Some(other) => {
                return Err(format!("{other:?} is not a unit of DRILLDEF; um and mm are"));
            }
        };
        let zero = self.zero.as_deref().unwrap_or_default().parse();
        let registers = self.wpreg.iter().map(|register| register.parse());
        let machine = self.machine.as_ref().or(file.machine.as_ref());
        let source = self.source(file)?;
        Ok(JobCase {
            id: id.to_owned(),
            source,
            title: self.title.clone(),
            model,
            program: self.bytes()?,
            options: Options {
                no_reference: self.no_ref,
                drill_in_mm,
                leave_out_tools: self.leave_out_tool_changes,
            },
            zero: zero.map_err(|error: NoZero| error.to_string())?,
            registers: registers.collect::<Result<_, NoZero>>().map_err(|e| e.to_string())?,
            lenient: self.lenient,
            answers: self.answers.clone(),
            inputs: self.inputs.iter().map(|text| change(text)).collect::<Result<_, _>>()?,
            diagnostics: lines(
                &on(&self.diagnostics_on).unwrap_or_else(|| self.diagnostics.clone()),
            ),
            commands,
            never: self.never.clone(),
            end: self.end.iter().map(counter).collect::<Result<_, _>>()?,
            time: self.time.as_deref().map(nanos).transpose()?,
            at_least: self.at_least.as_deref().map(nanos).transpose()?,
            arc: self.arc.clone(),
            field: self.field.as_deref().map(lines),
            field_diagnostics: self.field_diagnostics.as_deref().map(lines),
            profile: self.profile.clone(),
            machine: machine_table(machine)?,
        })
    }

    /// The file as it would be on a disk.
    fn bytes(&self) -> Result<Vec<u8>, String> {
        if !self.latin1 {
            return Ok(self.program.clone().into_bytes());
        }
        let byte =
            |c: char| u8::try_from(u32::from(c)).map_err(|_| format!("{c:?} is not in Latin-1"));
        self.program.chars().map(byte).collect()
    }
}

/// The models that a name stands for.
fn members(name: &str) -> Vec<&'static str> {
    let group = GROUPS.iter().find(|(group, _)| *group == name);
    let documented = with_manual(Family::Isel);
    let of = |model: &&str| {
        name == "isel" && documented.contains(model)
            || *model == name
            || group.is_some_and(|(_, g)| g.contains(model))
    };
    Family::Isel.models().into_iter().filter(of).collect()
}

/// The lines of a text that are not blank.
fn lines(text: &str) -> Vec<String> {
    text.lines().map(str::trim).filter(|line| !line.is_empty()).map(str::to_owned).collect()
}

/// The counter that an axis must have.
fn counter((axis, number): (&String, &Number)) -> Result<(usize, i64), String> {
    let axes = ["x", "y", "z", "a"];
    let index = axes.iter().position(|name| name == axis);
    let index = index.ok_or_else(|| format!("{axis:?} is not an axis; x, y, z and a are"))?;
    Ok((index, number.0 as i64))
}

/// `0.2=1@2s`: a signal, its value, and when it takes it.
fn change(text: &str) -> Result<Change, String> {
    let parts = text.split_once('@').and_then(|(what, at)| Some((what.split_once('=')?, at)));
    let ((signal, value), at) =
        parts.ok_or_else(|| format!("{text:?} is no change; \"0.2=1@2s\" is one"))?;
    let value = value.parse().map_err(|_| format!("{value:?} is not a value"))?;
    Ok(Change { at: nanos(at)?, signal: signal.to_owned(), value })
}

/// A time in ns, written as in a session.
fn nanos(text: &str) -> Result<u64, String> {
    let span = parse_duration(text).map_err(|error| format!("{text:?} {error}"))?;
    Ok(span.as_nanos() as u64)
}

fn machine_table(raw: Option<&RawMachine>) -> Result<MachineTable, String> {
    let mut table = MachineTable { like: "bench".into(), without: vec![], differs: Table::new() };
    match raw {
        None => {}
        Some(RawMachine::Name(name)) => table.like.clone_from(name),
        Some(RawMachine::Profile(profile)) => {
            table.differs.clone_from(profile);
            if let Some(like) = table.differs.remove("like") {
                table.like = like.try_into().map_err(|error| format!("like: {error}"))?;
            }
            if let Some(without) = table.differs.remove("without") {
                table.without = without.try_into().map_err(|error| format!("without: {error}"))?;
            }
        }
    }
    Ok(table)
}

impl JobCase {
    /// The model, with what the job says differs.
    ///
    /// # Errors
    ///
    /// If a value cannot be.
    pub fn model(&self) -> Result<Model, String> {
        let text = vimc4::model_profile(self.model).map_err(|error| error.to_string())?;
        let mut profile: Table = toml::from_str(text).map_err(|error| error.to_string())?;
        merge(&mut profile, self.profile.clone());
        workshop::model(&profile)
    }

    /// The machine, with what the job says differs.
    ///
    /// # Errors
    ///
    /// If a value cannot be.
    pub fn machine(&self) -> Result<Arc<Machine>, String> {
        let text = vimc4::machine_profile(&self.machine.like).map_err(|error| error.to_string())?;
        let mut profile: Table = toml::from_str(text).map_err(|error| error.to_string())?;
        if let Some(Value::Table(axes)) = profile.get_mut("axes") {
            axes.retain(|axis, _| !self.machine.without.iter().any(|left_out| left_out == axis));
        }
        merge(&mut profile, self.machine.differs.clone());
        let text = toml::to_string(&profile).map_err(|error| error.to_string())?;
        Machine::from_toml(&text).map(Arc::new).map_err(|error| error.to_string())
    }
}

impl JobCase {
    /// What the job has to know of its model and its machine, with the zeros it is given.
    ///
    /// # Errors
    ///
    /// If the model is none of isel's.
    pub fn target(&self, model: &Model, machine: &Machine) -> Result<Target, String> {
        let mut target = target(model, machine)?;
        target.set_zero(self.zero);
        self.registers.iter().for_each(|register| target.fill(*register));
        Ok(target)
    }
}
