//! Building expectations as sentences.

use std::time::Duration;

use vimc4_device::{Condition, Names};
use vimc4_language::{known_command, known_error, read_condition};

use super::check::{self, Mistake};
use super::failure::Unmet;
use super::watch::Trial;
use super::{Clause, Expectation, Pattern, Reply, Rule, Stage, Then};
use crate::Journal;

/// The beginning of a sentence. `C` is what it is about: a [`Journal`], or a controller that runs.
#[derive(Clone, Debug)]
#[must_use = "nothing is expected yet"]
pub struct Expect<C>(Draft<C>);

/// An event; how often it happens is still to be said.
#[derive(Clone, Debug)]
#[must_use = "say how often: `once()`, `times(n)`, `at_least(n)`, `at_most(n)` or `never()`"]
pub struct Clauses<C> {
    draft: Draft<C>,
    what: Pattern,
}

/// A command; how often it comes, and perhaps how it is answered, is still to be said.
#[derive(Clone, Debug)]
#[must_use = "say how often: `once()`, `times(n)`, `at_least(n)`, `at_most(n)` or `never()`"]
pub struct CommandClause<C> {
    draft: Draft<C>,
    like: String,
    reply: Option<Reply>,
    within: Option<Duration>,
}

/// A whole sentence.
#[derive(Clone, Debug)]
#[must_use = "nobody looks: end the sentence with `watch()` or `so_far()`"]
pub struct Sentence<C> {
    draft: Draft<C>,
    rule: Option<Rule>,
}

/// Whenever something happens …
#[derive(Clone, Debug)]
#[must_use = "say what is so then: `must_be(…)`, `must_have_been(…)` or `must_follow(…)`"]
pub struct Whenever<C> {
    draft: Draft<C>,
    whenever: Pattern,
}

/// … a state has to have lasted …
#[derive(Clone, Debug)]
#[must_use = "say how long: `for_at_least(span)`"]
pub struct Must<C> {
    draft: Draft<C>,
    whenever: Pattern,
    state: Condition,
}

/// … something has to follow …
#[derive(Clone, Debug)]
#[must_use = "say how soon: `within(span)`"]
pub struct Following<C> {
    draft: Draft<C>,
    whenever: Pattern,
    what: Pattern,
}

/// A condition in a sentence: as text, where positions may be in mm, or as a value.
#[derive(Clone, Debug)]
pub enum ConditionLike {
    /// As people type it.
    Text(String),
    /// As a value.
    Value(Condition),
}

impl From<&str> for ConditionLike {
    fn from(text: &str) -> ConditionLike {
        ConditionLike::Text(text.to_owned())
    }
}

impl From<String> for ConditionLike {
    fn from(text: String) -> ConditionLike {
        ConditionLike::Text(text)
    }
}

impl From<Condition> for ConditionLike {
    fn from(condition: Condition) -> ConditionLike {
        ConditionLike::Value(condition)
    }
}

impl From<&Condition> for ConditionLike {
    fn from(condition: &Condition) -> ConditionLike {
        ConditionLike::Value(condition.clone())
    }
}

/// A target that can be watched from now on.
pub trait Follower {
    /// What watches it.
    type Watching;

    /// Watches from now on, unless the sentence has a mistake.
    fn watch(self, expected: Result<Expectation, Mistake>, names: &Names) -> Self::Watching;
}

/// A target with a past that can be checked.
pub trait Looker {
    /// The result of the check.
    type Outcome;

    /// Looks at what has happened so far, unless the sentence has a mistake.
    fn so_far(self, expected: Result<Expectation, Mistake>, names: &Names) -> Self::Outcome;
}

impl Looker for &Journal {
    type Outcome = Result<(), Unmet>;

    fn so_far(self, expected: Result<Expectation, Mistake>, names: &Names) -> Self::Outcome {
        Trial::of(expected?, self, names)
    }
}

impl Journal {
    /// Begins a sentence about what this journal must contain. `names` are those of the device.
    pub fn expect<'a>(&'a self, names: &Names) -> Expect<&'a Journal> {
        Expect::of(self, names.clone())
    }
}

