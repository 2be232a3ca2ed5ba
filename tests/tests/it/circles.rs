//! The modules of a crate use each other in one direction: there are no circles, with re-exports
//! resolved. A parent that only declares or re-exports its children does not use them.

use std::collections::{BTreeMap, BTreeSet};

use plumb_tests::source_tree::{code_lines, files, is_test, read, root};

/// Crates whose modules are checked.
const CRATES: [&str; 4] = ["host/runtime", "host/log", "host/setup", "host/page"];

/// Modules of a crate by their paths, such as `rig::check`; that of `lib.rs` is empty.
#[derive(Default)]
struct Modules {
    /// Code of each module without comments and tests.
    code: BTreeMap<String, String>,
    /// Re-exported paths, by module and name.
    exports: BTreeMap<(String, String), Vec<String>>,
}

/// Import of a module: whether it is a re-export, and its path.
type Import = (bool, String);

/// Returns the imports of a module, and the rest of its code.
fn imports(code: &str) -> (Vec<Import>, String) {
    let (mut found, mut rest) = (Vec::new(), String::new());
    let mut lines = code.lines();
    while let Some(line) = lines.next() {
        let words = line.trim_start();
        let begin = if words.starts_with("use ") { Some(0) } else { words.find(" use ") };
        let Some(begin) = begin.filter(|_| words.starts_with("use ") || words.starts_with("pub"))
        else {
            rest.push_str(&format!("{line}\n"));
            continue;
        };
        let mut statement = words.to_owned();
        while !statement.ends_with(';') {
            let Some(line) = lines.next() else { break };
            statement.push_str(line.trim());
        }
        let paths = statement[begin..].trim().trim_start_matches("use ").trim_end_matches(';');
        found.extend(expanded(paths).into_iter().map(|path| (begin > 0, path)));
    }
    (found, rest)
}

/// Returns the single paths of an import with braces.
fn expanded(paths: &str) -> Vec<String> {
    let paths = paths.trim();
    let Some((prefix, list)) = paths.split_once('{') else {
        return vec![paths.split(" as ").next().unwrap_or(paths).to_owned()];
    };
    let (mut parts, mut depth) = (vec![String::new()], 0);
    for c in list.strip_suffix('}').unwrap_or(list).chars() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        parts.last_mut().into_iter().for_each(|part| part.push(c));
    }
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(|part| expanded(&format!("{prefix}{}", part.trim()))).collect()
}

impl Modules {
    /// Reads the modules of a crate.
    fn read(folder: &str) -> Self {
        let (mut modules, source) = (Self::default(), root().join(folder).join("src"));
        for path in files(&source, &[".rs"]).iter().filter(|path| !is_test(path)) {
            let name = path.strip_prefix(&source).unwrap_or(path).with_extension("");
            let name = name.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>();
            let name = name.join("::");
            let name = if name == "lib" { String::new() } else { name };
            let code: Vec<_> = code_lines(&read(path)).iter().map(|it| it.1.to_owned()).collect();
            // A visibility is no use.
            modules.code.insert(name, code.join("\n").replace("pub(in crate::", "pub("));
        }
        let mut exports = BTreeMap::new();
        for (module, code) in &modules.code {
            for (_, path) in imports(code).0.into_iter().filter(|(is_export, _)| *is_export) {
                let Some(path) = modules.absolute(module, &path) else { continue };
                let name = path.last().cloned().unwrap_or_default();
                exports.insert((module.clone(), name), path);
            }
        }
        Self { exports, ..modules }
    }

