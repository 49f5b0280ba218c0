//! The sources of one crate: which file defines what.

use std::collections::{BTreeMap, BTreeSet};

use syn::visit::{self, Visit};
use syn::{Fields, ImplItem, Item, ReturnType, TraitItem, Type, UseTree};

/// A module by its number, the root's is 0.
pub(crate) type ModuleId = usize;

/// An item: where it is defined, and its name.
pub(crate) type ItemId = (ModuleId, String);

/// A crate as it is written.
#[derive(Default)]
pub(crate) struct Crate {
    pub(crate) modules: Vec<Module>,
    /// What is known of each item.
    pub(crate) items: BTreeMap<ItemId, Known>,
    /// Which modules define a method of a name, for whichever type.
    pub(crate) methods: BTreeMap<String, BTreeSet<ModuleId>>,
    /// The macros, which have no path.
    pub(crate) macros: BTreeMap<String, ModuleId>,
}

/// A module, in a file of its own or within one.
pub(crate) struct Module {
    pub(crate) file: String,
    pub(crate) parent: Option<ModuleId>,
    pub(crate) children: BTreeMap<String, ModuleId>,
    /// What `use` gives a name here, and where that is.
    pub(crate) aliases: BTreeMap<String, Vec<String>>,
    /// The modules and enums that `use` brings everything of.
    pub(crate) globs: Vec<Vec<String>>,
    pub(crate) content: Vec<Item>,
}

/// What is known of an item.
#[derive(Default)]
pub(crate) struct Known {
    /// The type of a constant, the result of a function, what a type stands for.
    pub(crate) is: Option<Type>,
    /// The types of its fields, those of a variant as `Variant.field`.
    pub(crate) fields: BTreeMap<String, Type>,
    pub(crate) variants: BTreeSet<String>,
    pub(crate) methods: BTreeMap<String, Method>,
    /// The traits of this crate that it has.
    pub(crate) traits: Vec<ItemId>,
}

/// A method, or what else belongs to a type.
pub(crate) struct Method {
    pub(crate) module: ModuleId,
    pub(crate) result: Option<Type>,
}

/// What a path leads to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Found {
    Module(ModuleId),
    Item(ItemId),
    /// A variant, method or constant of a type.
    Of(ItemId, String),
}

impl Crate {
    /// Reads a crate from its first file on; `read` gives the text of a file, if there is one.
    pub(crate) fn read(root: &str, read: &dyn Fn(&str) -> Option<String>) -> Self {
        let mut this = Self::default();
        let folder = root.rsplit_once('/').map_or("", |(folder, _)| folder);
        let text = read(root).expect("the first file of a crate");
        let content = syn::parse_file(&text).expect("Rust").items;
        this.add(None, root, folder, content, read);
        for module in 0..this.modules.len() {
            let content = std::mem::take(&mut this.modules[module].content);
            content.iter().for_each(|item| this.learn_methods(module, item));
            this.modules[module].content = content;
        }
        this
    }

    /// Adds a module and those within it; `folder` is where their files are.
    fn add(
        &mut self,
        parent: Option<ModuleId>,
        file: &str,
        folder: &str,
        content: Vec<Item>,
        read: &dyn Fn(&str) -> Option<String>,
    ) -> ModuleId {
        let id = self.modules.len();
        let content: Vec<Item> = content.into_iter().filter(|item| !is_for_tests(item)).collect();
        let mut names = Names::default();
        content.iter().for_each(|item| names.visit_item(item));
        let Names { aliases, globs } = names;
        let children = BTreeMap::new();
        let file = file.to_owned();
        self.modules.push(Module { file, parent, children, aliases, globs, content: Vec::new() });
        for item in &content {
            self.learn(id, item);
            let Item::Mod(module) = item else { continue };
            let name = module.ident.to_string();
            let within = join(folder, &name);
            let child = match &module.content {
                Some((_, content)) => {
                    let file = self.modules[id].file.clone();
                    self.add(Some(id), &file, &within, content.clone(), read)
                }
                None => {
                    let path = module.attrs.iter().find_map(path_attribute);
                    let files = match path {
                        Some(path) => vec![join(folder, &path)],
                        None => vec![format!("{within}.rs"), format!("{within}/mod.rs")],
                    };
                    let mut found = files.into_iter().filter_map(|file| Some((read(&file)?, file)));
                    let (text, file) = found.next().expect("the file of a module");
                    let content = syn::parse_file(&text).expect("Rust").items;
                    self.add(Some(id), &file, &within, content, read)
                }
            };
            self.modules[id].children.insert(name, child);
        }
        self.modules[id].content = content;
        id
    }

