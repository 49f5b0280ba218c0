//! The rules of scenarios: how far each has come, and what they hold.

use serde::{Deserialize, Serialize};

use crate::{
    Act, Awaits, Breakpoint, Condition, Deed, Device, Event, FaultNumber, Faulting, Input, Kinds,
    Lasts, MOST_RULES, Names, Output, OwnedInput, Rule, RuleId, RuleNews, RuleStage, RuleView,
    Scenario, ScenarioNumber, SignalId, Time, Trigger,
};

/// So often a rule acts at one instant. Two rules that call each other would never let time go on.
const MOST_AT_ONCE: u32 = 100;

/// The rules of a device, and what they have changed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Rules {
    /// In the order of their scenarios' numbers.
    list: Vec<Begun>,
    /// What is to be set back, in the order in which it was changed.
    held: Vec<Held>,
}

/// A rule that was begun.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Begun {
    id: RuleId,
    rule: Rule,
    stage: Stage,
    #[serde(default)]
    acted: u64,
    /// How often it has acted at an instant.
    #[serde(default)]
    at_once: (Time, u32),
    /// When the device was idle last as it waits for. Between two bytes that take no time it does not
    /// become idle anew.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rested: Option<Time>,
}

/// How far a rule has come.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Stage {
    /// It waits for this one of its cues, which has come so often. A breakpoint is there where the cue is
    /// a condition.
    Waits {
        step: usize,
        met: u32,
        breakpoint: Option<Breakpoint>,
    },
    /// It waits for a time, and then for the cue of this place.
    Pauses {
        until: Time,
        step: usize,
    },
    /// What has to be so while it acts is so.
    IsSo,
    Over,
}

/// Something that a rule has changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Held {
    scenario: ScenarioNumber,
    place: u32,
    /// Which of its acts.
    act: usize,
    change: Change,
    until: Until,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Until {
    /// Its scenario ends, or what has to be so is not.
    End,
    Time(Time),
    Condition(Breakpoint),
}

impl Until {
    /// The end of a change that begins now.
    fn of(lasts: Option<&Lasts>, device: &impl Device) -> Until {
        match lasts {
            None => Until::End,
            Some(Lasts::For(span)) => Until::Time(device.now() + *span),
            Some(Lasts::Until(condition)) if device.holds(condition, [].iter()) => {
                Until::Time(device.now())
            }
            Some(Lasts::Until(condition)) => {
                Until::Condition(Breakpoint::new(device, condition.clone()))
            }
        }
    }
}

/// What was changed, to what, and what was before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Change {
    Signal { signal: SignalId, before: i32, now: i32 },
    Power { before: bool, now: bool },
    Fault(FaultNumber),
}

/// What of a device rules can change, as it will be when the inputs are given that are decided already.
struct Ahead<'d, D: Device> {
    device: &'d D,
    inputs: Vec<OwnedInput>,
    /// Looked up when it is needed first.
    values: Option<Values>,
}

/// The signals, those that have a lasting value with it, and whether the power is on.
struct Values {
    signals: Vec<(SignalId, Option<i32>)>,
    powered: bool,
}

impl<'d, D: Device> Ahead<'d, D> {
    fn new(device: &'d D) -> Self {
        Ahead { device, inputs: Vec::new(), values: None }
    }

    fn values(&mut self) -> &mut Values {
        let device = self.device;
        self.values.get_or_insert_with(|| {
            let view = device.view(device.now());
            let signals = view.signals.iter().map(|signal| (signal.id, signal.value));
            Values { signals: signals.collect(), powered: view.powered }
        })
    }

    fn signal(&mut self, wanted: SignalId) -> Option<i32> {
        self.values().signals.iter().find(|(signal, _)| *signal == wanted)?.1
    }

    fn is_powered(&mut self) -> bool {
        self.values().powered
    }

