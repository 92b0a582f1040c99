//! What an instruction asks for, as atoms: over one object, over every one of a type, or denied.

use std::collections::BTreeSet;

use super::super::{ParsedGoal, Reason};
use super::claim::{Arg, Claim};
use super::contradictions::{GroundAtom, groups};
use super::resolve::Resolver;
use super::syntax::{Clause, ClauseKind};
use super::{Fault, Span, told};
use crate::pddl::{Atom, Condition, Name};

/// Most ground atoms that are looked at for contradictions.
const GROUND_ATOMS_MAX: usize = 2000;

impl Resolver<'_> {
    /// The goal's atoms over the objects known so far, each with its place in the text.
    pub(super) fn ground_atoms(&self) -> Vec<GroundAtom> {
        self.ground(false)
    }

    fn ground(&self, is_denied: bool) -> Vec<GroundAtom> {
        let mut found = Vec::new();
        for claim in self.claims.iter().filter(|claim| claim.is_denied == is_denied) {
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
        let seen = self.view.objects.iter().filter(|o| types.is_a(&o.type_name, type_name));
        let expected = self
            .expected
            .iter()
            .filter(|typed| types.fits(&typed.types, std::slice::from_ref(type_name)));
        seen.map(|o| o.name.clone()).chain(expected.map(|typed| typed.name.clone())).collect()
    }

    /// What is asked for and denied at once.
    pub(super) fn check_denials(&self) -> Result<(), Fault> {
        let wished = self.ground(false);
        let denied = self.ground(true);
        let both = denied.iter().find(|denied| wished.iter().any(|w| w.atom == denied.atom));
        match both {
            None => Ok(()),
            Some(denied) => Err(Fault {
                span: denied.span.clone(),
                reason: Reason::Contradiction {
                    first: denied.atom.to_string(),
                    second: format!("(not {})", denied.atom),
                    because: "it cannot hold and not hold".to_owned(),
                },
            }),
        }
    }

    /// The numbers of a heading must be those of what the clauses describe.
    pub(super) fn check_stacks(&self, clauses: &[Clause]) -> Result<(), Fault> {
        let Some(stacks) = &self.language.stacks else { return Ok(()) };
        let (mut stacks_said, mut objects_said) = (Vec::new(), Vec::new());
        for clause in clauses {
            if let ClauseKind::Heading { n_stacks, n_objects } = &clause.kind {
                stacks_said.extend(n_stacks.iter());
                objects_said.extend(n_objects.iter());
            }
        }
        let atoms = self.ground_atoms();
        let wrong = |first: &Span, described: usize| {
            let reason = Reason::WrongCount { phrase: self.words(first), described };
            Err(Fault { span: first.clone(), reason })
        };
        let n_stacks: usize = stacks_said.iter().map(|(number, _)| number).sum();
        let described = groups(&atoms, &stacks.predicate);
        if let Some((_, first)) = stacks_said.first()
            && n_stacks != described
        {
            return wrong(first, described);
        }
        let related = atoms.iter().filter(|found| found.atom.predicate == stacks.predicate);
        let objects: BTreeSet<&Name> = related.flat_map(|found| &found.atom.args).collect();
        let n_objects: usize = objects_said.iter().map(|(number, _)| number).sum();
        if let Some((_, first)) = objects_said.first()
            && n_objects * n_stacks.max(1) != objects.len()
        {
            return wrong(first, objects.len());
        }
        Ok(())
    }

    /// The claims in an order of their own, to compare readings.
    pub(super) fn content(&self) -> Vec<(Name, Vec<Arg>, bool)> {
        let said = |claim: &Claim| (claim.predicate.clone(), claim.args.clone(), claim.is_denied);
        let mut content: Vec<_> = self.claims.iter().map(said).collect();
        content.sort();
        content
    }

    /// The finished goal.
    pub(super) fn finish(mut self) -> ParsedGoal {
        let said = self.claims.iter().map(|claim| told::claim(claim, self.language)).collect();
        let mut conditions: Vec<Condition> = self.claims.iter().map(Claim::condition).collect();
        let goal = match conditions.len() {
            1 => conditions.remove(0),
            _ => Condition::And(conditions),
        };
        self.phrases.sort_by_key(|phrase| phrase.span.start);
        let (phrases, expected, notes) = (self.phrases, self.expected, self.notes);
        ParsedGoal { goal, phrases, expected, notes, said }
    }
}
