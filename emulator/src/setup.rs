//! For which controller on which machine: what the command line says, or else the file.

use std::io::{self, Write};
use std::path::Path;

use vimc4_script::{Kind, Script, is_job};

use crate::completions;
use crate::failure::Failure;
use crate::identity::profile_files;
use crate::text::{self, shown_in_line};

/// The model and the machine of a command that reads a file.
#[derive(Clone, clap::Args)]
pub(crate) struct Setup {
    /// The model of controller: a name from `vimc4 models`, or a profile file; by default that
    /// of a data field, or imc4
    #[arg(long, value_name = "NAME|FILE", add = completions::models())]
    model: Option<String>,
    /// The machine: a name from `vimc4 machines`, or a profile file; by default that of a
    /// data field, or bench
    #[arg(long, value_name = "NAME|FILE", add = completions::machines())]
    machine: Option<String>,
}

impl Setup {
    /// The same from elsewhere than a command line.
    pub(crate) fn said(model: Option<String>, machine: Option<String>) -> Setup {
        Setup { model, machine }
    }

    /// The name or profile file of the model.
    pub(crate) fn model(&self) -> &str {
        self.model.as_deref().unwrap_or("imc4")
    }

    /// The name or profile file of the machine.
    pub(crate) fn machine(&self) -> &str {
        self.machine.as_deref().unwrap_or("bench")
    }

    /// The profile files that are read.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        profile_files(self.model.as_deref(), self.machine.as_deref())
    }

    /// The comments in which a data field says what it was made for.
    pub(crate) fn comments(&self) -> String {
        let comment = |key: &str, name: &str| match name.contains(char::is_control) {
            // It would not stay a comment.
            true => String::new(),
            false => format!("; {key}: {name}\n"),
        };
        comment("model", self.model()) + &comment("machine", self.machine())
    }

    /// Takes what the comments of a data field say where the command line says nothing. Where both
    /// do, the command line wins, and it is said that they differ.
    ///
    /// # Errors
    ///
    /// If there is no profile of what the file says.
    pub(crate) fn heed(&mut self, path: &Path, bytes: &[u8]) -> Result<(), Failure> {
        let script = Script::parse(bytes).filter(|_| !is_job(bytes));
        let Some(Script { kind: Kind::DataField, model, machine, .. }) = script else {
            return Ok(());
        };
        let file = text::name(path);
        let known = |name: &str| vimc4::model_profile(name).is_ok();
        heed(&file, "model", &mut self.model, model, known)?;
        let known = |name: &str| vimc4::machine_profile(name).is_ok();
        heed(&file, "machine", &mut self.machine, machine, known)
    }
}

fn heed(
    file: &str,
    what: &str,
    told: &mut Option<String>,
    said: Option<String>,
    known: impl Fn(&str) -> bool,
) -> Result<(), Failure> {
    let Some(said) = said else { return Ok(()) };
    match told {
        Some(told) if *told != said => {
            let (told, said) = (shown_in_line(told), shown_in_line(&said));
            let note = format!("{file} was made for the {what} {said}; --{what} {told} is used");
            // Where standard error is closed there is nowhere else to say it.
            let _ = writeln!(io::stderr(), "{note}");
        }
        Some(_) => {}
        None if known(&said) || Path::new(&said).exists() => *told = Some(said),
        None => {
            return Err(Failure::usage(format!(
                "{file} was made for the {what} {said}, of which there is no profile here; say \
                 where it is with --{what}"
            )));
        }
    }
    Ok(())
}
