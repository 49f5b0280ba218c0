//! What happens, as it happens: the messages of the WebSocket.

use std::collections::{BTreeMap, VecDeque};

use serde::Deserialize;
use serde_json::{Map, Value, json};
use vimc4_device::Names;

use crate::entry::{is_kind, kind, unknown_kind};
use crate::feed::{Feed, Part};
use crate::fields::no_such;
use crate::problem::{Kind, Problem};
use crate::seen::Position;

/// So many entries are in a message at most: each wakes whoever gets it.
const BATCH: usize = 1_024;

/// A message that is so long has no further entry, bytes: clients take no messages of any length.
const LONG: usize = 256 * 1024;

/// So many messages of a controller are remembered for those who want the same: more than are made before
/// all who keep up have got them.
const SHARED: usize = 16;

/// What a client wants, in its own words.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Wish {
    /// What lets it in, where that is needed.
    pub token: Option<String>,
    controllers: Option<Vec<usize>>,
    kinds: Option<Vec<String>>,
    after: BTreeMap<usize, u64>,
    /// So many positions a second.
    pub positions: Option<u32>,
}

impl Wish {
    /// Everything of these kinds that has happened at so many controllers, and so many positions a second.
    #[must_use]
    pub fn from_the_beginning(controllers: usize, kinds: &[&str], positions: u32) -> Wish {
        let kinds = kinds.iter().map(|kind| (*kind).to_owned()).collect();
        let after = (1..=controllers).map(|number| (number, 0)).collect();
        Wish { kinds: Some(kinds), after, positions: Some(positions), ..Wish::default() }
    }

    /// Reads a message.
    ///
    /// # Errors
    ///
    /// If it makes no sense.
    pub fn read(text: &str) -> Result<Wish, Problem> {
        let object = serde_json::from_str::<Map<String, Value>>(text);
        let wish = object.and_then(|object| serde_json::from_value(object.into()));
        wish.map_err(|error| {
            Problem::new(
                Kind::WrongRequest,
                format!("the message is not understood: {error}"),
                "send an object with any of token, controllers, kinds, after and positions, such \
                 as {\"after\":{\"1\":0}}",
            )
        })
    }
}

/// What a client gets.
#[derive(Debug)]
pub struct Subscription {
    kinds: Option<Vec<String>>,
    /// The controllers that it follows.
    pub followed: Vec<Followed>,
}

/// A controller that a client follows.
#[derive(Debug)]
pub struct Followed {
    /// Its place among the controllers.
    pub place: usize,
    /// The number of the last entry that was sent, or passed over.
    sent: u64,
    /// How things stood when a position was taken last.
    looked: Option<Stand>,
    position: Option<Position>,
}

impl Subscription {
    /// What a client gets that wishes this.
    ///
    /// # Errors
    ///
    /// If there is no such controller, or no such kind of entry.
    pub fn new(wish: Wish, feeds: &[&Feed]) -> Result<Subscription, Problem> {
        let count = feeds.len();
        let numbers = wish.controllers.unwrap_or_else(|| (1..=count).collect());
        let known = |number: &usize| (1..=count).contains(number);
        let wrong = numbers.iter().chain(wish.after.keys()).find(|number| !known(number));
        if let Some(wrong) = wrong {
            return Err(no_such("controller", &wrong.to_string()));
        }
        if let Some(wrong) = wish.kinds.iter().flatten().find(|kind| !is_kind(kind)) {
            return Err(unknown_kind(wrong));
        }
        let mut places: Vec<usize> = numbers.iter().map(|number| number - 1).collect();
        places.sort_unstable();
        places.dedup();
        let followed = places.into_iter().map(|place| {
            let (last, _) = feeds[place].state();
            // What is to come cannot have been seen.
            let sent = wish.after.get(&(place + 1)).map_or(last, |after| last.min(*after));
            Followed { place, sent, looked: None, position: None }
        });
        Ok(Subscription { kinds: wish.kinds, followed: followed.collect() })
    }

    /// The first message: what there is.
    #[must_use]
    pub fn hello(&self, instance: &str, feeds: &[&Feed]) -> Value {
        let controllers = self.followed.iter().map(|followed| {
            let part = feeds[followed.place].after(u64::MAX - 1, 0);
            json!({ "number": followed.place + 1, "first": part.first, "last": part.last })
        });
        let controllers = controllers.collect::<Vec<_>>();
        json!({ "type": "hello", "instance": instance, "controllers": controllers })
    }
}

/// The messages of a controller that were made last: each is made once for all clients that want the same.
/// A `T` is a text that is cheap to clone.
#[derive(Debug)]
pub struct Messages<T>(VecDeque<Message<T>>);

/// What there is to tell between two numbers of those who want some kinds of entries.
#[derive(Debug)]
struct Message<T> {
    kinds: Option<Vec<String>>,
    /// The number before the first.
    after: u64,
    /// The number of the last.
    last: u64,
    text: Option<T>,
}

