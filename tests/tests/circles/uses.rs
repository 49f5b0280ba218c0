//! What each file of a crate uses of the others.

use std::collections::BTreeMap;

use syn::parse::{ParseStream, Parser};
use syn::punctuated::Punctuated;
use syn::visit::{self, Visit};
use syn::{Expr, FnArg, GenericArgument, Pat, PathArguments, Token, Type, TypeParamBound};

use crate::Uses;
use crate::krate::{self, Crate, Found, ItemId, ModuleId};

/// Which file uses which other, and what of it.
pub(crate) fn between_files(krate: &Crate) -> Uses {
    let mut uses = Uses::new();
    for (module, content) in krate.modules.iter().enumerate() {
        let locals = BTreeMap::new();
        let parameters = BTreeMap::new();
        let mut reader = Reader { krate, module, me: None, parameters, locals, uses: &mut uses };
        content.content.iter().for_each(|item| reader.visit_item(item));
    }
    uses
}

/// The type of a value, as far as it matters here.
#[derive(Clone, Debug)]
enum Kind {
    /// A type or trait of this crate.
    Ours(ItemId),
    /// Another type, with what it holds.
    Holds(Vec<Option<Kind>>),
}

/// Types that are no more than a way to what they hold.
const POINTERS: [&str; 7] = ["Arc", "Box", "Cow", "MutexGuard", "Rc", "Ref", "RefMut"];

/// Methods of other types that lead from what holds something to that itself.
const OPENS: [&str; 7] = [
    "unwrap",
    "expect",
    "unwrap_or_default",
    "unwrap_or",
    "unwrap_or_else",
    "borrow",
    "borrow_mut",
];

/// Methods of other types that give one of what is held, if there is one.
const PICKS: [&str; 14] = [
    "get",
    "get_mut",
    "first",
    "first_mut",
    "last",
    "last_mut",
    "next",
    "next_back",
    "pop",
    "pop_front",
    "pop_back",
    "front",
    "back",
    "peek",
];

/// Methods of other types that give something else than they hold.
const LEAVES: [&str; 8] =
    ["map", "and_then", "flat_map", "filter_map", "zip", "enumerate", "fold", "collect"];

/// Methods that types of the standard library have too.
const COMMON: [&str; 60] = [
    "abs",
    "all",
    "and_then",
    "any",
    "as_bytes",
    "as_ref",
    "as_str",
    "chain",
    "clear",
    "clone",
    "contains",
    "end",
    "entry",
    "eq",
    "extend",
    "fill",
    "find",
    "first",
    "flush",
    "get",
    "insert",
    "into_iter",
    "is_empty",
    "is_some",
    "iter",
    "join",
    "keys",
    "kind",
    "last",
    "len",
    "lines",
    "lock",
    "map",
    "max",
    "merge",
    "min",
    "new",
    "next",
    "parse",
    "path",
    "peek",
    "pop",
    "position",
    "push",
    "read",
    "remove",
    "replace",
    "send",
    "set",
    "split",
    "start",
    "step_by",
    "take",
    "to_string",
    "trim",
    "try_into",
    "unwrap",
    "values",
    "wait",
    "write",
];

struct Reader<'a> {
    krate: &'a Crate,
    module: ModuleId,
    /// What `Self` is.
    me: Option<ItemId>,
    /// What the type parameters in force are bound to.
    parameters: BTreeMap<String, Option<Kind>>,
    /// The variables met so far in this function.
    locals: BTreeMap<String, Option<Kind>>,
    uses: &'a mut Uses,
}

