//! The session files: what a session says about itself, besides its script.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::{Spanned, Table};
use vimc4_catalogue::Family;
use vimc4_device::Deed;

use crate::script::{self, Action, Needs, Step};
use crate::source::{Source, with_manual};

/// Names that stand for several models, besides those of the families, which stand for all of
/// theirs that have a manual.
const GROUPS: [(&str, &[&str]); 2] =
    [("classic", &["imc4", "imc4-m"]), ("imc-xx", &["imc-m", "imc-mp", "imc-s8"])];

/// One behaviour: what is sent, what happens, what must come.
#[derive(Clone, Debug)]
pub struct Session {
    /// Family, topic, file and name: `isel/stop/software-stop/keeps-the-remainder`.
    pub id: String,
    /// The family that its models are of.
    pub family: Family,
    /// Its file.
    pub path: PathBuf,
    /// The behaviour as one sentence.
    pub title: String,
    /// Where it is known from.
    pub source: Source,
    /// The models it applies to, all of its family, in the order of [`vimc4_catalogue::models`].
    pub models: Vec<&'static str>,
    /// Values of the model's profile that differ from the built-in one.
    pub profile: Table,
    /// The machine it needs.
    pub machine: MachineChoice,
    /// Whether replies take as long as their bits take on the line.
    pub line_pacing: bool,
    /// What is done, in order.
    pub steps: Vec<Step>,
}

/// The machine behind the controller.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineChoice {
    /// The built-in machine.
    pub name: String,
    /// Values of its profile that differ.
    pub differs: Table,
}

impl Session {
    /// What it needs of the code that plays it.
    #[must_use]
    pub fn needs(&self) -> Needs {
        script::needs(self.family, self.steps.iter().map(|step| &step.action))
    }

    /// Whether something goes wrong in it, or a rule does something, so that it needs a controller at a
    /// line.
    #[must_use]
    pub fn has_faults(&self) -> bool {
        let is_fault =
            |step: &Step| matches!(step.action, Action::Do(Deed::Fault(_)) | Action::Rule(_));
        self.steps.iter().any(is_fault)
    }

    /// The folder it is in.
    #[must_use]
    pub fn topic(&self) -> &str {
        self.id.split('/').nth(1).unwrap_or_default()
    }
}

/// What is wrong with a session file, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}:{line}: {message}", path.display())]
pub struct FormatError {
    /// The file.
    pub path: PathBuf,
    /// The line, from 1.
    pub line: usize,
    /// What is wrong; what would be right.
    pub message: String,
}

