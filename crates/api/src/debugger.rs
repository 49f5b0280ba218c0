//! The debugger of a controller: a thread that carries out what is asked, one thing at a time.

use std::convert::Infallible;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::thread;

use serde_json::{Value, json};
use tokio::sync::{Mutex, Semaphore, oneshot};
use tokio::time::timeout;
use vimc4::{Control, ControlError, Names, Sink, Time};
use vimc4_answers::entry::list;
use vimc4_answers::feed::Feed;
use vimc4_answers::limits::HISTORY;
use vimc4_answers::past::{Goal, Sight, wrong_line, wrong_look};
use vimc4_answers::problem::{Kind, Problem};

use crate::holding::{Ends, Holding};
use crate::limits::PATIENCE;
use crate::past::Memory;

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

    /// The moment that is looked at, the one at which the controller itself is, and the branches.
    ///
    /// # Errors
    ///
    /// Why that cannot be told.
    fn history(&mut self) -> Result<Value, String>;

    /// Looks at another moment. The controller stays where it is.
    ///
    /// # Errors
    ///
    /// Why there is no such moment.
    fn go(&mut self, goal: Goal) -> Result<(), String>;

    /// Carries out a line at the moment that is looked at. In the past that begins a branch, and what
    /// would come of it by itself is worked out.
    ///
    /// # Errors
    ///
    /// Why it was not carried out.
    fn branch(&mut self, line: &str) -> Result<String, String>;

    /// Reports what happened on a branch, or on the one that is looked at, and how many reports before
    /// those lead up to it.
    ///
    /// # Errors
    ///
    /// If there is no such branch.
    fn happened(&mut self, branch: Option<u64>, sink: &mut dyn Sink) -> Result<u64, String>;

    /// Whether the end was asked for.
    fn is_over(&self) -> bool;
}

/// What other threads may want of a debugger, whatever it does.
pub trait Reins: Send + Sync {
    /// Ends what it is doing.
    fn cancel(&self);

    /// Whether its controller stays paused when it is dropped.
    fn stay_paused(&self, stays: bool);

    /// How far what it is doing has come, for people; empty if it does nothing that takes long.
    fn progress(&self) -> String;
}

/// A debugger, and what other threads have of it.
pub type Reined = (Box<dyn Debugging>, Arc<dyn Reins>);

/// Opens a debugger on a controller with its past, in the thread in which it is then used.
pub type Open = Arc<dyn Fn(&Control, &Memory) -> Result<Reined, String> + Send + Sync>;

/// What is asked of a debugger.
#[derive(Debug)]
pub(crate) enum Question {
    Line(String),
    View,
    History,
    Go(Goal),
    /// A line at the moment that is looked at.
    Do(String, Sight),
    Take(Sight),
    /// What happened on a branch.
    Entries(Option<u64>, Box<Names>),
}

/// As JSON, or why there is nothing.
type Said = Result<String, Problem>;

/// What a debugger says to it.
fn answer(debugger: &mut dyn Debugging, question: Question) -> Said {
    let wrong = |why: String| wrong_look(&why);
    match question {
        Question::View => return Ok(debugger.view().to_string()),
        Question::Line(line) => {
            let text = debugger.carry_out(&line).map_err(|why| wrong_line(&line, &why))?;
            return Ok(json!({ "text": text }).to_string());
        }
        Question::Entries(branch, names) => return entries(debugger, branch, &names),
        Question::History => {}
        Question::Go(goal) => debugger.go(goal).map_err(wrong)?,
        Question::Do(line, sight) => {
            sight.is_right(&debugger.history().map_err(wrong)?)?;
            debugger.branch(&line).map_err(wrong)?;
        }
        Question::Take(sight) => {
            sight.is_right(&debugger.history().map_err(wrong)?)?;
            debugger.carry_out("take").map_err(wrong)?;
        }
    }
    let mut history = debugger.history().map_err(wrong)?;
    history["open"] = true.into();
    history["possible"] = true.into();
    history["view"] = debugger.view();
    Ok(history.to_string())
}

/// What happened on a branch, as entries of the journal have it.
fn entries(debugger: &mut dyn Debugging, branch: Option<u64>, names: &Names) -> Said {
    let feed = Feed::new(Arc::new(|| {}));
    let before = debugger.happened(branch, &mut feed.sink()).map_err(|why| wrong_look(&why))?;
    let part = feed.after(before, HISTORY);
    let (first, last) = (part.first.max(before + 1), part.last);
    Ok(format!(
        r#"{{"first":{first},"last":{last},"next":{last},"entries":[{}]}}"#,
        list(&part.items, names)
    ))
}

