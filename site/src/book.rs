//! The chapters: what docs/README.md lists, and what those lead to. Their links lead within the site.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};

use crate::paths::{self, resolve};
use crate::{Outcome, diagram, view};

/// The list of all chapters, which is one itself.
const LIST: &str = "docs/README.md";

/// A chapter: where its text is, and its name in the list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Chapter {
    pub(crate) path: String,
    pub(crate) title: String,
    /// Below which other it stands: 0 is none.
    pub(crate) depth: usize,
    /// Its text, if it is made here.
    pub(crate) text: Option<String>,
}

/// The chapters in their order.
#[derive(Debug)]
pub(crate) struct Book {
    chapters: Vec<Chapter>,
}

impl Book {
    /// What the list has. Every page of its folder must be in it.
    pub(crate) fn read(root: &Path) -> Outcome<Book> {
        let chapters = listed(&paths::read(&root.join(LIST))?);
        let docs = root.join("docs");
        let entries = fs::read_dir(&docs).map_err(|error| paths::about(&docs, &error))?;
        let mut missing: Vec<String> = Vec::new();
        for entry in entries {
            let name = entry.map_err(|error| paths::about(&docs, &error))?.file_name();
            let path = format!("docs/{}", name.to_string_lossy());
            let is_listed = path == LIST || chapters.iter().any(|chapter| chapter.path == path);
            if path.ends_with(".md") && !is_listed {
                missing.push(path);
            }
        }
        missing.sort();
        match missing.is_empty() {
            true => Ok(Book { chapters }),
            false => Err(format!("{LIST} does not list {}", missing.join(", "))),
        }
    }

    /// One more, after another of the list and what is below that; at the end if there is no such.
    pub(crate) fn add_after(&mut self, path: &str, chapter: Chapter) {
        let at = self.chapters.iter().position(|chapter| chapter.path == path);
        let below = at.map_or(&[][..], |at| &self.chapters[at + 1..]);
        let below = below.iter().take_while(|chapter| chapter.depth > 0).count();
        let at = at.map_or(self.chapters.len(), |at| at + 1 + below);
        self.chapters.insert(at, chapter);
    }

    /// Writes the chapters with all that they lead to, and mdBook's table of contents.
    pub(crate) fn write(mut self, root: &Path, src: &Path) -> Outcome<()> {
        let start =
            Chapter { path: LIST.to_owned(), title: "The book".to_owned(), depth: 0, text: None };
        let listed = self.chapters.len();
        self.chapters.push(start);
        let mut others: BTreeSet<String> = BTreeSet::new();
        // It grows while it is walked along: what chapters lead to are chapters, too.
        let mut at = 0;
        while let Some(chapter) = self.chapters.get(at).cloned() {
            let text = match &chapter.text {
                Some(text) => text.clone(),
                None => paths::read(&root.join(&chapter.path))?,
            };
            let adapted = adapt(root, &chapter.path, &text)?;
            paths::write(&src.join(chapter_file(&chapter.path)), adapted.text)?;
            for path in adapted.leads_to {
                let is_known = self.chapters.iter().any(|chapter| chapter.path == path);
                match path.ends_with(".md") {
                    true if is_known => {}
                    true => {
                        let title = title(&paths::read(&root.join(&path))?)
                            .ok_or_else(|| format!("{path} has no heading"))?;
                        self.chapters.push(Chapter { path, title, depth: 0, text: None });
                    }
                    false => drop(others.insert(path)),
                }
            }
            at += 1;
        }
        for path in others {
            hand_out(root, src, &path)?;
        }
        paths::write(&src.join("SUMMARY.md"), self.summary(listed))
    }

    /// The table of contents: the list, then those that are not in it.
    fn summary(&self, listed: usize) -> String {
        let mut text = "# Summary\n\n".to_owned();
        let (listed, others) = self.chapters.split_at(listed);
        let link =
            |chapter: &Chapter| format!("[{}]({})", chapter.title, chapter_file(&chapter.path));
        for chapter in listed {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{}- {}", "  ".repeat(chapter.depth), link(chapter));
        }
        text.push_str("\n---\n\n");
        for chapter in others {
            let _ = writeln!(text, "{}\n", link(chapter));
        }
        text
    }
}

