//! What the binary carries: `domains/` and `configs/`.

use std::borrow::Cow;
use std::collections::BTreeSet;

use rust_embed::Embed;

#[derive(Embed)]
#[folder = "domains/"]
#[prefix = "domains/"]
struct Domains;

#[derive(Embed)]
#[folder = "configs/"]
#[prefix = "configs/"]
struct Configs;

/// An embedded file by its path.
pub(super) fn embedded(path: &str) -> Option<Cow<'static, [u8]>> {
    Domains::get(path).or_else(|| Configs::get(path)).map(|file| file.data)
}

/// Names of the embedded files in a folder.
pub(super) fn embedded_below(folder: &str) -> Vec<String> {
    let all = Domains::iter().chain(Configs::iter());
    let below =
        all.filter_map(|path| path.strip_prefix(folder)?.strip_prefix('/').map(str::to_owned));
    below.filter(|name| !name.contains('/')).collect()
}

/// Names of the folders of embedded files in a folder, in order.
pub(super) fn embedded_folders_below(folder: &str) -> BTreeSet<String> {
    let all = Domains::iter().chain(Configs::iter());
    let below = all.filter_map(|path| {
        let rest = path.strip_prefix(folder)?.strip_prefix('/')?;
        rest.split_once('/').map(|(name, _)| name.to_owned())
    });
    below.collect()
}

/// Names of the shipped domains, in order.
pub fn shipped_domains() -> Vec<String> {
    let name = |path: &str| {
        let (name, file) = path.strip_prefix("domains/")?.split_once('/')?;
        (file == "domain.pddl").then(|| name.to_owned())
    };
    let mut names: Vec<String> = Domains::iter().filter_map(|path| name(&path)).collect();
    names.sort_unstable();
    names
}

/// Names of the shipped run files, in order.
pub fn shipped_names() -> Vec<String> {
    names_in("configs")
}

/// Names of the shipped sweeps, in order.
pub fn shipped_sweeps() -> Vec<String> {
    names_in("configs/sweeps")
}

fn names_in(folder: &str) -> Vec<String> {
    let mut names: Vec<String> = embedded_below(folder);
    names.retain(|name| !name.starts_with("defaults"));
    let stem = |name: &String| name.strip_suffix(".toml").map(str::to_owned);
    let mut names: Vec<String> = names.iter().filter_map(stem).collect();
    names.sort_unstable();
    names
}
