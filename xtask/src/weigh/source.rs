//! One source file: its lines of code, its functions and its types.

use std::path::Path;

use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{Attribute, Block, Ident, ImplItemFn, Item, ItemFn, TraitItemFn};

use crate::tool::Outcome;

/// Lines of code that a function may have, as clippy's `too_many_lines` counts them.
const LONGEST_FUNCTION: u64 = 80;

/// A file, and what of it is a test.
#[derive(Debug, Default)]
pub(crate) struct Source {
    pub(crate) path: String,
    pub(crate) package: String,
    pub(crate) product_lines: u64,
    pub(crate) test_lines: u64,
    /// Calls of `sleep` in tests.
    pub(crate) test_sleeps: u64,
    /// Functions of the product that are too long, with their lines.
    pub(crate) long_functions: Vec<(String, u64)>,
    /// Types that the product defines.
    pub(crate) types: Vec<String>,
}

impl Source {
    pub(crate) fn read(path: &Path, text: &str) -> Outcome<Self> {
        let file = syn::parse_file(text).map_err(|error| format!("{}: {error}", path.display()))?;
        let mut names = path.iter().filter_map(|name| name.to_str());
        let folder = names.next().unwrap_or_default();
        let package = if folder == "crates" { names.next().unwrap_or_default() } else { folder };
        let is_test = path
            .iter()
            .any(|name| ["examples", "tests", "tests.rs"].iter().any(|test| name == *test));
        let mut reader = Reader { lines: Lines::new(text), is_test, source: Self::default() };
        reader.visit_file(&file);
        let Reader { lines, mut source, .. } = reader;
        source.path = path.to_string_lossy().into_owned();
        source.package = package.to_owned();
        let all = lines.between(1, lines.0.len());
        source.test_lines = if is_test { all } else { source.test_lines };
        source.product_lines = all - source.test_lines;
        Ok(source)
    }
}

/// For each line whether it is code.
struct Lines<'a>(Vec<(&'a str, bool)>);

impl<'a> Lines<'a> {
    fn new(text: &'a str) -> Self {
        let is_code = |line: &str| !line.is_empty() && !line.starts_with("//");
        Self(text.lines().map(str::trim).map(|line| (line, is_code(line))).collect())
    }

    /// The lines of code from one line to another, both counted from 1 and included.
    fn between(&self, first: usize, last: usize) -> u64 {
        self.part(first, last).count() as u64
    }

    fn part(&self, first: usize, last: usize) -> impl Iterator<Item = &'a str> {
        let lines = self.0.get(first.saturating_sub(1)..last.min(self.0.len())).unwrap_or_default();
        lines.iter().filter(|(_, is_code)| *is_code).map(|(line, _)| *line)
    }
}

struct Reader<'a> {
    lines: Lines<'a>,
    is_test: bool,
    source: Source,
}

impl Reader<'_> {
    fn function(&mut self, name: &Ident, body: &Block) {
        let (open, close) = (body.brace_token.span.open().start().line, body.span().end().line);
        if self.is_test {
            let sleeps = self.lines.part(open, close).filter(|line| line.contains("sleep("));
            self.source.test_sleeps += sleeps.count() as u64;
            return;
        }
        let lines = self.lines.between(open + 1, close.saturating_sub(1));
        if lines > LONGEST_FUNCTION {
            self.source.long_functions.push((name.to_string(), lines));
        }
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        let was_test = self.is_test;
        if !was_test && attributes(item).iter().any(is_of_a_test) {
            self.is_test = true;
            let span = item.span();
            self.source.test_lines += self.lines.between(span.start().line, span.end().line);
        }
        let name = match item {
            Item::Enum(item) => Some(&item.ident),
            Item::Struct(item) => Some(&item.ident),
            Item::Trait(item) => Some(&item.ident),
            Item::Union(item) => Some(&item.ident),
            _ => None,
        };
        if let Some(name) = name.filter(|_| !self.is_test) {
            self.source.types.push(name.to_string());
        }
        visit::visit_item(self, item);
        self.is_test = was_test;
    }

    fn visit_item_fn(&mut self, function: &'ast ItemFn) {
        self.function(&function.sig.ident, &function.block);
    }

    fn visit_impl_item_fn(&mut self, function: &'ast ImplItemFn) {
        self.function(&function.sig.ident, &function.block);
    }

    fn visit_trait_item_fn(&mut self, function: &'ast TraitItemFn) {
        if let Some(body) = &function.default {
            self.function(&function.sig.ident, body);
        }
    }
}

fn is_of_a_test(attribute: &Attribute) -> bool {
    let path = attribute.path();
    let is_only_for_tests =
        || attribute.parse_args::<Ident>().is_ok_and(|argument| argument == "test");
    path.is_ident("test") || path.is_ident("cfg") && is_only_for_tests()
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn code_is_counted_by_kind_without_comments_and_blank_lines() {
        let text = "//! About.\n\n/// A pair.\nstruct Pair;\n\nfn one() {\n    // Why.\n    two();\n}\n\n\
                    #[cfg(test)]\nmod tests {\n    struct Double;\n    fn wait() {\n        sleep(1);\n    }\n}\n";
        let source = Source::read(Path::new("crates/motion/src/lib.rs"), text).unwrap();
        assert_eq!(
            (source.package.as_str(), source.product_lines, source.test_lines),
            ("motion", 4, 7)
        );
        assert_eq!(
            (source.types.as_slice(), source.test_sleeps),
            ([String::from("Pair")].as_slice(), 1)
        );
        let test = Source::read(Path::new("emulator/tests/run.rs"), text).unwrap();
        assert_eq!((test.product_lines, test.test_lines), (0, 11));
    }

    #[test]
    fn a_function_of_81_lines_is_too_long() {
        let long = |lines| format!("fn long() {{\n{}}}\n", "    next();\n".repeat(lines));
        let read = |text: &str| {
            Source::read(Path::new("emulator/src/main.rs"), text).unwrap().long_functions
        };
        assert_eq!(read(&long(80)), []);
        assert_eq!(read(&long(81)), [("long".to_owned(), 81)]);
    }
}
