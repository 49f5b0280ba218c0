//! The controls of a running controller.

use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Wake, Waker};
use std::thread::{self, Thread};
use std::time::{Duration, Instant};

use thiserror::Error;
use tokio::sync::{mpsc, oneshot};
use vimc4_device::{Condition, Device, Input, Signal, SignalKind, Time, View};

use crate::report::{Deed, Effect, Sink, Source};
use crate::runner::{Destination, Job, Runner};
use crate::transport::Transport;

/// Buttons that stay pressed until somebody releases them.
const LATCHING: [&str; 1] = ["estop"];

/// Controls a running controller from outside: its panel, its power, its time.
///
/// Every method asks at once and in order; the [`Reply`] can be awaited or waited for. Bytes
/// never take this way. The controller ends when it is [told to](Handle::stop) or when the
/// last handle is dropped.
#[derive(Debug)]
pub struct Handle<D: Device> {
    jobs: mpsc::UnboundedSender<Job<D>>,
    stop: Arc<Mutex<Option<oneshot::Sender<()>>>>,
    /// Who has it.
    who: Arc<str>,
}

impl<D: Device> Clone for Handle<D> {
    fn clone(&self) -> Self {
        Handle { jobs: self.jobs.clone(), stop: Arc::clone(&self.stop), who: Arc::clone(&self.who) }
    }
}

/// Why a controller did not do what it was told.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ControlError {
    /// It runs no longer.
    #[error("the emulator has ended")]
    Ended,
    /// It has no such signal.
    #[error("there is no {wanted} `{name}`; there are {known}")]
    NoSuchSignal {
        /// What kind of thing was asked for, such as `button`.
        wanted: &'static str,
        /// The name.
        name: String,
        /// The names that would be right.
        known: String,
    },
    /// The signal does not take this value.
    #[error("`{name}` cannot be `{value}`; it can be {possible}")]
    NoSuchValue {
        /// The signal.
        name: String,
        /// What it was to be.
        value: String,
        /// What would be right.
        possible: String,
    },
    /// No input is connected to this bit.
    #[error("nothing outside drives bit {bit} of port {port}; the inputs are {known}")]
    NotAnInput {
        /// The port.
        port: u16,
        /// The bit.
        bit: u8,
        /// The inputs there are.
        known: String,
    },
    /// Its time cannot be moved.
    #[error("time moves by itself with this clock; use the manual clock to move it")]
    RunsByItself,
    /// It cannot do that, being what it is or as it was set up; the words say what to do instead.
    #[error("{0}")]
    Unsupported(&'static str),
    /// What was waited for has not happened in this time.
    #[error("nothing within {0:?}; it may come later, or never")]
    Late(Duration),
    /// It comes to rest, or runs on without end, and the condition never holds.
    #[error(
        "this never happens unless something else does first; give the command or the order that \
         leads there before"
    )]
    Never,
}

/// An answer that is on its way.
#[derive(Debug)]
#[must_use = "without waiting for the reply nobody learns whether it was done"]
pub struct Reply<T>(oneshot::Receiver<Result<T, ControlError>>);

impl<T> Reply<T> {
    /// A reply that comes when somebody gives the answer. If nobody will, it says that the
    /// emulator has ended.
    pub fn promised() -> (oneshot::Sender<Result<T, ControlError>>, Reply<T>) {
        let (answer, reply) = oneshot::channel();
        (answer, Reply(reply))
    }

    /// Blocks this thread until the answer is there.
    pub fn wait(self) -> Result<T, ControlError> {
        block_on(self)
    }

    /// Blocks this thread until the answer is there, but no longer than so.
    pub fn wait_within(self, limit: Duration) -> Result<T, ControlError> {
        block_until(self, Instant::now().checked_add(limit))
            .unwrap_or(Err(ControlError::Late(limit)))
    }
}

impl<T> Future for Reply<T> {
    type Output = Result<T, ControlError>;

    fn poll(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Self::Output> {
        Pin::new(&mut self.0).poll(cx).map(|reply| reply.unwrap_or(Err(ControlError::Ended)))
    }
}

impl<D: Device + Clone + 'static> Handle<D> {
    pub(crate) fn new(jobs: mpsc::UnboundedSender<Job<D>>, stop: oneshot::Sender<()>) -> Handle<D> {
        Handle { jobs, stop: Arc::new(Mutex::new(Some(stop))), who: Arc::from("the library") }
    }

    /// The same handle for somebody of this name, who appears in the [news](crate::News::Input).
    #[must_use]
    pub fn by(&self, who: &str) -> Handle<D> {
        Handle { who: Arc::from(who), ..self.clone() }
    }

