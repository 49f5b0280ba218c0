//! Whether every link of the site leads somewhere in it, and nothing is loaded from elsewhere.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use html5gum::{Token, Tokenizer};

use crate::Outcome;
use crate::paths::{self, resolve};

/// A page: the places in it that can be linked to, and what it links to or loads.
#[derive(Default)]
struct Page {
    places: BTreeSet<String>,
    links: Vec<String>,
    loads: Vec<String>,
}

/// Follows every link of every page, and says how many there are.
pub(crate) fn check(site: &Path) -> Outcome<usize> {
    let files = files(site)?;
    let mut pages: BTreeMap<String, Page> = BTreeMap::new();
    let mut names: BTreeSet<String> = BTreeSet::new();
    let mut wrong: BTreeSet<String> = BTreeSet::new();
    for path in files {
        let name = path.strip_prefix(site).unwrap_or(&path).to_string_lossy().replace('\\', "/");
        if name.ends_with(".html") {
            pages.insert(name.clone(), read(&paths::read(&path)?));
        } else if name.ends_with(".css") && paths::read(&path)?.contains("url(http") {
            wrong.insert(format!("{name} loads from elsewhere"));
        }
        names.insert(name);
    }
    let mut followed = 0;
    // The page for what is not found does not know where it will stand.
    for (name, page) in pages.iter().filter(|(name, _)| *name != "404.html") {
        let elsewhere = page.loads.iter().filter(|link| is_elsewhere(link));
        wrong.extend(elsewhere.map(|link| format!("{name} loads {link}")));
        for link in page.links.iter().chain(&page.loads).filter(|link| !is_elsewhere(link)) {
            followed += 1;
            let (place, anchor) = link.split_once('#').unwrap_or((link, ""));
            let place = place.split('?').next().unwrap_or_default();
            let to = match place {
                "" => Some(name.clone()),
                place => resolve(name, place),
            };
            let to = to.map(|to| match place.ends_with('/') || to.is_empty() {
                true => format!("{to}/index.html").trim_start_matches('/').to_owned(),
                false => to,
            });
            let Some(to) = to.filter(|to| names.contains(to)) else {
                wrong.insert(format!("{name} links to {link}, which is not there"));
                continue;
            };
            let has = |page: &Page| page.places.contains(anchor);
            if !anchor.is_empty() && !pages.get(&to).is_some_and(has) {
                wrong.insert(format!("{name} links to {link}; there is no such place in {to}"));
            }
        }
    }
    match wrong.is_empty() {
        true => Ok(followed),
        false => Err(format!(
            "{} links lead nowhere:\n  {}",
            wrong.len(),
            wrong.into_iter().collect::<Vec<_>>().join("\n  ")
        )),
    }
}

/// Whether a link names a scheme or a host.
fn is_elsewhere(link: &str) -> bool {
    link.starts_with("//")
        || link.split_once(':').is_some_and(|(scheme, _)| !scheme.contains(['/', '#', '?', '.']))
}

/// What of a page can be linked to, and what it links to and loads.
fn read(text: &str) -> Page {
    let mut page = Page::default();
    for Ok(token) in Tokenizer::new(text) {
        let Token::StartTag(tag) = token else { continue };
        let of = |name: &[u8]| {
            let value = tag.attributes.get(name)?;
            Some(String::from_utf8_lossy(value).into_owned())
        };
        page.places.extend(of(b"id"));
        let links = of(b"href");
        match &**tag.name {
            b"a" => {
                page.places.extend(of(b"name"));
                page.links.extend(links);
            }
            _ => page.loads.extend(links),
        }
        page.loads.extend(of(b"src"));
    }
    page
}

fn files(folder: &Path) -> Outcome<Vec<PathBuf>> {
    let mut found = Vec::new();
    let entries = fs::read_dir(folder).map_err(|error| paths::about(folder, &error))?;
    for entry in entries {
        let path = entry.map_err(|error| paths::about(folder, &error))?.path();
        match path.is_dir() {
            true => found.extend(files(&path)?),
            false => found.push(path),
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the check says of a page beside `b/c.html`, which has a place.
    fn said_of(page: &str) -> Outcome<usize> {
        let site = tempfile::tempdir().map_err(|error| error.to_string())?;
        paths::write(&site.path().join("a.html"), page)?;
        paths::write(
            &site.path().join("b/c.html"),
            "<h2 id='place'><a href='../a.html'>back</a></h2>",
        )?;
        check(site.path())
    }

    #[test]
    fn links_that_lead_somewhere_are_counted() {
        let page =
            "<a href=b/c.html#place></a><a id=x href=#x></a><a href=https://example.org></a>";
        assert_eq!(said_of(page), Ok(3));
    }

    #[test]
    fn a_link_that_leads_nowhere_is_named() {
        let of = |page: &str| said_of(page).err().unwrap_or_default();
        assert!(of("<a href=b/d.html>").ends_with("a.html links to b/d.html, which is not there"));
        let place = "a.html links to b/c.html#other; there is no such place in b/c.html";
        assert!(of("<a href='b/c.html#other'>").ends_with(place));
        assert!(of("<img src=../x.png>").contains("which is not there"));
    }

    #[test]
    fn nothing_is_loaded_from_elsewhere() {
        let said = said_of("<script src='https://example.org/x.js'></script>").err();
        assert!(said.is_some_and(|said| said.ends_with("a.html loads https://example.org/x.js")));
        assert!(said_of("<link rel=stylesheet href='//example.org/x.css'>").is_err());
    }
}