    /// Returns a path in `module` from the root of the crate; `None` for one of another crate.
    fn absolute(&self, module: &str, path: &str) -> Option<Vec<String>> {
        let mut base: Vec<&str> = module.split("::").filter(|part| !part.is_empty()).collect();
        let mut parts: Vec<&str> = path.split("::").collect();
        match parts[0] {
            "crate" => base.clear(),
            "self" => {}
            "super" => {
                while parts.get(1) == Some(&"super") {
                    base.pop();
                    parts.remove(0);
                }
                base.pop();
            }
            child => {
                let child = [&base[..], &[child]].concat().join("::");
                return self.code.contains_key(&child).then(|| self.joined(&base, &parts));
            }
        }
        Some(self.joined(&base, &parts[1..]))
    }

    fn joined(&self, base: &[&str], rest: &[&str]) -> Vec<String> {
        base.iter().chain(rest).map(|part| (*part).to_owned()).collect()
    }

    /// Returns the module that has what `path` names, behind its re-exports.
    fn home(&self, path: &[String]) -> String {
        for length in (0..=path.len()).rev() {
            let module = path[..length].join("::");
            if !self.code.contains_key(&module) {
                continue;
            }
            let export = path.get(length).map(|name| (module.clone(), name.clone()));
            return match export.and_then(|export| self.exports.get(&export)) {
                Some(target) if target[..] != *path => {
                    self.home(&[&target[..], &path[length + 1..]].concat())
                }
                _ => module,
            };
        }
        String::new()
    }

    /// Returns the modules that each module uses.
    fn uses(&self) -> BTreeMap<&str, BTreeSet<String>> {
        let uses = |module: &str, code: &str| {
            let (imports, rest) = imports(code);
            let paths = imports.into_iter().filter(|(is_export, _)| !is_export).map(|it| it.1);
            let words = rest.split(|c: char| !c.is_alphanumeric() && c != '_' && c != ':');
            let inline = words.filter(|word| word.contains("::")).map(str::to_owned);
            let homes = paths.chain(inline).filter_map(|path| self.absolute(module, &path));
            let homes = homes.map(|path| self.home(&path));
            homes.filter(|home| !home.is_empty() && home != module).collect()
        };
        self.code.iter().map(|(module, code)| (module.as_str(), uses(module, code))).collect()
    }
}

/// Returns the modules that stand in a circle, with those that they use in it.
fn circles(modules: &Modules) -> Vec<String> {
    let uses = modules.uses();
    let reaches = |from: &str, to: &str| {
        let (mut open, mut seen) = (vec![from], BTreeSet::new());
        while let Some(module) = open.pop() {
            if module == to {
                return true;
            }
            if seen.insert(module) {
                open.extend(uses.get(module).into_iter().flatten().map(String::as_str));
            }
        }
        false
    };
    let edges = uses.iter().flat_map(|(from, all)| all.iter().map(move |to| (*from, to.as_str())));
    edges.filter(|(from, to)| reaches(to, from)).map(|(a, b)| format!("{a} -> {b}")).collect()
}

#[test]
fn no_modules_use_each_other_in_circles() {
    for folder in CRATES {
        let modules = Modules::read(folder);
        assert!(modules.code.len() > 10, "{folder}: {:?}", modules.code.keys());
        assert_eq!(circles(&modules), [""; 0], "{folder}: move what they share below both");
    }
}

#[test]
fn a_circle_is_found_behind_braces_and_re_exports() {
    let modules = |c: &str| {
        let mut modules = Modules::default();
        let text = [("", "pub use a::A;"), ("a", "use super::{b::B, x};"), ("b", c), ("c", "")];
        modules.code.extend(text.map(|(name, text)| (name.to_owned(), text.to_owned())));
        modules
            .exports
            .insert((String::new(), "A".to_owned()), ["a", "A"].map(String::from).into());
        modules
    };
    assert_eq!(circles(&modules("use crate::c::C;\nfn f() { std::mem::take() }")), [""; 0]);
    assert_eq!(circles(&modules("use crate::{\n    A,\n    c,\n};")), ["a -> b", "b -> a"]);
    assert_eq!(circles(&modules("fn f() -> super::A {}")), ["a -> b", "b -> a"]);
}