    /// Ends the controller. Its transports are closed when its task has ended.
    pub fn stop(&self) {
        let stop = self.stop.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(stop) = stop {
            // If nobody hears it, it has ended already.
            let _ = stop.send(());
        }
    }

    /// The things of the outside world that can be set.
    pub fn signals(&self) -> Reply<Vec<Signal>> {
        self.with(|runner| Ok(runner.device().signals()))
    }

    /// Sets a signal by name to any value it takes.
    pub fn set(&self, name: &str, value: i32) -> Reply<Effect> {
        let name = name.to_owned();
        self.act(move |device| {
            let signal = find(&device.signals(), "signal", &name, |_| true)?;
            check(&signal, value)?;
            Ok((Deed::Set(name, value), vec![Input::Signal(signal.id, value)]))
        })
    }

    /// Sets several signals at the same instant, in this order. `what` is that in one word.
    pub fn set_all(&self, what: &str, values: &[(&str, i32)]) -> Reply<Effect> {
        let what = what.to_owned();
        let values: Vec<_> =
            values.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        self.act(move |device| {
            let mut inputs = Vec::with_capacity(values.len());
            for (name, value) in &values {
                let signal = find(&device.signals(), "signal", name, |_| true)?;
                check(&signal, *value)?;
                inputs.push(Input::Signal(signal.id, *value));
            }
            Ok((Deed::Several { what, signals: values }, inputs))
        })
    }

    /// Puts a switch into a position by name, as in `key auto`.
    pub fn turn(&self, name: &str, position: &str) -> Reply<Effect> {
        let (name, position) = (name.to_owned(), position.to_owned());
        self.act(move |device| {
            let signal =
                find(&device.signals(), "switch", &name, |s| s.kind == SignalKind::Switch)?;
            let value = position_of(&signal, &position)?;
            Ok((Deed::Turn(name, position), vec![Input::Signal(signal.id, value)]))
        })
    }

    /// Presses a button and releases it at the same instant. The emergency stop stays pressed.
    pub fn press(&self, name: &str) -> Reply<Effect> {
        self.button(Deed::Press, name, if LATCHING.contains(&name) { &[1] } else { &[1, 0] })
    }

    /// Presses a button and keeps it pressed.
    pub fn hold(&self, name: &str) -> Reply<Effect> {
        self.button(Deed::Hold, name, &[1])
    }

    /// Releases a button.
    pub fn release(&self, name: &str) -> Reply<Effect> {
        self.button(Deed::Release, name, &[0])
    }

    fn button(
        &self,
        deed: fn(String) -> Deed,
        name: &str,
        values: &'static [i32],
    ) -> Reply<Effect> {
        let name = name.to_owned();
        self.act(move |device| {
            let signal =
                find(&device.signals(), "button", &name, |s| s.kind == SignalKind::Button)?;
            let inputs = values.iter().map(|&value| Input::Signal(signal.id, value)).collect();
            Ok((deed(name), inputs))
        })
    }

    /// Sets a bit of an input port.
    pub fn set_input(&self, port: u16, bit: u8, level: bool) -> Reply<Effect> {
        self.act(move |device| {
            let Some(id) = device.input_signal(port, bit) else {
                let known = names(&device.signals(), |s| s.name.starts_with("input "));
                return Err(ControlError::NotAnInput { port, bit, known });
            };
            let value = i32::from(level);
            let deed = Deed::Set(format!("input {port}.{bit}"), value);
            Ok((deed, vec![Input::Signal(id, value)]))
        })
    }

    /// Takes the power away or gives it back.
    pub fn power(&self, on: bool) -> Reply<Effect> {
        self.act(move |_| Ok((Deed::Power(on), vec![Input::Power(on)])))
    }