/// A file as written. Keys before the first `[[session]]` hold for all of them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawFile {
    models: Option<Spanned<RawModels>>,
    evidence: Option<Spanned<String>>,
    source: Option<Spanned<String>>,
    machine: Option<RawMachine>,
    setup: Option<Spanned<String>>,
    session: Vec<RawSession>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSession {
    name: Spanned<String>,
    title: String,
    models: Option<Spanned<RawModels>>,
    evidence: Option<Spanned<String>>,
    source: Option<Spanned<String>>,
    #[serde(default)]
    quirks: Table,
    #[serde(default)]
    profile: Table,
    machine: Option<RawMachine>,
    #[serde(default)]
    line_pacing: bool,
    setup: Option<Spanned<String>>,
    each: Option<Spanned<String>>,
    script: Spanned<String>,
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

/// Reads one session file of a topic. `programs` are those that `store` can name.
///
/// # Errors
///
/// The first mistake, with its place.
pub fn parse(
    topic: &str,
    path: &Path,
    text: &str,
    programs: &BTreeMap<String, String>,
) -> Result<Vec<Session>, FormatError> {
    let file = File { path, text, programs };
    let raw: RawFile = toml::from_str(text).map_err(|error| {
        let keys = "fixtures/README.md lists the keys";
        file.error(error.span().unwrap_or(0..0), format!("{}; {keys}", error.message()))
    })?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut sessions: Vec<Session> = Vec::new();
    for session in &raw.session {
        let name = session.name.as_ref();
        let at = session.name.span();
        if name.is_empty() || !name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-') {
            let message = format!("{name:?} is not a name; small letters, digits and - make one");
            return Err(file.error(at, message));
        }
        let missing = |key: &str| {
            let message = format!("{name:?} has no {key}; add it there or at the top of the file");
            file.error(at.clone(), message)
        };
        let models = session.models.as_ref().or(raw.models.as_ref());
        let (family, models) = file.models(models.ok_or_else(|| missing("models"))?)?;
        let id = format!("{}/{topic}/{stem}/{name}", family.name());
        if sessions.iter().any(|earlier| earlier.id == id) {
            return Err(file.error(at, format!("a second {name:?}; give it a name of its own")));
        }
        let evidence = session.evidence.as_ref().or(raw.evidence.as_ref());
        let evidence = evidence.ok_or_else(|| missing("evidence"))?;
        let source = session.source.as_ref().or(raw.source.as_ref());
        let source = source.ok_or_else(|| missing("source"))?;
        let mut profile = session.profile.clone();
        if !session.quirks.is_empty() {
            merge(
                &mut profile,
                Table::from_iter([("quirks".into(), session.quirks.clone().into())]),
            );
        }
        let setup = match session.setup.as_ref().or(raw.setup.as_ref()) {
            Some(setup) => file.script(setup, &Row(vec![]))?,
            None => vec![],
        };
        let mut steps = Vec::new();
        for (index, row) in file.rows(session.each.as_ref())?.iter().enumerate() {
            if index > 0 {
                let text = "a new controller".to_owned();
                let line = file.line_of(session.script.span().start);
                steps.push(Step { line, text, action: Action::New });
            }
            steps.extend(setup.iter().cloned());
            steps.extend(file.script(&session.script, row)?);
        }
        sessions.push(Session {
            path: path.to_owned(),
            title: session.title.clone(),
            source: file.source(source, evidence, name, &models)?,
            family,
            models,
            profile,
            machine: match session.machine.as_ref().or(raw.machine.as_ref()) {
                None => MachineChoice { name: "bench".to_owned(), differs: Table::new() },
                Some(RawMachine::Name(name)) => {
                    MachineChoice { name: name.clone(), differs: Table::new() }
                }
                Some(RawMachine::Profile(differs)) => {
                    let mut differs = differs.clone();
                    let name = match differs.remove("like") {
                        Some(toml::Value::String(name)) => name,
                        _ => "bench".to_owned(),
                    };
                    MachineChoice { name, differs }
                }
            },
            line_pacing: session.line_pacing,
            steps,
            id,
        });
    }
    Ok(sessions)
}

/// Puts the values of `differs` into a profile, table by table.
pub fn merge(profile: &mut Table, differs: Table) {
    for (key, value) in differs {
        match (profile.get_mut(&key), value) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(value)) => merge(inner, value),
            (_, value) => {
                profile.insert(key, value);
            }
        }
    }
}

/// A file and its text, to locate mistakes in it.
struct File<'a> {
    path: &'a Path,
    text: &'a str,
    programs: &'a BTreeMap<String, String>,
}