impl Reader<'_> {
    fn use_of(&mut self, module: ModuleId, name: String) {
        let file = |module: ModuleId| &self.krate.modules[module].file;
        let (here, there) = (file(self.module), file(module));
        if here != there {
            let uses = self.uses.entry(here.clone()).or_default();
            uses.entry(there.clone()).or_default().insert(name);
        }
    }

    fn use_path(&mut self, names: &[String]) {
        match self.found(names) {
            Some(Found::Item(id)) => self.use_of(id.0, id.1),
            Some(Found::Of(id, name)) => {
                self.use_method(&id, &name);
                if names[0] != "Self" {
                    self.use_of(id.0, id.1);
                }
            }
            Some(Found::Module(_)) | None => {}
        }
    }

    fn use_method(&mut self, id: &ItemId, name: &str) {
        if let Some((module, _)) = self.method(id, name) {
            self.use_of(module, format!("{}::{name}", id.1));
        }
    }

    /// Where a method of a type is, and what it gives.
    fn method(&self, id: &ItemId, name: &str) -> Option<(ModuleId, Option<Kind>)> {
        let known = self.krate.items.get(id)?;
        if let Some(method) = known.methods.get(name) {
            let result = method.result.as_ref();
            let result = result.and_then(|written| self.kind(method.module, Some(id), written));
            return Some((method.module, result));
        }
        known.traits.iter().filter(|given| *given != id).find_map(|given| self.method(given, name))
    }

    /// A type that is written in a module.
    fn kind(&self, module: ModuleId, me: Option<&ItemId>, written: &Type) -> Option<Kind> {
        let kind = |inner: &Type| self.kind(module, me, inner);
        match written {
            Type::Reference(inner) => kind(&inner.elem),
            Type::Paren(inner) => kind(&inner.elem),
            Type::Slice(inner) => Some(Kind::Holds(vec![kind(&inner.elem)])),
            Type::Array(inner) => Some(Kind::Holds(vec![kind(&inner.elem)])),
            Type::Tuple(inner) => Some(Kind::Holds(inner.elems.iter().map(kind).collect())),
            Type::ImplTrait(inner) => self.bound(module, me, &inner.bounds),
            Type::TraitObject(inner) => self.bound(module, me, &inner.bounds),
            Type::Path(path) => self.path(module, me, &path.path),
            _ => None,
        }
    }

    fn bound(
        &self,
        module: ModuleId,
        me: Option<&ItemId>,
        bounds: &Punctuated<TypeParamBound, Token![+]>,
    ) -> Option<Kind> {
        bounds.iter().find_map(|bound| match bound {
            TypeParamBound::Trait(bound) => self.path(module, me, &bound.path),
            _ => None,
        })
    }

    fn path(&self, module: ModuleId, me: Option<&ItemId>, path: &syn::Path) -> Option<Kind> {
        let names = krate::segments(path);
        if names[0] == "Self" {
            return match names.get(1) {
                None => me.cloned().map(Kind::Ours),
                Some(name) => self.method(me?, name)?.1,
            };
        }
        match self.krate.find(module, &names) {
            Some(Found::Item(id)) => match &self.krate.items[&id].is {
                Some(alias) => self.kind(id.0, None, alias),
                None => Some(Kind::Ours(id)),
            },
            Some(Found::Of(..) | Found::Module(_)) => None,
            None if names.len() == 1 && self.parameters.contains_key(&names[0]) => {
                self.parameters[&names[0]].clone()
            }
            // A single letter is a parameter, of which nothing is known here.
            None if names.len() == 1 && names[0].len() == 1 => None,
            None => {
                let PathArguments::AngleBracketed(held) = &path.segments.last()?.arguments else {
                    return Some(Kind::Holds(Vec::new()));
                };
                let held = held.args.iter().filter_map(|held| match held {
                    GenericArgument::Type(held) => Some(self.kind(module, me, held)),
                    GenericArgument::AssocType(held) => Some(self.kind(module, me, &held.ty)),
                    _ => None,
                });
                let mut held: Vec<Option<Kind>> = held.collect();
                match names.last() {
                    Some(name) if POINTERS.contains(&name.as_str()) => held.pop()?,
                    _ => Some(Kind::Holds(held)),
                }
            }
        }
    }

    /// The type of an expression, where it can be told.
    fn type_of(&self, expression: &Expr) -> Option<Kind> {
        match expression {
            Expr::Paren(inner) => self.type_of(&inner.expr),
            Expr::Group(inner) => self.type_of(&inner.expr),
            Expr::Reference(inner) => self.type_of(&inner.expr),
            Expr::Unary(inner) if matches!(inner.op, syn::UnOp::Deref(_)) => {
                self.type_of(&inner.expr)
            }
            Expr::Try(inner) => self.held(&inner.expr, 0),
            Expr::Await(inner) => self.type_of(&inner.base),
            Expr::Index(inner) => match &*inner.index {
                Expr::Range(_) => self.type_of(&inner.expr),
                _ => self.last_held(&inner.expr),
            },
            Expr::Field(field) => {
                let name = match &field.member {
                    syn::Member::Named(name) => name.to_string(),
                    syn::Member::Unnamed(number) => number.index.to_string(),
                };
                match self.type_of(&field.base)? {
                    Kind::Ours(id) => self.field(&id, &name),
                    Kind::Holds(held) => held.get(name.parse::<usize>().ok()?)?.clone(),
                }
            }
            Expr::Struct(made) => self.path(self.module, self.me.as_ref(), &made.path),
            Expr::Path(path) => self.value(&path.path),
            Expr::Call(call) => match &*call.func {
                Expr::Path(path) => self.value(&path.path).or_else(|| {
                    let name = path.path.segments.last()?.ident.to_string();
                    let held = call.args.first().and_then(|held| self.type_of(held));
                    let of = path.path.segments.iter().rev().nth(1).map(|of| of.ident.to_string());
                    match (of.as_deref(), name.as_str()) {
                        (None, "Some" | "Ok") => Some(Kind::Holds(vec![held])),
                        (Some(of), _) if POINTERS.contains(&of) => held,
                        (Some("mem"), _) => held,
                        // What another crate gives is its own.
                        (Some(_), _) => Some(Kind::Holds(Vec::new())),
                        _ => None,
                    }
                }),
                _ => None,
            },
            Expr::MethodCall(call) => {
                let name = call.method.to_string();
                match self.type_of(&call.receiver)? {
                    Kind::Ours(id) if name == "clone" => Some(Kind::Ours(id)),
                    Kind::Ours(id) => self.method(&id, &name)?.1,
                    Kind::Holds(_) if OPENS.contains(&name.as_str()) => {
                        self.held(&call.receiver, 0)
                    }
                    Kind::Holds(held) if PICKS.contains(&name.as_str()) => {
                        Some(Kind::Holds(vec![held.last()?.clone()]))
                    }
                    Kind::Holds(_) if LEAVES.contains(&name.as_str()) => None,
                    holds @ Kind::Holds(_) => Some(holds),
                }
            }
            Expr::Block(block) => match block.block.stmts.last()? {
                syn::Stmt::Expr(last, None) => self.type_of(last),
                _ => None,
            },
            Expr::If(choice) => match choice.then_branch.stmts.last()? {
                syn::Stmt::Expr(last, None) => self.type_of(last),
                _ => None,
            },
            Expr::Match(choice) => choice.arms.iter().find_map(|arm| self.type_of(&arm.body)),
            Expr::Lit(_) | Expr::Range(_) | Expr::Binary(_) | Expr::Cast(_) => {
                Some(Kind::Holds(Vec::new()))
            }
            _ => None,
        }
    }

    fn held(&self, expression: &Expr, number: usize) -> Option<Kind> {
        match self.type_of(expression)? {
            Kind::Holds(held) => held.get(number)?.clone(),
            Kind::Ours(_) => None,
        }
    }

    fn last_held(&self, expression: &Expr) -> Option<Kind> {
        match self.type_of(expression)? {
            Kind::Holds(held) => held.last()?.clone(),
            Kind::Ours(_) => None,
        }
    }

    fn field(&self, id: &ItemId, name: &str) -> Option<Kind> {
        let written = self.krate.items.get(id)?.fields.get(name)?;
        self.kind(id.0, Some(id), written)
    }

    /// The type of a variable, constant, variant, or of what a function gives.
    fn value(&self, path: &syn::Path) -> Option<Kind> {
        let names = krate::segments(path);
        if let [name] = &names[..]
            && let Some(local) = self.locals.get(name)
        {
            return local.clone();
        }
        match self.found(&names)? {
            Found::Of(id, name) => match self.method(&id, &name) {
                Some((_, result)) => result,
                None => Some(Kind::Ours(id)),
            },
            Found::Item(id) => match &self.krate.items[&id].is {
                Some(written) => self.kind(id.0, None, written),
                None => Some(Kind::Ours(id)),
            },
            Found::Module(_) => None,
        }
    }

    fn found(&self, names: &[String]) -> Option<Found> {
        if names[0] == "Self" {
            let me = self.me.clone()?;
            return Some(match names.get(1) {
                Some(name) => Found::Of(me, name.clone()),
                None => Found::Item(me),
            });
        }
        self.krate.find(self.module, names)
    }

    /// Takes down the variables of a pattern.
    fn bind(&mut self, pattern: &Pat, kind: Option<Kind>) {
        match pattern {
            Pat::Ident(name) => {
                if let Some((_, inner)) = &name.subpat {
                    self.bind(inner, kind.clone());
                }
                self.locals.insert(name.ident.to_string(), kind);
            }
            Pat::Reference(inner) => self.bind(&inner.pat, kind),
            Pat::Paren(inner) => self.bind(&inner.pat, kind),
            Pat::Guard(inner) => self.bind(&inner.pat, kind),
            Pat::Type(inner) => {
                let kind = self.kind(self.module, self.me.as_ref(), &inner.ty);
                self.bind(&inner.pat, kind);
            }
            Pat::Or(inner) => inner.cases.iter().for_each(|case| self.bind(case, kind.clone())),
            Pat::Slice(inner) => {
                let held = match kind {
                    Some(Kind::Holds(held)) => held.last().cloned().flatten(),
                    _ => None,
                };
                inner.elems.iter().for_each(|part| self.bind(part, held.clone()));
            }
            Pat::Tuple(inner) => {
                for (number, part) in inner.elems.iter().enumerate() {
                    let held = match &kind {
                        Some(Kind::Holds(held)) => held.get(number).cloned().flatten(),
                        _ => None,
                    };
                    self.bind(part, held);
                }
            }
            Pat::TupleStruct(inner) => {
                let names = krate::segments(&inner.path);
                let of = self.found(&names);
                for (number, part) in inner.elems.iter().enumerate() {
                    let held = match (&of, names[names.len() - 1].as_str(), &kind) {
                        (Some(Found::Of(id, name)), ..) => {
                            self.field(id, &format!("{name}.{number}"))
                        }
                        (Some(Found::Item(id)), ..) => self.field(id, &number.to_string()),
                        (None, "Some" | "Ok", Some(Kind::Holds(held))) => {
                            held.first().cloned().flatten()
                        }
                        (None, "Err", Some(Kind::Holds(held))) => held.get(1).cloned().flatten(),
                        _ => None,
                    };
                    self.bind(part, held);
                }
            }
            Pat::Struct(inner) => {
                let of = self.found(&krate::segments(&inner.path));
                for part in &inner.fields {
                    let syn::Member::Named(name) = &part.member else { continue };
                    let held = match &of {
                        Some(Found::Of(id, variant)) => {
                            self.field(id, &format!("{variant}.{name}"))
                        }
                        Some(Found::Item(id)) => self.field(id, &name.to_string()),
                        _ => None,
                    };
                    self.bind(&part.pat, held);
                }
            }
            _ => {}
        }
    }

    fn generic(&mut self, generics: &syn::Generics, read: impl FnOnce(&mut Self)) {
        let before = self.parameters.clone();
        for parameter in generics.type_params() {
            let bound = self.bound(self.module, None, &parameter.bounds);
            self.parameters.insert(parameter.ident.to_string(), bound);
        }
        for condition in generics.where_clause.iter().flat_map(|clause| &clause.predicates) {
            let syn::WherePredicate::Type(condition) = condition else { continue };
            let Type::Path(of) = &condition.bounded_ty else { continue };
            let bound = self.bound(self.module, None, &condition.bounds);
            if let (Some(name), Some(_)) = (of.path.get_ident(), &bound) {
                self.parameters.insert(name.to_string(), bound);
            }
        }
        read(self);
        self.parameters = before;
    }

    /// Reads what stands in a type, trait or `impl`, of which `me` is `Self`.
    fn within(
        &mut self,
        me: Option<ItemId>,
        generics: &syn::Generics,
        read: impl FnOnce(&mut Self),
    ) {
        let before = std::mem::replace(&mut self.me, me);
        self.generic(generics, read);
        self.me = before;
    }

    fn function(&mut self, signature: &syn::Signature, read: impl FnOnce(&mut Self)) {
        self.generic(&signature.generics, |this| this.arguments(signature, read));
    }

    fn arguments(&mut self, signature: &syn::Signature, read: impl FnOnce(&mut Self)) {
        let before = self.locals.clone();
        for argument in &signature.inputs {
            match argument {
                FnArg::Receiver(_) => {
                    let me = self.me.clone().map(Kind::Ours);
                    self.locals.insert("self".into(), me);
                }
                FnArg::Typed(argument) => {
                    let kind = self.kind(self.module, self.me.as_ref(), &argument.ty);
                    self.bind(&argument.pat, kind);
                }
            }
        }
        read(self);
        self.locals = before;
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_attribute(&mut self, _: &'ast syn::Attribute) {}
    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {}
    fn visit_item_use(&mut self, _: &'ast syn::ItemUse) {}
    // The modules within this one are read by themselves.
    fn visit_item_mod(&mut self, _: &'ast syn::ItemMod) {}

    fn visit_item_impl(&mut self, item: &'ast syn::ItemImpl) {
        let me = self.krate.type_of(self.module, &item.self_ty);
        self.within(me, &item.generics, |this| visit::visit_item_impl(this, item));
    }

    fn visit_item_struct(&mut self, item: &'ast syn::ItemStruct) {
        let me = (self.module, item.ident.to_string());
        self.within(Some(me), &item.generics, |this| visit::visit_item_struct(this, item));
    }

    fn visit_item_enum(&mut self, item: &'ast syn::ItemEnum) {
        let me = (self.module, item.ident.to_string());
        self.within(Some(me), &item.generics, |this| visit::visit_item_enum(this, item));
    }

    fn visit_item_trait(&mut self, item: &'ast syn::ItemTrait) {
        let me = (self.module, item.ident.to_string());
        self.within(Some(me), &item.generics, |this| visit::visit_item_trait(this, item));
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.function(&item.sig, |this| visit::visit_item_fn(this, item));
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        if !krate::is_test(&item.attrs) {
            self.function(&item.sig, |this| visit::visit_impl_item_fn(this, item));
        }
    }

    fn visit_trait_item_fn(&mut self, item: &'ast syn::TraitItemFn) {
        self.function(&item.sig, |this| visit::visit_trait_item_fn(this, item));
    }

    fn visit_local(&mut self, local: &'ast syn::Local) {
        visit::visit_local(self, local);
        let kind = local.init.as_ref().and_then(|init| self.type_of(&init.expr));
        self.bind(&local.pat, kind);
    }

    fn visit_expr_let(&mut self, choice: &'ast syn::ExprLet) {
        visit::visit_expr_let(self, choice);
        let kind = self.type_of(&choice.expr);
        self.bind(&choice.pat, kind);
    }

    fn visit_expr_match(&mut self, choice: &'ast syn::ExprMatch) {
        self.visit_expr(&choice.expr);
        let kind = self.type_of(&choice.expr);
        for arm in &choice.arms {
            self.bind(&arm.pat, kind.clone());
            self.visit_arm(arm);
        }
    }

    fn visit_expr_for_loop(&mut self, repeat: &'ast syn::ExprForLoop) {
        let kind = self.last_held(&repeat.expr);
        self.bind(&repeat.pat, kind);
        visit::visit_expr_for_loop(self, repeat);
    }

    fn visit_expr_closure(&mut self, closure: &'ast syn::ExprClosure) {
        for input in &closure.inputs {
            // What it takes may be known from what calls it.
            if !matches!(input, Pat::Ident(name) if self.locals.contains_key(&name.ident.to_string()))
            {
                self.bind(input, None);
            }
        }
        visit::visit_expr_closure(self, closure);
    }

    fn visit_expr_method_call(&mut self, call: &'ast syn::ExprMethodCall) {
        let name = call.method.to_string();
        self.visit_expr(&call.receiver);
        match self.type_of(&call.receiver) {
            Some(Kind::Ours(id)) => self.use_method(&id, &name),
            Some(Kind::Holds(held)) => {
                for argument in &call.args {
                    let Expr::Closure(closure) = argument else { continue };
                    if let Some(input) = closure.inputs.last() {
                        self.bind(input, held.last().cloned().flatten());
                    }
                }
            }
            None => {
                let defined = self.krate.methods.get(&name);
                let mut files = defined.into_iter().flatten().copied();
                if let (Some(only), None) = (files.next(), files.next())
                    && !COMMON.contains(&name.as_str())
                {
                    self.use_of(only, format!(".{name}()"));
                }
            }
        }
        call.args.iter().for_each(|argument| self.visit_expr(argument));
    }

    fn visit_expr_path(&mut self, path: &'ast syn::ExprPath) {
        match path.path.get_ident() {
            Some(name) if self.locals.contains_key(&name.to_string()) => {}
            _ => visit::visit_expr_path(self, path),
        }
    }

    fn visit_pat_ident(&mut self, name: &'ast syn::PatIdent) {
        // An upper case name is a constant or a variant.
        let text = name.ident.to_string();
        if text.starts_with(char::is_uppercase) {
            self.use_path(&[text]);
        }
        visit::visit_pat_ident(self, name);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.use_path(&krate::segments(path));
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        let names = krate::segments(&call.path);
        if let Some(module) = self.krate.macros.get(&names[names.len() - 1]) {
            self.use_of(*module, format!("{}!", names[names.len() - 1]));
        }
        let expressions =
            |input: ParseStream<'_>| Punctuated::<Expr, Token![,]>::parse_terminated(input);
        let matches = |input: ParseStream<'_>| {
            let value: Expr = input.parse()?;
            input.parse::<Token![,]>()?;
            let pattern = Pat::parse_multi_with_leading_vert(input)?;
            let guard = match input.parse::<Option<Token![if]>>()? {
                Some(_) => Some(input.parse::<Expr>()?),
                None => None,
            };
            input.parse::<Option<Token![,]>>()?;
            Ok((value, pattern, guard))
        };
        if let Ok(expressions) = expressions.parse2(call.tokens.clone()) {
            expressions.iter().for_each(|expression| self.visit_expr(expression));
        } else if let Ok((value, pattern, guard)) = matches.parse2(call.tokens.clone()) {
            self.visit_expr(&value);
            let kind = self.type_of(&value);
            self.bind(&pattern, kind);
            self.visit_pat(&pattern);
            guard.iter().for_each(|guard| self.visit_expr(guard));
        }
    }
}