/// What is said so far.
#[derive(Clone, Debug)]
struct Draft<C> {
    of: C,
    names: Names,
    stages: Vec<Stage>,
    mistake: Option<Mistake>,
}

impl<C> Draft<C> {
    fn add(&mut self, what: Pattern, least: u64, most: Option<u64>) {
        let clause = Clause { what, least, most };
        if let Some(mistake) = check::number(&clause, &self.names) {
            self.wrong(mistake);
        }
        match self.stages.last_mut() {
            Some(stage) => stage.clauses.push(clause),
            None => self.begin(None, None, vec![clause]),
        }
    }

    fn begin(&mut self, after: Option<Duration>, within: Option<Duration>, clauses: Vec<Clause>) {
        self.stages.push(Stage { after, within, clauses });
    }

    /// The first mistake is told.
    fn wrong(&mut self, mistake: Mistake) {
        self.mistake.get_or_insert(mistake);
    }

    fn condition(&mut self, when: impl Into<ConditionLike>) -> Condition {
        let condition = match when.into() {
            ConditionLike::Text(text) => read_condition(&text, &self.names).map_err(Mistake::from),
            ConditionLike::Value(condition) => Ok(condition),
        };
        let checked = condition.and_then(|condition| {
            check::condition(&condition, &self.names)?;
            Ok(condition)
        });
        checked.unwrap_or_else(|mistake| {
            self.wrong(mistake);
            Condition::Any(Vec::new())
        })
    }

    fn command(&mut self, like: &str) -> String {
        match known_command(like, &self.names) {
            Ok(Condition::Command { like: Some(known) }) => known,
            Ok(_) => like.to_owned(),
            Err(error) => {
                self.wrong(error.into());
                like.to_owned()
            }
        }
    }
}

/// The first mistake in what is said so far.
macro_rules! mistake {
    ($($part:ident $draft:tt),*) => {$(
        impl<C> $part<C> {
            /// Why what is said so far could never be met. Nothing that is added makes it good again.
            #[must_use]
            pub fn mistake(&self) -> Option<&Mistake> {
                self.$draft.mistake.as_ref()
            }
        }
    )*};
}

mistake!(
    Expect 0, CommandClause draft, Clauses draft, Sentence draft, Whenever draft, Must draft,
    Following draft
);

impl<C> Expect<C> {
    /// Begins a sentence about something, with the names that its device has.
    pub fn of(of: C, names: Names) -> Expect<C> {
        Expect(Draft { of, names, stages: Vec::new(), mistake: None })
    }

    /// A command of this mnemonic, or whose line begins so: `@A`, `@0A5000`. Of isel's commands the
    /// letter alone is enough.
    pub fn command(mut self, like: &str) -> CommandClause<C> {
        let like = self.0.command(like);
        CommandClause { draft: self.0, like, reply: None, within: None }
    }

    /// A condition becomes true: `z < -5mm`, `port 2 bit 0 on`, `answer error 2`, `line 12`. A
    /// state that holds at the beginning counts as becoming true then, and counts again after it
    /// has not held in between.
    pub fn when(mut self, condition: impl Into<ConditionLike>) -> Clauses<C> {
        let condition = self.0.condition(condition);
        Clauses { draft: self.0, what: Pattern::When(condition) }
    }

    /// A condition never becomes true: `z < -5mm and x < 0`.
    pub fn never(self, condition: impl Into<ConditionLike>) -> Sentence<C> {
        self.when(condition).never()
    }

    /// What comes next is complete in these limits after what was before, or after the beginning.
    pub(super) fn stage(mut self, after: Option<Duration>, within: Option<Duration>) -> Expect<C> {
        self.0.begin(after, within, Vec::new());
        self
    }

    /// Whenever a condition becomes true, something holds.
    pub fn whenever(mut self, condition: impl Into<ConditionLike>) -> Whenever<C> {
        let whenever = Pattern::When(self.0.condition(condition));
        Whenever { draft: self.0, whenever }
    }
}

impl<C> CommandClause<C> {
    /// It is answered with this text, without the end of the line.
    pub fn answered(self, text: impl Into<String>) -> CommandClause<C> {
        CommandClause { reply: Some(Reply::Text(text.into())), ..self }
    }