impl File<'_> {
    fn error(&self, span: Range<usize>, message: String) -> FormatError {
        self.error_at(self.line_of(span.start), message)
    }

    fn error_at(&self, line: usize, message: String) -> FormatError {
        FormatError { path: self.path.to_owned(), line, message }
    }

    fn line_of(&self, offset: usize) -> usize {
        self.text.bytes().take(offset).filter(|&byte| byte == b'\n').count() + 1
    }

    /// The lines of a literal text, each with its line in the file.
    fn lines<'t>(&self, text: &'t Spanned<String>) -> Result<Vec<(usize, &'t str)>, FormatError> {
        if !self.text.get(text.span().start..).is_some_and(|text| text.starts_with("'''\n")) {
            let message = "no plain text; write it on lines of its own between ''' and '''";
            return Err(self.error(text.span(), message.to_owned()));
        }
        let first = self.line_of(text.span().start) + 1;
        Ok(text.as_ref().lines().enumerate().map(|(at, line)| (first + at, line)).collect())
    }

    /// The steps of a script, its columns filled in.
    fn script(&self, script: &Spanned<String>, row: &Row) -> Result<Vec<Step>, FormatError> {
        let mut steps = Vec::new();
        for (line, text) in self.lines(script)? {
            let text = row.fill(text);
            let actions = script::parse_line(&text);
            let actions = actions.map_err(|error| self.error_at(line, error.message))?;
            for action in actions {
                steps.extend(self.step(line, text.trim_end(), action)?);
            }
        }
        Ok(steps)
    }

    /// A line's step; for `store` those of the program's lines.
    fn step(&self, line: usize, text: &str, action: Action) -> Result<Vec<Step>, FormatError> {
        let Action::Store(name) = action else {
            return Ok(vec![Step { line, text: text.to_owned(), action }]);
        };
        let program = self.programs.get(&name).ok_or_else(|| {
            let known: Vec<&str> = self.programs.keys().map(String::as_str).collect();
            let message = format!("no program {name:?}; there are {}", known.join(", "));
            self.error_at(line, message)
        })?;
        let steps = script::store(program);
        let steps = steps.map_err(|error| self.error_at(line, format!("{name}: {error}")))?;
        Ok(steps.into_iter().map(|(text, action)| Step { line, text, action }).collect())
    }

    /// The rows of a table with the columns named in its first line; without a table, one row
    /// without columns.
    fn rows(&self, each: Option<&Spanned<String>>) -> Result<Vec<Row>, FormatError> {
        let Some(each) = each else { return Ok(vec![Row(vec![])]) };
        let lines = self.lines(each)?;
        let mut lines = lines.into_iter().filter(|(_, line)| !line.trim().is_empty());
        let cells =
            |line: &str| line.split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
        let names = lines.next().map(|(_, line)| cells(line)).unwrap_or_default();
        lines
            .map(|(at, line)| {
                let values = cells(line);
                if values.len() == names.len() {
                    return Ok(Row(names.iter().cloned().zip(values).collect()));
                }
                let message = format!(
                    "{} values in a row; the table has the {} columns {}",
                    values.len(),
                    names.len(),
                    names.join(" | ")
                );
                Err(self.error_at(at, message))
            })
            .collect()
    }

    /// Where a behaviour is known from.
    fn source(
        &self,
        source: &Spanned<String>,
        evidence: &Spanned<String>,
        name: &str,
        models: &[&str],
    ) -> Result<Source, FormatError> {
        let error = |message| self.error(source.span(), format!("{name:?}: {message}"));
        let read = Source::parse(source.as_ref(), evidence.as_ref()).map_err(error)?;
        read.is_about(models).map_err(error)?;
        Ok(read)
    }

    /// The models that are named, one by one or in groups, and the family of all of them.
    fn models(
        &self,
        models: &Spanned<RawModels>,
    ) -> Result<(Family, Vec<&'static str>), FormatError> {
        let names = match models.as_ref() {
            RawModels::One(name) => std::slice::from_ref(name),
            RawModels::Many(names) => names.as_slice(),
        };
        let groups = || {
            let families =
                Family::ALL.map(|family| (family.name(), with_manual(family))).into_iter();
            families.chain(GROUPS.map(|(group, members)| (group, members.to_vec())))
        };
        let all = vimc4_catalogue::models();
        for name in names {
            if !all.contains(&name.as_str()) && !groups().any(|(group, _)| group == name) {
                let groups: Vec<&str> = groups().map(|(group, _)| group).collect();
                let message =
                    format!("no model {name:?}; {}, {} are", groups.join(", "), all.join(", "));
                return Err(self.error(models.span(), message));
            }
        }
        let named = |model: &str| {
            names.iter().any(|name| {
                let mut groups = groups().filter(|(group, _)| group == name);
                name == model || groups.any(|(_, members)| members.contains(&model))
            })
        };
        let of = Family::ALL.into_iter().map(|family| {
            let models = family.models().into_iter().filter(|model| named(model));
            (family, models.collect::<Vec<_>>())
        });
        let mut of = of.filter(|(_, models)| !models.is_empty());
        match (of.next(), of.next()) {
            (Some(one), None) => Ok(one),
            (None, _) => {
                Err(self.error(models.span(), "no model is named; \"isel\" is one way".into()))
            }
            (Some(_), Some(_)) => {
                let message = "models of two families; a session is about one, so write two";
                Err(self.error(models.span(), message.to_owned()))
            }
        }
    }
}