impl<T> Default for Messages<T> {
    fn default() -> Messages<T> {
        Messages(VecDeque::new())
    }
}

impl<T> Messages<T> {
    fn of(&self, kinds: Kinds<'_>) -> impl Iterator<Item = &Message<T>> {
        self.0.iter().filter(move |made| made.kinds.as_deref() == kinds.0)
    }

    fn keep(&mut self, message: Message<T>) {
        if self.0.len() == SHARED {
            self.0.pop_front();
        }
        self.0.push_back(message);
    }
}

impl Followed {
    /// The messages with a batch of what has happened, and whether there is more.
    pub fn entries<T: Clone + From<String>>(
        &mut self,
        kinds: Kinds<'_>,
        feed: &Feed,
        names: &Names,
        messages: &mut Messages<T>,
    ) -> (Vec<T>, bool) {
        let Part { first, last, .. } = feed.after(self.sent, 0);
        // What is not kept any more is not told any more, although a message may still have it.
        if self.sent + 1 >= first
            && let Some(made) = messages.of(kinds).find(|made| made.after == self.sent)
        {
            self.sent = made.last;
            return (made.text.iter().cloned().collect(), self.sent < last);
        }
        // Whoever is elsewhere ends where others do, to go on with them.
        let end = messages.of(kinds).map(|made| made.last).filter(|last| *last > self.sent).min();
        let number = self.place + 1;
        let mut texts = Vec::new();
        let part = feed.after(self.sent, BATCH);
        if self.sent + 1 < part.first {
            let (from, to) = (self.sent + 1, part.first - 1);
            let gap = json!({ "type": "gap", "controller": number, "from": from, "to": to });
            texts.push(gap.to_string().into());
            self.sent = to;
        }
        let after = self.sent;
        let mut text = format!(r#"{{"type":"events","controller":{number},"entries":["#);
        let opening = text.len();
        for item in &part.items {
            if text.len() >= LONG || Some(self.sent) == end {
                break;
            }
            self.sent = item.number;
            if kinds.contain(kind(&item.report)) {
                if text.len() > opening {
                    text.push(',');
                }
                item.write(names, &mut text);
            }
        }
        text.push_str("]}");
        let text = (text.len() > opening + 2).then(|| T::from(text));
        texts.extend(text.clone());
        if self.sent > after {
            let kinds = kinds.0.map(<[String]>::to_vec);
            messages.keep(Message { kinds, after, last: self.sent, text });
        }
        (texts, self.sent < part.last)
    }

    /// How things stand, if there may be another position than was sent last.
    #[must_use]
    pub fn looks(&self, feed: &Feed) -> Option<Stand> {
        let stand = Stand(feed.state());
        let last = self.position.as_ref();
        let moves = stand.0.1.unwrap_or_else(|| last.is_some_and(Position::moves));
        (moves || self.looked != Some(stand)).then_some(stand)
    }

    /// The message with where the axes are, if that is news: the latest only, however slow the client is.
    /// How things stand was asked before, so that what happens meanwhile is looked at again.
    pub fn position(&mut self, stand: Stand, position: Position) -> Option<String> {
        self.looked = Some(stand);
        if self.position.as_ref().is_some_and(|last| !position.differs(last)) {
            return None;
        }
        let mut message = serde_json::to_value(&position).unwrap_or_default();
        message["type"] = "position".into();
        message["controller"] = (self.place + 1).into();
        message["moving"] = stand.0.1.unwrap_or_else(|| position.moves()).into();
        self.position = Some(position);
        Some(message.to_string())
    }
}

/// How things stand at a controller: the number of the last entry, and whether something moves, if
/// what was told says so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stand((u64, Option<bool>));

impl Stand {
    /// Whether something moves for sure.
    #[must_use]
    pub fn moves(self) -> bool {
        self.0.1 == Some(true)
    }
}

/// The kinds of entries that a client wants.
#[derive(Clone, Copy, Debug)]
pub struct Kinds<'a>(Option<&'a [String]>);

impl Kinds<'_> {
    fn contain(&self, kind: &str) -> bool {
        self.0.is_none_or(|kinds| kinds.iter().any(|own| own == kind))
    }
}

