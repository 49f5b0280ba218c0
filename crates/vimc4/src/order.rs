//! Orders that people type while a controller runs, carried out.

use std::future::Future;
use std::pin::Pin;

use vimc4_device::{Condition, Ruling, faults_in_words, position_in_words, rules_in_words};
use vimc4_host::ControlError;
use vimc4_language::{Order, completions, help, help_on, list_signals};
use vimc4_session::order::{erased, ruled, said};

use crate::control::Control;
use crate::error::Error;

/// What an order leads to: text to print, if there is any.
pub type Outcome = Pin<Box<dyn Future<Output = Result<String, Error>> + Send>>;

impl Control {
    /// Carries an order out. It is given at once, so orders take effect in the order of these
    /// calls; what comes of it can be awaited.
    ///
    /// ```
    /// # #[tokio::main(flavor = "current_thread")]
    /// # async fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// use vimc4::{Emulator, Order};
    ///
    /// let emu = Emulator::builder().start()?;
    /// let names = emu.names()?;
    /// let order = Order::read("cover open", &names)?.ok_or("it says something")?;
    /// assert_eq!(emu.control().give(&order).await?, "ok");
    /// let wrong = Order::read("cover shut", &names).unwrap_err();
    /// assert_eq!(
    ///     wrong.to_string(),
    ///     "`cover shut` is wrong at `shut`: `cover` cannot be `shut`; it can be open or closed",
    /// );
    /// # Ok(())
    /// # }
    /// ```
    pub fn give(&self, order: &Order) -> Outcome {
        match order {
            Order::Do(deed) => answer(self.act(deed.clone()), |effect| said(&effect)),
            Order::Erase => {
                let takes_ms = self.model().panel_erase_ms().unwrap_or(0);
                let (before, effect) = (self.view(), self.erase());
                Box::pin(async move {
                    let (before, effect) = (before.await?, effect.await?);
                    Ok(erased(&effect, before.powered, takes_ms))
                })
            }
            Order::Advance(span) => answer(self.advance(*span), |at| format!("now {at}")),
            Order::RunUntil(condition) => {
                let there = if *condition == Condition::Idle { "idle" } else { "there" };
                answer(self.run_until(condition.clone()), move |at| format!("{there} at {at}"))
            }
            Order::Cancel => {
                self.cancel_all();
                answer(self.now(), |_| "ok".to_owned())
            }
            Order::Position => {
                answer(self.view(), |view| position_in_words(&view.axes, view.activity))
            }
            Order::Faults => {
                let (names, faults) = (self.names(), self.faults());
                Box::pin(async move { Ok(faults_in_words(&faults.await?, &names.await?)) })
            }
            Order::Rule(Ruling::Begin(_, scenario)) => {
                let begun = scenario.clone();
                let (number, rules) = (self.scenario(begun.clone()), self.rules());
                Box::pin(async move { Ok(ruled(number.await?, &begun, &rules.await?)) })
            }
            Order::Rule(Ruling::End(number)) => {
                answer(self.end_scenario(*number), |effect| said(&effect))
            }
            Order::Rule(Ruling::EndAll) => answer(self.end_scenarios(), |effect| said(&effect)),
            Order::Reset => answer(self.reset(), |effect| said(&effect)),
            Order::Rules => {
                let (names, rules) = (self.names(), self.rules());
                Box::pin(async move { Ok(rules_in_words(&rules.await?, &names.await?)) })
            }
            Order::Signals => answer(self.names(), |names| list_signals(&names)),
            Order::Help(None) => answer(self.names(), |names| help(&names)),
            Order::Help(Some(verb)) => {
                let verb = *verb;
                answer(self.names(), move |names| help_on(verb, &names))
            }
            Order::Complete(begun) => {
                let begun = begun.clone();
                answer(self.names(), move |names| completions(&begun, &names))
            }
            Order::Quit => {
                self.stop();
                Box::pin(async { Ok(String::new()) })
            }
        }
    }
}

fn answer<T: Send + 'static>(
    reply: impl Future<Output = Result<T, ControlError>> + Send + 'static,
    text: impl FnOnce(T) -> String + Send + 'static,
) -> Outcome {
    Box::pin(async { Ok(text(reply.await?)) })
}
