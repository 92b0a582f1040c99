//! A goal in words that read back as that goal.

use std::collections::BTreeSet;

use crate::draws::Draws;
use crate::goals::instruction::parse;
use crate::goals::{GoalObject, Language};
use crate::pddl::{Atom, Condition, Domain, Literal, Name, Term};

/// What a goal is said with.
#[derive(Debug, Clone, Copy)]
pub(super) struct Speech<'a> {
    pub(super) domain: &'a Domain,
    pub(super) language: &'a Language,
    /// The objects with their boxes: words such as "left" are read over them.
    pub(super) objects: &'a [GoalObject],
}

/// How objects are called: in words (`red block`), or by their exact names.
const CALLED: [fn(&Name) -> String; 2] =
    [|name| name.as_str().replace('_', " "), |name| name.as_str().to_owned()];

impl Speech<'_> {
    /// The atoms of a goal as sentences, one for each predicate; which of the words that would do are taken
    /// is drawn. `None` where the language has none.
    pub(super) fn said(&self, goal: &BTreeSet<Atom>, draws: &mut Draws) -> Option<String> {
        let predicates: BTreeSet<&Name> = goal.iter().map(|atom| &atom.predicate).collect();
        let sentences: Option<Vec<String>> = predicates
            .into_iter()
            .map(|predicate| {
                let atoms = goal.iter().filter(|atom| atom.predicate == *predicate);
                self.sentence(&atoms.cloned().collect(), predicate, draws)
            })
            .collect();
        let text = sentences?.join(" ");
        self.reads_as(&text, goal).then_some(text)
    }

    /// A sentence for the atoms of one predicate.
    fn sentence(
        &self,
        atoms: &BTreeSet<Atom>,
        predicate: &Name,
        draws: &mut Draws,
    ) -> Option<String> {
        let mut phrases = self.phrases(predicate);
        draws.shuffle(&mut phrases);
        let ways = CALLED.iter().flat_map(|called| phrases.iter().map(move |p| (called, p)));
        let mut sentences = ways.map(|(called, (phrase, is_swapped))| {
            let clause = |atom: &Atom| {
                let names = atom.args.iter().map(called).collect::<Vec<_>>();
                match names.as_slice() {
                    [a, b] if *is_swapped => format!("{b} {phrase} {a}"),
                    [a, b] => format!("{a} {phrase} {b}"),
                    names => format!("{} {phrase}", names.join(" ")),
                }
            };
            sentence_of(&atoms.iter().map(clause).collect::<Vec<_>>().join(", "))
        });
        sentences.find(|sentence| self.reads_as(sentence, atoms))
    }

    /// The phrases for a predicate, and whether they name its second object first.
    fn phrases(&self, predicate: &Name) -> Vec<(&str, bool)> {
        let relations = self.language.relations.iter().filter(|r| r.predicate == *predicate);
        let relations = relations.flat_map(|r| r.phrases.iter().map(|p| (p.as_str(), r.swap)));
        let properties = self.language.properties.iter().filter(|p| p.predicate == *predicate);
        let properties = properties.flat_map(|p| p.phrases.iter().map(|p| (p.as_str(), false)));
        relations.chain(properties).collect()
    }

    fn reads_as(&self, text: &str, goal: &BTreeSet<Atom>) -> bool {
        let Ok(parsed) = parse(text, self.domain, self.language, self.objects) else {
            return false;
        };
        let mut atoms = BTreeSet::new();
        parsed.expected.is_empty() && collect(&parsed.goal, &mut atoms) && atoms == *goal
    }
}

/// With a capital letter and a full stop.
fn sentence_of(text: &str) -> String {
    let mut chars = text.chars();
    let first: String = chars.next().into_iter().flat_map(char::to_uppercase).collect();
    format!("{first}{}.", chars.as_str())
}

/// The atoms of a conjunction; whether it is one.
fn collect(condition: &Condition, atoms: &mut BTreeSet<Atom>) -> bool {
    match condition {
        Condition::True => true,
        Condition::And(parts) => parts.iter().all(|part| collect(part, atoms)),
        Condition::Atom(Literal { predicate, args }) => {
            let name =
                |arg: &Term| if let Term::Object(name) = arg { Some(name.clone()) } else { None };
            let args: Option<Vec<Name>> = args.iter().map(name).collect();
            atoms.extend(args.clone().map(|args| Atom { predicate: predicate.clone(), args }));
            args.is_some()
        }
        Condition::False
        | Condition::Equal(..)
        | Condition::Not(_)
        | Condition::Or(_)
        | Condition::Exists(..)
        | Condition::Forall(..) => false,
    }
}

/// Atoms as a condition.
pub(super) fn condition_of(atoms: &BTreeSet<Atom>) -> Condition {
    let literal = |atom: &Atom| {
        let args = atom.args.iter().cloned().map(Term::Object).collect();
        Condition::Atom(Literal { predicate: atom.predicate.clone(), args })
    };
    Condition::And(atoms.iter().map(literal).collect())
}
