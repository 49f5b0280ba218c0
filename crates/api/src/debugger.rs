//! The debugger of a controller: a thread that carries out what is asked, one thing at a time.

use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::thread;

use serde_json::{Value, json};
use tokio::sync::{Mutex, Semaphore, oneshot};
use vimc4::Control;

use crate::problem::{Kind, Problem};

/// A debugger on a running controller, in the words of the console. The controller's time is paused
/// while it is inspected, and goes on when this is dropped.
pub trait Debugging {
    /// Carries out a line, and returns what there is to say.
    ///
    /// # Errors
    ///
    /// Why it was not carried out.
    fn carry_out(&mut self, line: &str) -> Result<String, String>;

    /// A picture of the controller at the moment that is looked at.
    fn view(&self) -> Value;

    /// Whether the end was asked for.
    fn is_over(&self) -> bool;
}

/// Ends what a debugger is doing, from another thread.
pub type Cancel = Arc<dyn Fn() + Send + Sync>;

/// Opens a debugger on a controller, in the thread in which it is then used.
pub type Open = Arc<dyn Fn(&Control) -> Result<(Box<dyn Debugging>, Cancel), String> + Send + Sync>;

/// What is asked of a debugger.
#[derive(Debug)]
pub(crate) enum Question {
    Line(String),
    View,
}

/// The place of the debugger of a controller.
#[derive(Debug, Default)]
pub(crate) struct Desk(Mutex<Option<Opened>>);

/// A debugger that is open.
struct Opened {
    asks: Sender<(Question, oneshot::Sender<Result<Value, String>>)>,
    cancel: Cancel,
    /// One asks at a time.
    turn: Arc<Semaphore>,
    ended: oneshot::Receiver<()>,
}

impl fmt::Debug for Opened {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Opened")
    }
}

impl Opened {
    fn is_over(&mut self) -> bool {
        !matches!(self.ended.try_recv(), Err(oneshot::error::TryRecvError::Empty))
    }
}

/// Ends what is under way when nobody waits for it any more.
struct Asker(Option<Cancel>);

impl Drop for Asker {
    fn drop(&mut self) {
        if let Some(cancel) = &self.0 {
            cancel();
        }
    }
}

impl Desk {
    /// Asks the debugger, which is opened first if it is not open.
    pub(crate) async fn ask(
        &self,
        open: Option<&Open>,
        control: &Control,
        question: Question,
    ) -> Result<Value, Problem> {
        let refused = |detail: String| {
            let (detail, remedy) = detail.split_once("; ").unwrap_or((&detail, ""));
            Problem::new(Kind::NotNow, detail, remedy)
        };
        let (answer, reply) = oneshot::channel();
        let (_turn, cancel) = {
            let mut desk = self.0.lock().await;
            if desk.as_mut().is_none_or(Opened::is_over) {
                let Some(open) = open else {
                    let remedy = "leave out --dap, --line-pacing, --line-physics and --time manual";
                    let detail = "this program was started without a debugger for requests";
                    return Err(Problem::new(Kind::NotNow, detail, remedy));
                };
                *desk = Some(start(Arc::clone(open), control.clone()).await.map_err(refused)?);
            }
            let Some(opened) = desk.as_ref() else { return Err(gone()) };
            let turn = Arc::clone(&opened.turn).try_acquire_owned().map_err(|_| {
                let remedy = "wait for it; deleting the debugger ends what it does";
                Problem::new(Kind::NotNow, "the debugger does something else", remedy)
            })?;
            opened.asks.send((question, answer)).map_err(|_| gone())?;
            (turn, Arc::clone(&opened.cancel))
        };
        let mut asker = Asker(Some(cancel));
        let said = reply.await;
        asker.0 = None;
        said.map_err(|_| gone())?.map_err(|wrong| {
            let (detail, remedy) =
                wrong.split_once("; ").unwrap_or((&wrong, "the line `help` lists all"));
            Problem::new(Kind::NotUnderstood, detail, remedy)
        })
    }

    /// Closes the debugger, and returns when the controller goes on. Returns whether it was open.
    pub(crate) async fn close(&self) -> bool {
        let Some(Opened { asks, cancel, ended, .. }) = self.0.lock().await.take() else {
            return false;
        };
        drop(asks);
        cancel();
        let _ = ended.await;
        true
    }
}

fn gone() -> Problem {
    Problem::new(Kind::NotNow, "the debugger has been closed", "ask again, which opens another one")
}

/// Opens a debugger in a thread of its own.
async fn start(open: Open, control: Control) -> Result<Opened, String> {
    let (asks, asked) = channel::<(Question, oneshot::Sender<Result<Value, String>>)>();
    let (opened, opening) = oneshot::channel();
    let (end, ended) = oneshot::channel();
    let serve = move || {
        match open(&control) {
            Err(wrong) => drop(opened.send(Err(wrong))),
            Ok((mut debugger, cancel)) => {
                let _ = opened.send(Ok(cancel));
                for (question, answer) in asked {
                    let said = match question {
                        Question::View => Ok(debugger.view()),
                        Question::Line(line) => {
                            debugger.carry_out(&line).map(|text| json!({ "text": text }))
                        }
                    };
                    let is_over = debugger.is_over();
                    if is_over {
                        // Its controller goes on before that is answered.
                        drop(debugger);
                        let _ = end.send(());
                        let _ = answer.send(said);
                        return;
                    }
                    let _ = answer.send(said);
                }
                drop(debugger);
            }
        }
        let _ = end.send(());
    };
    let thread = thread::Builder::new().name("debugger".to_owned()).spawn(serve);
    thread.map_err(|error| format!("cannot start a thread: {error}"))?;
    let cancel = opening.await.map_err(|_| "the debugger could not be opened".to_owned())??;
    Ok(Opened { asks, cancel, turn: Arc::new(Semaphore::new(1)), ended })
}