impl Subscription {
    /// What it follows, and the kinds of entries that it wants.
    pub fn parts(&mut self) -> (Kinds<'_>, &mut [Followed]) {
        (Kinds(self.kinds.as_deref()), &mut self.followed)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use vimc4_device::{Event, Time};
    use vimc4_session::{Report, ReportKind, Sink};

    use super::*;

    #[test]
    fn many_long_entries_come_in_messages_of_some_length() {
        let feed = Feed::new(Arc::new(|| ()));
        let mut ear = feed.sink();
        let mut happens = |what: &str, times| {
            let event = Event::Flash { what: what.to_owned().into() };
            let what = ReportKind::Event { command: None, event };
            let report = Report { controller: "".into(), at: Time::ZERO, what };
            (0..times).for_each(|_| ear.report(&report, &|_| String::new()));
        };
        happens("short", 3_000);
        happens(&"long".repeat(10_000), 30);
        happens("short", 1);
        let wish = Wish::from_the_beginning(1, &["flash"], 0);
        let mut subscription = Subscription::new(wish, &[&feed]).expect("there is one");
        let (kinds, followed) = subscription.parts();
        let (names, mut messages) = (Names::default(), Messages::<String>::default());
        let (mut numbers, mut lengths) = (Vec::new(), Vec::new());
        loop {
            let (texts, is_more) = followed[0].entries(kinds, &feed, &names, &mut messages);
            for message in texts {
                let read: Value = serde_json::from_str(&message).expect("it is JSON");
                let entries = read["entries"].as_array().expect("a list");
                numbers.extend(entries.iter().filter_map(|entry| entry["number"].as_u64()));
                lengths.push(message.len());
            }
            if !is_more {
                break;
            }
        }
        assert_eq!(numbers, Vec::from_iter(1..=3_031));
        assert!(lengths.iter().all(|length| *length < LONG + 100_000), "{lengths:?}");
        assert!(lengths.len() < 20, "{lengths:?}");
    }

    #[test]
    fn a_message_is_made_once_for_all_who_want_the_same() {
        let feed = Feed::new(Arc::new(|| ()));
        let mut ear = feed.sink();
        let mut happens = |event| {
            let what = ReportKind::Event { command: None, event };
            let report = Report { controller: "".into(), at: Time::ZERO, what };
            ear.report(&report, &|_| String::new());
        };
        let names = Names::default();
        let mut messages = Messages::<Arc<str>>::default();
        let subscribe = |kinds: Option<&str>, after: u64| {
            let kinds = kinds.map(|kind| vec![kind.to_owned()]);
            let wish = Wish { kinds, after: BTreeMap::from([(1, after)]), ..Wish::default() };
            Subscription::new(wish, &[&feed]).expect("there is one")
        };
        let mut early = [subscribe(None, 0), subscribe(None, 0)];
        let mut some = [subscribe(Some("baud"), 0), subscribe(Some("baud"), 0)];
        let mut told = |client: &mut Subscription| {
            let (kinds, followed) = client.parts();
            let mut texts = Vec::new();
            loop {
                let (more, is_more) = followed[0].entries(kinds, &feed, &names, &mut messages);
                texts.extend(more);
                if !is_more {
                    return texts;
                }
            }
        };
        let numbers = |texts: &[Arc<str>]| -> Vec<u64> {
            let read = |text: &Arc<str>| serde_json::from_str::<Value>(text).expect("it is JSON");
            let entries = texts.iter().flat_map(|text| read(text)["entries"].as_array().cloned());
            entries.flatten().filter_map(|entry| entry["number"].as_u64()).collect()
        };
        let same = |one: &[Arc<str>], other: &[Arc<str>]| {
            one.len() == other.len() && one.iter().zip(other).all(|(a, b)| Arc::ptr_eq(a, b))
        };
        // Nothing has happened, and it is not remembered that nothing has.
        assert!(told(&mut early[0]).is_empty() && told(&mut early[1]).is_empty());

        (0..3).for_each(|_| happens(Event::Port { port: 1, value: 2 }));
        let first = told(&mut early[0]);
        assert_eq!(numbers(&first), [1, 2, 3]);
        happens(Event::Baud { baud: 9_600 });
        // Who comes later gets what was made, and then the rest.
        let second = told(&mut early[1]);
        assert_eq!(numbers(&second), [1, 2, 3, 4]);
        assert!(Arc::ptr_eq(&first[0], &second[0]));
        assert!(same(&told(&mut early[0]), &second[1..]));
        // Who wants something else gets something else, and all that want it the same.
        let few = told(&mut some[0]);
        assert_eq!(numbers(&few), [4]);
        assert!(same(&told(&mut some[1]), &few));
        // Who begins in the middle is told up to where others were, and goes on with them.
        let mut late = subscribe(None, 1);
        let texts = told(&mut late);
        assert_eq!(numbers(&texts), [2, 3, 4]);
        assert!(same(&texts[1..], &second[1..]));
        (0..3_000).for_each(|_| happens(Event::Port { port: 1, value: 3 }));
        let all = told(&mut early[0]);
        assert_eq!(numbers(&all), Vec::from_iter(5..=3_004));
        assert!(same(&told(&mut late), &all) && same(&told(&mut early[1]), &all));
        // Whoever comes too late for what is not kept any more gets a gap, whatever others have got.
        (0..7_000).for_each(|_| happens(Event::Port { port: 1, value: 4 }));
        told(&mut early[0]);
        let texts = told(&mut subscribe(None, 0));
        let gap = json!({ "type": "gap", "controller": 1, "from": 1, "to": 4 });
        assert_eq!(*texts[0], *gap.to_string());
        assert_eq!(numbers(&texts[1..2])[0], 5);
        // Where nothing of it is wanted nobody is told anything.
        assert!(told(&mut some[0]).is_empty() && told(&mut some[1]).is_empty());
    }
}
