//! Clauses to atoms: which predicate, which objects.

use std::collections::BTreeSet;

use super::super::language::{Relation, Sequence};
use super::super::{GoalView, Language, Phrase, Reason, Referent};
use super::claim::{Arg, Claim};
use super::syntax::{Clause, ClauseKind, Head, Link, Mood, NounPhrase, Trait};
use super::vocabulary::Vocabulary;
use super::{Fault, Span};
use crate::pddl::{Domain, Name, Typed};

/// A type an object's words may stand for, with its noun where there is one.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub(super) type_name: Name,
    pub(super) noun_idx: Option<usize>,
}

/// What a pronoun may stand for.
#[derive(Debug, Clone)]
pub(super) struct Antecedent {
    pub(super) means: Referent,
    type_name: Name,
}

/// Whether an object is moved, or is what another one is moved to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Theme,
    Landmark,
}

/// Collects the goal's atoms while it resolves clause after clause.
#[derive(Debug)]
pub(super) struct Resolver<'a> {
    pub(super) text: &'a str,
    pub(super) domain: &'a Domain,
    pub(super) language: &'a Language,
    pub(super) vocabulary: &'a Vocabulary,
    pub(super) view: GoalView<'a>,
    pub(super) claims: Vec<Claim>,
    pub(super) phrases: Vec<Phrase>,
    pub(super) expected: Vec<Typed>,
    pub(super) notes: Vec<String>,
    /// The objects that were moved last, and the one that they were moved to.
    pub(super) moved: Vec<Antecedent>,
    pub(super) landmark: Option<Antecedent>,
    /// Every object that has been named.
    pub(super) mentioned: BTreeSet<Name>,
    /// Whether "on it" means the object that something was moved to; and whether that was a choice.
    pub(super) it_is_landmark: bool,
    pub(super) has_choice: bool,
    /// What has been taken up and not put anywhere.
    taken: Option<Span>,
    /// The last object of the newest chain.
    tail: Option<NounPhrase>,
}

impl<'a> Resolver<'a> {
    pub(super) fn new(
        text: &'a str,
        (domain, language): (&'a Domain, &'a Language),
        vocabulary: &'a Vocabulary,
        view: GoalView<'a>,
        it_is_landmark: bool,
    ) -> Self {
        let (claims, phrases, expected, notes) = Default::default();
        let (moved, landmark, mentioned) = Default::default();
        let (has_choice, taken, tail) = Default::default();
        Self {
            text,
            domain,
            language,
            vocabulary,
            view,
            claims,
            phrases,
            expected,
            notes,
            moved,
            landmark,
            mentioned,
            it_is_landmark,
            has_choice,
            taken,
            tail,
        }
    }

    /// Adds what a row of clauses asks for.
    pub(super) fn read(&mut self, clauses: &[Clause]) -> Result<(), Fault> {
        for clause in clauses {
            if let Some(taken) = self.taken.take_if(|_| !speaks_of_it(clause)) {
                return Err(self.nothing_said(&taken));
            }
            self.clause(clause)?;
            if !matches!(clause.kind, ClauseKind::Take { .. }) {
                self.taken = None;
            }
        }
        match self.taken.take() {
            Some(taken) => Err(self.nothing_said(&taken)),
            None => Ok(()),
        }
    }

    fn nothing_said(&self, span: &Span) -> Fault {
        let reason = Reason::NothingSaid { phrase: self.words(span) };
        Fault { span: span.clone(), reason }
    }