    fn give(&mut self, input: OwnedInput) {
        match &input {
            OwnedInput::Signal(signal, value) => {
                let known = self.values().signals.iter_mut().find(|(known, _)| known == signal);
                // What has no lasting value has none afterwards either.
                if let Some((_, before @ Some(_))) = known {
                    *before = Some(*value);
                }
            }
            OwnedInput::Power(on) => self.values().powered = *on,
            _ => {}
        }
        self.inputs.push(input);
    }
}

impl Rules {
    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    // --- beginning and ending ---

    /// Whether so many rules of a scenario of this number can begin now.
    pub(super) fn has_room_for(&self, number: ScenarioNumber, rules: usize) -> bool {
        let stay = |begun: &&Begun| begun.id.scenario != number && !self.is_done(begun);
        self.list.iter().filter(stay).count() + rules <= MOST_RULES
    }

    /// Whether nothing is left of a rule that could make a difference.
    fn is_done(&self, begun: &Begun) -> bool {
        begun.stage == Stage::Over && !self.held.iter().any(|held| begun.holds(held))
    }

    /// Begins the rules of a scenario, for which there [is room](Rules::has_room_for); one of that
    /// number ends.
    pub(super) fn begin<D: Device>(
        &mut self,
        number: ScenarioNumber,
        scenario: Scenario,
        device: &D,
        news: &mut Vec<Output>,
    ) -> Vec<OwnedInput> {
        let inputs = self.end(Some(number), device, news);
        self.make_room_for(scenario.rules.len(), device.now(), news);
        let place = self.list.partition_point(|begun| begun.id.scenario < number);
        let single = scenario.rules.len() == 1;
        let begun = scenario.rules.into_iter().enumerate().map(|(nth, rule)| {
            let nth = u32::try_from(nth).unwrap_or(u32::MAX).saturating_add(1);
            let nth = if single { 0 } else { nth };
            let id = RuleId { scenario: number, place: nth, name: rule.name.clone() };
            tell(news, device.now(), &id, RuleNews::Begins);
            let mut begun = Begun {
                id,
                rule,
                stage: Stage::Over,
                acted: 0,
                at_once: (Time::ZERO, 0),
                rested: None,
            };
            begun.start(device);
            begun
        });
        let begun: Vec<Begun> = begun.collect();
        self.list.splice(place..place, begun);
        inputs
    }

    /// Rules that are over give way to so many others, the oldest first.
    fn make_room_for(&mut self, rules: usize, now: Time, news: &mut Vec<Output>) {
        let mut surplus = (self.list.len() + rules).saturating_sub(MOST_RULES);
        for begun in std::mem::take(&mut self.list) {
            if surplus > 0 && self.is_done(&begun) {
                surplus -= 1;
                tell(news, now, &begun.id, RuleNews::Ends);
            } else {
                self.list.push(begun);
            }
        }
    }

    /// Ends the scenario of this number, or all.
    pub(super) fn end<D: Device>(
        &mut self,
        number: Option<ScenarioNumber>,
        device: &D,
        news: &mut Vec<Output>,
    ) -> Vec<OwnedInput> {
        let mut ahead = Ahead::new(device);
        let ends = |scenario: ScenarioNumber| number.is_none_or(|number| number == scenario);
        self.set_back(&mut ahead, |held| ends(held.scenario));
        self.list.retain(|begun| {
            let over = ends(begun.id.scenario);
            if over {
                tell(news, device.now(), &begun.id, RuleNews::Ends);
            }
            !over
        });
        ahead.inputs
    }

    // --- what is waited for ---

    /// The kinds of events in which what rules wait for is seen.
    pub(super) fn kinds(&self) -> Kinds {
        let rules = self.list.iter().flat_map(|begun| begun.rule.conditions());
        rules.fold(Kinds::NONE, |kinds, condition| kinds.and(condition.kinds()))
    }

