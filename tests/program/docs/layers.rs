//! Modules depend on each other without circles: of the modules in one folder, each uses those
//! that do not use it, directly or through others. Crates cannot form circles at all.
//!
//! A module counts with all that is below it. What a module and its parent use of each other is
//! not looked at, and neither are tests and the bodies of macros.

use super::{name, text};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use syn::visit::{self, Visit};
use syn::{Attribute, Item, ItemMod, ItemUse, UseTree};
use trisect_tests::root;

/// Path of a module inside its crate, or of an item.
type Segments = Vec<String>;

/// Names in the source of a module.
#[derive(Default)]
struct Names {
    /// Paths that begin with `crate`, `self` or `super`, and those of `use`.
    paths: Vec<Segments>,
    /// Items that `use` brings into the module, by their names there.
    imports: BTreeMap<String, Segments>,
}

/// Modules of a crate by their paths.
type Modules = BTreeMap<Segments, Names>;

/// Uses between the modules of one folder: which uses which, and where.
type Uses = BTreeMap<String, BTreeMap<String, BTreeSet<String>>>;

/// Collects the names of a module and of the modules that are written out inside it.
struct Collector<'a> {
    modules: &'a mut Modules,
    module: Segments,
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute.parse_args::<syn::Path>().is_ok_and(|path| path.is_ident("test"))
    })
}

/// Adds the paths of a `use` to `found`, each with its name in the module.
fn expand(tree: &UseTree, before: &[String], found: &mut Vec<(Option<String>, Segments)>) {
    let with = |name: String| [before, &[name]].concat();
    match tree {
        UseTree::Path(path) => expand(&path.tree, &with(path.ident.to_string()), found),
        UseTree::Name(name) if name.ident == "self" => found.push((before.last().cloned(), before.to_vec())),
        UseTree::Name(name) => found.push((Some(name.ident.to_string()), with(name.ident.to_string()))),
        UseTree::Rename(name) => found.push((Some(name.rename.to_string()), with(name.ident.to_string()))),
        UseTree::Glob(_) => found.push((None, before.to_vec())),
        UseTree::Group(group) => group.items.iter().for_each(|item| expand(item, before, found)),
    }
}

impl Visit<'_> for Collector<'_> {
    fn visit_item(&mut self, item: &Item) {
        let attributes: &[Attribute] = match item {
            Item::Mod(item) => &item.attrs,
            Item::Fn(item) => &item.attrs,
            Item::Use(item) => &item.attrs,
            Item::Impl(item) => &item.attrs,
            _ => &[],
        };
        if !is_test(attributes) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, item: &ItemMod) {
        if item.content.is_some() {
            self.module.push(item.ident.to_string());
            self.modules.entry(self.module.clone()).or_default();
            visit::visit_item_mod(self, item);
            self.module.pop();
        }
    }

    fn visit_item_use(&mut self, item: &ItemUse) {
        let mut found = Vec::new();
        expand(&item.tree, &[], &mut found);
        let names = self.modules.entry(self.module.clone()).or_default();
        for (name, path) in found {
            names.paths.push(path.clone());
            names.imports.extend(name.map(|name| (name, path)));
        }
    }

    fn visit_path(&mut self, path: &syn::Path) {
        let segments: Segments = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
        if matches!(segments[0].as_str(), "crate" | "self" | "super") {
            self.modules.entry(self.module.clone()).or_default().paths.push(segments);
        }
        visit::visit_path(self, path);
    }
}

/// Reads the modules of a crate from its `src` folder.
fn read(folder: &Path, module: &[String], modules: &mut Modules) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if stem == "tests" || stem == "testing" || stem.ends_with("_tests") {
            continue;
        }
        let own = match stem.as_str() {
            "lib" | "main" | "mod" => module.to_vec(),
            _ => [module, std::slice::from_ref(&stem)].concat(),
        };
        if path.is_dir() {
            read(&path, &own, modules);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            add(modules, own, &text(&path));
        }
    }
}

fn add(modules: &mut Modules, module: Segments, source: &str) {
    let file = syn::parse_file(source).unwrap();
    modules.entry(module.clone()).or_default();
    Collector { modules, module }.visit_file(&file);
}

/// Returns a path from the root of the crate; `None` for one into another crate.
fn absolute(modules: &Modules, module: &[String], path: &[String]) -> Option<Segments> {
    let mut base = module.to_vec();
    let mut rest = path;
    match path.first()?.as_str() {
        "crate" => (base.clear(), rest = &rest[1..]).0,
        "self" => rest = &rest[1..],
        "super" => {
            while rest.first().is_some_and(|segment| segment == "super") {
                base.pop()?;
                rest = &rest[1..];
            }
        }
        first if modules.contains_key(&[module, &[first.to_owned()]].concat()) => {}
        _ => return None,
    }
    Some([&base[..], rest].concat())
}

