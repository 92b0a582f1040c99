//! The layouts as a C header.

#![expect(clippy::let_underscore_must_use, reason = "writing into a text cannot fail")]

use std::fmt::Write as _;

use super::layout::{Kind, Layouts};
use super::topics::TOPICS;

const HEAD: &str = "\
/* Layouts of groundloop's topics, for C and C++.
 *
 * Made from src/transport/wire.rs by `cargo test --test attach protocol`; docs/protocol.md says what they mean.
 * Text is UTF-8, padded with zero bytes. Reserved fields are zero.
 *
 * A topic but `control` has one writer. Before you create a publisher, clean up dead nodes, open the service and
 * look at its number of publishers (number_of_publishers of its dynamic config): above 0 another process does the
 * same, and two would be mixed. Say so and end: `TOPIC of run \"RUN\" has a writer already`. */
#ifndef GROUNDLOOP_H
#define GROUNDLOOP_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern \"C\" {
#define GROUNDLOOP_ASSERT(what, why) static_assert(what, why)
#else
#define GROUNDLOOP_ASSERT(what, why) _Static_assert(what, why)
#endif
";
const TAIL: &str = "
#ifdef __cplusplus
}
#endif

#endif
";

/// The whole file.
pub(crate) fn header(layouts: &Layouts) -> String {
    let mut text = HEAD.to_owned();
    text.push('\n');
    for (name, value, doc) in &layouts.constants {
        let _ = writeln!(text, "/* {doc} */\n#define GROUNDLOOP_{name} {value}u");
    }
    let _ = writeln!(
        text,
        "/* Event id of a wake-up: a message was sent. */\n#define GROUNDLOOP_EVENT_SENT 4u"
    );
    let _ = writeln!(
        text,
        "/* Event id of a reader that announces itself. */\n#define GROUNDLOOP_EVENT_JOINED 5u"
    );
    for record in &layouts.records {
        let name = snake(&record.name);
        let _ = writeln!(text, "\n/* {} */", record.doc);
        let _ = writeln!(
            text,
            "#define GROUNDLOOP_{}_TYPE_NAME \"{}\"",
            name.to_uppercase(),
            record.type_name
        );
        let _ = writeln!(text, "typedef struct groundloop_{name} {{");
        for field in &record.fields {
            let _ = writeln!(text, "    /* {} */", field.doc);
            let _ = writeln!(text, "    {};", declared(&field.kind, &field.name));
        }
        let _ = writeln!(text, "}} groundloop_{name};");
        let _ = writeln!(
            text,
            "GROUNDLOOP_ASSERT(sizeof(groundloop_{name}) == {}, \"size of {name}\");",
            record.size
        );
        for field in &record.fields {
            let _ = writeln!(
                text,
                "GROUNDLOOP_ASSERT(offsetof(groundloop_{name}, {0}) == {1}, \"{name}.{0}\");",
                field.name, field.offset
            );
        }
    }
    text.push('\n');
    for topic in TOPICS {
        let _ = writeln!(
            text,
            "/* {}: groundloop_{}, payload {} */",
            topic.name,
            snake(topic.header),
            topic.payload
        );
    }
    text + TAIL
}

fn declared(kind: &Kind, name: &str) -> String {
    match kind {
        Kind::U8 => format!("uint8_t {name}"),
        Kind::U32 => format!("uint32_t {name}"),
        Kind::U64 => format!("uint64_t {name}"),
        Kind::F32 => format!("float {name}"),
        Kind::F64 => format!("double {name}"),
        Kind::Record(record) => format!("groundloop_{} {name}", snake(record)),
        Kind::Array(kind, n) => declared(kind, &format!("{name}[{n}]")),
    }
}

/// `FrameHeader` to `frame_header`.
pub(crate) fn snake(name: &str) -> String {
    let mut snake = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !snake.is_empty() {
            snake.push('_');
        }
        snake.extend(c.to_lowercase());
    }
    snake
}