    /// It is answered with anything.
    pub(super) fn answered_at_all(self) -> CommandClause<C> {
        CommandClause { reply: Some(Reply::Any), ..self }
    }

    /// It is answered with an error.
    pub fn refused(self) -> CommandClause<C> {
        CommandClause { reply: Some(Reply::Error(None)), ..self }
    }

    /// It is answered with this error: `2`, `E09`, or the number in it.
    pub fn refused_with(mut self, code: &str) -> CommandClause<C> {
        if let Err(error) = known_error(Some(code), &self.draft.names) {
            self.draft.wrong(error.into());
        }
        CommandClause { reply: Some(Reply::Error(Some(code.to_owned()))), ..self }
    }

    /// It is answered within this time after it has begun.
    pub fn within(self, span: Duration) -> CommandClause<C> {
        let reply = self.reply.or(Some(Reply::Any));
        CommandClause { reply, within: Some(span), ..self }
    }

    pub(super) fn clauses(self) -> Clauses<C> {
        let CommandClause { draft, like, reply, within } = self;
        Clauses { draft, what: Pattern::Command { like, reply, within } }
    }

    /// Exactly once.
    pub fn once(self) -> Sentence<C> {
        self.clauses().once()
    }

    /// Exactly this many times.
    pub fn times(self, count: u64) -> Sentence<C> {
        self.clauses().times(count)
    }

    /// This many times or more.
    pub fn at_least(self, count: u64) -> Sentence<C> {
        self.clauses().at_least(count)
    }

    /// This many times or fewer.
    pub fn at_most(self, count: u64) -> Sentence<C> {
        self.clauses().at_most(count)
    }

    /// Not at all.
    pub fn never(self) -> Sentence<C> {
        self.clauses().never()
    }
}

impl<C> Clauses<C> {
    /// Exactly once.
    pub fn once(self) -> Sentence<C> {
        self.times(1)
    }

    /// Exactly this many times.
    pub fn times(self, count: u64) -> Sentence<C> {
        self.number(count, Some(count))
    }

    /// This many times or more.
    pub fn at_least(self, count: u64) -> Sentence<C> {
        self.number(count, None)
    }

    /// This many times or fewer.
    pub fn at_most(self, count: u64) -> Sentence<C> {
        self.number(0, Some(count))
    }

    /// Not at all.
    pub fn never(self) -> Sentence<C> {
        self.times(0)
    }

    pub(super) fn number(mut self, least: u64, most: Option<u64>) -> Sentence<C> {
        self.draft.add(self.what, least, most);
        Sentence { draft: self.draft, rule: None }
    }
}

impl<C> Clauses<C> {
    /// This in words, if it is not a state but happens in one moment.
    pub(super) fn happening(&self) -> Option<String> {
        let happens = match &self.what {
            Pattern::When(condition) => condition.has_happenings(),
            Pattern::Command { .. } => true,
        };
        (happens && self.draft.mistake.is_none()).then(|| self.what.in_words(&self.draft.names))
    }

    /// Whenever this happens, something holds.
    pub(super) fn whenever(self) -> Whenever<C> {
        Whenever { draft: self.draft, whenever: self.what }
    }
}

impl<C> Whenever<C> {
    /// This follows, in the same moment or after it.
    pub(super) fn must_follow_what(mut self, what: Clauses<C>) -> Following<C> {
        if let Some(mistake) = what.draft.mistake {
            self.draft.wrong(mistake);
        }
        Following { draft: self.draft, whenever: self.whenever, what: what.what }
    }

    /// This state holds at that moment.
    pub fn must_be(self, state: impl Into<ConditionLike>) -> Sentence<C> {
        self.must_have_been(state).for_at_least(Duration::ZERO)
    }

    /// This state has held for some time.
    pub fn must_have_been(mut self, state: impl Into<ConditionLike>) -> Must<C> {
        let state = self.draft.condition(state);
        if state.has_happenings() {
            let text = self.draft.names.write(&state).to_string();
            let follows = "say `must_follow` for what comes after";
            self.draft.wrong(Mistake::of_happening(&text, follows));
        }
        Must { draft: self.draft, whenever: self.whenever, state }
    }

