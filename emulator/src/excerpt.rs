//! Messages that point at a place in a text.

use std::iter;
use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};

/// A part of a text, and the place in it that a message points at.
#[derive(Clone, Debug)]
pub(crate) struct Excerpt {
    /// The name of the file.
    pub(crate) name: String,
    /// Whole lines.
    pub(crate) text: String,
    /// The number of the first of these lines, from 1.
    pub(crate) line: usize,
    /// The place, in bytes of `text`.
    pub(crate) span: Range<usize>,
}

impl Excerpt {
    /// The lines of a place in a whole text, the line before them and the line after them.
    pub(crate) fn around(name: String, text: &str, span: Range<usize>) -> Excerpt {
        let before = text.get(..span.start).unwrap_or(text);
        let behind = text.get(span.end..).unwrap_or_default();
        let start = before.rmatch_indices('\n').nth(1).map_or(0, |(at, _)| at + 1);
        let end = behind.match_indices('\n').nth(1).map_or(text.len(), |(at, _)| span.end + at);
        Excerpt {
            name,
            text: text.get(start..end).unwrap_or_default().to_owned(),
            line: 1 + text.get(..start).unwrap_or_default().matches('\n').count(),
            span: span.start - start..span.end - start,
        }
    }
}

/// A message in several lines: what is wrong, where, and what to do. It has colours; a stream of
/// `anstream` takes them out where they are not wanted.
pub(crate) fn message(
    level: Level<'static>,
    code: Option<&str>,
    text: &str,
    place: Option<&Excerpt>,
    help: Option<&str>,
) -> String {
    let mut title = level.primary_title(text);
    if let Some(code) = code {
        title = title.id(code);
    }
    // Long lines stay whole, so that they can be copied and searched for.
    let renderer = Renderer::styled().term_width(usize::MAX >> 1);
    let help = help.map(|help| Group::with_title(Level::HELP.secondary_title(help)));
    match place {
        // Two groups of one report would have a line between them that leads from a place to its help.
        None => {
            let groups = iter::once(Group::with_title(title)).chain(help);
            groups.map(|group| renderer.render(&[group])).collect::<Vec<_>>().join("\n")
        }
        Some(place) => {
            let snippet = Snippet::source(&place.text)
                .path(&place.name)
                .line_start(place.line)
                .fold(false)
                .annotation(AnnotationKind::Primary.span(place.span.clone()));
            let groups: Vec<_> = iter::once(title.element(snippet)).chain(help).collect();
            renderer.render(&groups)
        }
    }
}
