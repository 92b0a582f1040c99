//! Which parts of a folder use which: read from paths in the code, through re-exports.

use std::collections::{BTreeMap, BTreeSet};

/// The modules of one crate, by their paths (`planning::task`; empty for the root).
pub(super) struct Modules {
    by_path: BTreeMap<String, Module>,
}

/// One file.
struct Module {
    file: String,
    /// What the file re-exports: its name, and the path that it stands for.
    exports: BTreeMap<String, String>,
    /// The paths that the code names, from the root.
    paths: BTreeSet<String>,
}

impl Modules {
    /// Reads the files of a crate: path below its `src`, and code without comments and strings.
    pub(super) fn read(files: &[(String, String)]) -> Self {
        let mut by_path = BTreeMap::new();
        for (file, code) in files {
            let path = module_path(file);
            let code = without_tests(code);
            let (mut exports, mut paths) = (BTreeMap::new(), BTreeSet::new());
            for (is_pub, name, target) in uses(&code) {
                let target = absolute(&path, &target);
                if is_pub {
                    exports.insert(name, target.clone());
                }
                paths.insert(target);
            }
            for target in inline_paths(&code) {
                paths.insert(absolute(&path, &target));
            }
            by_path.insert(path, Module { file: file.clone(), exports, paths });
        }
        Self { by_path }
    }

    /// The file in which a path ends up; none for what is not of this crate.
    fn file_of(&self, path: &str) -> Option<&str> {
        let mut path = path.to_owned();
        for _ in 0..8 {
            let mut module = path.as_str();
            while !self.by_path.contains_key(module) {
                module = module.rsplit_once("::").map_or("", |(parent, _)| parent);
            }
            let found = &self.by_path[module];
            let rest = path[module.len()..].trim_start_matches("::");
            let (name, after) = rest.split_once("::").map_or((rest, None), |(a, b)| (a, Some(b)));
            match found.exports.get(name) {
                Some(target) if !name.is_empty() => {
                    path = after.map_or(target.clone(), |after| format!("{target}::{after}"));
                }
                _ => return Some(&found.file),
            }
        }
        None
    }

    /// For each folder, which of its children (files and folders) uses which, and one example.
    ///
    /// A folder's own `mod.rs` is no child of it: it declares, re-exports and may define what its
    /// children have in common.
    fn uses_in_folders(&self) -> BTreeMap<String, BTreeMap<(String, String), String>> {
        let mut folders: BTreeMap<String, BTreeMap<(String, String), String>> = BTreeMap::new();
        for module in self.by_path.values() {
            for path in &module.paths {
                let Some(target) = self.file_of(path) else { continue };
                let (from, to) = (parts(&module.file), parts(target));
                let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
                let (Some(a), Some(b)) = (from.get(common), to.get(common)) else { continue };
                if [a, b].iter().any(|part| **part == "mod.rs" || **part == "lib.rs") {
                    continue;
                }
                let edge = ((*a).to_owned(), (*b).to_owned());
                let example = format!("{} uses {target} ({path})", module.file);
                let folder = from[..common].join("/");
                folders.entry(folder).or_default().entry(edge).or_insert(example);
            }
        }
        folders
    }

    /// One line for each circle: the folder, its children in the circle, and who uses what.
    pub(super) fn circles(&self) -> Vec<String> {
        let mut found = Vec::new();
        for (folder, edges) in self.uses_in_folders() {
            for circle in circles(edges.keys()) {
                let names: Vec<&str> = circle.iter().map(String::as_str).collect();
                let inside = |(a, b): &(String, String)| circle.contains(a) && circle.contains(b);
                let lines = edges.iter().filter(|(edge, _)| inside(edge)).map(|(_, line)| line);
                let lines: Vec<String> = lines.map(|line| format!("\n    {line}")).collect();
                found.push(format!("{folder}/: {}{}", names.join(", "), lines.concat()));
            }
        }
        found
    }
}

/// The folders and the file name of a path.
fn parts(file: &str) -> Vec<&str> {
    file.split('/').collect()
}

/// `planning/task/mod.rs` to `planning::task`.
fn module_path(file: &str) -> String {
    let path = file.trim_end_matches(".rs");
    let path = path.strip_suffix("/mod").unwrap_or(path);
    let path = if ["lib", "main", "mod"].contains(&path) { "" } else { path };
    path.replace('/', "::")
}

/// The code before the tests that stand at the end of a file.
fn without_tests(code: &str) -> String {
    let end = code.find("#[cfg(test)]\nmod tests {").unwrap_or(code.len());
    code[..end].to_owned()
}