    fn clause(&mut self, clause: &Clause) -> Result<(), Fault> {
        let is_denied = clause.mood == Mood::Denial;
        match &clause.kind {
            ClauseKind::Heading { .. } => Ok(()),
            ClauseKind::Place { themes, links, ends } => {
                self.place(themes, links, ends.as_ref(), is_denied)
            }
            ClauseKind::GoesOn { links, ends } => {
                let Some(tail) = self.tail.clone() else {
                    let word = links.first().map_or(clause.span.clone(), |link| link.word.clone());
                    let reason = Reason::NoObject { side: "before", word: self.words(&word) };
                    return Err(Fault { span: word, reason });
                };
                self.place(&[tail], links, ends.as_ref(), is_denied)
            }
            ClauseKind::Has { themes, what } => self.has(themes, what, is_denied),
            ClauseKind::Chain { sequence_idx, word, objects } => {
                self.chain(*sequence_idx, word, objects)
            }
            ClauseKind::Take { themes } => {
                self.moved =
                    themes.iter().map(|theme| self.picked_up(theme)).collect::<Result<_, _>>()?;
                self.landmark = None;
                self.taken = themes.first().map(|theme| theme.span.clone());
                Ok(())
            }
            ClauseKind::Swap { both } => self.swap(both, &clause.span),
        }
    }

    /// The object of "take": its words alone say of which type it is.
    fn picked_up(&mut self, theme: &NounPhrase) -> Result<Antecedent, Fault> {
        let candidates = self.candidates(theme, Role::Theme)?;
        let mut fault = None;
        for candidate in &candidates {
            match self.resolve(theme, Role::Theme, candidate) {
                Ok(means) => {
                    return Ok(Antecedent { means, type_name: candidate.type_name.clone() });
                }
                Err(error) => _ = fault.get_or_insert(error),
            }
        }
        Err(fault.unwrap_or_else(|| self.nothing_said(&theme.span)))
    }

    fn place(
        &mut self,
        themes: &[NounPhrase],
        links: &[Link],
        ends: Option<&Trait>,
        is_denied: bool,
    ) -> Result<(), Fault> {
        let Some((first, more)) = links.split_first() else { return Ok(()) };
        let (mut moved, mut landmark) = (Vec::new(), None);
        for theme in themes {
            let (left, right) = self.relate(theme, first, Role::Theme, is_denied)?;
            moved.push(left);
            landmark = Some(right);
        }
        for (before, link) in links.iter().zip(more) {
            self.relate(&before.landmark, link, Role::Landmark, is_denied)?;
            landmark = None;
        }
        let last = links.last().unwrap_or(first);
        if let Some(what) = ends {
            self.attribute(&last.landmark, what, Role::Landmark, is_denied)?;
        }
        self.tail = Some(last.landmark.clone());
        self.moved = moved;
        let is_one = |found: &Antecedent| matches!(found.means, Referent::Object(_));
        self.landmark = landmark.filter(is_one);
        Ok(())
    }

    fn has(&mut self, themes: &[NounPhrase], what: &Trait, is_denied: bool) -> Result<(), Fault> {
        let mut moved = Vec::new();
        for theme in themes {
            moved.push(self.attribute(theme, what, Role::Theme, is_denied)?);
        }
        self.moved = moved;
        self.landmark = None;
        self.tail = None;
        Ok(())
    }

    fn chain(&mut self, idx: usize, word: &Span, objects: &[NounPhrase]) -> Result<(), Fault> {
        let Some(Sequence { phrases, predicate, swap }) = self.language.sequences.get(idx).cloned()
        else {
            return Ok(());
        };
        let relation = [Relation { phrases, predicate, swap }];
        if let [only] = objects {
            return Err(self.nothing_said(&only.span));
        }
        for pair in objects.windows(2) {
            if let [left, right] = pair {
                self.relate_by(&relation, word, (left, Role::Theme), right, false)?;
            }
        }
        self.moved = Vec::new();
        self.landmark = None;
        self.tail = None;
        Ok(())
    }

    fn relate(
        &mut self,
        theme: &NounPhrase,
        link: &Link,
        role: Role,
        is_denied: bool,
    ) -> Result<(Antecedent, Antecedent), Fault> {
        let relations = link.relation_idxs.iter();
        let relations: Vec<Relation> =
            relations.filter_map(|idx| self.language.relations.get(*idx).cloned()).collect();
        self.relate_by(&relations, &link.word, (theme, role), &link.landmark, is_denied)
    }

