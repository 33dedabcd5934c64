//! The imports of a crate, file by file, read from its source.
//!
//! A path that begins with `crate`, `self`, `super` or a child module is resolved through modules and re-exports to the
//! file that defines the named item. Code behind `#[cfg(test)]` is ignored: tests may import everything. A re-export
//! (`pub use`) is not an import.
//!
//! An `impl` of a type of another file counts as an import in both directions, because a caller of a method of the type
//! may call code of either file. Exceptions are traits that the file itself defines, and traits with a type argument
//! that the file defines, such as `impl From<Own> for Other`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::Visit;

/// The path of a module below the crate's root; the root itself is empty.
type ModulePath = Vec<String>;

/// Items that a module defines, and names that it imports.
#[derive(Debug, Default)]
struct Module {
    file: PathBuf,
    items: BTreeSet<String>,
    /// Imported paths by the name under which the module imports them.
    names: BTreeMap<String, Vec<String>>,
    globs: Vec<Vec<String>>,
    /// Paths that the module's own code names.
    uses: Vec<Vec<String>>,
    impls: Vec<Implementation>,
}

/// The types and traits of one `impl`, as paths.
#[derive(Debug)]
struct Implementation {
    of: Vec<String>,
    /// The trait and its type arguments.
    trait_and_arguments: Vec<Vec<String>>,
}

/// The modules of a crate.
#[derive(Debug)]
pub(crate) struct Crate {
    name: String,
    source: PathBuf,
    modules: BTreeMap<ModulePath, Module>,
}

/// One import: a file, the file from which it imports, and the imported name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Import {
    pub(crate) from: PathBuf,
    pub(crate) to: PathBuf,
    pub(crate) name: String,
}

impl Crate {
    /// Reads the crate in a folder.
    pub(crate) fn read(folder: &Path) -> Self {
        let source = folder.join("src");
        let name = folder.file_name().expect("a folder has a name").to_string_lossy().into_owned();
        let mut this = Self { name: name.replace('-', "_"), source, modules: BTreeMap::new() };
        let root = this.source.join("lib.rs");
        this.read_file(Vec::new(), root);
        this
    }

    /// Names of the crate's top-level modules that are files or folders.
    pub(crate) fn top_modules(&self) -> Vec<&str> {
        let root = self.source.join("lib.rs");
        let top_modules = self.modules.iter().filter(|(path, m)| path.len() == 1 && m.file != root);
        top_modules.map(|(path, _)| path[0].as_str()).collect()
    }

    /// Top-level module to which a file of this crate belongs; `None` for the root.
    pub(crate) fn top_module_of(&self, file: &Path) -> Option<String> {
        let inside = file.strip_prefix(&self.source).ok()?;
        let first = inside.iter().next()?.to_string_lossy().into_owned();
        let module = first.strip_suffix(".rs").unwrap_or(&first);
        (module != "lib" && module != "main").then(|| module.to_owned())
    }

    /// All imports between two files.
    pub(crate) fn imports(&self) -> BTreeSet<Import> {
        let mut imports = BTreeSet::new();
        for (path, module) in &self.modules {
            for used in &module.uses {
                let Some(to) = self.file_of(path, used, 0) else { continue };
                if to != module.file {
                    let name = used.last().expect("a path has a segment").clone();
                    imports.insert(Import { from: module.file.clone(), to, name });
                }
            }
        }
        imports.extend(self.foreign_impls().into_iter().flat_map(|import| {
            let Import { from, to, name } = import.clone();
            [import, Import { from: to, to: from, name }]
        }));
        imports
    }

    /// The `impl`s of types that another file defines, as imports from the file of the type by the file of the `impl`.
    pub(crate) fn foreign_impls(&self) -> BTreeSet<Import> {
        let mut foreign = BTreeSet::new();
        for (path, module) in &self.modules {
            for Implementation { of, trait_and_arguments } in &module.impls {
                let file = |named: &Vec<String>| match named.as_slice() {
                    [_] => self.defined(path, named, 0),
                    _ => self.file_of(path, named, 0),
                };
                let Some(to) = file(of).filter(|to| *to != module.file) else { continue };
                if trait_and_arguments.iter().any(|named| self.is_defined_in(module, named)) {
                    continue;
                }
                let name = format!("impl {}", of.join("::"));
                foreign.insert(Import { from: module.file.clone(), to, name });
            }
        }
        foreign
    }

    fn is_defined_in(&self, module: &Module, named: &[String]) -> bool {
        matches!(named, [name] if self.defines(&module.file, name))
    }

    /// Paths of the modules below the root that have more than `most` files, including the files of all their
    /// descendants.
    pub(crate) fn large_modules(&self, most: usize) -> Vec<ModulePath> {
        let is_file = |path: &ModulePath| {
            let parent = self.modules.get(&path[..path.len().saturating_sub(1)]);
            parent.is_none_or(|parent| parent.file != self.modules[path].file)
        };
        let files_below = |path: &ModulePath| {
            let below = self.modules.keys().filter(|other| other.starts_with(path));
            below.filter(|other| is_file(other)).count()
        };
        let large = self.modules.keys().filter(|path| !path.is_empty() && is_file(path));
        large.filter(|path| files_below(path) > most).cloned().collect()
    }

