//! The line console: what somebody types, line by line.

use std::cell::RefCell;
use std::env;
use std::fs;
#[cfg(unix)]
use std::io::{self, Write};
use std::path::PathBuf;
use std::rc::Rc;
#[cfg(unix)]
use std::sync::{Mutex, PoisonError};

#[cfg(unix)]
use rustix::event::{PollFd, PollFlags, Timespec, poll};
#[cfg(unix)]
use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcsetattr};
use rustyline::completion::{Completer, Pair};
use rustyline::error::ReadlineError;
use rustyline::highlight::Highlighter;
use rustyline::hint::Hinter;
use rustyline::history::FileHistory;
use rustyline::validate::Validator;
use rustyline::{CompletionType, Config, Context, Editor, Helper};

use super::script::Console;
use super::session::hint;
use crate::failure::Failure;

/// What stands before what is typed.
pub(crate) const PROMPT: &str = "(vimc4) ";

/// So many lines are remembered.
const REMEMBERED: usize = 1_000;

/// The terminal as it was before anybody typed.
#[cfg(unix)]
static BEFORE: Mutex<Option<Termios>> = Mutex::new(None);

/// Gives the terminal back as it was, if a line is being typed: for an end in the middle of that.
#[cfg(unix)]
pub(crate) fn leave() {
    let before = BEFORE.lock().unwrap_or_else(PoisonError::into_inner);
    let (Some(before), Ok(now)) = (&*before, tcgetattr(rustix::stdio::stdin())) else { return };
    if now.local_modes != before.local_modes {
        let _ = io::stdout().write_all(PASTE_AS_TYPED);
        let _ = io::stdout().flush();
        let _ = tcsetattr(rustix::stdio::stdin(), OptionalActions::Now, before);
    }
}

#[cfg(not(unix))]
pub(crate) fn leave() {}

/// Whether the terminal is one at which lines are read as they are.
#[cfg(unix)]
fn is_dumb() -> bool {
    matches!(env::var("TERM").as_deref(), Ok("dumb" | "") | Err(_))
}

/// Ends the marks that the editor has the terminal put around what is pasted.
#[cfg(unix)]
const PASTE_AS_TYPED: &[u8] = b"\x1B[?2004l";

/// Somebody at a terminal.
pub(crate) struct Shell<C: Console> {
    editor: Editor<Table<C>, FileHistory>,
    /// Where lines are remembered from one time to the next, if there is such a place.
    file: Option<PathBuf>,
}

/// What the editor asks the debugger's table of commands.
struct Table<C>(Rc<RefCell<C>>);

impl<C: Console> Shell<C> {
    pub(crate) fn new(console: Rc<RefCell<C>>) -> Result<Shell<C>, Failure> {
        #[cfg(unix)]
        {
            let before = tcgetattr(rustix::stdio::stdin()).ok();
            *BEFORE.lock().unwrap_or_else(PoisonError::into_inner) = before;
        }
        let failed = |error| Failure::usage(format!("cannot read the terminal: {error}"));
        let config = Config::builder()
            .completion_type(CompletionType::List)
            .max_history_size(REMEMBERED)
            .map_err(failed)?
            .auto_add_history(true)
            .build();
        let mut editor = Editor::with_config(config).map_err(failed)?;
        editor.set_helper(Some(Table(console)));
        let file = remembered();
        if let Some(file) = &file {
            // There is none the first time.
            let _ = editor.load_history(file);
        }
        Ok(Shell { editor, file })
    }

