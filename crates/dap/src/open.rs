//! What is debugged, and how it is opened.

use serde::de::Error;
use serde::{Deserialize, Deserializer};
use serde_json::Value;
use std::collections::BTreeMap;
use vimc4_debug::{Debugger, Unit};
use vimc4_timeline::Progress;

use crate::live::Live;
use crate::message::Refusal;

/// An editor's configuration of what is to be debugged, as in a `launch.json`. [`ATTRIBUTES`] lists
/// every attribute.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct Configuration {
    /// A file of commands, a program, a plot or a job.
    pub program: Option<String>,
    /// A recording of a controller.
    pub recording: Option<String>,
    /// The model of controller.
    pub model: Option<String>,
    /// The machine.
    pub machine: Option<String>,
    /// Whether it is behind ports, for host software to connect to.
    pub serve: bool,
    /// The name of the link to its pseudo-terminal.
    pub pty: Option<String>,
    /// The address at which it listens.
    pub tcp: Option<String>,
    /// A real serial port.
    pub serial: Option<String>,
    /// How time passes behind ports.
    pub time: Option<String>,
    /// The file in which its flash memory is kept.
    pub flash: Option<String>,
    /// Values of quirks, by their names: texts, numbers or true and false.
    #[serde(deserialize_with = "quirks")]
    pub quirks: BTreeMap<String, String>,
    /// What is said about jobs besides their file: options of a command line.
    pub job_options: Option<Vec<String>>,
    /// What the controller is called.
    pub name: Option<String>,
    /// The folder that names of files are relative to.
    pub cwd: Option<String>,
    /// Whether it stops before the first line.
    pub stop_on_entry: bool,
    /// Whether it ends instead of stopping at the end.
    pub end_at_end: bool,
    /// Whether the rest of a program is sent even after an error reply.
    pub keep_going: Option<bool>,
    /// Whether it runs without debugging and never stops.
    pub no_debug: bool,
    /// Several controllers, each with its own attributes.
    pub controllers: Vec<Configuration>,
    /// What else it has: attributes of the editor itself, and what means nothing.
    #[serde(flatten)]
    pub others: BTreeMap<String, Value>,
}

/// Quirks as `vimc4 models show` and recordings have them, or as texts.
fn quirks<'d, D: Deserializer<'d>>(from: D) -> Result<BTreeMap<String, String>, D::Error> {
    let quirks: BTreeMap<String, Value> = BTreeMap::deserialize(from)?;
    let text = |(name, value): (String, Value)| match value {
        Value::String(text) => Ok((name, text)),
        Value::Bool(_) | Value::Number(_) => Ok((name, value.to_string())),
        _ => Err(Error::custom(format!("the value of {name} is a text, a number, true or false"))),
    };
    quirks.into_iter().map(text).collect()
}

/// The attributes of a configuration: name, its type in JSON, and what it means.
pub const ATTRIBUTES: [(&str, &str, &str); 18] = [
    ("program", "string", "the file: a command list, a program (data field), a plot or a job file"),
    (
        "recording",
        "string",
        "instead of a program: a file in which a controller was recorded, with `--record`",
    ),
    (
        "model",
        "string",
        "with `program` or `serve`: the model of controller, a name from `vimc4 models`, or a profile file",
    ),
    (
        "machine",
        "string",
        "with `program` or `serve`: the machine, a name from `vimc4 machines`, or a profile file",
    ),
    (
        "serve",
        "boolean",
        "instead of a program: host software sends, behind ports as those of `vimc4 serve`",
    ),
    (
        "pty",
        "string",
        "with `serve`: the link to its pseudo-terminal, or `none`; ./vimc4.pty by default",
    ),
    ("tcp", "string", "with `serve`: where it listens, or `none`; 127.0.0.1:4004 by default"),
    ("serial", "string", "with `serve`: a real serial port"),
    ("time", "string", "with `serve`: how time passes, as in real, 8x or instant; real by default"),
    ("flash", "string", "with `serve`: a file that keeps the flash memory"),
    (
        "quirks",
        "object",
        "with `program` or `serve`: quirks of the model that have another value here",
    ),
    (
        "jobOptions",
        "array",
        "with a `program` that is a job: what else is said about it, as `vimc4 ncp run` takes it: --no-ref, --lenient, --zero, --wpreg or --drilldef-unit, as in `[\"--zero=100mm,50mm,-60mm\"]`; other files have no such options",
    ),
    (
        "cwd",
        "string",
        "the folder that names of files are relative to; by default that of the adapter",
    ),
    ("stopOnEntry", "boolean", "stop before the first line; false by default"),
    (
        "endAtEnd",
        "boolean",
        "with `program` or `recording`: end with it; if not, it stops at the end, and goes back from there",
    ),
    (
        "keepGoing",
        "boolean",
        "with `program`: go on sending after an error reply, as software does that ignores it; false by default",
    ),
    (
        "noDebug",
        "boolean",
        "ignore all breakpoints and `stopOnEntry`, and end the session at the end",
    ),
    (
        "controllers",
        "array",
        "several controllers, each with these attributes and a `name`; what one leaves out is taken from beside it",
    ),
];