    /// Does something to the device in the name of whoever has this handle.
    fn act(
        &self,
        what: impl FnOnce(&D) -> Result<(Deed, Vec<Input<'static>>), ControlError> + Send + 'static,
    ) -> Reply<Effect> {
        let by = Source::Controls(self.who.as_ref().to_owned());
        self.with(move |runner| {
            let (deed, inputs) = what(runner.device())?;
            Ok(runner.act(by, deed, &inputs))
        })
    }

    /// Moves time forward. Only clocks that do not run by themselves can be moved.
    pub fn advance(&self, span: Duration) -> Reply<Time> {
        self.travel(Destination::After(span))
    }

    /// Moves time forward to the first instant at which the condition holds, or waits for that
    /// instant if the clock runs by itself.
    pub fn run_until(&self, condition: Condition) -> Reply<Time> {
        self.travel(Destination::Until(condition))
    }

    /// The controller's time.
    pub fn now(&self) -> Reply<Time> {
        self.with(|runner| Ok(runner.device().now()))
    }

    /// A picture of the controller at its present time.
    pub fn view(&self) -> Reply<View<D::Details>> {
        self.with(|runner| Ok(runner.device().view(runner.device().now())))
    }

    /// Everything that decides what the controller will do.
    pub fn state(&self) -> Reply<D::State>
    where
        D::State: Send,
    {
        self.with(|runner| Ok(runner.device().state().clone()))
    }

    /// Continues from a state taken earlier, its time included.
    pub fn restore(&self, state: D::State) -> Reply<()>
    where
        D::State: Send,
    {
        let by = Source::Controls(self.who.as_ref().to_owned());
        self.with(move |runner| {
            runner.restore(by, state);
            Ok(())
        })
    }

    /// Opens another way to the line.
    pub fn attach(&self, transport: impl Transport + 'static) -> Reply<()> {
        self.with(move |runner| {
            runner.attach(Box::new(transport));
            Ok(())
        })
    }

    /// Lets a sink watch from now on.
    pub fn watch(&self, sink: impl Sink + 'static) -> Reply<()> {
        self.with(move |runner| {
            runner.watch(Box::new(sink));
            Ok(())
        })
    }

    /// Does anything with the controller, between two inputs and after all that was sent before.
    pub fn with<T: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Runner<D>) -> Result<T, ControlError> + Send + 'static,
    ) -> Reply<T> {
        let (sender, reply) = Reply::promised();
        // If it cannot be sent, the sender is dropped with it, and the reply says so.
        let _ = self.jobs.send(Box::new(move |runner| {
            let _ = sender.send(work(runner));
        }));
        reply
    }

    fn travel(&self, destination: Destination) -> Reply<Time> {
        let (sender, reply) = Reply::promised();
        let _ = self.jobs.send(Box::new(move |runner| runner.set_out(destination, sender)));
        reply
    }
}

fn find(
    signals: &[Signal],
    wanted: &'static str,
    name: &str,
    fits: impl Fn(&Signal) -> bool,
) -> Result<Signal, ControlError> {
    signals.iter().find(|s| s.name == name && fits(s)).cloned().ok_or_else(|| {
        ControlError::NoSuchSignal { wanted, name: name.to_owned(), known: names(signals, fits) }
    })
}

fn names(signals: &[Signal], fits: impl Fn(&Signal) -> bool) -> String {
    let names: Vec<&str> = signals.iter().filter(|s| fits(s)).map(|s| s.name.as_str()).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn check(signal: &Signal, value: i32) -> Result<(), ControlError> {
    let (low, high) = match signal.kind {
        SignalKind::Analogue { low, high } => (low, high),
        SignalKind::Button | SignalKind::Switch | SignalKind::Input => (0, 1),
    };
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(ControlError::NoSuchValue {
        name: signal.name.clone(),
        value: value.to_string(),
        possible: format!("{low} to {high}"),
    })
}

fn position_of(signal: &Signal, position: &str) -> Result<i32, ControlError> {
    let positions = signal.positions.as_ref().map_or(&[] as &[String], |p| p.as_slice());
    match positions.iter().position(|p| p == position) {
        Some(0) => Ok(0),
        Some(_) => Ok(1),
        None => Err(ControlError::NoSuchValue {
            name: signal.name.clone(),
            value: position.to_owned(),
            possible: positions.join(" or "),
        }),
    }
}

/// Waits for a future on this thread. The executors of tokio refuse to do so inside of tasks;
/// this one does what it is told, so the blocking methods work everywhere.
pub fn block_on<F: Future + Unpin>(mut future: F) -> F::Output {
    loop {
        // Without a deadline it does not give up.
        if let Some(output) = block_until(&mut future, None) {
            return output;
        }
    }
}

/// The same up to a moment.
fn block_until<F: Future + Unpin>(future: F, deadline: Option<Instant>) -> Option<F::Output> {
    struct Unpark(Thread);

    impl Wake for Unpark {
        fn wake(self: Arc<Self>) {
            self.0.unpark();
        }
    }

    let waker = Waker::from(Arc::new(Unpark(thread::current())));
    let mut cx = Context::from_waker(&waker);
    // Inside of a task tokio would hold back what is ready after a hundred such waits, until the
    // task comes to a pause. It will not: it is blocked here.
    let mut future = tokio::task::unconstrained(future);
    loop {
        if let Poll::Ready(output) = Pin::new(&mut future).poll(&mut cx) {
            return Some(output);
        }
        match deadline {
            None => thread::park(),
            Some(deadline) => match deadline.checked_duration_since(Instant::now()) {
                Some(left) if !left.is_zero() => thread::park_timeout(left),
                _ => return None,
            },
        }
    }
}
