//! The layouts as `ctypes` structures.

#![expect(clippy::let_underscore_must_use, reason = "writing into a text cannot fail")]

use std::fmt::Write as _;

use super::layout::{Kind, Layouts};

/// The whole module.
pub(crate) fn module(layouts: &Layouts) -> String {
    let mut text = "\
\"\"\"Layouts of groundloop's topics.

Made from src/transport/wire.rs by `cargo test --test attach protocol`; docs/protocol.md says what they mean.
\"\"\"

import ctypes
"
    .to_owned();
    text.push('\n');
    for (name, value, doc) in &layouts.constants {
        let _ = writeln!(text, "{name} = {value}\n\"\"\"{doc}\"\"\"");
    }
    for record in &layouts.records {
        let _ = write!(
            text,
            "\n\nclass {}(ctypes.Structure):\n    \"\"\"{}\"\"\"\n\n",
            record.name, record.doc
        );
        let _ = writeln!(text, "    _fields_ = [");
        for field in &record.fields {
            let _ = writeln!(
                text,
                "        (\"{}\", {}),  # {}",
                field.name,
                ctype(&field.kind),
                field.doc
            );
        }
        let _ = write!(text, "    ]\n\n    @staticmethod\n    def type_name() -> str:\n");
        let _ = writeln!(text, "        return \"{}\"", record.type_name);
    }
    text
}

fn ctype(kind: &Kind) -> String {
    match kind {
        Kind::U8 => "ctypes.c_uint8".to_owned(),
        Kind::U32 => "ctypes.c_uint32".to_owned(),
        Kind::U64 => "ctypes.c_uint64".to_owned(),
        Kind::F32 => "ctypes.c_float".to_owned(),
        Kind::F64 => "ctypes.c_double".to_owned(),
        Kind::Record(name) => name.clone(),
        Kind::Array(kind, n) => format!("{} * {n}", ctype(kind)),
    }
}
