//! Statements to atoms: which predicate, which objects.

use super::super::language::{Pick, Relation, Sequence};
use super::super::{GoalObject, Language, ParsedGoal, Phrase, Reason, Referent};
use super::contradictions::{GroundAtom, groups};
use super::grammar::{Parsed, Spec, Statement};
use super::positions::{self, Keyed, Miss};
use super::{Fault, Span, vocabulary};
use crate::pddl::{Atom, Condition, Domain, Literal, Name, Term, Typed};

/// Most ground atoms that are looked at for contradictions.
const GROUND_ATOMS_MAX: usize = 2000;

/// An argument of a claim.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Arg {
    One(Name),
    Every(Name),
}

/// One atom of the goal, possibly over every object of a type.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Claim {
    predicate: Name,
    args: Vec<Arg>,
    span: Span,
}

/// Collects the goal's atoms while it resolves statement after statement.
#[derive(Debug)]
pub(super) struct Resolver<'a> {
    text: &'a str,
    domain: &'a Domain,
    language: &'a Language,
    objects: &'a [GoalObject],
    claims: Vec<Claim>,
    phrases: Vec<Phrase>,
    expected: Vec<Typed>,
    notes: Vec<String>,
}

/// A type an object's words may stand for, with its noun where there is one.
#[derive(Debug, Clone)]
struct Candidate {
    type_name: Name,
    noun_idx: Option<usize>,
}

impl<'a> Resolver<'a> {
    pub(super) fn new(
        text: &'a str,
        domain: &'a Domain,
        language: &'a Language,
        objects: &'a [GoalObject],
    ) -> Self {
        let (claims, phrases, expected, notes) = Default::default();
        Self { text, domain, language, objects, claims, phrases, expected, notes }
    }

    /// Adds one statement's atoms.
    pub(super) fn state(&mut self, statement: &Statement) -> Result<(), Fault> {
        match statement {
            Statement::Relation { relation_idxs, word, left, right } => {
                let relations: Vec<Relation> = relation_idxs
                    .iter()
                    .filter_map(|idx| self.language.relations.get(*idx).cloned())
                    .collect();
                for object in left {
                    self.relate(&relations, word, object, right)?;
                }
                Ok(())
            }
            Statement::Property { property_idx, word, object } => {
                self.attribute(*property_idx, word, object)
            }
            Statement::Chain { sequence_idx, word, objects } => {
                let Some(Sequence { phrases, predicate, swap }) =
                    self.language.sequences.get(*sequence_idx).cloned()
                else {
                    return Ok(());
                };
                let relation = [Relation { phrases, predicate, swap }];
                for pair in objects.windows(2) {
                    if let [left, right] = pair {
                        self.relate(&relation, word, left, right)?;
                    }
                }
                Ok(())
            }
        }
    }

    fn relate(
        &mut self,
        relations: &[Relation],
        word: &Span,
        left: &Spec,
        right: &Spec,
    ) -> Result<(), Fault> {
        let (lefts, rights) = (self.candidates(left), self.candidates(right));
        let readings = relations.iter().flat_map(|relation| {
            let pairs = lefts.iter().flat_map(|l| rights.iter().map(move |r| (l, r)));
            pairs.map(move |(l, r)| (relation, l, r))
        });
        let fitting = readings
            .into_iter()
            .find(|(relation, l, r)| self.fits(&relation.predicate, &in_order(relation, *l, *r)));
        if let Some((relation, l, r)) = fitting {
            let said = [self.resolve(left, l)?, self.resolve(right, r)?];
            let args = in_order(relation, &said[0], &said[1]);
            let start = left.span.start.min(right.span.start).min(word.start);
            let end = left.span.end.max(right.span.end).max(word.end);
            self.claim(&relation.predicate, &args, &(start..end));
            return Ok(());
        }
        let wanted =
            relations.iter().map(|relation| self.signature(&relation.predicate, relation.swap));
        Err(Fault {
            span: left.span.start.min(word.start)..right.span.end.max(word.end),
            reason: Reason::WrongTypes {
                word: self.text[word.clone()].to_owned(),
                given: format!("{} and {}", types_of(&lefts), types_of(&rights)),
                wanted: wanted.collect::<Vec<_>>().join(", or "),
            },
        })
    }

    fn attribute(&mut self, idx: usize, word: &Span, object: &Spec) -> Result<(), Fault> {
        let Some(property) = self.language.properties.get(idx).cloned() else { return Ok(()) };
        let candidates = self.candidates(object);
        let span = object.span.start.min(word.start)..object.span.end.max(word.end);
        let fitting = candidates.iter().find(|c| self.fits(&property.predicate, &[*c]));
        if let Some(candidate) = fitting {
            let said = self.resolve(object, candidate)?;
            self.claim(&property.predicate, &[&said], &span);
            return Ok(());
        }
        let reason = Reason::WrongTypes {
            word: self.text[word.clone()].to_owned(),
            given: types_of(&candidates),
            wanted: self.signature(&property.predicate, false),
        };
        Err(Fault { span, reason })
    }