/// A path from the root: `crate::a::b` to `a::b`, `super::c` by the module that says it.
fn absolute(module: &str, path: &str) -> String {
    let mut base: Vec<&str> = module.split("::").filter(|part| !part.is_empty()).collect();
    let mut rest: Vec<&str> = path.split("::").collect();
    match rest.first() {
        Some(&"crate") => {
            base.clear();
            rest.remove(0);
        }
        Some(&"self") => {
            rest.remove(0);
        }
        _ => {}
    }
    while rest.first() == Some(&"super") {
        base.pop();
        rest.remove(0);
    }
    base.extend(rest);
    base.join("::")
}

/// Every `use` of this crate: whether others see it, its name, and its path.
fn uses(code: &str) -> Vec<(bool, String, String)> {
    let mut found = Vec::new();
    let children: BTreeSet<&str> = declared(code);
    for (at, _) in code.match_indices("use ") {
        let before = code[..at].rsplit('\n').next().unwrap_or_default().trim();
        let is_pub = before.starts_with("pub");
        if !(before.is_empty() || is_pub) {
            continue;
        }
        let Some(end) = code[at..].find(';') else { continue };
        let tree: String = code[at + 4..at + end].split_whitespace().collect::<Vec<_>>().join(" ");
        for (name, path) in expand("", &tree) {
            let first = path.split("::").next().unwrap_or_default();
            if ["crate", "self", "super"].contains(&first) || children.contains(first) {
                found.push((is_pub, name, path));
            }
        }
    }
    found
}

/// The modules that a file declares.
fn declared(code: &str) -> BTreeSet<&str> {
    let lines = code.lines().filter_map(|line| line.trim().strip_suffix(';'));
    lines.filter_map(|line| line.rsplit_once("mod ").map(|(_, name)| name)).collect()
}

/// The (name, path) of each leaf of a `use` tree.
fn expand(prefix: &str, tree: &str) -> Vec<(String, String)> {
    let tree = tree.trim();
    if let Some(open) = tree.find('{') {
        let prefix = format!("{prefix}{}", tree[..open].trim());
        let inner = &tree[open + 1..];
        let inner = &inner[..matching(inner)];
        return split(inner).into_iter().flat_map(|part| expand(&prefix, part)).collect();
    }
    if tree.is_empty() {
        return Vec::new();
    }
    let (path, name) = tree.split_once(" as ").map_or((tree, None), |(p, n)| (p, Some(n)));
    let whole = format!("{prefix}{path}");
    let whole = whole.strip_suffix("::self").unwrap_or(&whole).to_owned();
    let last = whole.rsplit("::").next().unwrap_or_default().to_owned();
    vec![(name.map_or(last, str::to_owned), whole)]
}

/// How far it is to the brace that closes what is open.
fn matching(text: &str) -> usize {
    let mut depth = 0;
    for (at, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => return at,
            '}' => depth -= 1,
            _ => {}
        }
    }
    text.len()
}

/// The parts between the commas that are in no braces.
fn split(text: &str) -> Vec<&str> {
    let (mut parts, mut depth, mut start) = (Vec::new(), 0, 0);
    for (at, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&text[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[start..]);
    parts
}

/// Paths that begin with `crate::`, `super::` or `self::` outside of `use`.
fn inline_paths(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    for root in ["crate::", "super::", "self::"] {
        for (at, _) in code.match_indices(root) {
            if code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':') {
                continue;
            }
            let is_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
            let end = code[at..].find(|c| !is_path(c)).unwrap_or(code.len() - at);
            found.push(code[at..at + end].trim_end_matches(':').to_owned());
        }
    }
    found
}

/// The strongly connected components of more than one node.
fn circles<'a>(edges: impl Iterator<Item = &'a (String, String)>) -> Vec<BTreeSet<String>> {
    let mut next: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (from, to) in edges {
        next.entry(from).or_default().insert(to);
    }
    let reached = |start: &str| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![start.to_owned()]);
        while let Some(node) = open.pop() {
            for &node in next.get(node.as_str()).into_iter().flatten() {
                if seen.insert(node.to_owned()) {
                    open.push(node.to_owned());
                }
            }
        }
        seen
    };
    let reach: BTreeMap<&str, BTreeSet<String>> =
        next.keys().map(|&node| (node, reached(node))).collect();
    let circle = |node: &str| {
        let back = |other: &&String| reach.get(other.as_str()).is_some_and(|r| r.contains(node));
        reach[node].iter().filter(back).cloned().collect::<BTreeSet<String>>()
    };
    let found: BTreeSet<BTreeSet<String>> = next.keys().map(|&node| circle(node)).collect();
    found.into_iter().filter(|circle| circle.len() > 1).collect()
}
