//! The modules of a program or library, and the paths in their code, read with `syn`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use proc_macro2::{TokenStream, TokenTree};
use syn::ext::IdentExt;
use syn::visit::{self, Visit};
use syn::{Attribute, Ident, ImplItem, Item, ItemMod, ItemUse, Meta, UseTree, Visibility};

/// Number of a module in [`Modules`].
type Id = usize;

/// Function that returns the text of a file; `None` if there is no such file.
pub(super) type Read<'a> = dyn Fn(&Path) -> Option<String> + 'a;

/// A path as its segments.
type Segments = Vec<String>;

/// Meaning of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Meaning {
    Module(Id),
    /// An item that is defined in this module.
    ItemOf(Id),
    /// An item or module of another crate.
    Elsewhere,
}

/// A name that a `use` brings into a module.
struct Import {
    name: String,
    path: Segments,
    is_reexport: bool,
}

/// A module: a file, or a part of one in braces.
#[derive(Default)]
struct Module {
    /// Path in the crate; that of its file, for a part in braces.
    name: String,
    parent: Option<Id>,
    children: BTreeMap<String, Id>,
    items: BTreeSet<String>,
    imports: Vec<Import>,
    globs: Vec<Segments>,
    /// Paths in the code of the module.
    paths: BTreeSet<Segments>,
}

/// All modules of a program or library. The first is its root.
pub(super) struct Modules(Vec<Module>);

impl Modules {
    /// Reads the modules from the file of the root on.
    pub(super) fn new(root: &Path, read: &Read) -> Self {
        let mut modules = Self(vec![Module { name: "crate".to_owned(), ..Module::default() }]);
        modules.add_file(0, root, root.parent().unwrap_or(root), read);
        modules
    }

    /// Adds the items of a module's file, whose children are in `folder`.
    fn add_file(&mut self, id: Id, file: &Path, folder: &Path, read: &Read) {
        let text = read(file).unwrap_or_else(|| panic!("{}: no such file", file.display()));
        let parsed = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        self.add_items(id, folder, &parsed.items, read);
    }

    fn add_items(&mut self, id: Id, folder: &Path, items: &[Item], read: &Read) {
        for item in items.iter().filter(|item| !is_test(attributes(item))) {
            if let Item::Mod(module) = item {
                self.add_module(id, folder, module, read);
            } else {
                self.0[id].items.extend(defined(item).map(|name| name.unraw().to_string()));
                self.0[id].visit_item(item);
            }
        }
    }

    /// Adds a child of a module.
    fn add_module(&mut self, parent: Id, folder: &Path, module: &ItemMod, read: &Read) {
        let ident = module.ident.unraw().to_string();
        let name = match &module.content {
            Some(_) => self.0[parent].name.clone(),
            None if parent == 0 => ident.clone(),
            None => format!("{}::{ident}", self.0[parent].name),
        };
        let folder_of_file = if parent == 0 { folder } else { folder.parent().unwrap_or(folder) };
        let (id, folder) = (self.0.len(), folder.join(&ident));
        self.0.push(Module { name, parent: Some(parent), ..Module::default() });
        self.0[parent].children.insert(ident, id);
        if let Some((_, items)) = &module.content {
            return self.add_items(id, &folder, items, read);
        }
        let [beside, inside] = [folder.with_extension("rs"), folder.join("mod.rs")];
        let usual = if read(&inside).is_some() { inside } else { beside };
        let others = other_files(&module.attrs);
        if others.is_empty() {
            self.add_file(id, &usual, &folder, read);
        }
        for other in others {
            let file = folder_of_file.join(other);
            self.add_file(id, &file, file.parent().unwrap_or(&file), read);
        }
    }

