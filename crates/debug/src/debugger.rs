//! The debugger.

use std::collections::BTreeMap;
use std::num::NonZeroU64;
use std::ops::ControlFlow;

use serde_json::Value;
use vimc4_catalogue::Controller;
use vimc4_device::{CommandNumber, Condition, Device, Kinds, Line, Names, Time, TimedInput};
use vimc4_language::{known_error, read_condition};
use vimc4_session::BreakpointId;
use vimc4_timeline::{BranchId, History, Moment, Place};

use crate::breakpoint::{Breakpoint, Options, Trigger};
use crate::differences::Differences;
use crate::feed::Standing;
use crate::reel::Unread;
use crate::walk::is_in_program;
use crate::{DebugError, Expression, Feed, Field, Piece, Source, Unit, Variable, Wired};

/// A controller, its history, and the present moment in it.
///
/// Every walk moves the present and returns where and why it stopped: a [`Stop`](crate::Stop). All
/// questions about the controller concern the present. An input that is given in the past begins a
/// branch.
///
/// Long walks ask `progress` every few milliseconds whether to go on.
///
/// ```
/// use std::ops::ControlFlow;
/// use vimc4_debug::{Debugger, Depth, Reason, Unit, Way};
/// use vimc4_device::Input;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let (model, machine) = (vimc4_catalogue::model("imc4")?, vimc4_catalogue::machine("bench")?);
/// let mut debugger = Debugger::new(vimc4_catalogue::bare(&model, &machine, &[])?);
/// let go_on = &mut |_| ControlFlow::Continue(());
/// debugger.give(Input::Bytes(b"@01\r@0A1000,900\r"));
/// assert_eq!(debugger.go(Way::Forward, None, go_on).why, Reason::Rest);
///
/// // In the middle of the motion.
/// let condition = vimc4_language::read_condition("x = 400", debugger.names())?;
/// assert_eq!(debugger.seek(&condition, Way::Back, go_on).why, Reason::Found);
/// assert_eq!(debugger.evaluate("x")?, 400);
/// debugger.step(Unit::Step, Way::Back, Depth::Into, 10, go_on);
/// assert_eq!(debugger.evaluate("x")?, 390);
///
/// // The same as a line that somebody types.
/// let answer = debugger.execute("print x + 1", go_on)?;
/// assert_eq!(answer.to_string(), "391");
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Debugger {
    pub(crate) history: History<Wired>,
    names: Names,
    pub(crate) source: Option<Source>,
    pub(crate) feed: Option<Feed>,
    /// The commands of each branch that came by hand and not from the source, and when that was given.
    by_hand: BTreeMap<BranchId, Vec<(Moment, CommandNumber)>>,
    /// What is still to be read of a recording.
    pub(crate) unread: Option<Unread>,
    /// Where that recording contradicts the emulation.
    pub(crate) differences: Differences,
    pub(crate) breakpoints: Vec<Breakpoint>,
    /// The number of the breakpoint that was made last.
    last_breakpoint: u64,
    pub(crate) marks: BTreeMap<String, Bookmark>,
    watches: Vec<Expression>,
    pub(crate) stays: bool,
    /// The unit that was named last.
    pub(crate) unit: Option<Unit>,
}

impl Debugger {
    /// Begins with a controller as it is now.
    #[must_use]
    pub fn new(controller: Controller) -> Debugger {
        Debugger::over(History::new(Line::ideal(controller)))
    }

    /// Goes on with a history. All kinds of events are watched from now on.
    #[must_use]
    pub fn over(mut history: History<Wired>) -> Debugger {
        history.watch(Kinds::ALL);
        history.drain();
        Debugger {
            names: Names::of(history.device()),
            history,
            source: None,
            feed: None,
            by_hand: BTreeMap::new(),
            unread: None,
            differences: Differences::default(),
            breakpoints: Vec::new(),
            last_breakpoint: 0,
            marks: BTreeMap::new(),
            watches: Vec::new(),
            stays: false,
            unit: None,
        }
    }

    /// The commands come from a text.
    #[must_use]
    pub fn with_source(mut self, source: Source) -> Debugger {
        self.source = Some(source);
        self
    }

    /// No walk goes beyond the end of the present history and later inputs: a recording is looked
    /// at and not continued.
    pub fn stay_within(&mut self, stays: bool) {
        self.stays = stays;
    }

    /// The history.
    #[must_use]
    pub fn history(&self) -> &History<Wired> {
        &self.history
    }

    /// The history, to be walked by other means.
    pub fn history_mut(&mut self) -> &mut History<Wired> {
        &mut self.history
    }

    /// The controller at the present.
    #[must_use]
    pub fn device(&self) -> &Controller {
        self.line().device()
    }

