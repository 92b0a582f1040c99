//! Phrases to statements: `object (relation object)+`, `object property`, `property object`, and
//! lists of objects that a sequence word turns into a chain.

use super::super::{Language, Reason};
use super::tokens::Token;
use super::vocabulary::Meaning;
use super::{Fault, Span};
use crate::pddl::Name;

/// The words for one or more objects, before they are resolved.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Spec {
    pub(super) named: Option<Name>,
    pub(super) all: bool,
    /// "three" in "three disks".
    pub(super) number: Option<usize>,
    /// "2" in "peg 2".
    pub(super) ordinal: Option<usize>,
    pub(super) colour: Option<Name>,
    pub(super) position_idx: Option<usize>,
    pub(super) noun_idx: Option<usize>,
    pub(super) many: bool,
    /// Whether it was said as "it".
    pub(super) pronoun: bool,
    pub(super) span: Span,
}

impl Spec {
    /// Whether both are said in the same words, or one is a pronoun for the other.
    fn same_words(&self, other: &Self) -> bool {
        let words = |spec: &Self| Self { span: Span::default(), pronoun: false, ..spec.clone() };
        words(self) == words(other)
    }

    /// Whether it only names a type, as headings do ("a stack of blocks:").
    fn is_bare(&self) -> bool {
        let picked = self.position_idx.is_some() || self.ordinal.is_some();
        !self.all && self.colour.is_none() && self.named.is_none() && !picked
    }
}

/// One statement of the instruction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Statement {
    /// Each of `left` stands in one of these relations to `right`.
    Relation { relation_idxs: Vec<usize>, word: Span, left: Vec<Spec>, right: Spec },
    /// The object has the property.
    Property { property_idx: usize, word: Span, object: Spec },
    /// Neighbours of the list stand in the sequence's relation.
    Chain { sequence_idx: usize, word: Span, objects: Vec<Spec> },
}

/// Statements, and the number of stacks that a heading announces.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Parsed {
    pub(super) statements: Vec<Statement>,
    pub(super) n_stacks: Option<(usize, Span)>,
    /// Places that something is said to come from; they are no part of the goal.
    pub(super) sources: Vec<Span>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Item {
    Object(Spec),
    Relation(Vec<usize>, Span),
    Property(usize, Span),
    Separator,
}

/// Reads the tokens of a whole instruction.
pub(super) fn parse(tokens: &[Token], text: &str, language: &Language) -> Result<Parsed, Fault> {
    let mut reader = Reader::new(text, language);
    let mut items: Vec<Item> = Vec::new();
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        at += 1;
        if [Meaning::Stop, Meaning::HeadingEnd, Meaning::Separator].iter().any(|m| token.is(m)) {
            reader.topic = reader.last.clone().or(reader.topic);
        }
        if token.is(&Meaning::Stop) {
            reader.sentence(&std::mem::take(&mut items))?;
        } else if token.is(&Meaning::HeadingEnd) {
            end_heading(&mut items);
        } else if token.is(&Meaning::Separator) {
            items.push(Item::Separator);
        } else if token.is(&Meaning::Source) {
            let (spec, next) = object(tokens, at, reader.antecedent())
                .ok_or_else(|| reader.no_object("after", &token.span))?;
            reader.parsed.sources.push(token.span.start..spec.span.end);
            at = next;
        } else if let Some((spec, next)) = object(tokens, at - 1, reader.antecedent()) {
            reader.last = Some(spec.clone());
            items.push(Item::Object(spec));
            at = next;
        } else if let Some(item) = reader.word(token, tokens.get(at))? {
            items.push(item);
        }
    }
    reader.sentence(&items)?;
    Ok(reader.parsed)
}

/// Drops a heading that names no object of its own; otherwise its end is a separator.
fn end_heading(items: &mut Vec<Item>) {
    let is_heading = items.iter().all(|item| match item {
        Item::Object(spec) => spec.is_bare(),
        Item::Separator => true,
        Item::Relation(..) | Item::Property(..) => false,
    });
    if is_heading {
        items.clear();
    } else {
        items.push(Item::Separator);
    }
}