    fn relate_by(
        &mut self,
        relations: &[Relation],
        word: &Span,
        (left, role): (&NounPhrase, Role),
        right: &NounPhrase,
        is_denied: bool,
    ) -> Result<(Antecedent, Antecedent), Fault> {
        let lefts = self.candidates(left, role)?;
        let rights = self.candidates(right, Role::Landmark)?;
        let readings = relations.iter().flat_map(|relation| {
            let pairs = lefts.iter().flat_map(|l| rights.iter().map(move |r| (l, r)));
            pairs.map(move |(l, r)| (relation, l, r))
        });
        let fitting = readings
            .into_iter()
            .find(|(relation, l, r)| self.fits(&relation.predicate, &in_order(relation, *l, *r)));
        let span = left.span.start.min(word.start).min(right.span.start)
            ..right.span.end.max(word.end).max(left.span.end);
        if let Some((relation, l, r)) = fitting {
            let said = [self.resolve(left, role, l)?, self.resolve(right, Role::Landmark, r)?];
            let args = in_order(relation, &said[0], &said[1]);
            self.claim(&relation.predicate, &args, &span, is_denied);
            let [first, second] = said;
            let antecedent =
                |means, of: &Candidate| Antecedent { means, type_name: of.type_name.clone() };
            return Ok((antecedent(first, l), antecedent(second, r)));
        }
        let wanted =
            relations.iter().map(|relation| self.signature(&relation.predicate, relation.swap));
        Err(Fault {
            span,
            reason: Reason::WrongTypes {
                word: self.text[word.clone()].to_owned(),
                given: format!("{} and {}", types_of(&lefts), types_of(&rights)),
                wanted: wanted.collect::<Vec<_>>().join(", or "),
            },
        })
    }

    fn attribute(
        &mut self,
        object: &NounPhrase,
        Trait { property_idx, word }: &Trait,
        role: Role,
        is_denied: bool,
    ) -> Result<Antecedent, Fault> {
        let candidates = self.candidates(object, role)?;
        let predicate = self.language.properties.get(*property_idx).map(|p| p.predicate.clone());
        let predicate = predicate.unwrap_or_else(|| Name::new(""));
        let span = object.span.start.min(word.start)..object.span.end.max(word.end);
        let fitting = candidates.iter().find(|c| self.fits(&predicate, &[*c]));
        if let Some(candidate) = fitting {
            let means = self.resolve(object, role, candidate)?;
            self.claim(&predicate, &[&means], &span, is_denied);
            return Ok(Antecedent { means, type_name: candidate.type_name.clone() });
        }
        let reason = Reason::WrongTypes {
            word: self.text[word.clone()].to_owned(),
            given: types_of(&candidates),
            wanted: self.signature(&predicate, false),
        };
        Err(Fault { span, reason })
    }

    /// "swap red and blue": what is seen of each is wished of the other.
    fn swap(&mut self, both: &[NounPhrase; 2], span: &Span) -> Result<(), Fault> {
        let [first, second] = both;
        let (first, second) = (self.picked_up(first)?, self.picked_up(second)?);
        let (Referent::Object(a), Referent::Object(b)) = (&first.means, &second.means) else {
            return Err(self.nothing_said(span));
        };
        let Some(facts) = self.view.facts else {
            let reason = Reason::CannotTell { phrase: self.words(span) };
            return Err(Fault { span: span.clone(), reason });
        };
        let places = self.places();
        let other = |name: &Name| match name {
            name if name == a => Referent::Object(b.clone()),
            name if name == b => Referent::Object(a.clone()),
            name => Referent::Object(name.clone()),
        };
        let about = |args: &[Name]| args.contains(a) || args.contains(b);
        let told: Vec<_> = facts
            .known
            .iter()
            .filter(|f| places.contains(&f.predicate) && about(&f.args))
            .collect();
        if told.is_empty()
            || facts.unknown.iter().any(|f| places.contains(&f.predicate) && about(&f.args))
        {
            let reason = Reason::CannotTell { phrase: self.words(span) };
            return Err(Fault { span: span.clone(), reason });
        }
        for fact in told {
            let args: Vec<Referent> = fact.args.iter().map(other).collect();
            self.claim(&fact.predicate, &args.iter().collect::<Vec<_>>(), span, false);
        }
        self.moved = Vec::new();
        self.landmark = None;
        Ok(())
    }