    /// Takes down what an item is.
    fn learn(&mut self, module: ModuleId, item: &Item) {
        let mut known = Known::default();
        let name = match item {
            Item::Const(item) => {
                known.is = Some((*item.ty).clone());
                &item.ident
            }
            Item::Static(item) => {
                known.is = Some((*item.ty).clone());
                &item.ident
            }
            Item::Type(item) => {
                known.is = Some((*item.ty).clone());
                &item.ident
            }
            Item::Fn(item) => {
                known.is = result(&item.sig.output);
                &item.sig.ident
            }
            Item::Struct(item) => {
                known.fields = fields("", &item.fields);
                &item.ident
            }
            Item::Enum(item) => {
                for variant in &item.variants {
                    let name = variant.ident.to_string();
                    known.fields.extend(fields(&format!("{name}."), &variant.fields));
                    known.variants.insert(name);
                }
                &item.ident
            }
            Item::Trait(item) => {
                for part in &item.items {
                    let TraitItem::Fn(method) = part else { continue };
                    let name = method.sig.ident.to_string();
                    let result = result(&method.sig.output);
                    known.methods.insert(name.clone(), Method { module, result });
                    self.methods.entry(name).or_default().insert(module);
                }
                &item.ident
            }
            Item::Macro(item) => {
                if let Some(name) = &item.ident {
                    self.macros.insert(name.to_string(), module);
                }
                return;
            }
            _ => return,
        };
        self.items.insert((module, name.to_string()), known);
    }

    /// Takes down the methods that an `impl` gives a type, once all types are known.
    fn learn_methods(&mut self, module: ModuleId, item: &Item) {
        let Item::Impl(item) = item else { return };
        let of = self.type_of(module, &item.self_ty);
        let given = item.trait_.as_ref();
        let given = given.and_then(|(given, _)| self.find(module, &segments(given)));
        let given = match given {
            Some(Found::Item(id)) => Some(id),
            _ => None,
        };
        let mut found = Vec::new();
        for part in &item.items {
            let (name, result) = match part {
                ImplItem::Fn(method) if !is_test(&method.attrs) => {
                    let name = method.sig.ident.to_string();
                    self.methods.entry(name.clone()).or_default().insert(module);
                    (name, result(&method.sig.output))
                }
                ImplItem::Const(constant) => {
                    (constant.ident.to_string(), Some(constant.ty.clone()))
                }
                ImplItem::Type(of) => (of.ident.to_string(), Some(of.ty.clone())),
                _ => continue,
            };
            found.push((name, Method { module, result }));
        }
        if let Some(known) = of.and_then(|of| self.items.get_mut(&of)) {
            known.traits.extend(given);
            known.methods.extend(found);
        }
    }

    /// The item of this crate that a type is, references and boxes aside.
    pub(crate) fn type_of(&self, module: ModuleId, written: &Type) -> Option<ItemId> {
        match written {
            Type::Reference(inner) => self.type_of(module, &inner.elem),
            Type::Path(path) => match self.find(module, &segments(&path.path))? {
                Found::Item(id) => Some(id),
                Found::Module(_) | Found::Of(..) => None,
            },
            _ => None,
        }
    }

    /// What a path that is written in a module leads to, if that is in this crate.
    pub(crate) fn find(&self, module: ModuleId, path: &[String]) -> Option<Found> {
        self.find_within(module, path, 0)
    }

    fn find_within(&self, module: ModuleId, path: &[String], depth: usize) -> Option<Found> {
        // A name that leads back to itself leads nowhere.
        if depth > 20 {
            return None;
        }
        let (first, rest) = path.split_first()?;
        let mut found = match first.as_str() {
            "crate" => Found::Module(0),
            "self" => Found::Module(module),
            "super" => Found::Module(self.modules[module].parent?),
            name => self.look_up(module, name, depth)?,
        };
        for name in rest {
            found = match found {
                Found::Module(module) if name == "super" => {
                    Found::Module(self.modules[module].parent?)
                }
                Found::Module(module) => self.look_up(module, name, depth)?,
                Found::Item(id) => match self.items.get(&id).and_then(|known| known.is.as_ref()) {
                    Some(Type::Path(alias)) if !self.items[&id].methods.contains_key(name) => {
                        match self.find_within(id.0, &segments(&alias.path), depth + 1) {
                            Some(Found::Item(id)) => Found::Of(id, name.clone()),
                            _ => return None,
                        }
                    }
                    _ => Found::Of(id, name.clone()),
                },
                of @ Found::Of(..) => of,
            };
        }
        Some(found)
    }