/// Reads the words for an object from `start`; `None` when there is none.
fn object(tokens: &[Token], start: usize, last: Option<&Spec>) -> Option<(Spec, usize)> {
    let mut spec = Spec::default();
    let mut at = start;
    while let Some(token) = tokens.get(at) {
        if !extend(&mut spec, token, at == start, last) {
            break;
        }
        at += 1;
        if spec.noun_idx.is_some() || spec.named.is_some() {
            break;
        }
    }
    let has_noun = spec.noun_idx.is_some();
    if has_noun && tokens.get(at).is_some_and(|token| follows_noun(&mut spec, token)) {
        at += 1;
    }
    let has_content = spec.noun_idx.is_some() || !spec.is_bare();
    if at == start || !has_content {
        return None;
    }
    spec.span = tokens.get(start)?.span.start..tokens.get(at - 1)?.span.end;
    Some((spec, at))
}

/// Takes one more token into an object; whether it fitted.
fn extend(spec: &mut Spec, token: &Token, is_first: bool, last: Option<&Spec>) -> bool {
    let has_content = !spec.is_bare();
    for meaning in &token.meanings {
        match meaning {
            Meaning::All if !spec.all => spec.all = true,
            Meaning::Colour(colour) if spec.colour.is_none() => spec.colour = Some(colour.clone()),
            Meaning::Before(idx) if spec.position_idx.is_none() => spec.position_idx = Some(*idx),
            Meaning::Noun { noun_idx, many }
                if has_content || token.meanings.iter().all(is_noun) =>
            {
                spec.noun_idx = Some(*noun_idx);
                spec.many = *many;
            }
            Meaning::Everything(idx) if !has_content || spec.all => {
                spec.noun_idx = Some(*idx);
                spec.all = true;
            }
            Meaning::Number(number) if spec.number.is_none() && spec.colour.is_none() => {
                if has_content && token.meanings.iter().any(is_noun) {
                    continue;
                }
                spec.number = Some(*number);
            }
            Meaning::Named(name) if is_first => spec.named = Some(name.clone()),
            Meaning::Pronoun if is_first => {
                let Some(last) = last else { return false };
                *spec = Spec { pronoun: true, span: token.span.clone(), ..last.clone() };
                return true;
            }
            Meaning::Filler
            | Meaning::Separator
            | Meaning::Stop
            | Meaning::HeadingEnd
            | Meaning::All
            | Meaning::Pronoun
            | Meaning::Source
            | Meaning::Number(_)
            | Meaning::Colour(_)
            | Meaning::Noun { .. }
            | Meaning::Everything(_)
            | Meaning::Before(_)
            | Meaning::After(_)
            | Meaning::Relation(_)
            | Meaning::Property(_)
            | Meaning::Sequence(_)
            | Meaning::Stacks
            | Meaning::Named(_) => continue,
        }
        return true;
    }
    false
}

fn is_noun(meaning: &Meaning) -> bool {
    matches!(meaning, Meaning::Noun { .. })
}

/// Takes "2" of "peg 2" or "on the right" of "the peg on the right".
fn follows_noun(spec: &mut Spec, token: &Token) -> bool {
    for meaning in &token.meanings {
        if let Meaning::After(idx) = meaning
            && spec.position_idx.is_none()
        {
            spec.position_idx = Some(*idx);
            return true;
        }
        if let Meaning::Number(number) = meaning
            && !spec.many
            && spec.is_bare()
        {
            spec.ordinal = Some(*number);
            return true;
        }
    }
    false
}