    /// When the device has to be looked at next.
    pub(super) fn due<D: Device>(&self, device: &D) -> Option<Time> {
        let rules =
            self.list.iter().filter_map(|begun| match (&begun.stage, &begun.rule.trigger) {
                (Stage::Waits { breakpoint, .. }, _) => breakpoint.as_ref()?.next(device),
                (Stage::Pauses { until, .. }, _) => Some(*until),
                (Stage::IsSo, Trigger::While(condition)) => device.leaving(condition),
                (Stage::IsSo | Stage::Over, _) => None,
            });
        let held = self.held.iter().filter_map(|held| match &held.until {
            Until::End => None,
            Until::Time(until) => Some(*until),
            Until::Condition(breakpoint) => breakpoint.next(device),
        });
        rules.chain(held).min().filter(|due| *due != Time::NEVER)
    }

    /// Looks at the device right after a cause or an input with these events, or between two causes.
    /// Says what rules do to it.
    pub(super) fn look<D: Device>(
        &mut self,
        events: &[Event],
        device: &D,
        numbered: &mut FaultNumber,
        news: &mut Vec<Output>,
    ) -> Vec<OwnedInput> {
        let now = device.now();
        let mut ahead = Ahead::new(device);
        // What is over is set back before anything is done anew.
        let mut over: Vec<(ScenarioNumber, u32, usize)> = Vec::new();
        for held in &mut self.held {
            let ends = match &mut held.until {
                Until::End => false,
                Until::Time(until) => *until <= now,
                Until::Condition(breakpoint) => breakpoint.look(device, events.iter()),
            };
            if ends {
                over.push((held.scenario, held.place, held.act));
            }
        }
        for begun in &mut self.list {
            if let (Stage::IsSo, Trigger::While(condition)) = (&begun.stage, &begun.rule.trigger)
                && !device.holds(condition, [].iter())
            {
                begun.await_state(device);
                let RuleId { scenario, place, .. } = begun.id;
                over.extend((0..begun.rule.acts.len()).map(|act| (scenario, place, act)));
            }
        }
        if !over.is_empty() {
            let is_over = |held: &Held| over.contains(&(held.scenario, held.place, held.act));
            for begun in &self.list {
                let mine = |held: &Held| begun.holds(held) && is_over(held);
                if self.held.iter().any(mine) {
                    tell(news, now, &begun.id, RuleNews::SetsBack);
                }
            }
            self.set_back(&mut ahead, is_over);
        }
        let mut acted: Vec<String> = Vec::new();
        for place in 0..self.list.len() {
            self.follow(place, events, &mut ahead, numbered, &mut acted, news);
        }
        // What rules do lets others act, those before them, too.
        let mut seen = 0;
        while let Some(name) = acted.get(seen).cloned() {
            seen += 1;
            for place in 0..self.list.len() {
                let Some(begun) = self.list.get_mut(place) else { continue };
                if begun.hears(&name, device) {
                    self.act(place, &mut ahead, numbered, &mut acted, news);
                    self.follow(place, &[], &mut ahead, numbered, &mut acted, news);
                }
            }
        }
        ahead.inputs
    }

    /// Lets a rule see these events, and what is so.
    fn follow<D: Device>(
        &mut self,
        place: usize,
        events: &[Event],
        ahead: &mut Ahead<'_, D>,
        numbered: &mut FaultNumber,
        acted: &mut Vec<String>,
        news: &mut Vec<Output>,
    ) {
        let mut rest = events;
        while let Some(begun) = self.list.get_mut(place)
            && begun.comes(&mut rest, ahead.device)
        {
            self.act(place, ahead, numbered, acted, news);
        }
    }

    // --- what is done ---