    /// The file of a module.
    pub(crate) fn file(&self, path: &[String]) -> &Path {
        &self.modules[path].file
    }

    /// The child of a module to which a file belongs; `None` for the module's own file and files outside it.
    pub(crate) fn child_of(&self, path: &[String], file: &Path) -> Option<&str> {
        let below = self
            .modules
            .iter()
            .filter(|(other, _)| other.len() > path.len() && other.starts_with(path));
        let mut children = below.filter(|(_, module)| module.file == file);
        let own = self.file(path);
        children.find(|(_, module)| module.file != own).map(|(other, _)| other[path.len()].as_str())
    }

    /// The children of a module that have files of their own.
    pub(crate) fn children(&self, path: &[String]) -> BTreeSet<String> {
        let own = self.file(path);
        let children = self.modules.iter().filter(|(other, module)| {
            other.len() == path.len() + 1 && other.starts_with(path) && module.file != own
        });
        children.map(|(other, _)| other[path.len()].clone()).collect()
    }

    fn read_file(&mut self, path: ModulePath, file: PathBuf) {
        let text = std::fs::read_to_string(&file)
            .unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let parsed =
            syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        self.read_items(path, &file, &parsed.items);
    }

    fn read_items(&mut self, path: ModulePath, file: &Path, items: &[syn::Item]) {
        let mut module = Module { file: file.to_owned(), ..Module::default() };
        let mut paths = Paths::default();
        for item in items {
            if is_test(attributes(item)) {
                continue;
            }
            module.items.extend(name_of(item));
            match item {
                syn::Item::Use(item) => {
                    let passes_on = !matches!(item.vis, syn::Visibility::Inherited);
                    let mut found = Vec::new();
                    flatten(&item.tree, &mut Vec::new(), &mut found);
                    for (name, full) in found {
                        if !passes_on {
                            module.uses.push(full.clone());
                        }
                        match name {
                            Some(name) => drop(module.names.insert(name, full)),
                            None => module.globs.push(full),
                        }
                    }
                }
                syn::Item::Mod(item) => {
                    let mut child = path.clone();
                    child.push(item.ident.to_string());
                    match &item.content {
                        Some((_, items)) => self.read_items(child, file, items),
                        None => {
                            let file = self.file_below(&path, file, item);
                            self.read_file(child, file);
                        }
                    }
                }
                syn::Item::Impl(item) => {
                    module.impls.extend(implementation(item));
                    paths.visit_item_impl(item);
                }
                other => paths.visit_item(other),
            }
        }
        module.uses.append(&mut paths.found);
        self.modules.insert(path, module);
    }

    fn file_below(&self, path: &[String], parent: &Path, item: &syn::ItemMod) -> PathBuf {
        let folder = path.iter().fold(self.source.clone(), |folder, name| folder.join(name));
        let name = item.ident.to_string();
        let candidates = [folder.join(format!("{name}.rs")), folder.join(&name).join("mod.rs")];
        let found = candidates.into_iter().find(|file| file.is_file());
        found.unwrap_or_else(|| panic!("{}: no file for `mod {name};`", parent.display()))
    }

    /// The file that defines the item which a path names in a module; `None` if the item is not of this crate.
    fn file_of(&self, from: &[String], path: &[String], depth: usize) -> Option<PathBuf> {
        let mut at: ModulePath;
        let mut rest = path;
        match path.first()?.as_str() {
            "crate" => at = Vec::new(),
            name if name == self.name => at = Vec::new(),
            "self" => at = from.to_vec(),
            "super" => {
                at = from.to_vec();
                at.pop();
                while rest.get(1).is_some_and(|segment| segment == "super") {
                    at.pop();
                    rest = &rest[1..];
                }
            }
            child => {
                at = from.to_vec();
                at.push(child.to_owned());
                if !self.modules.contains_key(&at) {
                    at.pop();
                    // the name is imported in this module, or is not of this crate
                    let known = depth > 0 && self.modules[from].names.contains_key(child);
                    return if known { self.defined(&at, path, depth) } else { None };
                }
            }
        }
        rest = &rest[1..];
        while let Some(segment) = rest.first() {
            at.push(segment.clone());
            if !self.modules.contains_key(&at) {
                at.pop();
                break;
            }
            rest = &rest[1..];
        }
        self.defined(&at, rest, depth)
    }

    /// The file that defines the first name of `rest` within a module.
    fn defined(&self, at: &[String], rest: &[String], depth: usize) -> Option<PathBuf> {
        let module = self.modules.get(at)?;
        let Some(name) = rest.first() else { return Some(module.file.clone()) };
        if module.items.contains(name) || name == "*" || depth > 8 {
            return Some(module.file.clone());
        }
        if let Some(path) = module.names.get(name) {
            return self.file_of(at, path, depth + 1);
        }
        for glob in &module.globs {
            let mut path = glob.clone();
            path.push(name.clone());
            let target = self.file_of(at, &path, depth + 1);
            if let Some(file) = target
                && file != module.file
                && self.defines(&file, name)
            {
                return Some(file);
            }
        }
        // the item is defined by a macro
        Some(module.file.clone())
    }