/// Turns items into statements; what spans several segments of a sentence is kept here.
#[derive(Debug)]
struct Reader<'a> {
    text: &'a str,
    language: &'a Language,
    parsed: Parsed,
    /// The object named last, and the one named last before the newest separator.
    last: Option<Spec>,
    topic: Option<Spec>,
    /// The sequence word in force, from where it stands to the end.
    sequence: Option<(usize, Span)>,
    /// A number that waits for what it counts.
    number: Option<(usize, Span)>,
}

impl<'a> Reader<'a> {
    fn new(text: &'a str, language: &'a Language) -> Self {
        let parsed = Parsed::default();
        Self { text, language, parsed, last: None, topic: None, sequence: None, number: None }
    }

    /// What a pronoun stands for: in "red on the table and blue on it" the red block.
    fn antecedent(&self) -> Option<&Spec> {
        self.topic.as_ref().or(self.last.as_ref())
    }

    /// A token that is no part of an object.
    fn word(&mut self, token: &Token, next: Option<&Token>) -> Result<Option<Item>, Fault> {
        let relations: Vec<usize> = token
            .meanings
            .iter()
            .filter_map(
                |meaning| {
                    if let Meaning::Relation(idx) = meaning { Some(*idx) } else { None }
                },
            )
            .collect();
        if !relations.is_empty() {
            return Ok(Some(Item::Relation(relations, token.span.clone())));
        }
        match token.meanings.first() {
            Some(Meaning::Property(idx)) => Ok(Some(Item::Property(*idx, token.span.clone()))),
            Some(Meaning::Sequence(idx)) => {
                self.sequence = Some((*idx, token.span.clone()));
                Ok(None)
            }
            Some(Meaning::Stacks) => {
                if let Some((number, span)) = self.number.take() {
                    self.parsed.n_stacks = Some((number, span.start..token.span.end));
                }
                Ok(None)
            }
            // "two stacks", or "1." at the head of a list.
            Some(Meaning::Number(number))
                if next
                    .is_some_and(|next| next.is(&Meaning::Stacks) || next.is(&Meaning::Stop)) =>
            {
                self.number = Some((*number, token.span.clone()));
                Ok(None)
            }
            _ => Err(Fault {
                span: token.span.clone(),
                reason: Reason::OutOfPlace {
                    word: self.text[token.span.clone()].to_owned(),
                    expected: "an object or a relation",
                },
            }),
        }
    }

    /// Reads one sentence.
    fn sentence(&mut self, items: &[Item]) -> Result<(), Fault> {
        self.number = None;
        let mut state = Sentence::default();
        for segment in items.split(|item| *item == Item::Separator) {
            self.segment(&mut state, segment)?;
        }
        if state.waiting.is_empty() {
            return match state.prefix {
                Some((_, word)) if !state.prefix_used => Err(self.no_object("after", &word)),
                _ => Ok(()),
            };
        }
        match (&self.sequence, state.waiting.as_slice()) {
            (Some((sequence_idx, word)), [_, _, ..]) => {
                let (sequence_idx, word) = (*sequence_idx, word.clone());
                let objects = state.waiting;
                self.parsed.statements.push(Statement::Chain { sequence_idx, word, objects });
                Ok(())
            }
            (_, objects) => Err(self.nothing_said(objects)),
        }
    }