    /// A rule acts, and waits anew.
    fn act<D: Device>(
        &mut self,
        place: usize,
        ahead: &mut Ahead<'_, D>,
        numbered: &mut FaultNumber,
        acted: &mut Vec<String>,
        news: &mut Vec<Output>,
    ) {
        let Some(begun) = self.list.get_mut(place) else { return };
        let now = ahead.device.now();
        let (id, acts) = (begun.id.clone(), begun.rule.acts.clone());
        begun.acted += 1;
        begun.at_once = match begun.at_once {
            (at, times) if at == now => (at, times + 1),
            _ => (now, 1),
        };
        let runs_away = begun.at_once.1 > MOST_AT_ONCE;
        if runs_away {
            begun.stage = Stage::Over;
            tell(news, now, &id, RuleNews::Runaway);
            return;
        }
        begun.wait_anew(ahead.device);
        acted.extend(id.name.clone());
        let names = Names::of(ahead.device);
        let (mut done, mut faults, mut failed) = (Vec::new(), Vec::new(), Vec::new());
        for (nth, act) in acts.iter().enumerate() {
            match act.deed.inputs(names.signals()) {
                Ok(inputs) => {
                    faults.extend(self.change(&id, nth, act, inputs, ahead, numbered));
                    done.push(names.write_deed(&act.deed));
                }
                Err(error) => failed.push((names.write_deed(&act.deed), error.to_string())),
            }
        }
        if !done.is_empty() || failed.is_empty() {
            tell(news, now, &id, RuleNews::Acts(done, faults));
        }
        for (deed, why) in failed {
            tell(news, now, &id, RuleNews::Cannot(deed, why));
        }
    }

    /// Gives the inputs of an act, and remembers what it changes. Returns the faults that begin.
    fn change<D: Device>(
        &mut self,
        id: &RuleId,
        nth: usize,
        act: &Act,
        mut inputs: Vec<OwnedInput>,
        ahead: &mut Ahead<'_, D>,
        numbered: &mut FaultNumber,
    ) -> Vec<FaultNumber> {
        if act.lasts.is_some() && matches!(act.deed, Deed::Press(_)) {
            // Who presses a button for a time holds it.
            inputs.truncate(1);
        }
        let device = ahead.device;
        let until = Until::of(act.lasts.as_ref(), device);
        let mine =
            |held: &Held| (held.scenario, held.place, held.act) == (id.scenario, id.place, nth);
        let mut changes: Vec<Change> = Vec::new();
        let mut begun = Vec::new();
        for input in inputs {
            let input = match input {
                OwnedInput::Signal(signal, now) => {
                    if let Some(before) = ahead.signal(signal) {
                        let known = changes.iter_mut().find_map(|change| match change {
                            Change::Signal { signal: known, now, .. } if *known == signal => {
                                Some(now)
                            }
                            _ => None,
                        });
                        match known {
                            Some(known) => *known = now,
                            None => changes.push(Change::Signal { signal, before, now }),
                        }
                    }
                    OwnedInput::Signal(signal, now)
                }
                OwnedInput::Power(now) => {
                    changes.push(Change::Power { before: ahead.is_powered(), now });
                    OwnedInput::Power(now)
                }
                OwnedInput::Fault(Faulting::Begin(number, fault)) => {
                    // What it began before is over with that.
                    self.held.retain(|held| match held.change {
                        Change::Fault(number) if mine(held) => {
                            ahead.inputs.push(OwnedInput::Fault(Faulting::End(number)));
                            false
                        }
                        _ => true,
                    });
                    let number = match number {
                        FaultNumber::NEXT => FaultNumber(numbered.0.saturating_add(1)),
                        number => number,
                    };
                    *numbered = (*numbered).max(number);
                    changes.push(Change::Fault(number));
                    begun.push(number);
                    OwnedInput::Fault(Faulting::Begin(number, fault))
                }
                other => other,
            };
            ahead.give(input);
        }
        for change in changes {
            let same = |held: &Held| held.change.is_of_same(&change);
            let latest = self.held.iter().rposition(same);
            let again = self.held.iter().position(|held| mine(held) && same(held));
            if let Some(held) =
                again.filter(|_| again == latest).and_then(|at| self.held.get_mut(at))
            {
                // What was before it held this the first time is what is set back.
                held.change.takes(&change);
                held.until = until.clone();
                continue;
            }
            if let Some(again) = again {
                // It is above the others from now on.
                let before = self.held.remove(again);
                self.close_gap(again, &before.change);
            }
            // As long as another holds this, it is held even if it was so already.
            if change.is_one() || latest.is_some() {
                let RuleId { scenario, place, .. } = *id;
                self.held.push(Held { scenario, place, act: nth, change, until: until.clone() });
            }
        }
        begun
    }

