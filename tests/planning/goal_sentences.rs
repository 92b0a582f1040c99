//! What sentences mean: a corpus with the right outcome of each, counted by right, refused and wrong.
//!
//! A wrong goal is worse than any refusal, so there may be none.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a failed step must fail the test")]

use std::collections::{BTreeMap, BTreeSet};

use crate::common::project;
use groundloop::goals::instruction::parse_in;
use groundloop::goals::{GoalError, GoalObject, GoalView, ParsedGoal};
use groundloop::logic::Facts;
use groundloop::pddl::{
    Condition, Literal, Name, SourceText, Term, Typed, parse_facts, parse_goal,
};
use groundloop::run::DomainFolder;

/// Of the sentences that ask for a goal, at least this part is to be understood.
const UNDERSTOOD_MIN: f64 = 0.9;

/// What is seen.
struct Scene {
    folder: DomainFolder,
    objects: Vec<GoalObject>,
    facts: Facts,
}

impl Scene {
    fn new(domain: &str) -> Self {
        let folder = DomainFolder::read(&project("domains").join(domain)).unwrap();
        Self { folder, objects: Vec::new(), facts: Facts::default() }
    }

    fn typed(&self) -> Vec<Typed> {
        self.objects.iter().map(|o| Typed::new(o.name.clone(), o.type_name.clone())).collect()
    }

    fn add_objects(&mut self, text: &str) {
        for word in text.split_whitespace() {
            let (word, at) = word.split_once('@').unwrap_or((word, ""));
            let (name, type_name) = word.split_once(':').unwrap();
            let edges: Vec<f64> = at.split(',').filter_map(|n| n.parse().ok()).collect();
            let pixel_box = <[f64; 4]>::try_from(edges).ok().map(Into::into);
            let (name, type_name) = (name.into(), type_name.into());
            let object = GoalObject::new(&self.folder.perception, name, type_name, pixel_box);
            self.objects.push(object);
        }
    }

    fn add_facts(&mut self, text: &str) {
        let source = SourceText::new("facts", text);
        let facts = parse_facts(&source, &self.folder.domain, &self.typed()).unwrap().value;
        self.facts.known.extend(facts);
    }

    fn read(&self, sentence: &str) -> Result<ParsedGoal, GoalError> {
        let language = self.folder.language.as_ref().unwrap();
        let view = GoalView { objects: &self.objects, facts: Some(&self.facts) };
        parse_in(sentence, &self.folder.domain, language, view)
    }

    /// The literals that a goal asks for over the objects of the scene.
    fn literals(&self, goal: &Condition) -> BTreeSet<String> {
        self.expand(goal, true, &BTreeMap::new())
    }

    fn expand(
        &self,
        goal: &Condition,
        is_true: bool,
        bound: &BTreeMap<Name, Name>,
    ) -> BTreeSet<String> {
        match goal {
            Condition::And(parts) if is_true => {
                parts.iter().flat_map(|part| self.expand(part, true, bound)).collect()
            }
            Condition::Not(inner) => self.expand(inner, !is_true, bound),
            Condition::Atom(Literal { predicate, args }) => {
                let name = |term: &Term| match term {
                    Term::Var(name) => bound[name].to_string(),
                    Term::Object(name) => name.to_string(),
                };
                let args: Vec<String> = args.iter().map(name).collect();
                let sign = if is_true { "" } else { "not " };
                BTreeSet::from([format!("{sign}{predicate} {}", args.join(" "))])
            }
            Condition::Forall(variables, body) if is_true => {
                let [variable] = variables.as_slice() else { panic!("one variable: {goal}") };
                let types = &self.folder.domain.types;
                let typed = self.typed();
                let fitting = typed.iter().filter(|o| types.fits(&o.types, &variable.types));
                let bind = |o: &Typed| {
                    let more = [(variable.name.clone(), o.name.clone())];
                    bound.clone().into_iter().chain(more).collect()
                };
                fitting.flat_map(|o| self.expand(body, true, &bind(o))).collect()
            }
            Condition::True
            | Condition::False
            | Condition::Equal(..)
            | Condition::And(_)
            | Condition::Or(_)
            | Condition::Exists(..)
            | Condition::Forall(..) => panic!("no conjunction of literals: {goal}"),
        }
    }
}

/// How many sentences came out how.
#[derive(Default)]
struct Counts {
    right: usize,
    refused_rightly: usize,
    refused: Vec<String>,
    wrong: Vec<String>,
}

#[test]
fn no_sentence_of_the_corpus_is_misread() {
    let text = std::fs::read_to_string(project("tests/planning/goal_sentences.txt")).unwrap();
    let mut scene = Scene::new("blocksworld");
    let mut wanted = None;
    let mut counts = Counts::default();
    for line in text.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        if let Some(at) = line.strip_prefix("@ ") {
            scene = Scene::new(at.split_whitespace().next().unwrap());
        } else if let Some(objects) = line.strip_prefix("objects ") {
            scene.add_objects(objects);
        } else if let Some(facts) = line.strip_prefix("facts ") {
            scene.add_facts(facts);
        } else if let Some(goal) = line.strip_prefix("= ") {
            wanted = (goal != "refused").then(|| {
                let source = SourceText::new("goal", goal);
                let goal = parse_goal(&source, &scene.folder.domain, &scene.typed()).unwrap();
                scene.literals(&goal)
            });
        } else {
            count(&scene, line, wanted.as_ref(), &mut counts);
        }
    }
    let Counts { right, refused_rightly, refused, wrong } = &counts;
    let n_expressible = right + refused.len();
    println!(
        "{right} right, {refused_rightly} refused as they should be, {} refused, {} wrong",
        refused.len(),
        wrong.len()
    );
    for line in refused {
        println!("refused: {line}");
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
    assert!(*right as f64 >= UNDERSTOOD_MIN * n_expressible as f64, "{right} of {n_expressible}");
    assert!(right + refused_rightly + refused.len() >= 300);
}

fn count(scene: &Scene, said: &str, wanted: Option<&BTreeSet<String>>, counts: &mut Counts) {
    let domain = &scene.folder.domain.name;
    match (scene.read(said), wanted) {
        (Ok(parsed), Some(wanted)) if scene.literals(&parsed.goal) == *wanted => counts.right += 1,
        (Ok(parsed), _) => counts.wrong.push(format!("{domain}: {said}: {}", parsed.goal)),
        (Err(_), None) => counts.refused_rightly += 1,
        (Err(error), Some(_)) => counts.refused.push(format!("{domain}: {said}: {error}")),
    }
}