    /// Reads what stands between two separators.
    fn segment(&mut self, state: &mut Sentence, items: &[Item]) -> Result<(), Fault> {
        let mut rest = match items {
            [] => return Ok(()),
            // "on the left peg put all disks"
            [Item::Relation(idxs, word), Item::Object(right), Item::Object(left)] => {
                self.relate(idxs, word, vec![left.clone()], right);
                return Ok(());
            }
            [Item::Property(idx, word)] if !state.waiting.is_empty() => {
                let objects = std::mem::take(&mut state.waiting);
                self.attribute(*idx, word, &objects);
                return Ok(());
            }
            [Item::Property(idx, word), rest @ ..] => {
                state.prefix = Some((*idx, word.clone()));
                state.prefix_used = false;
                rest
            }
            [Item::Object(spec), rest @ ..] => {
                state.waiting.push(spec.clone());
                rest
            }
            // ", over green" goes on with the chain before.
            [Item::Relation(_, word), ..] if state.waiting.is_empty() => {
                let tail = state.tail.clone().ok_or_else(|| self.no_object("before", word))?;
                state.waiting.push(tail);
                items
            }
            [Item::Relation(..) | Item::Separator, ..] => items,
        };
        while let Some((item, after)) = rest.split_first() {
            rest = after;
            match item {
                Item::Relation(idxs, word) => {
                    let Some((Item::Object(right), after)) = rest.split_first() else {
                        return Err(self.no_object("after", word));
                    };
                    rest = after;
                    let mut left = std::mem::take(&mut state.waiting);
                    // "take red and put blue on it" says nothing more about red.
                    left.retain(|spec| !(right.pronoun && spec.same_words(right)));
                    if left.is_empty() {
                        return Err(self.no_object("before", word));
                    }
                    self.relate(idxs, word, left, right);
                    state.tail = Some(right.clone());
                    if !rest.is_empty() {
                        state.waiting.push(right.clone());
                    }
                }
                Item::Property(idx, word) => {
                    let objects = std::mem::take(&mut state.waiting);
                    if objects.is_empty() {
                        return Err(self.no_object("before", word));
                    }
                    self.attribute(*idx, word, &objects);
                }
                Item::Object(spec) => match state.waiting.last() {
                    Some(left) => return Err(self.no_relation(left, spec)),
                    None => state.waiting.push(spec.clone()),
                },
                Item::Separator => {}
            }
        }
        self.apply_prefix(state);
        Ok(())
    }

    /// "clear red and blue": the property before holds for each object of the list.
    fn apply_prefix(&mut self, state: &mut Sentence) {
        if let Some((idx, word)) = state.prefix.clone()
            && !state.waiting.is_empty()
        {
            let objects = std::mem::take(&mut state.waiting);
            self.attribute(idx, &word, &objects);
            state.prefix_used = true;
        }
    }

    fn relate(&mut self, relation_idxs: &[usize], word: &Span, left: Vec<Spec>, right: &Spec) {
        self.parsed.statements.push(Statement::Relation {
            relation_idxs: relation_idxs.to_vec(),
            word: word.clone(),
            left,
            right: right.clone(),
        });
    }

    fn attribute(&mut self, property_idx: usize, word: &Span, objects: &[Spec]) {
        for object in objects {
            let (word, object) = (word.clone(), object.clone());
            self.parsed.statements.push(Statement::Property { property_idx, word, object });
        }
    }

    fn words(&self, span: &Span) -> String {
        self.text[span.clone()].to_owned()
    }

    fn no_object(&self, side: &'static str, word: &Span) -> Fault {
        Fault { span: word.clone(), reason: Reason::NoObject { side, word: self.words(word) } }
    }

    fn nothing_said(&self, objects: &[Spec]) -> Fault {
        if let [left, right, ..] = objects {
            return self.no_relation(left, right);
        }
        let span = objects.first().map(|spec| spec.span.clone()).unwrap_or_default();
        Fault { reason: Reason::NothingSaid { phrase: self.words(&span) }, span }
    }

    fn no_relation(&self, left: &Spec, right: &Spec) -> Fault {
        let relation = self.language.relations.iter().flat_map(|r| &r.phrases).next();
        let reason = Reason::NoRelation {
            left: self.words(&left.span),
            right: self.words(&right.span),
            relation: relation.cloned().unwrap_or_default(),
        };
        Fault { span: right.span.clone(), reason }
    }
}

/// What is open within one sentence.
#[derive(Debug, Default)]
struct Sentence {
    /// Objects about which nothing has been said yet.
    waiting: Vec<Spec>,
    /// The last object of the newest chain.
    tail: Option<Spec>,
    /// A property said before its objects.
    prefix: Option<(usize, Span)>,
    prefix_used: bool,
}
