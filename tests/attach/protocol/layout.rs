//! The layouts of `src/transport/wire.rs`, read from its source: names, types, offsets, what they mean.

#![expect(clippy::panic, reason = "a source that is not understood must fail the test")]

/// One record.
#[derive(Debug, Clone, Default)]
pub(crate) struct Record {
    pub(crate) name: String,
    /// What both ends must call it.
    pub(crate) type_name: String,
    pub(crate) doc: String,
    pub(crate) fields: Vec<Field>,
    pub(crate) size: usize,
    pub(crate) align: usize,
}

/// One field of a record.
#[derive(Debug, Clone)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) offset: usize,
    pub(crate) doc: String,
}

/// A type in shared memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Kind {
    U8,
    U32,
    U64,
    F32,
    F64,
    Record(String),
    Array(Box<Kind>, usize),
}

/// All constants and records of a source, records in its order.
#[derive(Debug, Clone, Default)]
pub(crate) struct Layouts {
    pub(crate) constants: Vec<(String, usize, String)>,
    pub(crate) records: Vec<Record>,
}

impl Layouts {
    /// Reads a source; panics at what it does not know, which is a failed test.
    pub(crate) fn read(source: &str) -> Self {
        let mut all = Self::default();
        let mut doc = Vec::new();
        let mut type_name = String::new();
        let mut open: Option<Record> = None;
        let mut waiting: Vec<Record> = Vec::new();
        for line in source.lines().map(str::trim) {
            if let Some(text) = line.strip_prefix("///") {
                doc.push(text.trim().to_owned());
                continue;
            }
            let told = || doc.join(" ").replace("[`", "`").replace("`]", "`");
            if let Some(rest) = line.strip_prefix("#[type_name(\"") {
                rest.trim_end_matches("\")]").clone_into(&mut type_name);
                continue;
            }
            if line.starts_with("#[") {
                continue;
            }
            if let Some(constant) = constant(line) {
                all.constants.push((constant.0, constant.1, told()));
            } else if let Some(name) = line.strip_prefix("pub struct ") {
                let name = name.trim_end_matches(" {").to_owned();
                open = Some(Record {
                    name,
                    type_name: type_name.clone(),
                    doc: told(),
                    align: 1,
                    ..Record::default()
                });
            } else if let (Some(record), Some(field)) = (&mut open, line.strip_prefix("pub ")) {
                let (name, kind) = field.trim_end_matches(',').split_once(": ").unwrap();
                let (name, kind, offset) = (name.to_owned(), all.kind(kind), 0);
                record.fields.push(Field { name, kind, offset, doc: told() });
            } else if line == "}"
                && let Some(record) = open.take()
            {
                waiting.push(record);
            }
            doc.clear();
        }
        // What a record is made of comes before it.
        while !waiting.is_empty() {
            let is_ready = |record: &Record| record.fields.iter().all(|f| all.is_known(&f.kind));
            let next = waiting.iter().position(is_ready).unwrap();
            let record = all.laid_out(waiting.remove(next));
            all.records.push(record);
        }
        all
    }

    fn is_known(&self, kind: &Kind) -> bool {
        match kind {
            Kind::Record(name) => self.records.iter().any(|record| record.name == *name),
            Kind::Array(kind, _) => self.is_known(kind),
            Kind::U8 | Kind::U32 | Kind::U64 | Kind::F32 | Kind::F64 => true,
        }
    }

    /// A record with its offsets and size, by the rules of C.
    fn laid_out(&self, mut record: Record) -> Record {
        for field in &mut record.fields {
            let (size, align) = self.size(&field.kind);
            field.offset = record.size.next_multiple_of(align);
            record.size = field.offset + size;
            record.align = record.align.max(align);
        }
        record.size = record.size.next_multiple_of(record.align);
        record
    }

    fn kind(&self, text: &str) -> Kind {
        match text {
            "u8" => Kind::U8,
            "u32" => Kind::U32,
            "u64" => Kind::U64,
            "f32" => Kind::F32,
            "f64" => Kind::F64,
            "NameBytes" => Kind::Array(Box::new(Kind::U8), self.constant("NAME_BYTES_MAX")),
            _ => {
                let Some(array) = text.strip_prefix('[') else {
                    return Kind::Record(text.to_owned());
                };
                let (kind, n) = array.trim_end_matches(']').split_once("; ").unwrap();
                let n = n.parse().unwrap_or_else(|_| self.constant(n));
                Kind::Array(Box::new(self.kind(kind)), n)
            }
        }
    }

    fn constant(&self, name: &str) -> usize {
        let found = self.constants.iter().find(|(known, ..)| known == name);
        found.unwrap_or_else(|| panic!("no constant {name}")).1
    }

    /// A record by its name.
    pub(crate) fn record(&self, name: &str) -> &Record {
        let found = self.records.iter().find(|record| record.name == name);
        found.unwrap_or_else(|| panic!("no record {name}"))
    }

    /// Size and alignment in bytes, by the rules of C.
    fn size(&self, kind: &Kind) -> (usize, usize) {
        match kind {
            Kind::U8 => (1, 1),
            Kind::U32 | Kind::F32 => (4, 4),
            Kind::U64 | Kind::F64 => (8, 8),
            Kind::Record(name) => (self.record(name).size, self.record(name).align),
            Kind::Array(kind, n) => {
                let (size, align) = self.size(kind);
                (size * n, align)
            }
        }
    }
}

fn constant(line: &str) -> Option<(String, usize)> {
    let (name, value) = line.strip_prefix("pub const ")?.split_once(" = ")?;
    Some((name.split(':').next()?.to_owned(), value.trim_end_matches(';').parse().ok()?))
}