/// A row of a table: column and value.
struct Row(Vec<(String, String)>);

impl Row {
    fn fill(&self, text: &str) -> String {
        self.0.iter().fold(text.to_owned(), |text, (name, value)| {
            text.replace(&format!("{{{name}}}"), value)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "models = \"imc-xx\"\nevidence = \"D\"\nsource = \"12 2.2.3\"\n\
                        setup = '''\n> @07 -> 0\n'''\n\n\
                        [[session]]\nname = \"two-rows\"\ntitle = \"t\"\n\
                        each = '''\nport | value\n1 | 03\n2 | E2\n'''\n\
                        script = '''\n> @0b{port} -> 0{value}\n'''\n";

    fn message(text: &str) -> String {
        parse("line", Path::new("x.toml"), text, &BTreeMap::new()).unwrap_err().to_string()
    }

    #[test]
    fn every_row_of_a_table_has_its_own_controller() {
        let sessions = parse("line", Path::new("x.toml"), GOOD, &BTreeMap::new()).unwrap();
        assert_eq!(sessions[0].id, "isel/line/x/two-rows");
        assert_eq!((sessions[0].family, sessions[0].topic()), (Family::Isel, "line"));
        assert_eq!(sessions[0].models, ["imc-m", "imc-mp", "imc-s8"]);
        let steps: Vec<_> = sessions[0].steps.iter().map(|s| (s.line, s.text.as_str())).collect();
        let (first, second, setup) = ("> @0b1 -> 003", "> @0b2 -> 0E2", "> @07 -> 0");
        let new = "a new controller";
        let row = |text| [(5, setup), (5, setup), (17, text), (17, text)];
        assert_eq!(steps, [&row(first)[..], &[(16, new)], &row(second)].concat());
    }

    #[test]
    fn an_error_names_the_file_the_line_and_the_remedy() {
        let error = message(&GOOD.replace("> @0b{port}", "send @0b{port}"));
        assert!(error.starts_with("x.toml:17: \"send\" is not a word"), "{error}");
        let error = message(&GOOD.replace("2 | E2", "2 | E2 | 3"));
        assert!(error.starts_with("x.toml:14: 3 values in a row"), "{error}");
        let error = message(&GOOD.replace("imc-xx", "imc5"));
        assert!(error.starts_with("x.toml:1: no model \"imc5\"; isel, lpkf, classic"), "{error}");
        let error = message(&GOOD.replace("\"imc-xx\"", "[\"imc4\", \"lpkf\"]"));
        assert!(error.starts_with("x.toml:1: models of two families"), "{error}");
        let error = message(&GOOD.replace("title", "titel"));
        assert!(error.starts_with("x.toml:10: "), "{error}");
        let error = message(&GOOD.replace("source = \"12 2.2.3\"", ""));
        assert!(error.contains("has no source"), "{error}");
    }

    #[test]
    fn profiles_differ_table_by_table() {
        let mut profile: Table = toml::from_str("[a]\nx = 1\ny = 2").unwrap();
        merge(&mut profile, toml::from_str("[a]\ny = 3\n[b]\nz = 4").unwrap());
        assert_eq!(profile, toml::from_str("[a]\nx = 1\ny = 3\n[b]\nz = 4").unwrap());
    }
}