    /// The controller at the present, with its line.
    #[must_use]
    pub fn line(&self) -> &Wired {
        self.history.device()
    }

    /// The present.
    #[must_use]
    pub fn place(&self) -> Place {
        self.history.present()
    }

    /// The present time.
    #[must_use]
    pub fn now(&self) -> Time {
        self.history.now()
    }

    /// The names of axes and signals.
    #[must_use]
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// The text that the commands come from, if one was handed in.
    #[must_use]
    pub fn source(&self) -> Option<&Source> {
        self.source.as_ref()
    }

    /// Adds a host that continues whenever the controller has done what it was told, so that a walk
    /// ends only when the host does. On a branch the host continues from where the branch parted.
    #[must_use]
    pub fn with_feed(mut self, feed: Feed) -> Debugger {
        self.feed = Some(feed);
        self
    }

    /// The host, if there is one.
    #[must_use]
    pub fn feed(&self) -> Option<&Feed> {
        self.feed.as_ref()
    }

    /// At the end of what the host does comes this as well.
    pub fn then(&mut self, piece: Piece) {
        if let Some(feed) = &mut self.feed {
            feed.then(piece);
        }
    }

    /// What the host asks or waits for at the present, if that holds it up.
    #[must_use]
    pub fn waits(&self) -> Option<String> {
        self.feed.as_ref()?.waits(&self.history)
    }

    /// Somebody answers what the host asks at the present, so that the next walk goes on. Says whether it
    /// asked anything: what it only waits for is not changed by an answer.
    pub fn answer(&mut self) -> bool {
        self.feed.as_mut().is_some_and(|feed| feed.is_answered(&self.history))
    }

    /// What a step is unless a unit is named: a line of the stored program where that runs, or where the host
    /// only starts it; elsewhere a command.
    pub(crate) fn usual_unit(&self) -> Unit {
        let starts = self.feed.as_ref().is_some_and(|feed| feed.only_starts(&self.history));
        let is_line = starts || is_in_program(self.device());
        self.unit.unwrap_or(if is_line { Unit::Line } else { Unit::Command })
    }

    /// The text that the commands come from.
    pub fn set_source(&mut self, source: Option<Source>) {
        self.source = source;
    }

    // --- what came by hand ---

    /// Whether commands that come by hand have to be told from those of the source.
    pub(crate) fn heeds_hands(&self) -> bool {
        self.source.is_some() && self.feed.is_some()
    }

    /// Bytes come by hand that no line of the source is of: so many commands get numbers of their own,
    /// behind that of the command that was executed last.
    pub(crate) fn keep_by_hand(&mut self, bytes: &[u8], last: u64) {
        let present = self.place();
        let own = self.by_hand.entry(present.branch).or_default();
        let kept = own.last().map_or(0, |(_, number)| number.0.get());
        let lines = bytes.split(|byte| matches!(byte, b'\r' | b'\n' | b';'));
        let count = lines.filter(|line| !line.trim_ascii().is_empty()).count() as u64;
        let first = last.max(kept) + 1;
        let numbers = (first..first + count).filter_map(NonZeroU64::new);
        own.extend(numbers.map(|number| (present.moment, CommandNumber(number))));
        self.find_by_hand();
    }

    /// The source heeds what came by hand on the way of the present, and nothing else.
    pub(crate) fn find_by_hand(&mut self) {
        let Some(source) = self.source.as_mut().filter(|_| !self.by_hand.is_empty()) else {
            return;
        };
        source.by_hand.clear();
        let branches: Vec<_> = self.history.branches().collect();
        let mut way = Some((self.history.heading(), None));
        while let Some((branch, limit)) = way {
            let own = self.by_hand.get(&branch).into_iter().flatten();
            let own = own.filter(|(at, _)| limit.is_none_or(|limit| *at < limit));
            source.by_hand.extend(own.map(|(_, number)| *number));
            let parted = branches.iter().find(|own| own.id == branch).and_then(|own| own.parted);
            way = parted.map(|place| (place.branch, Some(place.moment)));
        }
        source.by_hand.sort_unstable();
        source.by_hand.dedup();
    }

    // --- what is done to the controller ---

    /// Goes to the end of the branch and on to the time of an input, and gives that input: the
    /// history follows a controller that runs elsewhere.
    pub fn follow(&mut self, TimedInput { at, input }: &TimedInput) {
        if !self.history.is_at_end() {
            let heading = self.history.heading();
            self.history.go_to_end(heading);
        }
        self.history.run_to(*at);
        self.history.give(input.as_input());
        self.history.run_to(*at);
        self.history.drain();
    }

