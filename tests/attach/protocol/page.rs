//! The tables of the protocol page.

#![expect(clippy::let_underscore_must_use, reason = "writing into a text cannot fail")]

use std::fmt::Write as _;

use super::layout::{Kind, Layouts};
use super::topics::TOPICS;

/// What stands between the page's marks.
pub(crate) fn tables(layouts: &Layouts) -> String {
    let mut text =
        "\n## Topics\n\n| topic | header | payload | from | to |\n|---|---|---|---|---|\n"
            .to_owned();
    for topic in &TOPICS {
        let [header, payload, from, to] = [topic.header, topic.payload, topic.from, topic.to];
        let _ = writeln!(text, "| `{}` | `{header}` | {payload} | {from} | {to} |", topic.name);
    }
    text.push_str("\n## Records\n");
    for (name, value, doc) in &layouts.constants {
        let _ = writeln!(text, "\n`{name}` = {value}: {doc}");
    }
    for record in &layouts.records {
        let _ = write!(text, "\n### {}\n\n", record.name);
        let _ = writeln!(
            text,
            "{}\nType name `{}`, {} bytes, alignment {}.\n",
            record.doc, record.type_name, record.size, record.align
        );
        text.push_str("| offset | field | type | what |\n|--:|---|---|---|\n");
        for field in &record.fields {
            let _ = writeln!(
                text,
                "| {} | `{}` | {} | {} |",
                field.offset,
                field.name,
                kind(&field.kind),
                field.doc.replace('|', "\\|")
            );
        }
    }
    text.push('\n');
    text
}

fn kind(kind: &Kind) -> String {
    match kind {
        Kind::U8 => "u8".to_owned(),
        Kind::U32 => "u32".to_owned(),
        Kind::U64 => "u64".to_owned(),
        Kind::F32 => "f32".to_owned(),
        Kind::F64 => "f64".to_owned(),
        Kind::Record(name) => format!("[{name}](#{})", name.to_lowercase()),
        Kind::Array(of, n) => format!("{} × {n}", self::kind(of)),
    }
}