/// The place of the debugger of a controller.
#[derive(Debug, Default)]
pub(crate) struct Desk {
    opened: Mutex<Option<Opened>>,
    /// Another number after everything that may lead it elsewhere.
    edition: AtomicU64,
}

/// A debugger that is open.
struct Opened {
    asks: Sender<(Question, oneshot::Sender<Said>)>,
    reins: Arc<dyn Reins>,
    /// One asks at a time.
    turn: Arc<Semaphore>,
    /// Of lines, which may take for ever, only one waits for its turn or has it.
    lines: Arc<Semaphore>,
    ended: oneshot::Receiver<()>,
    /// Who it is for, and what ends with it.
    holder: Option<(String, oneshot::Sender<Infallible>)>,
}

/// A debugger that a client holds.
pub(crate) struct Held {
    /// That of the debugger, by which it is known.
    turn: Arc<Semaphore>,
    /// Whether it was open before, and so is left open.
    was_open: bool,
    reads: oneshot::Receiver<Infallible>,
}

impl Held {
    /// Resolves when the client has left, or the debugger has been closed.
    pub(crate) async fn ended(&mut self) {
        let _ = (&mut self.reads).await;
    }
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

    /// Returns when the controller goes on, and whether it was still open.
    async fn close(mut self) -> bool {
        let was_open = !self.is_over();
        let Opened { asks, reins, lines, ended, holder, .. } = self;
        // One that waits could take for ever, and what is cancelled is only what is under way.
        lines.close();
        drop(asks);
        if was_open {
            reins.cancel();
            let _ = ended.await;
        }
        drop(holder);
        was_open
    }
}

/// Ends what is under way when nobody waits for it any more.
struct Asker(Option<Arc<dyn Reins>>);

impl Drop for Asker {
    fn drop(&mut self) {
        if let Some(reins) = &self.0 {
            reins.cancel();
        }
    }
}

impl Desk {
    /// Whether one is open.
    pub(crate) async fn is_open(&self) -> bool {
        self.opened.lock().await.as_mut().is_some_and(|opened| !opened.is_over())
    }

    /// Another number after everything that may have led it elsewhere.
    pub(crate) fn edition(&self) -> u64 {
        self.edition.load(Ordering::Relaxed)
    }

    fn has_changed(&self) {
        self.edition.fetch_add(1, Ordering::Relaxed);
    }

    /// Asks the debugger, which is opened first if it is not open. What it says is JSON.
    pub(crate) async fn ask(
        &self,
        open: Option<&Open>,
        control: &Control,
        memory: &Memory,
        question: Question,
    ) -> Result<String, Problem> {
        let (answer, reply) = oneshot::channel();
        let (asks, turn, lines, reins, was_open) = {
            let mut desk = self.opened.lock().await;
            let was_open = desk.as_mut().is_some_and(|opened| !opened.is_over());
            let opened = opened(&mut desk, open, control, memory).await?;
            let (turn, lines) = (Arc::clone(&opened.turn), Arc::clone(&opened.lines));
            (opened.asks.clone(), turn, lines, Arc::clone(&opened.reins), was_open)
        };
        let own = Arc::clone(&turn);
        let only_looks =
            matches!(question, Question::View | Question::History | Question::Entries(..));
        let doing = Arc::clone(&reins);
        let busy = || {
            let remedy = "wait for it; posting to debugger/cancel ends what it does";
            let detail = match doing.progress() {
                progress if progress.is_empty() => "the debugger does something else".to_owned(),
                progress => format!("the debugger does something else: {progress}"),
            };
            Problem::new(Kind::NotNow, detail, remedy)
        };
        let is_line = matches!(question, Question::Line(_));
        let line = is_line.then(|| Arc::clone(&lines).try_acquire_owned()).transpose();
        let line = line.map_err(|_| busy())?;
        let turn = timeout(PATIENCE, turn.acquire_owned()).await.map_err(|_| busy())?;
        if is_line && lines.is_closed() {
            return Err(gone());
        }
        asks.send((question, answer)).map_err(|_| gone())?;
        drop(asks);
        let mut asker = Asker(Some(reins));
        let said = reply.await;
        asker.0 = None;
        drop((turn, line));
        // What was refused has stopped no time, and one that was told to end is there no more.
        let is_refused = !was_open && !matches!(said, Ok(Ok(_)));
        let mut desk = self.opened.lock().await;
        let is_done = |opened: &mut Opened| {
            Arc::ptr_eq(&opened.turn, &own)
                && (opened.is_over() || is_refused && opened.holder.is_none())
        };
        if let Some(opened) = desk.take_if(is_done) {
            opened.close().await;
        }
        drop(desk);
        if !only_looks {
            self.has_changed();
        }
        said.map_err(|_| gone())?
    }