    /// Something that was held up to now, below those from this place on, is not any more. Returns
    /// whether another holds the same: what was before it, it will be after that one.
    fn close_gap(&mut self, place: usize, gone: &Change) -> bool {
        let above = self.held.iter_mut().skip(place).find(|held| held.change.is_of_same(gone));
        match (above.map(|held| &mut held.change), gone) {
            (Some(Change::Signal { before, .. }), Change::Signal { before: below, .. }) => {
                *before = *below;
                true
            }
            (Some(Change::Power { before, .. }), Change::Power { before: below, .. }) => {
                *before = *below;
                true
            }
            _ => false,
        }
    }

    /// Somebody else does something to the device: it stays, whatever rules have held there.
    pub(super) fn yield_to(&mut self, input: &Input<'_>) {
        self.held.retain(|held| match (&held.change, input) {
            (Change::Signal { signal, .. }, Input::Signal(given, _)) => signal != given,
            (Change::Power { .. }, Input::Power(_)) => false,
            _ => true,
        });
    }

    /// Sets back what is held and meant, the latest first, so far as it still is what it was set to.
    fn set_back<D: Device>(&mut self, ahead: &mut Ahead<'_, D>, is_meant: impl Fn(&Held) -> bool) {
        let mut signals: Vec<(SignalId, i32)> = Vec::new();
        let mut power = None;
        for place in (0..self.held.len()).rev() {
            if !self.held.get(place).is_some_and(&is_meant) {
                continue;
            }
            let Held { change, .. } = self.held.remove(place);
            if self.close_gap(place, &change) {
                continue;
            }
            match change {
                Change::Signal { signal, before, now } => {
                    let known = signals.iter_mut().find(|(known, _)| *known == signal);
                    match known {
                        Some((_, value)) if *value == now => *value = before,
                        None if ahead.signal(signal) == Some(now) => signals.push((signal, before)),
                        _ => {}
                    }
                }
                Change::Power { before, now } => {
                    if power.unwrap_or_else(|| ahead.is_powered()) == now {
                        power = Some(before);
                    }
                }
                Change::Fault(number) => {
                    ahead.give(OwnedInput::Fault(Faulting::End(number)));
                }
            }
        }
        for (signal, value) in signals {
            if ahead.signal(signal) != Some(value) {
                ahead.give(OwnedInput::Signal(signal, value));
            }
        }
        if let Some(on) = power.filter(|on| *on != ahead.is_powered()) {
            ahead.give(OwnedInput::Power(on));
        }
    }

    // --- looking ---

    pub(super) fn views(&self) -> impl Iterator<Item = RuleView> {
        self.list.iter().map(|begun| {
            let holds = self.held.iter().any(|held| begun.holds(held));
            let stage = match &begun.stage {
                _ if holds => RuleStage::Holds,
                Stage::Over => RuleStage::Over,
                Stage::IsSo => RuleStage::Holds,
                Stage::Waits { .. } | Stage::Pauses { .. } => RuleStage::Waits,
            };
            let (id, rule) = (begun.id.clone(), begun.rule.clone());
            RuleView { id, rule, stage, acted: begun.acted }
        })
    }
}

impl Change {
    /// Whether anything is otherwise than before.
    fn is_one(&self) -> bool {
        match self {
            Change::Signal { before, now, .. } => before != now,
            Change::Power { before, now } => before != now,
            Change::Fault(_) => true,
        }
    }

    /// Whether the other is a change of the same thing.
    fn is_of_same(&self, other: &Change) -> bool {
        match (self, other) {
            (Change::Signal { signal, .. }, Change::Signal { signal: same, .. }) => signal == same,
            (Change::Power { .. }, Change::Power { .. }) => true,
            _ => false,
        }
    }

