//! `groundloop eval prodg-v` as tests call it.

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

use super::{project, schema};

/// The verb on a checkout, with further arguments: exit code, standard output, standard error.
pub fn eval(checkout: &Path, args: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("groundloop").unwrap();
    command.current_dir(project("")).args(["eval", "prodg-v", "--data"]).arg(checkout).args(args);
    let output = command.output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// The report as JSON; nothing else may be on standard output.
#[track_caller]
pub fn report(checkout: &Path, args: &[&str]) -> Value {
    let args: Vec<&str> = args.iter().copied().chain(["--json"]).collect();
    let (code, stdout, stderr) = eval(checkout, &args);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(stdout.lines().count(), 1, "{stdout}");
    let report = serde_json::from_str(&stdout).unwrap();
    schema::obeys("eval-prodg-v", &report);
    report
}

/// The fields of a JSON object that are asked for.
pub fn only(value: &Value, keys: &[&str]) -> Value {
    keys.iter().map(|key| ((*key).to_owned(), value[key].clone())).collect()
}