    /// Returns the names of the modules, and for each the modules whose items its code uses.
    pub(super) fn edges(&self) -> BTreeMap<String, BTreeSet<String>> {
        let mut edges = BTreeMap::<_, BTreeSet<_>>::new();
        for (id, module) in self.0.iter().enumerate() {
            let imports = module.imports.iter().filter(|import| !import.is_reexport);
            let paths = imports.map(|import| &import.path).chain(&module.globs);
            let paths = paths.chain(&module.paths);
            let used = edges.entry(module.name.clone()).or_default();
            used.extend(
                paths.flat_map(|path| self.meanings(id, path, &mut Vec::new())).filter_map(
                    |meaning| match meaning {
                        Meaning::ItemOf(other) => Some(self.0[other].name.clone()),
                        Meaning::Module(_) | Meaning::Elsewhere => None,
                    },
                ),
            );
            used.remove(&module.name);
        }
        edges
    }

    /// Returns what a path in the code of a module means. `open` has the names that are being
    /// looked up, where modules import from each other.
    fn meanings(&self, id: Id, path: &[String], open: &mut Vec<(Id, String)>) -> BTreeSet<Meaning> {
        let mut found = BTreeSet::from([Meaning::Module(id)]);
        for (number, name) in path.iter().enumerate() {
            let mut next = BTreeSet::new();
            for meaning in found {
                let Meaning::Module(id) = meaning else {
                    next.insert(meaning);
                    continue;
                };
                let named = self.named(id, name, open);
                if named.is_empty() {
                    // A macro makes the item, unless the path begins with another crate.
                    let is_crate = number == 0;
                    next.insert(if is_crate { Meaning::Elsewhere } else { Meaning::ItemOf(id) });
                }
                next.extend(named);
            }
            found = next;
        }
        found
    }

    /// Returns what a name means in a module.
    fn named(&self, id: Id, name: &str, open: &mut Vec<(Id, String)>) -> BTreeSet<Meaning> {
        let module = &self.0[id];
        match name {
            "crate" => return BTreeSet::from([Meaning::Module(0)]),
            "self" => return BTreeSet::from([Meaning::Module(id)]),
            "super" => return module.parent.into_iter().map(Meaning::Module).collect(),
            _ => {}
        }
        let key = (id, name.to_owned());
        if open.contains(&key) {
            return BTreeSet::new();
        }
        open.push(key);
        let mut found = BTreeSet::new();
        found.extend(module.items.contains(name).then_some(Meaning::ItemOf(id)));
        found.extend(module.children.get(name).copied().map(Meaning::Module));
        for import in module.imports.iter().filter(|import| import.name == name) {
            found.extend(self.meanings(id, &import.path, open));
        }
        for glob in &module.globs {
            for meaning in self.meanings(id, glob, open) {
                if let Meaning::Module(other) = meaning {
                    found.extend(self.named(other, name, open));
                }
            }
        }
        open.pop();
        found
    }
}

impl Module {
    /// Adds the names and paths of a `use`; `path` is the part before `tree`.
    fn add_use(&mut self, mut path: Segments, tree: &UseTree, is_reexport: bool) {
        let mut import = |name: &Ident, path| {
            let name = name.unraw().to_string();
            self.imports.push(Import { name, path, is_reexport });
        };
        match tree {
            UseTree::Path(tree) => {
                path.push(tree.ident.unraw().to_string());
                self.add_use(path, &tree.tree, is_reexport);
            }
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.add_use(path.clone(), tree, is_reexport);
                }
            }
            UseTree::Name(tree) if tree.ident == "self" => {
                let Some(name) = path.last().cloned() else { return };
                self.imports.push(Import { name, path, is_reexport });
            }
            UseTree::Name(tree) => {
                path.push(tree.ident.unraw().to_string());
                import(&tree.ident, path);
            }
            UseTree::Rename(tree) => {
                if tree.ident != "self" {
                    path.push(tree.ident.unraw().to_string());
                }
                import(&tree.rename, path);
            }
            UseTree::Glob(_) => self.globs.push(path),
        }
    }

    /// Adds the paths in the tokens of a macro.
    fn add_tokens(&mut self, tokens: TokenStream) {
        let mut path = Segments::new();
        let mut marks = String::new();
        for token in tokens {
            match token {
                TokenTree::Punct(mark) => {
                    marks.push(mark.as_char());
                    continue;
                }
                TokenTree::Ident(name) => {
                    if marks != "::" || path.is_empty() {
                        self.paths.insert(std::mem::take(&mut path));
                    }
                    // What follows a dot is a field or a method.
                    if marks != "." {
                        path.push(name.unraw().to_string());
                    }
                }
                TokenTree::Group(group) => self.add_tokens(group.stream()),
                TokenTree::Literal(_) => {}
            }
            marks.clear();
        }
        self.paths.insert(path);
    }
}

