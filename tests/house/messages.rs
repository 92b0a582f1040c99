//! What people read is written for people: no message shows a value as `Debug` has it.

use std::fs;
use std::path::{Component, Path};

use crate::common::{files_below, in_project, project};

/// Where a value may be shown so all the same, and why.
const EXCEPTIONS: &[(&str, &str)] = &[];

/// The lines of a file that are not its tests, with their numbers.
///
/// Messages are made in `#[error("…")]`, `format!`, `write!` and the calls of `out`; what is not a test
/// has no other use for `{:?}`: panics are forbidden, `Debug` is derived or made with the helpers of
/// `fmt`, and logs take values as fields.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let tests = text.match_indices("#[cfg(test)]\n").find(|(at, mark)| {
        let next = text[at + mark.len()..].lines().next().unwrap_or_default();
        next.ends_with("mod tests {")
    });
    let code = text[..tests.map_or(text.len(), |(at, _)| at)]
        .lines()
        .enumerate()
        .map(|(idx, line)| (idx + 1, line));
    code.filter(|(_, line)| !line.trim_start().starts_with("//"))
}

/// Whether a line of code shows a value as `Debug` has it.
fn shows_debug(line: &str) -> bool {
    line.contains(":?}") || line.contains(":#?}")
}

fn is_test(path: &Path) -> bool {
    let mut parts = path.components().map(Component::as_os_str);
    parts.any(|part| part == "tests" || part == "tests.rs")
}

#[test]
fn no_message_shows_a_value_as_debug_has_it() {
    let (mut faults, mut n_files, mut n_excepted) = (Vec::new(), 0, 0);
    for folder in ["src", "sim/src"] {
        for path in files_below(&project(folder), "rs") {
            let shown = in_project(&path);
            if is_test(Path::new(&shown)) {
                continue;
            }
            n_files += 1;
            let text = fs::read_to_string(&path).unwrap();
            for (number, line) in lines(&text).filter(|(_, line)| shows_debug(line)) {
                if EXCEPTIONS.iter().any(|(file, _)| *file == shown) {
                    n_excepted += 1;
                } else {
                    faults.push(format!("{shown}:{number}: {}", line.trim()));
                }
            }
        }
    }
    assert!(n_files > 200, "{n_files}");
    assert!(n_excepted >= EXCEPTIONS.len(), "an exception without need");
    let how =
        "write strings with `quoted`, arrays with `listed` (src/mismatch.rs), errors in words";
    assert!(faults.is_empty(), "{how}:\n{}", faults.join("\n"));
}

#[test]
fn what_is_a_message_is_told_from_what_is_a_test() {
    let text = "//! {a:?}\nfn f() {}\n    // {b:?}\nformat!(\"{c:?}\");\nwrite!(f, \"{:#?}\", d);\n\
                \n#[cfg(test)]\nmod tests {\n    panic!(\"{e:?}\");\n}\n";
    let found: Vec<usize> =
        lines(text).filter(|(_, line)| shows_debug(line)).map(|f| f.0).collect();
    assert_eq!(found, [4, 5]);
    assert!(is_test(Path::new("src/run/tests.rs")) && is_test(Path::new("src/a/tests/b.rs")));
    assert!(!is_test(Path::new("src/attests.rs")));
}
