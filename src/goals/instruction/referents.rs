//! Noun phrases to objects: what is seen decides which object is meant.

use super::super::language::Pick;
use super::super::{GoalObject, Phrase, Reason, Referent};
use super::meaning::{Ordinal, RowSide};
use super::positions::{self, Keyed, Miss};
use super::resolve::{Antecedent, Candidate, Resolver, Role};
use super::syntax::{Head, NounPhrase, Thing};
use super::vocabulary::split;
use super::{Fault, Span};
use crate::pddl::{Name, Typed};

/// What stands for a pronoun, in words of an error.
const BEFORE_IT: &str = "one object must have been moved before";
const BEFORE_THEM: &str = "several objects must have been moved before";
const BEFORE_REST: &str = "some objects must have been named before";

impl<'a> Resolver<'a> {
    /// Finds what the words mean, given the type they stand for, and remembers that it was named.
    pub(super) fn resolve(
        &mut self,
        object: &NounPhrase,
        role: Role,
        candidate: &Candidate,
    ) -> Result<Referent, Fault> {
        let means = self.referent(object, role, candidate)?;
        let is_new = self.phrases.iter().all(|phrase| phrase.span != object.span);
        if is_new {
            let text = self.words(&object.span);
            self.phrases.push(Phrase { text, span: object.span.clone(), means: means.clone() });
        }
        match &means {
            Referent::Object(name) => _ = self.mentioned.insert(name.clone()),
            Referent::Several(names) => self.mentioned.extend(names.iter().cloned()),
            Referent::Every(_) => {}
        }
        Ok(means)
    }

    fn referent(
        &mut self,
        object: &NounPhrase,
        role: Role,
        candidate: &Candidate,
    ) -> Result<Referent, Fault> {
        match &object.head {
            Head::It => self.antecedent(object, role).map(|found| found.means.clone()),
            Head::They => self.antecedents(object),
            Head::Listed => Err(self.nothing_listed(object)),
            Head::Named(name) => {
                let named = self.view.objects.iter().filter(|o| o.name == *name);
                self.one_of(object, &named.collect::<Vec<_>>(), candidate)
            }
            Head::Rest => {
                let thing = Thing { all: true, is_other: true, ..Thing::default() };
                self.several(object, &thing, candidate)
            }
            Head::Thing(thing) if thing.is_listed => Err(self.nothing_listed(object)),
            Head::Thing(thing) if thing.is_plural() && (thing.all || thing.many) => {
                self.several(object, thing, candidate)
            }
            Head::Thing(thing) => self.single(object, thing, candidate),
        }
    }

    /// What "it" stands for.
    pub(super) fn antecedent(
        &mut self,
        object: &NounPhrase,
        role: Role,
    ) -> Result<Antecedent, Fault> {
        let missing = || self.no_antecedent(object, BEFORE_IT);
        let moved = match self.moved.as_slice() {
            [one] if matches!(one.means, Referent::Object(_)) => Some(one.clone()),
            _ => None,
        };
        if role == Role::Theme {
            return moved.ok_or_else(missing);
        }
        let landmark = self.landmark.clone();
        let found = if self.it_is_landmark { landmark.or(moved) } else { moved.or(landmark) };
        let found = found.ok_or_else(missing)?;
        self.has_choice |= self.moved.len() == 1 && self.landmark.is_some();
        Ok(found)
    }

    /// What "them" stands for.
    fn antecedents(&self, object: &NounPhrase) -> Result<Referent, Fault> {
        if let [one] = self.moved.as_slice()
            && !matches!(one.means, Referent::Object(_))
        {
            return Ok(one.means.clone());
        }
        let name = |found: &Antecedent| match &found.means {
            Referent::Object(name) => Some(name.clone()),
            Referent::Several(_) | Referent::Every(_) => None,
        };
        let names: Option<Vec<Name>> = self.moved.iter().map(name).collect();
        match names {
            Some(names) if names.len() > 1 => Ok(Referent::Several(names)),
            _ => Err(self.no_antecedent(object, BEFORE_THEM)),
        }
    }

    /// "them" or "the rest" with nothing before it.
    pub(super) fn nothing_before(&self, object: &NounPhrase) -> Fault {
        let expected = if object.head == Head::Rest { BEFORE_REST } else { BEFORE_THEM };
        self.no_antecedent(object, expected)
    }

    fn no_antecedent(&self, object: &NounPhrase, expected: &'static str) -> Fault {
        let reason = Reason::NoAntecedent { phrase: self.words(&object.span), expected };
        Fault { span: object.span.clone(), reason }
    }