    /// Opens the debugger for a client, if it is not open: otherwise it stays open when the client has
    /// left. Only one holds it.
    pub(crate) async fn hold(
        &self,
        open: Option<&Open>,
        control: &Control,
        memory: &Memory,
        by: String,
    ) -> Result<(Holding, Held), Problem> {
        let mut desk = self.opened.lock().await;
        let was_open = desk.as_mut().is_some_and(|opened| !opened.is_over());
        let opened = opened(&mut desk, open, control, memory).await?;
        if let Some((who, _)) = &opened.holder {
            let remedy = "end that, or DELETE the debugger, which lets the controller go on";
            return Err(Problem::new(Kind::NotNow, format!("{who} has the debugger"), remedy));
        }
        let (holding, Ends { held, reads }) = Holding::new();
        opened.holder = Some((by, held));
        Ok((holding, Held { turn: Arc::clone(&opened.turn), was_open, reads }))
    }

    /// Closes the debugger that was held, if it is still open and was opened for that.
    pub(crate) async fn leave(&self, held: &Held) {
        let mut desk = self.opened.lock().await;
        let is_there = |opened: &&mut Opened| Arc::ptr_eq(&opened.turn, &held.turn);
        if let Some(opened) = desk.as_mut().filter(is_there)
            && held.was_open
        {
            opened.holder = None;
            return;
        }
        if let Some(opened) = desk.take_if(|opened| Arc::ptr_eq(&opened.turn, &held.turn)) {
            opened.close().await;
            self.has_changed();
        }
    }

    /// Ends what the debugger is doing, which is then answered. Returns whether it is open.
    pub(crate) async fn cancel(&self) -> bool {
        match &*self.opened.lock().await {
            Some(opened) => opened.reins.cancel(),
            None => return false,
        }
        true
    }

    /// Closes the debugger, and returns when the controller goes on. Returns whether it was open.
    pub(crate) async fn close(&self) -> bool {
        let mut desk = self.opened.lock().await;
        let Some(opened) = desk.take() else { return false };
        let was_open = opened.close().await;
        self.has_changed();
        was_open
    }

    /// Pauses the controller on behalf of a client, or lets it go on: an open debugger leaves it like that.
    pub(crate) async fn pause(&self, control: &Control, is_to: bool) -> Result<Time, ControlError> {
        // While this is held, none is being closed.
        let desk = self.opened.lock().await;
        if let Some(opened) = &*desk {
            opened.reins.stay_paused(is_to);
        }
        match is_to {
            true => control.pause().await,
            false => control.resume().await,
        }
    }
}

/// The debugger, which is opened first if it is not open.
async fn opened<'a>(
    desk: &'a mut Option<Opened>,
    open: Option<&Open>,
    control: &Control,
    memory: &Memory,
) -> Result<&'a mut Opened, Problem> {
    if desk.as_mut().is_none_or(Opened::is_over) {
        let Some(open) = open else {
            let remedy = "leave out --dap and --time manual";
            let detail = "this program was started without a debugger for requests";
            return Err(Problem::new(Kind::NotNow, detail, remedy));
        };
        let opened = start(Arc::clone(open), control.clone(), memory.clone()).await;
        *desk = Some(opened.map_err(|detail| Problem::said(Kind::NotNow, &detail, ""))?);
    }
    desk.as_mut().ok_or_else(gone)
}

fn gone() -> Problem {
    Problem::new(Kind::NotNow, "the debugger has been closed", "ask again, which opens another one")
}

/// Opens a debugger in a thread of its own.
async fn start(open: Open, control: Control, memory: Memory) -> Result<Opened, String> {
    let (asks, asked) = channel::<(Question, oneshot::Sender<Said>)>();
    let (opened, opening) = oneshot::channel();
    let (end, ended) = oneshot::channel();
    let serve = move || {
        match open(&control, &memory) {
            Err(wrong) => drop(opened.send(Err(wrong))),
            Ok((mut debugger, reins)) => {
                let _ = opened.send(Ok(reins));
                for (question, asker) in asked {
                    let said = answer(&mut *debugger, question);
                    let is_over = debugger.is_over();
                    if is_over {
                        // Its controller goes on before that is answered.
                        drop(debugger);
                        let _ = end.send(());
                        let _ = asker.send(said);
                        return;
                    }
                    let _ = asker.send(said);
                }
                drop(debugger);
            }
        }
        let _ = end.send(());
    };
    let thread = thread::Builder::new().name("debugger".to_owned()).spawn(serve);
    thread.map_err(|error| format!("cannot start a thread: {error}"))?;
    let reins = opening.await.map_err(|_| "the debugger could not be opened".to_owned())??;
    let [turn, lines] = [(); 2].map(|()| Arc::new(Semaphore::new(1)));
    Ok(Opened { asks, reins, turn, lines, ended, holder: None })
}
