//! The wire protocol as others see it: the page, the C header and the Python module are those of the code.
//!
//! After a change of `src/transport/wire.rs`: `GROUNDLOOP_WRITE=1 cargo test --release --test attach protocol`.

#![expect(clippy::unwrap_used, reason = "a failed step must fail the test")]

mod c_header;
mod layout;
mod page;
mod python;
mod topics;

use std::fs;
use std::process::Command;

use crate::common::project;
use groundloop::transport::topics::TOPICS;
use groundloop::transport::wire;
use layout::Layouts;

/// The marks in the page around what is made.
const MARKS: [&str; 2] = ["<!-- made by tests/attach/protocol/mod.rs -->", "<!-- to here -->"];

fn layouts() -> Layouts {
    Layouts::read(&fs::read_to_string(project("src/transport/wire.rs")).unwrap())
}

/// A file is as it is made from the code; with `GROUNDLOOP_WRITE` it is written.
#[track_caller]
fn is_made(path: &str, made: &str) {
    let file = project(path);
    let there = fs::read_to_string(&file).unwrap_or_default();
    if there == made {
        return;
    }
    #[expect(clippy::disallowed_methods, reason = "for people who change the layouts")]
    let is_to_write = std::env::var("GROUNDLOOP_WRITE").is_ok();
    assert!(
        is_to_write,
        "{path} is not that of src/transport/wire.rs: GROUNDLOOP_WRITE=1 writes it"
    );
    fs::write(&file, made).unwrap();
}

#[test]
fn the_page_has_every_topic_and_field() {
    let text = fs::read_to_string(project("docs/protocol.md")).unwrap();
    let (before, rest) = text.split_once(MARKS[0]).unwrap();
    let (_, after) = rest.split_once(MARKS[1]).unwrap();
    let [begin, end] = MARKS;
    is_made(
        "docs/protocol.md",
        &format!("{before}{begin}\n{}{end}{after}", page::tables(&layouts())),
    );
}

#[test]
fn the_c_header_and_the_python_module_are_those_of_the_code() {
    is_made("clients/c/groundloop.h", &c_header::header(&layouts()));
    is_made("clients/python/groundloop/wire.py", &python::module(&layouts()));
}

#[test]
fn every_topic_is_told() {
    let told: Vec<&str> = topics::TOPICS.iter().map(|topic| topic.name).collect();
    let there: Vec<&str> = TOPICS.iter().map(|topic| topic.name).collect();
    assert_eq!(told, there);
}

/// Sizes and alignments that are reckoned from the source are those of the compiler.
#[test]
fn layouts_are_those_of_the_compiler() {
    let layouts = layouts();
    let mut n = 0;
    let mut check = |name: &str, size: usize, align: usize| {
        let record = layouts.record(name);
        assert_eq!([record.size, record.align], [size, align], "{name}");
        n += 1;
    };
    macro_rules! check {
        ($($record:ident)+) => {
            $(check(stringify!($record), size_of::<wire::$record>(), align_of::<wire::$record>());)+
        };
    }
    check!(FrameHeader DeviceHeader TaskHeader StreamHeader SceneRecord NameText StepRecord DispatchRecord
        OutcomeRecord RobotStateRecord WaypointRecord CommandRecord StatusRecord ControlRecord
        DecisionRecord HealthRecord);
    assert_eq!(n, layouts.records.len(), "every record is checked");
}

/// The C compiler holds each offset and size against its own.
#[test]
fn a_c_compiler_agrees() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("use.c");
    fs::write(&source, "#include \"groundloop.h\"\nint main(void) { return 0; }\n").unwrap();
    let compiled = Command::new("cc")
        .args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I"])
        .arg(project("clients/c"))
        .arg(&source)
        .output()
        .unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
}