/// The file of a chapter's text for mdBook: a folder is opened by its index.
fn chapter_file(path: &str) -> String {
    match path.strip_suffix("README.md") {
        Some(folder) => format!("{folder}index.md"),
        None => path.to_owned(),
    }
}

fn parser(text: &str) -> impl Iterator<Item = (Event<'_>, std::ops::Range<usize>)> {
    Parser::new_ext(text, Options::ENABLE_TABLES).into_offset_iter()
}

/// The chapters of a list: the first link of an item, and below it the others that lead to pages.
fn listed(list: &str) -> Vec<Chapter> {
    let mut chapters: Vec<Chapter> = Vec::new();
    let mut depth = 0;
    let mut link: Option<(String, String)> = None;
    for (event, _) in parser(list) {
        match event {
            Event::Start(Tag::Item) => depth = 0,
            Event::Start(Tag::Link { dest_url, .. }) => {
                let path = resolve(LIST, dest_url.split('#').next().unwrap_or_default());
                link = path.filter(|path| path.ends_with(".md")).map(|path| (path, String::new()));
            }
            Event::Text(text) | Event::Code(text) => {
                if let Some((_, title)) = &mut link {
                    title.push_str(&text);
                }
            }
            Event::End(TagEnd::Link) => {
                let Some((path, title)) = link.take() else { continue };
                if !chapters.iter().any(|chapter| chapter.path == path) {
                    // `[examples](…)` in a sentence is the name of a page nonetheless.
                    chapters.push(Chapter { path, title: capital(&title), depth, text: None });
                    depth = 1;
                }
            }
            _ => {}
        }
    }
    chapters
}

/// The heading of a page.
fn title(text: &str) -> Option<String> {
    text.lines().find_map(|line| line.strip_prefix("# ")).map(str::to_owned)
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

/// A chapter whose links lead within the site, and what they lead to.
struct Adapted {
    text: String,
    leads_to: BTreeSet<String>,
}

/// Lets the links of a chapter lead to where things are in the site, and draws its diagrams.
fn adapt(root: &Path, path: &str, text: &str) -> Outcome<Adapted> {
    let mut edits: BTreeMap<usize, (usize, String)> = BTreeMap::new();
    let mut leads_to = BTreeSet::new();
    let mut diagram: Option<(usize, String)> = None;
    for (event, range) in parser(text) {
        match event {
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                let Some(target) = target(root, path, &dest_url)? else { continue };
                leads_to.insert(target.path);
                let at = text[range.clone()].rfind(&*dest_url).ok_or_else(|| {
                    format!("{path}: {dest_url} is not written where it is linked")
                })?;
                edits.insert(range.start + at, (range.start + at + dest_url.len(), target.link));
            }
            Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(kind))) if &*kind == "mermaid" => {
                diagram = Some((range.start, String::new()));
            }
            Event::Text(part) => {
                if let Some((_, text)) = &mut diagram {
                    text.push_str(&part);
                }
            }
            Event::End(TagEnd::CodeBlock) => {
                if let Some((from, drawn)) = diagram.take() {
                    let figure =
                        diagram::figure(&drawn).map_err(|error| format!("{path}: {error}"))?;
                    edits.insert(from, (range.end, figure));
                }
            }
            _ => {}
        }
    }
    let mut adapted = String::new();
    let mut done = 0;
    for (from, (to, with)) in edits {
        adapted.push_str(&text[done..from]);
        adapted.push_str(&with);
        done = to;
    }
    adapted.push_str(&text[done..]);
    Ok(Adapted { text: adapted, leads_to })
}

/// What a link leads to.
struct Target {
    /// In the repository.
    path: String,
    /// As it is written in the site.
    link: String,
}

/// What a link of a chapter leads to, if that is in the repository.
fn target(root: &Path, from: &str, link: &str) -> Outcome<Option<Target>> {
    let (place, anchor) =
        link.split_once('#').map_or((link, None), |(place, at)| (place, Some(at)));
    let is_elsewhere = place.split_once(':').is_some_and(|(scheme, _)| !scheme.contains('/'));
    if place.is_empty() || is_elsewhere {
        return Ok(None);
    }
    let path = resolve(from, place).ok_or_else(|| format!("{from}: {link} leads out of here"))?;
    let found = root.join(&path);
    let (path, place) = if found.is_dir() {
        let place = place.trim_end_matches('/');
        match found.join("README.md").exists() {
            true => (format!("{path}/README.md"), format!("{place}/index.md")),
            false => (path, format!("{place}/index.html")),
        }
    } else if path.ends_with(".md") {
        (path, chapter_file(place))
    } else if is_picture(&path) {
        (path, place.to_owned())
    } else {
        (path, format!("{place}.html"))
    };
    let anchor = anchor.map(|anchor| format!("#{anchor}")).unwrap_or_default();
    Ok(Some(Target { path, link: format!("{place}{anchor}") }))
}