    fn look_up(&self, module: ModuleId, name: &str, depth: usize) -> Option<Found> {
        let here = &self.modules[module];
        let id = (module, name.to_owned());
        if self.items.contains_key(&id) {
            return Some(Found::Item(id));
        }
        if let Some(child) = here.children.get(name) {
            return Some(Found::Module(*child));
        }
        if let Some(path) = here.aliases.get(name) {
            // `use x::x` names something else than itself.
            if path.len() > 1 || path[0] != name {
                return self.find_within(module, path, depth + 1);
            }
        }
        here.globs.iter().find_map(|glob| match self.find_within(module, glob, depth + 1)? {
            Found::Module(from) if from != module => self.look_up(from, name, depth + 1),
            Found::Item(id) if self.items[&id].variants.contains(name) => {
                Some(Found::Of(id, name.to_owned()))
            }
            _ => None,
        })
    }
}

/// The names that `use` gives, anywhere in a module but in those within it.
#[derive(Default)]
struct Names {
    aliases: BTreeMap<String, Vec<String>>,
    globs: Vec<Vec<String>>,
}

impl Names {
    fn add(&mut self, before: &[String], tree: &UseTree) {
        let with = |name: &syn::Ident| {
            let mut path = before.to_vec();
            // `use a::{self}` is `use a`.
            if name != "self" || path.is_empty() {
                path.push(name.to_string());
            }
            path
        };
        match tree {
            UseTree::Path(path) => self.add(&with(&path.ident), &path.tree),
            UseTree::Name(name) => {
                let path = with(&name.ident);
                self.aliases.insert(path[path.len() - 1].clone(), path);
            }
            UseTree::Rename(name) => {
                self.aliases.insert(name.rename.to_string(), with(&name.ident));
            }
            UseTree::Glob(_) => self.globs.push(before.to_vec()),
            UseTree::Group(group) => group.items.iter().for_each(|tree| self.add(before, tree)),
        }
    }
}

impl<'ast> Visit<'ast> for Names {
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.add(&[], &item.tree);
    }

    fn visit_item_mod(&mut self, _: &'ast syn::ItemMod) {}

    fn visit_item(&mut self, item: &'ast Item) {
        if !is_for_tests(item) {
            visit::visit_item(self, item);
        }
    }
}

/// The names of a path, without what stands in angle brackets.
pub(crate) fn segments(path: &syn::Path) -> Vec<String> {
    path.segments.iter().map(|segment| segment.ident.to_string()).collect()
}

fn fields(before: &str, fields: &Fields) -> BTreeMap<String, Type> {
    let name = |(number, field): (usize, &syn::Field)| {
        let name = field.ident.as_ref().map_or_else(|| number.to_string(), ToString::to_string);
        (format!("{before}{name}"), field.ty.clone())
    };
    fields.iter().enumerate().map(name).collect()
}

fn result(output: &ReturnType) -> Option<Type> {
    match output {
        ReturnType::Type(_, written) => Some((**written).clone()),
        ReturnType::Default => None,
    }
}

fn join(folder: &str, name: &str) -> String {
    if folder.is_empty() { name.to_owned() } else { format!("{folder}/{name}") }
}

/// Whether attributes say that something is only built for tests.
pub(crate) fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        syn::Meta::List(list) if list.path.is_ident("cfg") => {
            let condition = list.tokens.to_string().replace(' ', "");
            condition == "test" || condition.starts_with("all(test,")
        }
        _ => false,
    })
}

fn is_for_tests(item: &Item) -> bool {
    match item {
        Item::Mod(item) => is_test(&item.attrs),
        Item::Fn(item) => is_test(&item.attrs),
        Item::Impl(item) => is_test(&item.attrs),
        Item::Use(item) => is_test(&item.attrs),
        Item::Struct(item) => is_test(&item.attrs),
        Item::Enum(item) => is_test(&item.attrs),
        Item::Const(item) => is_test(&item.attrs),
        Item::Macro(item) => is_test(&item.attrs),
        _ => false,
    }
}

/// The file that `#[path = "…"]` names.
fn path_attribute(attribute: &syn::Attribute) -> Option<String> {
    let syn::Meta::NameValue(pair) = &attribute.meta else { return None };
    match &pair.value {
        syn::Expr::Lit(syn::ExprLit { lit: syn::Lit::Str(path), .. })
            if pair.path.is_ident("path") =>
        {
            Some(path.value())
        }
        _ => None,
    }
}