    fn defines(&self, file: &Path, name: &str) -> bool {
        self.modules.values().any(|module| module.file == file && module.items.contains(name))
    }
}

/// Collects paths that begin with `crate`, `self` or `super`.
#[derive(Default)]
struct Paths {
    found: Vec<Vec<String>>,
}

impl<'ast> Visit<'ast> for Paths {
    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if segments.len() > 1 && ["crate", "super", "self"].contains(&segments[0].as_str()) {
            self.found.push(segments);
        }
        syn::visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, item: &'ast syn::Macro) {
        self.tokens(item.tokens.clone());
        syn::visit::visit_macro(self, item);
    }

    fn visit_item_mod(&mut self, _: &'ast syn::ItemMod) {}
}

impl Paths {
    /// Collects paths `crate::…` in the arguments and the body of a macro.
    fn tokens(&mut self, tokens: TokenStream) {
        let mut path: Vec<String> = Vec::new();
        for token in tokens {
            match token {
                TokenTree::Ident(name) if name == "crate" || !path.is_empty() => {
                    path.push(name.to_string());
                }
                TokenTree::Punct(colon) if colon.as_char() == ':' && !path.is_empty() => {}
                other => {
                    self.end(&mut path);
                    if let TokenTree::Group(group) = other {
                        self.tokens(group.stream());
                    }
                }
            }
        }
        self.end(&mut path);
    }

    fn end(&mut self, path: &mut Vec<String>) {
        let path = std::mem::take(path);
        if path.len() > 1 {
            self.found.push(path);
        }
    }
}

/// Returns the names and full paths of an import; a glob import has no name.
fn flatten(
    tree: &syn::UseTree,
    before: &mut Vec<String>,
    found: &mut Vec<(Option<String>, Vec<String>)>,
) {
    match tree {
        syn::UseTree::Path(path) => {
            before.push(path.ident.to_string());
            flatten(&path.tree, before, found);
            before.pop();
        }
        syn::UseTree::Group(group) => {
            group.items.iter().for_each(|item| flatten(item, before, found));
        }
        syn::UseTree::Name(name) => {
            let name = name.ident.to_string();
            let known = if name == "self" { before.last().cloned() } else { Some(name.clone()) };
            let full = if name == "self" { before.clone() } else { joined(before, &name) };
            found.push((known, full));
        }
        syn::UseTree::Rename(rename) => {
            found
                .push((Some(rename.rename.to_string()), joined(before, &rename.ident.to_string())));
        }
        syn::UseTree::Glob(_) => found.push((None, before.clone())),
    }
}

/// The paths of an `impl`; `None` for types without a name, such as tuples.
fn implementation(item: &syn::ItemImpl) -> Option<Implementation> {
    let segments =
        |path: &syn::Path| path.segments.iter().map(|s| s.ident.to_string()).collect::<Vec<_>>();
    let named = |of: &syn::Type| match of {
        syn::Type::Path(path) => Some(segments(&path.path)),
        _ => None,
    };
    let of = named(&item.self_ty)?;
    let mut trait_and_arguments = Vec::new();
    if let Some((path, _)) = &item.trait_ {
        trait_and_arguments.push(segments(path));
        for segment in &path.segments {
            if let syn::PathArguments::AngleBracketed(arguments) = &segment.arguments {
                trait_and_arguments.extend(arguments.args.iter().filter_map(|of| match of {
                    syn::GenericArgument::Type(of) => named(of),
                    _ => None,
                }));
            }
        }
    }
    Some(Implementation { of, trait_and_arguments })
}

fn joined(before: &[String], name: &str) -> Vec<String> {
    before.iter().cloned().chain([name.to_owned()]).collect()
}

fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && matches!(&attribute.meta, syn::Meta::List(list) if list.tokens.to_string() == "test")
    })
}

fn attributes(item: &syn::Item) -> &[syn::Attribute] {
    match item {
        syn::Item::Const(item) => &item.attrs,
        syn::Item::Enum(item) => &item.attrs,
        syn::Item::Fn(item) => &item.attrs,
        syn::Item::Impl(item) => &item.attrs,
        syn::Item::Macro(item) => &item.attrs,
        syn::Item::Mod(item) => &item.attrs,
        syn::Item::Static(item) => &item.attrs,
        syn::Item::Struct(item) => &item.attrs,
        syn::Item::Trait(item) => &item.attrs,
        syn::Item::Type(item) => &item.attrs,
        syn::Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

fn name_of(item: &syn::Item) -> Option<String> {
    let name = match item {
        syn::Item::Const(item) => &item.ident,
        syn::Item::Enum(item) => &item.ident,
        syn::Item::Fn(item) => &item.sig.ident,
        syn::Item::Macro(item) => item.ident.as_ref()?,
        syn::Item::Static(item) => &item.ident,
        syn::Item::Struct(item) => &item.ident,
        syn::Item::Trait(item) => &item.ident,
        syn::Item::Type(item) => &item.ident,
        _ => return None,
    };
    Some(name.to_string())
}