/// Returns the module that an absolute path leads to, through what modules bring in by `use`.
fn resolve(modules: &Modules, path: &[String], depth: u32) -> Segments {
    let length = (0..=path.len()).rev().find(|&length| modules.contains_key(&path[..length])).unwrap_or(0);
    let (module, rest) = path.split_at(length);
    if let Some(names) = rest.first().and_then(|first| Some((modules.get(module)?, first))) {
        let target = names.0.imports.get(names.1).and_then(|path| absolute(modules, module, path));
        if let Some(target) = target.filter(|target| depth > 0 && target != path) {
            return resolve(modules, &target, depth - 1);
        }
    }
    module.to_vec()
}

/// Returns the uses between modules, by the folder that they are in.
fn uses(modules: &Modules) -> BTreeMap<Segments, Uses> {
    let mut folders: BTreeMap<Segments, Uses> = BTreeMap::new();
    for (module, names) in modules {
        for path in &names.paths {
            let Some(path) = absolute(modules, module, path) else { continue };
            let target = resolve(modules, &path, 4);
            let shared = module.iter().zip(&target).take_while(|(a, b)| a == b).count();
            if let (Some(user), Some(used)) = (module.get(shared), target.get(shared)) {
                let folder = folders.entry(module[..shared].to_vec()).or_default();
                let places = folder.entry(user.clone()).or_default().entry(used.clone()).or_default();
                places.insert(module.join("::"));
            }
        }
    }
    folders
}

/// Returns whether `to` is used by `from`, directly or through others.
fn reaches(uses: &Uses, from: &str, to: &str, seen: &mut BTreeSet<String>) -> bool {
    uses.get(from).is_some_and(|used| {
        used.keys().any(|next| next == to || seen.insert(next.clone()) && reaches(uses, next, to, seen))
    })
}

/// Returns a line for each use that is part of a circle.
fn circles(modules: &Modules) -> Vec<String> {
    let mut found = Vec::new();
    for (folder, uses) in uses(modules) {
        for (user, used) in &uses {
            for (used, places) in used {
                if reaches(&uses, used, user, &mut BTreeSet::new()) {
                    found.push(format!("{}: {user} uses {used} in {places:?}", folder.join("::")));
                }
            }
        }
    }
    found
}

/// Returns the `src` folders of the workspace's crates.
fn crates() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = ["shared", "kernels", "host", "tests"].map(|folder| root().join(folder)).to_vec();
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.ends_with("src") && folder.join("Cargo.toml").exists() {
                found.push(path);
            } else if path.is_dir() {
                open.push(path);
            }
        }
    }
    found.sort();
    found
}

#[test]
fn modules_form_no_circle() {
    let crates = crates();
    assert!(crates.len() >= 12, "{crates:?}");
    let mut found = Vec::new();
    for folder in &crates {
        let mut modules = Modules::new();
        read(folder, &[], &mut modules);
        found.extend(circles(&modules).into_iter().map(|line| format!("{}: {line}", name(folder))));
    }
    assert!(found.is_empty(), "{} uses in circles:\n{}", found.len(), found.join("\n"));
}

/// Negative controls: circles of two and three modules, through names that another module brings
/// into scope, and inside a folder. A module and its parent form no circle.
#[test]
fn circles_are_found() {
    let of = |files: &[(&str, &str)]| {
        let mut modules = Modules::new();
        for (path, source) in files {
            add(
                &mut modules,
                path.split("::").filter(|name| !name.is_empty()).map(str::to_owned).collect(),
                source,
            );
        }
        circles(&modules).len()
    };
    assert_eq!(of(&[("", "mod a; mod b;"), ("a", "use crate::b::B;"), ("b", "pub struct B;")]), 0);
    assert_eq!(of(&[("", "mod a; mod b;"), ("a", "use super::b::B;"), ("b", "fn b() { crate::a::a() }")]), 2);
    let three =
        [("a", "use crate::b;"), ("b", "use crate::{c::C, d};"), ("c", "use crate::a::x;"), ("d", "")];
    assert_eq!(of(&three), 3);
    let renamed = [("", "pub use b::B as Name;"), ("a", "use super::Name;"), ("b", "use super::a;")];
    assert_eq!(of(&renamed), 2);
    let nested =
        [("x", ""), ("x::a", "use super::b;"), ("x::b", "use crate::x::a::A;"), ("y", "use crate::x;")];
    assert_eq!(of(&nested), 2);
    assert_eq!(of(&[("", "mod a; use a::A;"), ("a", "use super::Root;")]), 0);
    assert_eq!(of(&[("a", "#[cfg(test)] mod tests { use crate::b; }"), ("b", "use crate::a;")]), 0);
}