    /// The same thing is changed again.
    fn takes(&mut self, later: &Change) {
        match (self, later) {
            (Change::Signal { now, .. }, Change::Signal { now: later, .. }) => *now = *later,
            (Change::Power { now, .. }, Change::Power { now: later, .. }) => *now = *later,
            _ => {}
        }
    }
}

impl Rule {
    /// All conditions in it.
    fn conditions(&self) -> impl Iterator<Item = &Condition> {
        let (cues, state) = match &self.trigger {
            Trigger::When(cues) => (cues.as_slice(), None),
            Trigger::While(condition) => ([].as_slice(), Some(condition)),
            Trigger::At(_) | Trigger::Every { .. } => ([].as_slice(), None),
        };
        let cues = cues.iter().filter_map(|cue| match &cue.awaits {
            Awaits::Condition(condition) => Some(condition),
            Awaits::Rule(_) | Awaits::Time(_) => None,
        });
        let ends = self.acts.iter().filter_map(|act| match &act.lasts {
            Some(Lasts::Until(condition)) => Some(condition),
            _ => None,
        });
        cues.chain(state).chain(ends)
    }
}

impl Begun {
    fn holds(&self, held: &Held) -> bool {
        (held.scenario, held.place) == (self.id.scenario, self.id.place)
    }

    /// Waits for the first time.
    fn start<D: Device>(&mut self, device: &D) {
        let now = device.now();
        if self.rule.times == Some(0) {
            self.stage = Stage::Over;
            return;
        }
        match &self.rule.trigger {
            Trigger::At(time) => self.stage = Stage::Pauses { until: now + *time, step: 0 },
            Trigger::Every { first, .. } => {
                self.stage = Stage::Pauses { until: now + *first, step: 0 };
            }
            Trigger::When(_) => self.wait_for(0, device, true),
            Trigger::While(condition) => {
                if device.holds(condition, [].iter()) {
                    self.stage = Stage::Pauses { until: now, step: 0 };
                } else {
                    self.await_state(device);
                }
            }
        }
    }

    /// Waits until what has to be so becomes so.
    fn await_state<D: Device>(&mut self, device: &D) {
        let Trigger::While(condition) = &self.rule.trigger else { return };
        self.stage = match self.has_acted_enough() {
            true => Stage::Over,
            false => {
                let breakpoint = Some(Breakpoint::new(device, condition.clone()));
                Stage::Waits { step: 0, met: 0, breakpoint }
            }
        };
    }

    fn has_acted_enough(&self) -> bool {
        self.rule.times.is_some_and(|times| self.acted >= times)
    }

    /// Waits for a cue, from one of them on. What `is_so` already has come, if that counts.
    fn wait_for<D: Device>(&mut self, from: usize, device: &D, counts: bool) {
        let Trigger::When(cues) = &self.rule.trigger else { return };
        let mut step = from;
        loop {
            let Some(cue) = cues.get(step) else {
                // All have come: it acts when it is looked at next.
                self.stage = Stage::Pauses { until: device.now(), step };
                return;
            };
            let stage = match &cue.awaits {
                Awaits::Time(span) => Stage::Pauses { until: device.now() + *span, step: step + 1 },
                Awaits::Rule(_) => Stage::Waits { step, met: 0, breakpoint: None },
                Awaits::Condition(condition) => {
                    let is_so = (counts || step > from) && device.holds(condition, [].iter());
                    if is_so && cue.times <= 1 {
                        if is_rest(condition) {
                            self.rested = Some(device.now());
                        }
                        step += 1;
                        continue;
                    }
                    let breakpoint = Some(Breakpoint::new(device, condition.clone()));
                    Stage::Waits { step, met: 0, breakpoint }
                }
            };
            self.stage = stage;
            return;
        }
    }