    fn nothing_listed(&self, object: &NounPhrase) -> Fault {
        let phrase = self.words(&object.span);
        let expected = "a list of objects must follow a colon";
        let reason = Reason::NoAntecedent { phrase, expected };
        Fault { span: object.span.clone(), reason }
    }

    /// Seen objects of that type and colour.
    pub(super) fn fitting(&self, thing: &Thing, candidate: &Candidate) -> Vec<&'a GoalObject> {
        let named = self.template_name(thing, candidate);
        let fits = |object: &&GoalObject| {
            self.domain.types.is_a(&object.type_name, &candidate.type_name)
                && match &thing.colour {
                    None => true,
                    Some(_) if object.colour.is_some() => object.colour == thing.colour,
                    Some(_) => named.as_ref() == Some(&object.name),
                }
        };
        let seen = self.view.objects.iter().filter(fits);
        seen.filter(|o| !thing.is_other || !self.mentioned.contains(&o.name)).collect()
    }

    fn template_name(&self, thing: &Thing, candidate: &Candidate) -> Option<Name> {
        let template = self.language.nouns.get(candidate.noun_idx?)?.name.as_ref()?;
        let text = match &thing.colour {
            Some(colour) => template.replace("{colour}", colour.as_str()),
            None => template.clone(),
        };
        (!text.contains("{colour}"))
            .then(|| Name::new(text.replace("{type}", candidate.type_name.as_str())))
    }

    /// "all disks", "the red disks", "three disks", "all blocks except red".
    fn several(
        &mut self,
        object: &NounPhrase,
        thing: &Thing,
        candidate: &Candidate,
    ) -> Result<Referent, Fault> {
        if thing.pick.is_some() || thing.place.is_some() {
            let expected = "a position with a single object";
            let reason = Reason::OutOfPlace { word: self.words(&object.span), expected };
            return Err(Fault { span: object.span.clone(), reason });
        }
        if thing.is_other && self.mentioned.is_empty() {
            return Err(self.no_antecedent(object, BEFORE_REST));
        }
        let fitting = self.fitting(thing, candidate);
        let is_checked = !thing.attributes.is_empty() || !object.descriptions.is_empty();
        let kept =
            if is_checked { self.checked_all(object, thing, &fitting)? } else { fitting.clone() };
        let excepted = self.excepted(object, candidate, &kept)?;
        let kept: Vec<&GoalObject> =
            kept.into_iter().filter(|o| !excepted.contains(&o.name)).collect();
        if thing.number.is_some_and(|number| number != kept.len()) {
            return Err(self.wrong_number(&object.span, kept.len()));
        }
        let is_whole = kept.len() == fitting.len() && !thing.is_other && excepted.is_empty();
        if thing.colour.is_none() && is_whole && thing.attributes.is_empty() {
            return Ok(Referent::Every(candidate.type_name.clone()));
        }
        if !kept.is_empty() {
            return Ok(Referent::Several(kept.iter().map(|o| o.name.clone()).collect()));
        }
        if thing.colour.is_some() && !is_checked && fitting.is_empty() {
            return Ok(Referent::Several(vec![self.expect(object, thing, candidate)?]));
        }
        if self.view.objects.is_empty() {
            return Err(self.not_seen(&object.span, candidate, 0, 1));
        }
        Err(self.none_fits(&object.span, &fitting))
    }

    /// The objects that are left out; each must be one of the others.
    fn excepted(
        &mut self,
        object: &NounPhrase,
        candidate: &Candidate,
        kept: &[&GoalObject],
    ) -> Result<Vec<Name>, Fault> {
        let mut names = Vec::new();
        for except in &object.except {
            let types = self.candidates(except, Role::Theme)?;
            let is_related = |c: &&Candidate| {
                self.domain.types.is_a(&c.type_name, &candidate.type_name)
                    || self.domain.types.is_a(&candidate.type_name, &c.type_name)
            };
            let of_type = types.iter().find(is_related).unwrap_or(candidate).clone();
            match self.referent(except, Role::Theme, &of_type)? {
                Referent::Object(name) => names.push(name),
                Referent::Several(more) => names.extend(more),
                Referent::Every(_) => return Err(self.none_fits(&except.span, kept)),
            }
        }
        if let Some(name) = names.iter().find(|name| kept.iter().all(|o| o.name != **name)) {
            let span = object.except.first().map_or(object.span.clone(), |o| o.span.clone());
            let reason = Reason::NoneFits { phrase: self.words(&span), head: vec![name.clone()] };
            return Err(Fault { span, reason });
        }
        Ok(names)
    }

    /// "the red block", "the first peg from the right", "the block on the table".
    fn single(
        &mut self,
        object: &NounPhrase,
        thing: &Thing,
        candidate: &Candidate,
    ) -> Result<Referent, Fault> {
        let fitting = self.fitting(thing, candidate);
        if thing.number.is_some_and(|number| number != 1) {
            return Err(self.wrong_number(&object.span, fitting.len()));
        }
        if let Some(pick) = self.pick(object, thing, fitting.len())? {
            let seen_min = self.seen_min(thing, candidate);
            if fitting.len() < seen_min {
                return Err(self.not_seen(&object.span, candidate, fitting.len(), seen_min));
            }
            let fitting = self.surely(object, thing, &fitting)?;
            return self.picked(object, candidate, pick, &fitting).map(Referent::Object);
        }
        let is_described = !thing.attributes.is_empty() || !object.descriptions.is_empty();
        if fitting.is_empty() && (!is_described || self.view.facts.is_none()) && !thing.is_other {
            if is_described {
                self.note_unchecked(object);
            }
            return self.expect(object, thing, candidate).map(Referent::Object);
        }
        if fitting.is_empty() {
            return Err(self.not_seen(&object.span, candidate, 0, 1));
        }
        self.one_of(object, &fitting, candidate)
    }

    /// The one of these that is as it is described.
    fn one_of(
        &mut self,
        object: &NounPhrase,
        fitting: &[&'a GoalObject],
        candidate: &Candidate,
    ) -> Result<Referent, Fault> {
        let plain = Thing::default();
        let thing = if let Head::Thing(thing) = &object.head { thing } else { &plain };
        let checked = self.check(object, thing, fitting)?;
        match (checked.sure.as_slice(), checked.open.as_slice()) {
            ([one], []) => Ok(Referent::Object(one.name.clone())),
            ([], []) => Err(self.none_fits(&object.span, fitting)),
            ([], [one])
                if fitting.len() == 1 && checked.nobody_knows && thing.attributes.is_empty() =>
            {
                let name = one.name.clone();
                self.note_unchecked(object);
                Ok(Referent::Object(name))
            }
            (_, []) => Err(self.ambiguous(&object.span, &checked.sure)),
            _ if checked.nobody_knows => Err(self.cannot_tell(&object.span)),
            _ => Err(self.not_seen(&object.span, candidate, 0, 1)),
        }
    }

    /// Those of several objects that are surely as they are described.
    fn surely(
        &mut self,
        object: &NounPhrase,
        thing: &Thing,
        fitting: &[&'a GoalObject],
    ) -> Result<Vec<&'a GoalObject>, Fault> {
        if thing.attributes.is_empty() && object.descriptions.is_empty() {
            return Ok(fitting.to_vec());
        }
        self.checked_all(object, thing, fitting)
    }

    fn checked_all(
        &mut self,
        object: &NounPhrase,
        thing: &Thing,
        fitting: &[&'a GoalObject],
    ) -> Result<Vec<&'a GoalObject>, Fault> {
        let checked = self.check(object, thing, fitting)?;
        if checked.open.is_empty() {
            return Ok(checked.sure);
        }
        if checked.nobody_knows && object.is_only_moved_from() && thing.attributes.is_empty() {
            self.note_unchecked(object);
            return Ok(fitting.to_vec());
        }
        Err(self.cannot_tell(&object.span))
    }

    fn note_unchecked(&mut self, object: &NounPhrase) {
        for description in &object.descriptions {
            let words = self.words(description.span());
            let note = format!("\"{words}\" is no part of the goal, and is not checked");
            if !self.notes.contains(&note) {
                self.notes.push(note);
            }
        }
    }

    /// An object that has not been seen but can be named.
    fn expect(
        &mut self,
        object: &NounPhrase,
        thing: &Thing,
        candidate: &Candidate,
    ) -> Result<Name, Fault> {
        let Some(name) = self.template_name(thing, candidate) else {
            return Err(self.not_seen(&object.span, candidate, 0, 1));
        };
        if self.expected.iter().all(|typed| typed.name != name) {
            self.expected.push(Typed::new(name.clone(), candidate.type_name.clone()));
        }
        Ok(name)
    }

    fn seen_min(&self, thing: &Thing, candidate: &Candidate) -> usize {
        let noun = candidate.noun_idx.and_then(|idx| self.language.nouns.get(idx));
        match &thing.colour {
            None => noun.map_or(1, |noun| noun.seen_min),
            Some(_) => 1,
        }
    }

    /// Which of a row is meant, where a position or a place is said.
    fn pick(&self, object: &NounPhrase, thing: &Thing, n: usize) -> Result<Option<Pick>, Fault> {
        let Some((ordinal, side)) = thing.place else { return Ok(thing.pick) };
        let default = self.language.counts_from_left.then_some(RowSide::Left);
        let Some(side) = side.or(default) else {
            let expected = "the side from which it is counted, such as \"from the left\"";
            let reason = Reason::OutOfPlace { word: self.words(&object.span), expected };
            return Err(Fault { span: object.span.clone(), reason });
        };
        let pick = match (ordinal, side) {
            (Ordinal::Nth(number), RowSide::Left) => Pick::FromLeft(number),
            (Ordinal::Nth(number), RowSide::Right) => {
                Pick::FromLeft((n + 1).saturating_sub(number))
            }
            (Ordinal::Last, RowSide::Left) => Pick::Right,
            (Ordinal::Last, RowSide::Right) => Pick::Left,
        };
        Ok(Some(pick))
    }

    /// The object that a position singles out by the boxes, or by the names where there are no
    /// boxes: `right_peg` is the right one.
    fn picked(
        &self,
        object: &NounPhrase,
        candidate: &Candidate,
        pick: Pick,
        fitting: &[&GoalObject],
    ) -> Result<Name, Fault> {
        let keyed: Option<Vec<Keyed<'_>>> =
            fitting.iter().map(|object| Keyed::new(object, pick)).collect();
        let Some(mut keyed) = keyed else {
            let n_boxes = fitting.iter().filter(|object| object.pixel_box.is_some()).count();
            return self
                .named_by_position(pick, candidate, fitting)
                .ok_or_else(|| self.not_seen(&object.span, candidate, n_boxes, fitting.len()));
        };
        positions::choose(&mut keyed, pick).map_err(|miss| match miss {
            Miss::NoSuchPlace => self.wrong_number(&object.span, fitting.len()),
            Miss::Equal(candidates) => {
                let reason = Reason::Ambiguous { phrase: self.words(&object.span), candidates };
                Fault { span: object.span.clone(), reason }
            }
        })
    }

    fn named_by_position(
        &self,
        pick: Pick,
        candidate: &Candidate,
        fitting: &[&GoalObject],
    ) -> Option<Name> {
        let n = fitting.len();
        let pick = match pick {
            Pick::FromLeft(1) => Pick::Left,
            Pick::FromLeft(number) if number == n => Pick::Right,
            Pick::FromLeft(number) if 2 * number == n + 1 => Pick::Middle,
            Pick::FromLeft(_)
            | Pick::Left
            | Pick::Right
            | Pick::Middle
            | Pick::Top
            | Pick::Bottom
            | Pick::Smallest
            | Pick::Largest => pick,
        };
        let type_words = split(candidate.type_name.as_str());
        let mut names = self.vocabulary.before(pick).map(|words| {
            let words = [words.clone(), type_words.clone()].concat();
            Name::new(words.join("_"))
        });
        names.find(|name| fitting.iter().any(|object| object.name == *name))
    }

    pub(super) fn words(&self, span: &Span) -> String {
        self.text[span.clone()].to_owned()
    }

    fn ambiguous(&self, span: &Span, fitting: &[&GoalObject]) -> Fault {
        let mut candidates: Vec<Name> = fitting.iter().map(|object| object.name.clone()).collect();
        candidates.sort();
        let reason = Reason::Ambiguous { phrase: self.words(span), candidates };
        Fault { span: span.clone(), reason }
    }

    fn none_fits(&self, span: &Span, fitting: &[&GoalObject]) -> Fault {
        let head = fitting.iter().map(|object| object.name.clone()).collect();
        let reason = Reason::NoneFits { phrase: self.words(span), head };
        Fault { span: span.clone(), reason }
    }

    fn cannot_tell(&self, span: &Span) -> Fault {
        let reason = Reason::CannotTell { phrase: self.words(span) };
        Fault { span: span.clone(), reason }
    }

    fn wrong_number(&self, span: &Span, seen: usize) -> Fault {
        let reason = Reason::WrongNumber { phrase: self.words(span), seen };
        Fault { span: span.clone(), reason }
    }

    pub(super) fn not_seen(
        &self,
        span: &Span,
        candidate: &Candidate,
        seen: usize,
        wanted: usize,
    ) -> Fault {
        let type_name = candidate.type_name.clone();
        let reason = Reason::NotSeen { phrase: self.words(span), type_name, seen, wanted };
        Fault { span: span.clone(), reason }
    }
}
