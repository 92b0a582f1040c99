//! Descriptions: which of several objects are as they are said to be, by facts and boxes.

use super::super::{GoalObject, Referent};
use super::Fault;
use super::meaning::RowSide;
use super::resolve::{Candidate, Resolver, Role};
use super::syntax::{Description, NounPhrase, Thing};
use crate::geometry::PixelBox;
use crate::logic::Truth;
use crate::pddl::{Atom, Name};

/// Two objects stand beside each other when their centres differ by this part of their mean width.
const BESIDE_MARGIN: f64 = 0.5;

/// Objects that are as described, and those of which it is not known.
#[derive(Debug, Default)]
pub(super) struct Checked<'a> {
    pub(super) sure: Vec<&'a GoalObject>,
    pub(super) open: Vec<&'a GoalObject>,
    /// Whether there are no facts or boxes that could tell.
    pub(super) nobody_knows: bool,
}

/// An answer, or that there is nothing to tell it by.
type Answer = Option<Truth>;

impl<'a> Resolver<'a> {
    /// Holds each object against its description.
    pub(super) fn check(
        &mut self,
        object: &NounPhrase,
        thing: &Thing,
        fitting: &[&'a GoalObject],
    ) -> Result<Checked<'a>, Fault> {
        let mut checked = Checked::default();
        for seen in fitting {
            let mut truth = Truth::True;
            let mut is_dark = false;
            for (property_idx, _) in &thing.attributes {
                let answer = self.is_or_becomes(*property_idx, seen);
                is_dark |= answer.is_none();
                truth = truth.min(answer.unwrap_or(Truth::Unknown));
            }
            for description in &object.descriptions {
                let answer = self.is_so(description, seen)?;
                is_dark |= answer.is_none();
                truth = truth.min(answer.unwrap_or(Truth::Unknown));
            }
            match truth {
                Truth::True => checked.sure.push(seen),
                Truth::Unknown => {
                    checked.nobody_knows |= is_dark;
                    checked.open.push(seen);
                }
                Truth::False => {}
            }
        }
        Ok(checked)
    }

    /// "the sliced tomato": it is, or the instruction has asked for it already.
    fn is_or_becomes(&self, property_idx: usize, object: &GoalObject) -> Answer {
        let property = self.language.properties.get(property_idx)?;
        let atom = Atom { predicate: property.predicate.clone(), args: vec![object.name.clone()] };
        if self.ground_atoms().iter().any(|found| found.atom == atom) {
            return Some(Truth::True);
        }
        self.view.facts.map(|facts| facts.truth(&atom))
    }

    fn is_so(&mut self, description: &Description, object: &GoalObject) -> Result<Answer, Fault> {
        match description {
            Description::Has { property_idx, .. } => {
                let property = self.language.properties.get(*property_idx);
                let predicate = property.map(|property| property.predicate.clone());
                let args = vec![object.name.clone()];
                Ok(predicate.and_then(|p| self.truth(&Atom { predicate: p, args })))
            }
            Description::Related { relation_idxs, landmark, .. } => {
                self.is_related(relation_idxs, landmark, object)
            }
            Description::At { landmark, .. } => {
                let all: Vec<usize> = (0..self.language.relations.len()).collect();
                self.is_related(&all, landmark, object)
            }
            Description::Beside { side, landmark, .. } => self.is_beside(*side, landmark, object),
        }
    }

    fn truth(&self, atom: &Atom) -> Answer {
        self.view.facts.map(|facts| facts.truth(atom))
    }

    /// Whether one of these relations holds between the object and what the words name.
    fn is_related(
        &mut self,
        relation_idxs: &[usize],
        landmark: &NounPhrase,
        object: &GoalObject,
    ) -> Result<Answer, Fault> {
        let own = Candidate { type_name: object.type_name.clone(), noun_idx: None };
        let candidates = self.candidates(landmark, Role::Landmark)?;
        let language = self.language;
        let mut answer: Answer = Some(Truth::False);
        let mut fits_any = false;
        let mut fault = None;
        for relation in relation_idxs.iter().filter_map(|idx| language.relations.get(*idx)) {
            for candidate in &candidates {
                let args = if relation.swap { [candidate, &own] } else { [&own, candidate] };
                if !self.fits(&relation.predicate, &args) {
                    continue;
                }
                let named = match self.looked_up(landmark, candidate) {
                    Ok(named) => named,
                    Err(error) => {
                        fault.get_or_insert(error);
                        continue;
                    }
                };
                fits_any = true;
                let Some(named) = named else {
                    answer = None;
                    continue;
                };
                let (a, b) = (object.name.clone(), named);
                let args = if relation.swap { vec![b, a] } else { vec![a, b] };
                let truth = self.truth(&Atom { predicate: relation.predicate.clone(), args });
                answer = answer.and_then(|known| truth.map(|truth| known.max(truth)));
            }
        }
        match fault {
            Some(fault) if !fits_any => Err(fault),
            _ => Ok(answer),
        }
    }

    /// The one object that the words of a description name; `None` where it has not been seen and nobody
    /// knows what holds.
    fn looked_up(
        &mut self,
        words: &NounPhrase,
        candidate: &Candidate,
    ) -> Result<Option<Name>, Fault> {
        let (n_phrases, n_expected) = (self.phrases.len(), self.expected.len());
        let found = self.resolve(words, Role::Landmark, candidate);
        self.phrases.truncate(n_phrases);
        let is_expected = self.expected.len() > n_expected;
        self.expected.truncate(n_expected);
        match found? {
            Referent::Object(_) if is_expected && self.view.facts.is_none() => Ok(None),
            Referent::Object(_) if is_expected => Err(self.not_seen(&words.span, candidate, 0, 1)),
            Referent::Object(name) => Ok(Some(name)),
            Referent::Several(_) | Referent::Every(_) => {
                let expected = "one object that describes another";
                let reason =
                    super::super::Reason::OutOfPlace { word: self.words(&words.span), expected };
                Err(Fault { span: words.span.clone(), reason })
            }
        }
    }

    /// Whether the object is on that side of another one in the picture.
    fn is_beside(
        &mut self,
        side: RowSide,
        landmark: &NounPhrase,
        object: &GoalObject,
    ) -> Result<Answer, Fault> {
        let candidates = self.candidates(landmark, Role::Landmark)?;
        let own_type = |c: &&Candidate| self.domain.types.is_a(&object.type_name, &c.type_name);
        let Some(candidate) = candidates.iter().find(own_type).or(candidates.first()) else {
            return Ok(None);
        };
        let named = self.looked_up(landmark, candidate)?;
        let other = self.view.objects.iter().find(|o| Some(&o.name) == named.as_ref());
        let box_of = |o: &GoalObject| o.pixel_box.filter(PixelBox::is_valid);
        let boxes = box_of(object).zip(other.and_then(box_of));
        Ok(boxes.map(|(own, other)| {
            let apart = other.centre().0 - own.centre().0;
            let apart = if side == RowSide::Left { apart } else { -apart };
            let margin = BESIDE_MARGIN * f64::midpoint(own.width(), other.width());
            if apart > margin { Truth::True } else { Truth::False }
        }))
    }
}