    /// The types that an object's words allow.
    fn candidates(&self, spec: &Spec) -> Vec<Candidate> {
        if let Some(name) = &spec.named {
            let object = self.objects.iter().find(|object| object.name == *name);
            let candidate =
                |o: &GoalObject| Candidate { type_name: o.type_name.clone(), noun_idx: None };
            return object.map(candidate).into_iter().collect();
        }
        let nouns = self.language.nouns.iter().enumerate();
        nouns
            .filter(|(idx, noun)| match (spec.noun_idx, &spec.colour) {
                (Some(said), _) => said == *idx,
                // A colour alone means a type whose objects are told apart by colour.
                (None, Some(_)) => noun.name.as_ref().is_some_and(|n| n.contains("{colour}")),
                (None, None) => true,
            })
            .map(|(idx, noun)| Candidate { type_name: noun.type_name.clone(), noun_idx: Some(idx) })
            .collect()
    }

    fn fits(&self, predicate: &Name, args: &[&Candidate]) -> bool {
        let Some(signature) = self.domain.predicate(predicate.as_str()) else { return false };
        signature.params.len() == args.len()
            && signature.params.iter().zip(args).all(|(param, arg)| {
                self.domain.types.fits(std::slice::from_ref(&arg.type_name), &param.types)
            })
    }

    /// "disk on peg"-like text of what a predicate takes, in the order it is said.
    fn signature(&self, predicate: &Name, swap: bool) -> String {
        let Some(signature) = self.domain.predicate(predicate.as_str()) else {
            return String::new();
        };
        let mut types: Vec<String> = signature
            .params
            .iter()
            .map(|param| match param.types.as_slice() {
                [] => "object".to_owned(),
                types => types.iter().map(Name::as_str).collect::<Vec<_>>().join("/"),
            })
            .collect();
        if swap {
            types.reverse();
        }
        types.join(" and ")
    }

    /// Finds what the words mean, given the type they stand for.
    fn resolve(&mut self, spec: &Spec, candidate: &Candidate) -> Result<Referent, Fault> {
        let means = self.referent(spec, candidate)?;
        let is_new = self.phrases.iter().all(|phrase| phrase.span != spec.span);
        if is_new {
            let text = self.words(spec);
            self.phrases.push(Phrase { text, span: spec.span.clone(), means: means.clone() });
        }
        Ok(means)
    }

    fn referent(&mut self, spec: &Spec, candidate: &Candidate) -> Result<Referent, Fault> {
        if let Some(name) = &spec.named {
            return Ok(Referent::Object(name.clone()));
        }
        let fitting = self.fitting(spec, candidate);
        if spec.all || spec.many {
            return self.several(spec, candidate, &fitting);
        }
        if spec.number.is_some_and(|number| number != 1) {
            return Err(self.wrong_number(spec, fitting.len()));
        }
        if let Some(pick) = self.pick(spec) {
            return self.picked(spec, candidate, pick, &fitting).map(Referent::Object);
        }
        match fitting.as_slice() {
            [one] => Ok(Referent::Object(one.name.clone())),
            [] => self.expect(spec, candidate).map(Referent::Object),
            _ => Err(self.ambiguous(spec, &fitting)),
        }
    }

