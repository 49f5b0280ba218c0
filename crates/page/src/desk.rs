//! The desk: controllers, and which of them a request is about.

use serde_json::Value;
use vimc4_answers::fields::{no_such, place_of};
use vimc4_answers::news::Subscription;
use vimc4_answers::problem::Problem;

use crate::call::Call;
use crate::served::Served;

/// Controllers, and all that is asked of them: the control API without a server.
///
/// It knows no clock: each request says what time it is for whoever asks, in milliseconds from any
/// beginning. Time begins to pass when somebody [hears](Desk::hear) what happens.
///
/// Beyond the API it knows `PUT /v1/controllers`, which puts other controllers on the desk, `PUT
/// /v1/recording`, which puts the one of a recording there with its past and says what is missing of it and from when
/// on the emulation differs from it, `PUT /v1/events`, which says what
/// is to be heard, `GET /v1/controllers/1/meaning?line=@07`, which says what a line would mean, `GET …/deeds`,
/// which lists all that was done to it on the way to the moment that is looked at, `GET …/quirks`,
/// which lists the values that each quirk of its model can have, `POST
/// /v1/controllers/1/work`, which takes a file apart into what a host gives to the controller, and `GET …/rest`,
/// which says whether it is done with what it was given, and how many bytes it takes before that.
///
/// ```
/// use vimc4_page::Desk;
///
/// let mut desk = Desk::new();
/// desk.ask("PUT", "/v1/controllers", r#"[{"model": "imc4", "clock": "manual"}]"#, 0.0);
/// desk.ask("POST", "/v1/controllers/1/line", r#"{"send": "@01\r@0A1000,900\r"}"#, 0.0);
/// let body = r#"{"condition": "idle"}"#;
/// desk.ask("POST", "/v1/controllers/1/clock/run-until", body, 0.0);
/// let answer = desk.ask("GET", "/v1/controllers/1/position", "", 0.0);
/// assert_eq!(answer.status, 200);
/// assert!(answer.body.ends_with(r#""axes":{"A":0,"X":1000,"Y":0,"Z":0}}"#), "{}", answer.body);
/// ```
pub struct Desk {
    pub(crate) controllers: Vec<Served>,
    /// By what a client knows that these are the controllers that it has seen before.
    pub(crate) instance: u64,
    pub(crate) subscription: Option<Subscription>,
    /// How many ms pass at least between two positions, and when they were told last.
    pub(crate) period: Option<f64>,
    pub(crate) told: f64,
    /// The moment up to which everything was heard: nothing is asked before that.
    pub(crate) heard: u64,
}

impl std::fmt::Debug for Desk {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Desk").field("controllers", &self.controllers.len()).finish_non_exhaustive()
    }
}

impl Desk {
    /// The controller that a request is about, where it is now, wherever somebody looks.
    pub(crate) fn present(&mut self, call: &Call) -> Result<&mut Served, Problem> {
        let served = self.looked_at(call)?;
        served.leave_the_past();
        Ok(served)
    }

    /// The controller that a request is about, where somebody looks.
    pub(crate) fn looked_at(&mut self, call: &Call) -> Result<&mut Served, Problem> {
        let place = place_of(call.named("n"), self.controllers.len())?;
        let served = self.controllers.get_mut(place);
        let served = served.ok_or_else(|| no_such("controller", call.named("n")))?;
        served.catch_up(call.moment);
        Ok(served)
    }

    pub(crate) fn instance(&self) -> String {
        self.instance.to_string()
    }

    pub(crate) fn about(&self) -> Value {
        (1..).zip(&self.controllers).map(|(number, served)| served.about(number)).collect()
    }
}