impl<'a> Visit<'a> for Module {
    fn visit_item(&mut self, item: &'a Item) {
        if !is_test(attributes(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_impl_item(&mut self, item: &'a ImplItem) {
        let attributes = match item {
            ImplItem::Const(it) => &it.attrs,
            ImplItem::Fn(it) => &it.attrs,
            ImplItem::Type(it) => &it.attrs,
            _ => &Vec::new(),
        };
        if !is_test(attributes) {
            visit::visit_impl_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'a ItemUse) {
        if item.leading_colon.is_none() {
            let is_reexport = !matches!(item.vis, Visibility::Inherited);
            self.add_use(Segments::new(), &item.tree, is_reexport);
        }
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        if path.leading_colon.is_none() {
            let segments = path.segments.iter().map(|it| it.ident.unraw().to_string());
            self.paths.insert(segments.collect());
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, it: &'a syn::Macro) {
        self.visit_path(&it.path);
        self.add_tokens(it.tokens.clone());
    }

    fn visit_attribute(&mut self, attribute: &'a Attribute) {
        if let Meta::List(list) = &attribute.meta {
            self.add_tokens(list.tokens.clone());
        }
    }
}

/// Returns the files that a module has by `#[cfg_attr(..., path = "...")]`, one for each condition.
fn other_files(attributes: &[Attribute]) -> Vec<String> {
    let lists = attributes.iter().filter_map(|attribute| attribute.meta.require_list().ok());
    let texts = lists.filter(|it| it.path.is_ident("cfg_attr")).map(|it| it.tokens.to_string());
    let path = |text: String| {
        let (_, rest) = text.split_once("path = \"")?;
        rest.split_once('"').map(|(path, _)| path.to_owned())
    };
    texts.filter_map(path).collect()
}

/// Returns whether only tests have what these attributes are of.
fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        Meta::Path(path) => path.is_ident("test"),
        Meta::List(list) if list.path.is_ident("cfg") => {
            let condition = list.tokens.to_string();
            condition == "test" || condition.starts_with("all (test")
        }
        _ => false,
    })
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(it) => &it.attrs,
        Item::Enum(it) => &it.attrs,
        Item::Fn(it) => &it.attrs,
        Item::Impl(it) => &it.attrs,
        Item::Macro(it) => &it.attrs,
        Item::Mod(it) => &it.attrs,
        Item::Static(it) => &it.attrs,
        Item::Struct(it) => &it.attrs,
        Item::Trait(it) => &it.attrs,
        Item::Type(it) => &it.attrs,
        Item::Union(it) => &it.attrs,
        Item::Use(it) => &it.attrs,
        _ => &[],
    }
}

/// Returns the name that an item defines.
fn defined(item: &Item) -> Option<&Ident> {
    match item {
        Item::Const(it) => Some(&it.ident),
        Item::Enum(it) => Some(&it.ident),
        Item::Fn(it) => Some(&it.sig.ident),
        Item::Macro(it) => it.ident.as_ref(),
        Item::Static(it) => Some(&it.ident),
        Item::Struct(it) => Some(&it.ident),
        Item::Trait(it) => Some(&it.ident),
        Item::Type(it) => Some(&it.ident),
        Item::Union(it) => Some(&it.ident),
        _ => None,
    }
}
