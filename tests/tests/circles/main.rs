//! No circle of files in any crate, also none through methods: where one file uses another, the
//! other never leads back.
//!
//! A file uses another where it names an item of it (by whatever path or re-export), calls a method that the
//! other defines, or reads a field of a type of the other; a `use` alone, `mod`, and whatever is
//! only built for tests, are no use. Types are followed as far as they are written down: fields,
//! parameters, results, what a pattern takes apart. Where the type of a receiver cannot be told, the call
//! counts when only one file of the crate defines a method of that name and the standard library
//! has none. So a circle that is shown is one; what goes through operators, `Display` or `into()`
//! is not looked at.

#![expect(clippy::expect_used, reason = "a test that cannot read the sources has failed")]

mod krate;
mod uses;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt::Write as _;
use std::path::Path;

use cargo_metadata::{MetadataCommand, TargetKind};

use krate::Crate;

#[test]
fn no_crate_has_a_circle_of_files() {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.toml");
    let metadata = MetadataCommand::new().manifest_path(manifest).no_deps().exec();
    let mut wrong = Vec::new();
    for package in metadata.expect("cargo metadata works").packages {
        let built = package.targets.iter().filter(|target| {
            [TargetKind::Lib, TargetKind::Bin].iter().any(|kind| target.kind.contains(kind))
        });
        let circles: Vec<String> = built
            .filter_map(|target| {
                let read = |path: &str| std::fs::read_to_string(path).ok();
                let uses = uses::between_files(&Crate::read(target.src_path.as_str(), &read));
                circle(&uses).map(|circle| said(&circle, &uses, target.src_path.as_str()))
            })
            .collect();
        if !circles.is_empty() {
            wrong.push(format!("{}:\n{}", package.name, circles.join("\n")));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Which file uses which, and what of it.
type Uses = BTreeMap<String, BTreeMap<String, BTreeSet<String>>>;

/// The shortest circle, each file once.
fn circle(uses: &Uses) -> Option<Vec<&str>> {
    circles(uses).min_by_key(Vec::len)
}

/// For every file that is in a circle the shortest way back to it.
fn circles(uses: &Uses) -> impl Iterator<Item = Vec<&str>> {
    uses.keys().filter_map(|start| {
        let mut came: BTreeMap<&str, &str> = BTreeMap::new();
        let mut open = VecDeque::from([start.as_str()]);
        while let Some(file) = open.pop_front() {
            for used in uses.get(file).into_iter().flat_map(BTreeMap::keys) {
                if used == start {
                    let mut way = vec![file];
                    while way[way.len() - 1] != start {
                        way.push(came[way[way.len() - 1]]);
                    }
                    way.reverse();
                    return Some(way);
                }
                if !came.contains_key(used.as_str()) {
                    came.insert(used, file);
                    open.push_back(used);
                }
            }
        }
        None
    })
}

/// A circle for people: each file, what it uses of the next, and how many files are in circles.
fn said(circle: &[&str], uses: &Uses, root: &str) -> String {
    let folder = root.rsplit_once('/').map_or("", |(folder, _)| folder);
    let short = |file: &str| file.trim_start_matches(folder).trim_start_matches('/').to_owned();
    let mut said = String::new();
    for (number, file) in circle.iter().enumerate() {
        let next = circle[(number + 1) % circle.len()];
        let items: Vec<&str> = uses[*file][next].iter().map(String::as_str).collect();
        let _ = writeln!(said, "  {} uses {} of {}", short(file), items.join(", "), short(next));
    }
    let files: Vec<String> = circles(uses).map(|circle| short(circle[0])).collect();
    let _ = writeln!(said, "  In circles: {}", files.join(", "));
    said
}

/// What the files of a made-up crate use of each other.
fn made_up(files: &[(&str, &str)]) -> Option<String> {
    let read = |path: &str| {
        files.iter().find(|(name, _)| *name == path).map(|(_, text)| (*text).to_owned())
    };
    let uses = uses::between_files(&Crate::read("lib.rs", &read));
    circle(&uses).map(|circle| said(&circle, &uses, "lib.rs"))
}

#[test]
fn items_through_re_exports_and_globs_make_a_circle() {
    let lib = ("lib.rs", "mod a; mod b; pub use a::A; pub use b::*;");
    let a = ("a.rs", "use super::B; pub struct A { b: B }");
    let b = ("b.rs", "pub struct B; pub fn make() -> Option<crate::A> { None }");
    let found = made_up(&[lib, a, b]).expect("a circle");
    assert_eq!(found, "  a.rs uses B of b.rs\n  b.rs uses A of a.rs\n  In circles: a.rs, b.rs\n");
    // A parent that re-exports uses nothing by that.
    let b = ("b.rs", "pub struct B;");
    assert_eq!(made_up(&[lib, ("a.rs", "pub struct A { b: crate::B }"), b]), None);
}

#[test]
fn methods_make_a_circle() {
    let lib = ("lib.rs", "mod state; mod moves; mod stop;");
    let state = ("state.rs", "pub struct State { pub held: Vec<u8> }");
    let moves = (
        "moves.rs",
        "use crate::state::State; impl State { pub fn go(&mut self) { if self.held.len() > 1 { self.halt() } } }",
    );
    let stop = (
        "stop.rs",
        "use crate::state::State; impl State {
            pub fn halt(&mut self) {}
            pub fn len(&self) -> usize { 0 }
            pub fn again(states: &mut [State]) { states.iter_mut().for_each(|state| state.go()); }
        }",
    );
    let found = made_up(&[lib, state, moves, stop]).expect("a circle");
    assert_eq!(
        found,
        "  moves.rs uses State::halt of stop.rs\n  stop.rs uses State::go of moves.rs\n  \
         In circles: moves.rs, stop.rs\n"
    );
    // `len` of a vector is not `len` of the state, and tests may use what they like.
    let stop = (
        "stop.rs",
        "use crate::state::State; impl State { pub fn halt(&mut self) {} pub fn len(&self) -> usize { 0 } }
        #[cfg(test)] mod tests { fn go(state: &mut super::State) { state.go() } }",
    );
    assert_eq!(made_up(&[lib, state, moves, stop]), None);
}

#[test]
fn macros_and_patterns_are_looked_into() {
    let lib = ("lib.rs", "mod a; mod b;");
    let a = ("a.rs", "pub enum A { X(Option<crate::b::B>) } impl A { pub fn one(&self) {} }");
    for body in [
        "match a { A::X(Some(b)) => b.two(), A::X(None) => {} }",
        "assert!(matches!(a, A::X(None)));",
        "println!(\"{:?}\", a.one());",
    ] {
        let text = format!(
            "impl B {{ pub fn two(&self) {{}} pub fn three(a: &crate::a::A) {{ use crate::a::A; {body} }} }} pub struct B;"
        );
        assert!(made_up(&[lib, a, ("b.rs", &text)]).is_some(), "{body}");
    }
}