    /// Changes the value of a field of the state, which begins a branch unless it is the value already.
    ///
    /// # Errors
    ///
    /// If the field cannot be set, or does not take this value.
    pub fn set_variable(&mut self, path: &str, value: Value) -> Result<(), DebugError> {
        let field = Field::parse(path, self.device())?;
        let mut state = self.line().state();
        state.device = field.put(self.device(), value.clone())?;
        if state == self.line().state() {
            return Ok(());
        }
        self.history.fork(format!("{path} = {value}"), state);
        Ok(())
    }

    // --- breakpoints ---

    /// All of them, in order of their numbers.
    #[must_use]
    pub fn breakpoints(&self) -> &[Breakpoint] {
        &self.breakpoints
    }

    /// Adds one.
    pub fn add_breakpoint(&mut self, trigger: Trigger, options: Options) -> BreakpointId {
        self.last_breakpoint += 1;
        let id = BreakpointId(self.last_breakpoint);
        self.breakpoints.push(Breakpoint::new(id, trigger, options));
        id
    }

    /// Adds one [of its own](BreakpointId::INTERNAL), which the caller removes again.
    pub fn await_trigger(&mut self, trigger: Trigger) -> BreakpointId {
        let id = BreakpointId::INTERNAL;
        self.breakpoints.push(Breakpoint::new(id, trigger, Options::default()));
        id
    }

    /// Removes one, and says whether there was one of this number.
    pub fn remove_breakpoint(&mut self, id: BreakpointId) -> bool {
        let before = self.breakpoints.len();
        self.breakpoints.retain(|breakpoint| breakpoint.id != id);
        self.breakpoints.len() < before
    }

    /// Removes all, and begins counting anew.
    pub fn clear_breakpoints(&mut self) {
        self.breakpoints.clear();
        self.last_breakpoint = 0;
    }

    /// Enables or disables a breakpoint, and says whether there is one of this number.
    pub fn enable_breakpoint(&mut self, id: BreakpointId, is_enabled: bool) -> bool {
        let found = self.breakpoints.iter_mut().find(|breakpoint| breakpoint.id == id);
        found.map(|breakpoint| breakpoint.is_enabled = is_enabled).is_some()
    }

    /// Parses what to wait for: `change FIELD`, a condition, a line of the file, or an expression.
    ///
    /// # Errors
    ///
    /// If the text is none of these.
    pub fn read_trigger(&self, text: &str) -> Result<Trigger, DebugError> {
        let text = text.trim();
        if let Some(field) = text.strip_prefix("change ") {
            return Ok(Trigger::Change(Field::parse(field, self.device())?));
        }
        if let (Some(line), true) = (text.strip_prefix("line "), self.source.is_some())
            && let Ok(line) = line.trim().parse()
        {
            return self.line_trigger(line);
        }
        match read_condition(text, &self.names) {
            Ok(condition) => Ok(Trigger::Condition(condition)),
            Err(error) => match Expression::parse(text, self.device()) {
                Ok(expression) if expression.is_claim() => Ok(Trigger::Expression(expression)),
                _ => Err(DebugError::new(error.to_string())),
            },
        }
    }

    /// The names of a built-in model, with what can happen there at all.
    fn names_of_model(&self) -> Option<Names> {
        let model = vimc4_catalogue::model(&self.device().view(self.now()).model).ok()?;
        Some(model.names(self.device().signals()))
    }

    /// A trigger for a command that begins so. The commands of built-in models are known; one of a model of
    /// the user's own can be any.
    ///
    /// # Errors
    ///
    /// If the text is wrong, or the model has no such command; with those it has.
    pub fn command_trigger(&self, begins: &str) -> Result<Trigger, DebugError> {
        let text = format!("command {begins}");
        match self.names_of_model().map(|names| read_condition(&text, &names)) {
            Some(Err(error)) => Err(DebugError::new(error.to_string())),
            Some(Ok(_)) | None => self.read_trigger(&text),
        }
    }

    /// The replies that are this error. The errors of built-in models are known; one of a model of the
    /// user's own can be any word.
    ///
    /// # Errors
    ///
    /// What would be right, if the model has no such error.
    pub fn error(&self, code: &str) -> Result<Condition, String> {
        if let Some(names) = self.names_of_model() {
            return known_error(Some(code), &names).map_err(|error| error.message());
        }
        match !code.is_empty() && code.chars().all(|c| c.is_ascii_alphanumeric()) {
            true => Ok(Condition::Error { code: Some(code.to_owned()) }),
            false => Err("the code of an error".to_owned()),
        }
    }