    /// Seen objects of that type and colour.
    fn fitting(&self, spec: &Spec, candidate: &Candidate) -> Vec<&'a GoalObject> {
        let named = self.template_name(spec, candidate);
        let fits = |object: &&GoalObject| {
            self.domain.types.is_a(&object.type_name, &candidate.type_name)
                && match &spec.colour {
                    None => true,
                    Some(_) if object.colour.is_some() => object.colour == spec.colour,
                    Some(_) => named.as_ref() == Some(&object.name),
                }
        };
        self.objects.iter().filter(fits).collect()
    }

    fn template_name(&self, spec: &Spec, candidate: &Candidate) -> Option<Name> {
        let template = self.language.nouns.get(candidate.noun_idx?)?.name.as_ref()?;
        let text = match &spec.colour {
            Some(colour) => template.replace("{colour}", colour.as_str()),
            None => template.clone(),
        };
        (!text.contains("{colour}"))
            .then(|| Name::new(text.replace("{type}", candidate.type_name.as_str())))
    }

    /// "all disks", "the red disks", "three disks".
    fn several(
        &mut self,
        spec: &Spec,
        candidate: &Candidate,
        fitting: &[&GoalObject],
    ) -> Result<Referent, Fault> {
        if spec.position_idx.is_some() {
            let reason = Reason::OutOfPlace {
                word: self.words(spec),
                expected: "a position with a single object",
            };
            return Err(Fault { span: spec.span.clone(), reason });
        }
        if spec.number.is_some_and(|number| number != fitting.len()) {
            return Err(self.wrong_number(spec, fitting.len()));
        }
        if spec.colour.is_none() {
            return Ok(Referent::Every(candidate.type_name.clone()));
        }
        if fitting.is_empty() {
            return Ok(Referent::Several(vec![self.expect(spec, candidate)?]));
        }
        Ok(Referent::Several(fitting.iter().map(|object| object.name.clone()).collect()))
    }

    /// An object that has not been seen but can be named.
    fn expect(&mut self, spec: &Spec, candidate: &Candidate) -> Result<Name, Fault> {
        let Some(name) = self.template_name(spec, candidate) else {
            return Err(self.not_seen(spec, candidate, 0, 1));
        };
        if self.expected.iter().all(|typed| typed.name != name) {
            self.expected.push(Typed::new(name.clone(), candidate.type_name.clone()));
        }
        Ok(name)
    }

    fn pick(&self, spec: &Spec) -> Option<Pick> {
        let position = spec.position_idx.and_then(|idx| self.language.positions.get(idx));
        position.map(|position| position.pick).or(spec.ordinal.map(Pick::FromLeft))
    }

    /// The object that a position singles out by the boxes, or by the names where there are no
    /// boxes: `right_peg` is the right one.
    fn picked(
        &self,
        spec: &Spec,
        candidate: &Candidate,
        pick: Pick,
        fitting: &[&GoalObject],
    ) -> Result<Name, Fault> {
        let noun = candidate.noun_idx.and_then(|idx| self.language.nouns.get(idx));
        let seen_min = match &spec.colour {
            None => noun.map_or(1, |noun| noun.seen_min),
            Some(_) => 1,
        };
        if fitting.len() < seen_min {
            return Err(self.not_seen(spec, candidate, fitting.len(), seen_min));
        }
        let keyed: Option<Vec<Keyed<'_>>> =
            fitting.iter().map(|object| Keyed::new(object, pick)).collect();
        let Some(mut keyed) = keyed else {
            let n_boxes = fitting.iter().filter(|object| object.pixel_box.is_some()).count();
            return self
                .named_by_position(spec, candidate, fitting)
                .ok_or_else(|| self.not_seen(spec, candidate, n_boxes, fitting.len()));
        };
        positions::choose(&mut keyed, pick).map_err(|miss| match miss {
            Miss::NoSuchPlace => self.wrong_number(spec, fitting.len()),
            Miss::Equal(candidates) => Fault {
                span: spec.span.clone(),
                reason: Reason::Ambiguous { phrase: self.words(spec), candidates },
            },
        })
    }

    fn named_by_position(
        &self,
        spec: &Spec,
        candidate: &Candidate,
        fitting: &[&GoalObject],
    ) -> Option<Name> {
        let position = self.language.positions.get(spec.position_idx?)?;
        let type_words = vocabulary::split(candidate.type_name.as_str());
        let names = position.before.iter().map(|phrase| {
            let words = [vocabulary::split(phrase), type_words.clone()].concat();
            Name::new(words.join("_"))
        });
        names.into_iter().find(|name| fitting.iter().any(|object| object.name == *name))
    }

    fn claim(&mut self, predicate: &Name, said: &[&Referent], span: &Span) {
        let mut rows: Vec<Vec<Arg>> = vec![Vec::new()];
        for referent in said {
            let choices: Vec<Arg> = match referent {
                Referent::Object(name) => vec![Arg::One(name.clone())],
                Referent::Several(names) => names.iter().cloned().map(Arg::One).collect(),
                Referent::Every(type_name) => vec![Arg::Every(type_name.clone())],
            };
            rows = rows
                .iter()
                .flat_map(|row| {
                    choices.iter().map(|arg| [row.as_slice(), std::slice::from_ref(arg)].concat())
                })
                .collect();
        }
        for args in rows {
            let claim = Claim { predicate: predicate.clone(), args, span: span.clone() };
            let is_new = self
                .claims
                .iter()
                .all(|other| (&other.predicate, &other.args) != (&claim.predicate, &claim.args));
            if is_new {
                self.claims.push(claim);
            }
        }
    }

    /// The goal's atoms over the objects known so far, each with its place in the text.
    pub(super) fn ground_atoms(&self) -> Vec<GroundAtom> {
        let mut found = Vec::new();
        for claim in &self.claims {
            let mut rows: Vec<Vec<Name>> = vec![Vec::new()];
            for arg in &claim.args {
                let choices: Vec<Name> = match arg {
                    Arg::One(name) => vec![name.clone()],
                    Arg::Every(type_name) => self.of_type(type_name),
                };
                rows = rows
                    .iter()
                    .flat_map(|row| {
                        choices.iter().map(|c| [row.as_slice(), std::slice::from_ref(c)].concat())
                    })
                    .take(GROUND_ATOMS_MAX)
                    .collect();
            }
            let atoms = rows.into_iter().map(|args| GroundAtom {
                atom: Atom { predicate: claim.predicate.clone(), args },
                span: claim.span.clone(),
            });
            found.extend(atoms);
        }
        found.truncate(GROUND_ATOMS_MAX);
        found
    }

    fn of_type(&self, type_name: &Name) -> Vec<Name> {
        let types = &self.domain.types;
        let seen = self.objects.iter().filter(|o| types.is_a(&o.type_name, type_name));
        let expected = self
            .expected
            .iter()
            .filter(|typed| types.fits(&typed.types, std::slice::from_ref(type_name)));
        seen.map(|o| o.name.clone()).chain(expected.map(|typed| typed.name.clone())).collect()
    }

    /// Remarks when a heading's number of stacks is not what the statements describe.
    pub(super) fn note_stacks(&mut self, atoms: &[GroundAtom], parsed: &Parsed) {
        let (Some(stacks), Some((number, span))) = (&self.language.stacks, &parsed.n_stacks) else {
            return;
        };
        let n_groups = groups(atoms, &stacks.predicate);
        if n_groups != *number {
            let words = &self.text[span.clone()];
            self.notes.push(format!("\"{words}\" is said, {n_groups} described"));
        }
    }

    /// The finished goal.
    pub(super) fn finish(mut self, sources: &[Span]) -> ParsedGoal {
        for span in sources {
            let words = &self.text[span.clone()];
            self.notes.push(format!("\"{words}\" is no part of the goal"));
        }
        let mut conditions: Vec<Condition> = self.claims.iter().map(Claim::condition).collect();
        let goal = match conditions.len() {
            1 => conditions.remove(0),
            _ => Condition::And(conditions),
        };
        self.phrases.sort_by_key(|phrase| phrase.span.start);
        ParsedGoal { goal, phrases: self.phrases, expected: self.expected, notes: self.notes }
    }

    fn words(&self, spec: &Spec) -> String {
        self.text[spec.span.clone()].to_owned()
    }

    fn ambiguous(&self, spec: &Spec, fitting: &[&GoalObject]) -> Fault {
        let mut candidates: Vec<Name> = fitting.iter().map(|object| object.name.clone()).collect();
        candidates.sort();
        let reason = Reason::Ambiguous { phrase: self.words(spec), candidates };
        Fault { span: spec.span.clone(), reason }
    }

    fn wrong_number(&self, spec: &Spec, seen: usize) -> Fault {
        let reason = Reason::WrongNumber { phrase: self.words(spec), seen };
        Fault { span: spec.span.clone(), reason }
    }

    fn not_seen(&self, spec: &Spec, candidate: &Candidate, seen: usize, wanted: usize) -> Fault {
        let reason = Reason::NotSeen {
            phrase: self.words(spec),
            type_name: candidate.type_name.clone(),
            seen,
            wanted,
        };
        Fault { span: spec.span.clone(), reason }
    }
}

impl Claim {
    fn condition(&self) -> Condition {
        let mut variables: Vec<Typed> = Vec::new();
        let args = self
            .args
            .iter()
            .zip(["x", "y"])
            .map(|(arg, variable)| match arg {
                Arg::One(name) => Term::Object(name.clone()),
                Arg::Every(type_name) => {
                    variables.push(Typed::new(variable, type_name.clone()));
                    Term::Var(variable.into())
                }
            })
            .collect();
        let atom = Condition::Atom(Literal { predicate: self.predicate.clone(), args });
        if variables.is_empty() { atom } else { Condition::Forall(variables, Box::new(atom)) }
    }
}

/// What is said first and second, in the order of the predicate's arguments.
fn in_order<'r, T>(relation: &Relation, first: &'r T, second: &'r T) -> [&'r T; 2] {
    if relation.swap { [second, first] } else { [first, second] }
}

fn types_of(candidates: &[Candidate]) -> String {
    let types: Vec<&str> = candidates.iter().map(|c| c.type_name.as_str()).collect();
    types.join("/")
}