    /// Something else becomes true, in the same moment or after it.
    pub fn must_follow(mut self, condition: impl Into<ConditionLike>) -> Following<C> {
        let what = Pattern::When(self.draft.condition(condition));
        Following { draft: self.draft, whenever: self.whenever, what }
    }

    /// A command that begins with this text is sent, in the same moment or after it.
    pub fn must_follow_command(mut self, like: &str) -> Following<C> {
        let like = self.draft.command(like);
        let what = Pattern::Command { like, reply: None, within: None };
        Following { draft: self.draft, whenever: self.whenever, what }
    }
}

impl<C> Must<C> {
    /// At least this long.
    pub fn for_at_least(self, span: Duration) -> Sentence<C> {
        let Must { draft, whenever, state } = self;
        let rule = Rule { whenever, then: Then::Held { state, span }, if_at_all: false };
        Sentence { draft, rule: Some(rule) }
    }
}

impl<C> Following<C> {
    /// No later than this time after it.
    pub fn within(self, span: Duration) -> Sentence<C> {
        let Following { draft, whenever, what } = self;
        let then = Then::Follows { what, within: span };
        Sentence { draft, rule: Some(Rule { whenever, then, if_at_all: false }) }
    }
}

impl<C> Sentence<C> {
    /// What comes next happens after all this.
    pub fn then(self) -> Expect<C> {
        self.next(None, None)
    }

    /// What comes next happens after all this, and no later than this time after it.
    pub fn then_within(self, span: Duration) -> Expect<C> {
        self.next(None, Some(span))
    }

    /// What comes next happens after all this, and no sooner than this time after it.
    pub fn then_after(self, span: Duration) -> Expect<C> {
        self.next(Some(span), None)
    }

    /// What comes next happens before, between or after what was named since the last `then`.
    pub fn and(mut self) -> Expect<C> {
        self.end_rule();
        Expect(self.draft)
    }

    /// The rule is met too if what it is about never happens.
    pub fn if_at_all(mut self) -> Sentence<C> {
        match &mut self.rule {
            Some(rule) => rule.if_at_all = true,
            None => self.draft.wrong(Mistake::new(
                "`if_at_all` is for `whenever`; of anything else say `at_most(n)`".to_owned(),
            )),
        }
        self
    }

    fn next(mut self, after: Option<Duration>, within: Option<Duration>) -> Expect<C> {
        self.end_rule();
        self.draft.begin(after, within, Vec::new());
        Expect(self.draft)
    }

    fn end_rule(&mut self) {
        if self.rule.is_some() {
            self.draft.wrong(Mistake::new(
                "a sentence with `whenever` is whole; begin another one for what else is expected"
                    .to_owned(),
            ));
        }
    }

    /// The expectation, as a value.
    ///
    /// # Errors
    ///
    /// If it could never be met.
    pub fn ready(self) -> Result<Expectation, Mistake> {
        let (_, expected, _) = self.split();
        expected
    }

    fn split(self) -> (C, Result<Expectation, Mistake>, Names) {
        let Sentence { mut draft, rule } = self;
        if rule.is_some() && !draft.stages.is_empty() {
            draft.wrong(Mistake::new(
                "a sentence with `whenever` has nothing before it; begin another one for what else is \
                 expected"
                    .to_owned(),
            ));
        }
        let Draft { of, names, stages, mistake } = draft;
        let expected = match (mistake, rule) {
            (Some(mistake), _) => Err(mistake),
            (None, Some(rule)) => Ok(Expectation::Rule(Box::new(rule))),
            (None, None) => Ok(Expectation::Order(stages)),
        };
        (of, expected, names)
    }
}

impl<C: Follower> Sentence<C> {
    /// Watches from now on. The caller must ask the returned watch for the outcome.
    pub fn watch(self) -> C::Watching {
        let (of, expected, names) = self.split();
        of.watch(expected, &names)
    }
}

impl<C: Looker> Sentence<C> {
    /// Looks at everything that has happened so far.
    pub fn so_far(self) -> C::Outcome {
        let (of, expected, names) = self.split();
        of.so_far(expected, &names)
    }
}