    /// It has acted: what it waits for has to come anew.
    fn wait_anew<D: Device>(&mut self, device: &D) {
        let now = device.now();
        if matches!(self.rule.trigger, Trigger::While(_)) {
            self.stage = Stage::IsSo;
            return;
        }
        if self.has_acted_enough() {
            self.stage = Stage::Over;
            return;
        }
        match &self.rule.trigger {
            Trigger::Every { span, .. } => {
                let before = match self.stage {
                    Stage::Pauses { until, .. } => until,
                    _ => now,
                };
                let until = before + (*span).max(Rule::SHORTEST);
                self.stage = Stage::Pauses { until, step: 0 };
            }
            Trigger::When(cues) if !cues.is_empty() => self.wait_for(0, device, false),
            _ => self.stage = Stage::Over,
        }
    }

    /// One of its cues has come: it waits for the next. Says whether it was the last one.
    fn has_come<D: Device>(&mut self, step: usize, device: &D) -> bool {
        let Trigger::When(cues) = &self.rule.trigger else { return true };
        if step >= cues.len() {
            return true;
        }
        self.wait_for(step, device, true);
        matches!(self.stage, Stage::Pauses { step, .. } if step >= self.length())
            && matches!(self.stage, Stage::Pauses { until, .. } if until <= device.now())
    }

    fn length(&self) -> usize {
        match &self.rule.trigger {
            Trigger::When(cues) => cues.len(),
            _ => 0,
        }
    }

    /// Looks at the device right after these events, each of which can be only one of the things that it
    /// waits for, one after the other. Says whether all of them have come.
    fn comes<D: Device>(&mut self, rest: &mut &[Event], device: &D) -> bool {
        let now = device.now();
        loop {
            match &mut self.stage {
                Stage::Pauses { until, .. } if *until > now => return false,
                Stage::Pauses { step, .. } => {
                    let step = *step;
                    if step >= self.length() || self.has_come(step, device) {
                        return true;
                    }
                }
                Stage::Waits { step, met, breakpoint: Some(breakpoint) } => {
                    if !breakpoint.look(device, rest.iter()) {
                        return false;
                    }
                    if is_rest(breakpoint.condition())
                        && self.rested.replace(now).is_some_and(|rested| rested == now)
                    {
                        return false;
                    }
                    let is_there = |length: &usize| {
                        device.holds(breakpoint.condition(), rest.iter().take(*length))
                    };
                    let used = (0..=rest.len()).find(is_there).unwrap_or(rest.len());
                    *rest = rest.get(used..).unwrap_or_default();
                    *met += 1;
                    let (step, met) = (*step, *met);
                    let wanted = match &self.rule.trigger {
                        Trigger::When(cues) => cues.get(step).map_or(1, |cue| cue.times),
                        _ => 1,
                    };
                    if met >= wanted && self.has_come(step + 1, device) {
                        return true;
                    }
                    if rest.is_empty() {
                        return false;
                    }
                }
                Stage::Waits { .. } | Stage::IsSo | Stage::Over => return false,
            }
        }
    }

    /// A rule of this name has acted. Says whether all that it waits for has come with that.
    fn hears<D: Device>(&mut self, name: &str, device: &D) -> bool {
        let Stage::Waits { step, met, breakpoint: None } = &mut self.stage else { return false };
        let Trigger::When(cues) = &self.rule.trigger else { return false };
        let Some(cue) = cues.get(*step) else { return false };
        if !matches!(&cue.awaits, Awaits::Rule(wanted) if wanted == name) {
            return false;
        }
        *met += 1;
        let next = *step + 1;
        *met >= cue.times && self.has_come(next, device)
    }
}

/// Whether this is a state in which the device rests.
fn is_rest(condition: &Condition) -> bool {
    let mentions = |parts: &[Condition]| parts.iter().any(is_rest);
    !condition.has_happenings()
        && match condition {
            Condition::Idle => true,
            Condition::All(parts) | Condition::Any(parts) => mentions(parts),
            _ => false,
        }
}

fn tell(news: &mut Vec<Output>, at: Time, rule: &RuleId, what: RuleNews) {
    news.push(Output::Event(at.into(), Event::Rule { rule: rule.clone(), news: what }));
}