    /// Does something while nobody types. `work` is told by what it is given whether somebody does, and
    /// ends then.
    #[cfg(unix)]
    pub(crate) fn meanwhile(
        &mut self,
        prompt: &str,
        work: impl FnOnce(&mut dyn FnMut() -> bool),
    ) -> Result<(), Failure> {
        let stdin = rustix::stdio::stdin();
        let (Ok(before), false) = (tcgetattr(stdin), is_dumb()) else { return Ok(()) };
        let mut keys = before.clone();
        // A key is there when it is pressed, and the editor that reads it shows it.
        keys.local_modes -= LocalModes::ICANON | LocalModes::ECHO | LocalModes::ISIG;
        if tcsetattr(stdin, OptionalActions::Now, &keys).is_err() {
            return Ok(());
        }
        let shown = write!(io::stdout(), "{prompt}").and_then(|()| io::stdout().flush());
        work(&mut || {
            let mut fds = [PollFd::new(&stdin, PollFlags::IN)];
            // Where it cannot be seen whether somebody types, it is looked for by reading.
            !matches!(poll(&mut fds, Some(&Timespec::default())), Ok(0))
        });
        let _ = tcsetattr(stdin, OptionalActions::Now, &before);
        // The editor writes the prompt again.
        let shown = shown.and_then(|()| write!(io::stdout(), "\r"));
        shown.map_err(|error| Failure::usage(format!("cannot use the terminal: {error}")))
    }

    /// It is read on where somebody comes to the end of what is known.
    #[cfg(not(unix))]
    pub(crate) fn meanwhile(
        &mut self,
        _: &str,
        _: impl FnOnce(&mut dyn FnMut() -> bool),
    ) -> Result<(), Failure> {
        Ok(())
    }

    /// The next line; nothing at the end. Ctrl-C leaves out what was typed.
    pub(crate) fn line(&mut self, prompt: &str) -> Result<Option<String>, Failure> {
        loop {
            return match self.editor.readline(prompt) {
                Ok(line) => Ok(Some(line)),
                Err(ReadlineError::Interrupted) => continue,
                Err(ReadlineError::Eof) => Ok(None),
                Err(error) => Err(Failure::usage(format!("cannot read the terminal: {error}"))),
            };
        }
    }
}

impl<C: Console> Drop for Shell<C> {
    fn drop(&mut self) {
        if let Some(file) = &self.file {
            if let Some(folder) = file.parent() {
                let _ = fs::create_dir_all(folder);
            }
            // Whoever cannot remember types again.
            let _ = self.editor.save_history(file);
        }
    }
}

/// The file in which lines are remembered, as the rules for folders of state have it; none if there
/// is no home.
fn remembered() -> Option<PathBuf> {
    let set = |name| env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let state = match cfg!(windows) {
        true => set("LOCALAPPDATA")?,
        false => set("XDG_STATE_HOME").or_else(|| Some(set("HOME")?.join(".local/state")))?,
    };
    Some(state.join("vimc4").join("console-history"))
}

impl<C: Console> Completer for Table<C> {
    type Candidate = Pair;

    fn complete(
        &self,
        line: &str,
        cursor: usize,
        _: &Context<'_>,
    ) -> rustyline::Result<(usize, Vec<Pair>)> {
        // Nobody edits a line while one is carried out.
        let Ok(console) = self.0.try_borrow() else { return Ok((cursor, Vec::new())) };
        let completion = console.complete(line, cursor);
        let is_only = completion.candidates.len() == 1;
        let pairs = completion.candidates.into_iter().map(|candidate| Pair {
            display: candidate.text.clone(),
            // Whoever knows which word it is goes on with the next.
            replacement: if is_only { candidate.text + " " } else { candidate.text },
        });
        Ok((completion.from, pairs.collect()))
    }
}

impl<C> Hinter for Table<C> {
    type Hint = String;

    fn hint(&self, line: &str, cursor: usize, _: &Context<'_>) -> Option<String> {
        if cursor < line.len() {
            return None;
        }
        hint(line)
    }
}

impl<C> Highlighter for Table<C> {
    fn highlight_hint<'h>(&self, hint: &'h str) -> std::borrow::Cow<'h, str> {
        match env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty()) {
            true => hint.into(),
            false => format!("\x1B[2m{hint}\x1B[0m").into(),
        }
    }
}

impl<C> Validator for Table<C> {}

impl<C: Console> Helper for Table<C> {}
