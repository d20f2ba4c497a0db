//! The modules of every crate of the workspace form no cycle.
//!
//! A module is a file. It depends on its children, because it declares them, and on every file to which one of its
//! paths leads. A parent may therefore export definitions of its children, but children must not import from their
//! parent.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The path of a module in its crate; empty for the root.
type Module = Vec<String>;

/// The modules of a crate and their source code without comments and tests.
fn modules(src: &Path) -> BTreeMap<Module, String> {
    let mut modules = BTreeMap::new();
    let mut folders = vec![src.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("the folder is readable") {
            let path: PathBuf = entry.expect("the entry is readable").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let inside = path.strip_prefix(src).expect("it lies below").with_extension("");
                let mut name: Module =
                    inside.iter().map(|part| part.to_string_lossy().into_owned()).collect();
                name.pop_if(|last| last == "mod" || last == "lib");
                let text = std::fs::read_to_string(&path).expect("sources are UTF-8");
                modules.insert(name, code(&text));
            }
        }
    }
    modules
}

/// The text without comments, and without the tests at its end.
fn code(text: &str) -> String {
    let text = text.split("\nmod tests {").next().unwrap_or(text);
    text.lines().map(|line| line.split("//").next().unwrap_or(line)).collect::<Vec<_>>().join("\n")
}

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Every path of a tree of imports, such as `super::{a, b::{self, C as D}}`.
fn expand(prefix: &[String], tree: &str, found: &mut Vec<Module>) {
    let tree = tree.trim();
    let (head, group) = match tree.find('{') {
        Some(at) => (&tree[..at], Some(&tree[at + 1..tree.rfind('}').expect("groups are closed")])),
        None => (tree.split(" as ").next().unwrap_or(tree), None),
    };
    let names = head.split("::").map(str::trim).filter(|name| !name.is_empty());
    let path: Module = prefix.iter().cloned().chain(names.map(str::to_owned)).collect();
    let Some(group) = group else { return found.push(path) };
    let (mut depth, mut start) = (0, 0);
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                expand(&path, &group[start..at], found);
                start = at + 1;
            }
            _ => {}
        }
    }
    if !group[start..].trim().is_empty() {
        expand(&path, &group[start..], found);
    }
}

/// The paths in some code that start at `crate`, `super` or `self`.
fn paths(code: &str) -> Vec<Module> {
    let mut found = Vec::new();
    for start in ["crate::", "super::", "self::"] {
        for (at, _) in code.match_indices(start) {
            if code[..at].ends_with(|c: char| is_name(c) || c == ':' || c == '$') {
                continue;
            }
            let rest = &code[at..];
            let statement = code[..at].trim_end().ends_with("use");
            let end = if statement { rest.find(';') } else { rest.find(|c: char| !is_name(c) && c != ':') };
            expand(&[], &rest[..end.unwrap_or(rest.len())], &mut found);
        }
    }
    found
}

/// The path from the root of the crate.
fn absolute(module: &Module, path: &[String]) -> Module {
    let up = path.iter().take_while(|part| *part == "super").count();
    let base = if path[0] == "crate" { &[][..] } else { &module[..module.len() - up] };
    let rest = path.iter().filter(|part| !matches!(part.as_str(), "crate" | "super" | "self"));
    base.iter().chain(rest).cloned().collect()
}

/// The modules that each one depends on.
fn dependencies(modules: &BTreeMap<Module, String>) -> BTreeMap<&Module, BTreeSet<&Module>> {
    let exported =
        |name: &str| modules.iter().find(|(_, code)| code.contains(&format!("macro_rules! {name} ")));
    let mut graph = BTreeMap::new();
    for (module, code) in modules {
        let mut used = BTreeSet::new();
        used.extend(modules.keys().filter(|m| m.len() == module.len() + 1 && m.starts_with(module)));
        for path in paths(code) {
            let mut target = absolute(module, &path);
            // An exported macro has its path at the root, wherever it is defined.
            let defined = (target.len() == 1).then(|| exported(&target[0])).flatten();
            while defined.is_none() && !modules.contains_key(&target) {
                target.pop();
            }
            let key = defined.map_or(&target, |(module, _)| module);
            used.extend(modules.get_key_value(key).map(|(found, _)| found).filter(|found| *found != module));
        }
        graph.insert(module, used);
    }
    graph
}

/// The modules left over when those without dependencies are removed, again and again, from both ends.
fn in_cycles(modules: &BTreeMap<Module, String>) -> Vec<String> {
    let mut graph = dependencies(modules);
    loop {
        let used: BTreeSet<&Module> = graph.values().flatten().copied().collect();
        let done: BTreeSet<&Module> = graph
            .iter()
            .filter(|(module, uses)| uses.is_empty() || !used.contains(*module))
            .map(|(module, _)| *module)
            .collect();
        if done.is_empty() {
            return graph.keys().map(|module| module.join("::")).collect();
        }
        graph.retain(|module, _| !done.contains(module));
        graph.values_mut().for_each(|uses| uses.retain(|module| !done.contains(module)));
    }
}

#[test]
fn modules_form_no_cycle() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("crates lie in one folder");
    let mut seen = 0;
    for entry in std::fs::read_dir(crates).expect("the folder is readable") {
        let path = entry.expect("the entry is readable").path();
        if path.join("src").is_dir() {
            let modules = modules(&path.join("src"));
            seen += modules.len();
            let cycle = in_cycles(&modules);
            assert!(cycle.is_empty(), "cycle in {}: {}", path.display(), cycle.join(", "));
        }
    }
    assert!(seen > 100, "only {seen} modules were found");
}

fn example(sources: &[(&str, &str)]) -> Vec<String> {
    let module = |name: &str| name.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect();
    in_cycles(&sources.iter().map(|(name, text)| (module(name), code(text))).collect())
}

#[test]
fn cycles_are_found() {
    // A child that imports from its parent, however the path is written.
    for path in ["super::T", "crate::a::T", "super::{c::U, T}", "{super::T}"] {
        let child = format!("use {path};");
        let found =
            example(&[("", "mod a;"), ("a", "mod b;\nmod c;\nstruct T;"), ("a::b", &child), ("a::c", "")]);
        assert_eq!(found, ["a", "a::b"], "{path}");
    }
    // Paths outside of imports, and cycles of several files.
    let found = example(&[
        ("", ""),
        ("a", "fn f() { crate::b::g() }"),
        ("b", "use crate::c;"),
        ("c", "use crate::a::f;"),
    ]);
    assert_eq!(found, ["a", "b", "c"]);
}

#[test]
fn acyclic_modules_pass() {
    let siblings =
        [("", "pub use a::b::T;"), ("a", "mod b;\nmod c;\npub use b::T;"), ("a::b", "use super::c::U;")];
    let rest =
        [("a::c", "// use super::T;\nuse crate::with_size;\n#[cfg(test)]\nmod tests { use crate::a::T; }")];
    let macros = [("size", "macro_rules! with_size { () => {} }")];
    assert!(example(&[&siblings[..], &rest, &macros].concat()).is_empty());
}