/// Why an entry of `controllers` has none itself.
pub(crate) const NO_LIST: &str = "an entry of `controllers` is one controller and has no `controllers` itself; put \
     them beside it";

/// A controller that is to be debugged.
#[derive(Debug)]
pub struct Opened {
    /// What it is called.
    pub name: String,
    /// It and its history. Its source, if it has one, has the path of the file as its name.
    pub debugger: Debugger,
    /// The line of the file, from 1, that each line of the stored program comes from, if it does.
    pub stored: Vec<u32>,
    /// Whether its source is a file; otherwise the source is shown from memory.
    pub is_file: bool,
    /// What a statement is.
    pub statement: Unit,
    /// The controller itself, if it runs by itself; the debugger follows it.
    pub live: Option<Box<dyn Live>>,
    /// What to tell the user about it at the beginning; may be empty.
    pub said: String,
}

/// Opens what is to be debugged.
pub trait Open {
    /// Opens what a configuration says: at least one controller. Long work asks `progress` now and
    /// then whether to go on.
    ///
    /// # Errors
    ///
    /// What is wrong with it, and what would be right; or that it was cancelled.
    fn open(
        &mut self,
        configuration: &Configuration,
        progress: &mut Progress<'_>,
    ) -> Result<Vec<Opened>, Refusal>;

    /// Attaches to controllers that already run for other clients: at least one.
    ///
    /// # Errors
    ///
    /// If there are none, or another session has them.
    fn attach(&mut self, configuration: &Configuration) -> Result<Vec<Opened>, Refusal>;

    /// Whether two paths are those of the same file.
    fn is_same_file(&self, one: &str, other: &str) -> bool;
}

impl Configuration {
    /// A refusal that is about one of a list, the controller of this number.
    pub(crate) fn refuses(&self, number: usize, refusal: Refusal) -> Refusal {
        Refusal(match &self.name {
            Some(name) => format!("controller {name}: {refusal}"),
            None => format!("controller {number} of the list: {refusal}"),
        })
    }

    /// Does something with each controller that is meant, one after the other.
    ///
    /// # Errors
    ///
    /// The first refusal. Of a list it says which controller it is about.
    pub fn with_each<T>(
        &self,
        mut deed: impl FnMut(&Configuration) -> Result<T, Refusal>,
    ) -> Result<Vec<T>, Refusal> {
        let is_list = !self.controllers.is_empty();
        let each = self.each();
        let done = (1..).zip(&each).map(|(number, each)| {
            let done = match each.controllers.is_empty() {
                true => deed(each),
                false => Err(Refusal::new(NO_LIST)),
            };
            done.map_err(|refusal| match is_list {
                true if refusal != Refusal::cancelled() => each.refuses(number, refusal),
                _ => refusal,
            })
        });
        done.collect()
    }

    /// One configuration for each controller, each with the common attributes.
    #[must_use]
    pub fn each(&self) -> Vec<Configuration> {
        if self.controllers.is_empty() {
            // The name of a configuration is not the name of a controller.
            return vec![Configuration { name: None, ..self.clone() }];
        }
        let each = self.controllers.iter().map(|own| {
            let own = own.clone();
            let file = own.program.is_some() || own.recording.is_some() || own.serve;
            // A recording has its own.
            let (model, machine, quirks) = match own.recording {
                Some(_) => Default::default(),
                None => (self.model.clone(), self.machine.clone(), self.quirks.clone()),
            };
            // Only a program may be a job.
            let is_program = own.program.is_some() || !file && self.program.is_some();
            let job_options = self.job_options.clone().filter(|_| is_program);
            Configuration {
                serve: own.serve || self.serve && !file,
                pty: own.pty.or_else(|| self.pty.clone()),
                tcp: own.tcp.or_else(|| self.tcp.clone()),
                serial: own.serial,
                time: own.time.or_else(|| self.time.clone()),
                flash: own.flash.or_else(|| self.flash.clone()),
                program: own.program.or_else(|| self.program.clone().filter(|_| !file)),
                recording: own.recording.or_else(|| self.recording.clone().filter(|_| !file)),
                model: own.model.or(model),
                machine: own.machine.or(machine),
                quirks: quirks.into_iter().chain(own.quirks).collect(),
                job_options: own.job_options.or(job_options),
                name: own.name,
                cwd: own.cwd.or_else(|| self.cwd.clone()),
                keep_going: own.keep_going.or(self.keep_going),
                controllers: own.controllers,
                ..self.clone()
            }
        });
        each.collect()
    }
}
