//! What happened, as far as somebody asks for it.

use std::collections::BTreeMap;

use vimc4_device::Names;

use crate::entry::{is_kind, kind, list, unknown_kind};
use crate::feed::Feed;
use crate::fields::number_of;
use crate::limits::PAGE;
use crate::problem::{Kind, Problem};

/// The entries that a query of the journal wants.
#[derive(Debug)]
pub struct Wanted<'a> {
    after: u64,
    most: usize,
    kinds: Option<Vec<&'a str>>,
    search: Option<String>,
}

impl Wanted<'_> {
    /// Reads it from the query.
    ///
    /// # Errors
    ///
    /// If a number is none, or there is no such kind of entry.
    pub fn read(query: &BTreeMap<String, String>) -> Result<Wanted<'_>, Problem> {
        let (after, limit) = (number_of(query, "after", 0)?, number_of(query, "limit", 200)?);
        let kinds = query.get("kinds").map(|kinds| kinds.split(',').collect::<Vec<_>>());
        if let Some(wrong) = kinds.iter().flatten().find(|kind| !is_kind(kind)) {
            return Err(unknown_kind(wrong));
        }
        if limit == 0 {
            // A client that goes on from `next` would ask for ever.
            let remedy = format!("write a number from 1 to {PAGE}, as in limit=200");
            return Err(Problem::new(Kind::WrongRequest, "`limit=0` asks for no entries", remedy));
        }
        let search = query.get("search").map(|search| search.to_lowercase());
        Ok(Wanted { after, most: PAGE.min(limit), kinds, search })
    }

    /// They, as JSON.
    #[must_use]
    pub fn of(&self, feed: &Feed, names: &Names) -> String {
        let Wanted { after, most, kinds, search } = self;
        let part = feed.after(*after, usize::MAX);
        let wanted = part.items.iter().filter(|item| {
            let fits = kinds.as_ref().is_none_or(|kinds| kinds.contains(&kind(&item.report)));
            let found = |search: &String| item.json(names).to_lowercase().contains(search);
            fits && search.as_ref().is_none_or(found)
        });
        let entries: Vec<_> = wanted.take(*most).collect();
        let next = match entries.last() {
            Some(last) if entries.len() == *most => last.number,
            // What is to come cannot have been seen.
            _ => part.last,
        };
        format!(
            r#"{{"first":{},"last":{},"next":{next},"entries":[{}]}}"#,
            part.first,
            part.last,
            list(entries, names)
        )
    }
}