    /// The first line, from this one on, of the file that the commands come from, from which a command
    /// comes or at which the host asks the operator.
    #[must_use]
    pub fn line_that_does(&self, line: u32) -> Option<u32> {
        let sends = self.source.as_ref()?.command_at(line).map(|(_, of)| of);
        let asks = self.feed.as_ref().and_then(|feed| feed.asks_from(line));
        sends.into_iter().chain(asks).min()
    }

    /// A trigger for a line, from 1, of the file that the commands come from, or else of the stored
    /// program. A line at which nothing is sent or asked stands for the next one at which something is.
    ///
    /// # Errors
    ///
    /// If nothing is sent or asked at the line or at one after it.
    pub fn line_trigger(&self, line: u32) -> Result<Trigger, DebugError> {
        if line == 0 {
            return Err(DebugError::new(NO_LINE));
        }
        let Some(source) = &self.source else {
            return Ok(Trigger::Condition(Condition::Line { line: Some(line) }));
        };
        match self.line_that_does(line) {
            Some(line) => Ok(Trigger::SourceLine(line)),
            None => Err(DebugError::new(format!(
                "no command comes from line {line} of {} or from one after it",
                source.name
            ))),
        }
    }

    // --- values ---

    /// The value of an expression, now.
    ///
    /// # Errors
    ///
    /// If it is none.
    pub fn evaluate(&self, expression: &str) -> Result<Value, DebugError> {
        let expression = Expression::parse(expression, self.device())?;
        expression.value(self.device(), self.now())
    }

    /// Everything that can be seen, and the state, as a tree.
    #[must_use]
    pub fn variables(&self) -> Variable {
        let value = crate::field::tree(self.device());
        Variable { name: String::new(), path: String::new(), value }
    }

    /// The variable at a path of that tree.
    ///
    /// # Errors
    ///
    /// If the path leads nowhere.
    pub fn variable(&self, path: &str) -> Result<Variable, DebugError> {
        let path = path.trim();
        if path.is_empty() {
            return Ok(self.variables());
        }
        let value = Field::parse(path, self.device())?.look(self.device(), self.now())?;
        let name = path.rsplit('.').next().unwrap_or(path).to_owned();
        Ok(Variable { name, path: path.to_owned(), value })
    }

    /// The watched expressions with their present values.
    #[must_use]
    pub fn watches(&self) -> Vec<(Expression, Result<Value, DebugError>)> {
        let value = |expression: &Expression| expression.value(self.device(), self.now());
        self.watches.iter().map(|watch| (watch.clone(), value(watch))).collect()
    }

    /// Watches an expression.
    ///
    /// # Errors
    ///
    /// If it is none.
    pub fn watch(&mut self, expression: &str) -> Result<(), DebugError> {
        self.watches.push(Expression::parse(expression, self.device())?);
        Ok(())
    }

    /// Removes the watch of a number, from 1, and says whether there was one.
    pub fn unwatch(&mut self, number: usize) -> bool {
        let place = number.checked_sub(1).filter(|place| *place < self.watches.len());
        place.map(|place| self.watches.remove(place)).is_some()
    }

    /// A number that stands for the whole state at the present: equal states have equal ones, and others
    /// almost always another. It is the 64-bit FNV-1a of the state as JSON.
    #[must_use]
    pub fn digest(&self) -> u64 {
        // Every state can be written down.
        let written = serde_json::to_vec(&self.device().state()).unwrap_or_default();
        written.iter().fold(0xCBF2_9CE4_8422_2325, |digest, byte| {
            (digest ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3)
        })
    }

    // --- bookmarks ---

    /// The moments with a name.
    #[must_use]
    pub fn marks(&self) -> &BTreeMap<String, Bookmark> {
        &self.marks
    }

    /// Gives the present a name, and returns the moment that had the name before.
    pub fn mark(&mut self, name: impl Into<String>) -> Option<Place> {
        let standing = self.feed.as_ref().map(Feed::standing);
        let mark = Bookmark { place: self.place(), standing };
        self.marks.insert(name.into(), mark).map(|before| before.place)
    }

    /// Forgets a name, and says whether there was one.
    pub fn unmark(&mut self, name: &str) -> bool {
        self.marks.remove(name).is_some()
    }
}

/// A moment with a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bookmark {
    /// Where it is.
    pub place: Place,
    /// What the host asked there, of several questions at one moment, if somebody has seen that.
    pub(crate) standing: Option<Standing>,
}

/// Why line 0 is refused.
pub(crate) const NO_LINE: &str = "there is no line 0; lines are counted from 1";

/// A [`Progress`](vimc4_timeline::Progress) that never cancels.
pub fn uninterrupted(_: Time) -> ControlFlow<()> {
    ControlFlow::Continue(())
}