    /// Predicates that say where something is: relations, and properties that exclude one.
    fn places(&self) -> BTreeSet<Name> {
        let relations: BTreeSet<Name> =
            self.language.relations.iter().map(|relation| relation.predicate.clone()).collect();
        let properties = self.language.properties.iter().map(|property| &property.predicate);
        let excludes = |property: &&Name| {
            self.language.mutex_rules.iter().any(|rule| {
                let named = rule.both.each_ref().map(|pattern| &pattern.predicate);
                named.contains(property) && named.iter().any(|name| relations.contains(*name))
            })
        };
        let excluding: Vec<Name> = properties.filter(excludes).cloned().collect();
        relations.into_iter().chain(excluding).collect()
    }

    /// The types that an object's words allow.
    pub(super) fn candidates(
        &mut self,
        object: &NounPhrase,
        role: Role,
    ) -> Result<Vec<Candidate>, Fault> {
        let typed = |type_name: &Name| Candidate { type_name: type_name.clone(), noun_idx: None };
        let thing = match &object.head {
            Head::It => return Ok(vec![typed(&self.antecedent(object, role)?.type_name)]),
            Head::They | Head::Rest => {
                let moved = self.moved.first().ok_or_else(|| self.nothing_before(object))?;
                return Ok(vec![typed(&moved.type_name)]);
            }
            Head::Listed => return Ok(Vec::new()),
            Head::Named(name) => {
                let object = self.view.objects.iter().find(|object| object.name == *name);
                return Ok(object.map(|object| typed(&object.type_name)).into_iter().collect());
            }
            Head::Thing(thing) => thing,
        };
        let nouns = self.language.nouns.iter().enumerate();
        Ok(nouns
            .filter(|(idx, noun)| match (thing.noun_idx, &thing.colour) {
                (Some(said), _) => said == *idx,
                // A colour alone means a type whose objects are told apart by colour.
                (None, Some(_)) => noun.name.as_ref().is_some_and(|n| n.contains("{colour}")),
                (None, None) => true,
            })
            .map(|(idx, noun)| Candidate { type_name: noun.type_name.clone(), noun_idx: Some(idx) })
            .collect())
    }

    pub(super) fn fits(&self, predicate: &Name, args: &[&Candidate]) -> bool {
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

    fn claim(&mut self, predicate: &Name, said: &[&Referent], span: &Span, is_denied: bool) {
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
            let (predicate, span) = (predicate.clone(), span.clone());
            let claim = Claim { predicate, args, is_denied, span };
            if !self.claims.iter().any(|other| other.says_same(&claim)) {
                self.claims.push(claim);
            }
        }
    }
}

/// Whether a clause has a pronoun, so that what was taken up before is meant.
fn speaks_of_it(clause: &Clause) -> bool {
    let is_it = |object: &NounPhrase| matches!(object.head, Head::It | Head::They);
    match &clause.kind {
        ClauseKind::Place { themes, links, .. } => {
            themes.iter().any(is_it) || links.iter().any(|link| is_it(&link.landmark))
        }
        ClauseKind::GoesOn { links, .. } => links.iter().any(|link| is_it(&link.landmark)),
        ClauseKind::Has { themes, .. } | ClauseKind::Take { themes } => themes.iter().any(is_it),
        ClauseKind::Chain { objects, .. } => objects.iter().any(is_it),
        ClauseKind::Swap { both } => both.iter().any(is_it),
        ClauseKind::Heading { .. } => true,
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