fn is_picture(path: &str) -> bool {
    [".svg", ".png"].iter().any(|end| path.ends_with(end))
}

/// Puts a file or a folder that is no chapter where a browser can open it.
fn hand_out(root: &Path, src: &Path, path: &str) -> Outcome<()> {
    let from = root.join(path);
    if from.is_dir() {
        let files = files(root, path)?;
        for file in &files {
            hand_out(root, src, file)?;
        }
        let named = files.iter().map(|file| {
            let name = file.strip_prefix(path).unwrap_or(file).trim_start_matches('/').to_owned();
            let link = if is_picture(&name) { name.clone() } else { format!("{name}.html") };
            (name, link)
        });
        let index = src.join(path).join("index.html");
        return paths::write(&index, view::folder(path, &named.collect::<Vec<_>>()));
    }
    paths::copy(&from, &src.join(path))?;
    if is_picture(path) {
        return Ok(());
    }
    paths::write(&src.join(format!("{path}.html")), view::file(path, &paths::read(&from)?))
}

/// The files of a folder that belong to the project.
fn files(root: &Path, folder: &str) -> Outcome<Vec<String>> {
    let mut git = Command::new("git");
    let listed = git.args(["ls-files", "--", folder]).current_dir(root).output();
    let listed = listed.map_err(|error| format!("git: {error}"))?;
    let listed = String::from_utf8_lossy(&listed.stdout).into_owned();
    let files: Vec<String> = listed.lines().map(str::to_owned).collect();
    match files.is_empty() {
        true => Err(format!("{folder} is empty, or git does not know it")),
        false => Ok(files),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_is_the_table_of_contents() {
        let list = "# The book\n\n* [Start](../README.md): with [examples](../examples/README.md)\n\
                    * [`ctl`](ctl.md#here): [a file](x.toml), [Start](../README.md) again\n";
        let found = listed(list);
        let found: Vec<_> = found.iter().map(|it| (&*it.path, &*it.title, it.depth)).collect();
        let wanted = [
            ("README.md", "Start", 0),
            ("examples/README.md", "Examples", 1),
            ("docs/ctl.md", "Ctl", 0),
        ];
        assert_eq!(found, wanted);
    }

    #[test]
    fn links_lead_to_where_things_are_in_the_site() -> Outcome<()> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let text = "[a](../README.md#x) [b](../fixtures/topics.toml) ![c](plate.svg) [d](../fixtures/reasons) \
                    [e](https://example.org/a.md) [f](#here) `[g](h.md)`";
        let adapted = adapt(&root, "docs/x.md", text)?;
        assert_eq!(
            adapted.text,
            "[a](../index.md#x) [b](../fixtures/topics.toml.html) ![c](plate.svg) \
             [d](../fixtures/reasons/index.html) [e](https://example.org/a.md) [f](#here) `[g](h.md)`"
        );
        let wanted = ["README.md", "docs/plate.svg", "fixtures/reasons", "fixtures/topics.toml"];
        assert_eq!(adapted.leads_to.iter().collect::<Vec<_>>(), wanted);
        Ok(())
    }

    #[test]
    fn a_page_that_is_not_listed_is_an_error() -> std::io::Result<()> {
        let root = tempfile::tempdir()?;
        fs::create_dir(root.path().join("docs"))?;
        fs::write(root.path().join(LIST), "* [A](a.md)\n")?;
        fs::write(root.path().join("docs/a.md"), "# A\n")?;
        assert!(Book::read(root.path()).is_ok());
        fs::write(root.path().join("docs/b.md"), "# B\n")?;
        let error = Book::read(root.path()).err();
        assert_eq!(error.as_deref(), Some("docs/README.md does not list docs/b.md"));
        Ok(())
    }
}
