//! A planning problem as the text that Fast Downward reads, and its plan as steps.

use std::collections::{BTreeMap, BTreeSet};

use super::plain::{OwnNames, plain};
use crate::pddl::{
    Action, Atom, Condition, CostTerm, Domain, Effect, Name, Number, Problem, Signature,
    SourceText, Step, Term, Typed, parse_plan, print_domain, print_problem,
};
use crate::planning::PlanRequest;

/// Most that a cost may be: it calculates with 32 bits, and some are left for sums.
const COST_MAX: u32 = 100_000_000;
/// Stands between an action's name and the number of the step of it that is penalised.
const PENALISED: &str = "--penalised-";

/// Requirements that cover all that this project reads; Fast Downward takes them as declarations.
const REQUIREMENTS: [&str; 4] = [":typing", ":adl", ":action-costs", ":derived-predicates"];

/// Domain and problem as text.
#[derive(Debug)]
pub(super) struct Encoded {
    pub(super) domain: String,
    pub(super) problem: String,
    /// The actions that are copied for one penalised step each, with their own names.
    copies: BTreeMap<Name, Name>,
    names: OwnNames,
}

/// Prints a problem. Each penalised step becomes an action of its own with a cost of its own; the
/// action that it comes from leaves its arguments out.
///
/// Fractional costs are written in units in which they are whole numbers.
///
/// # Errors
/// What Fast Downward cannot express: costs that are too large for it.
pub(super) fn encode(domain: &Domain, request: &PlanRequest<'_>) -> Result<Encoded, String> {
    let mut domain = domain.clone();
    let has_costs = request.minimise_cost || !request.penalties.is_empty();
    let decimals = if request.minimise_cost { decimals(&domain, request.costs) } else { 0 };
    domain.requirements = REQUIREMENTS.iter().map(|&r| r.into()).collect();
    for action in &mut domain.actions {
        if !request.minimise_cost {
            let cost = has_costs.then_some(Effect::Cost(CostTerm::Number(Number::ONE)));
            action.effect = with_cost(&action.effect, cost);
        }
        scale(&mut action.effect, decimals)?;
    }
    let mut costs = BTreeMap::new();
    if request.minimise_cost {
        costs.clone_from(request.costs);
        costs.values_mut().try_for_each(|value| in_units(value, decimals))?;
    }
    if !request.minimise_cost {
        domain.functions.clear();
    }
    if has_costs && domain.functions.iter().all(|f| f.name != "total-cost") {
        domain.functions.push(Signature { name: "total-cost".into(), params: Vec::new() });
    }
    let known = |object: &&Typed| domain.constants.iter().all(|c| c.name != object.name);
    let mut objects: Vec<Typed> = request.objects.iter().filter(known).cloned().collect();
    let copies = split(&mut domain, request.penalties, decimals)?;
    if !copies.is_empty() {
        // Preconditions may name constants only.
        domain.constants.append(&mut objects);
    }
    let derived: BTreeSet<Name> =
        domain.axioms.iter().map(|axiom| axiom.head.name.clone()).collect();
    let mut problem = Problem {
        name: "task".into(),
        domain: domain.name.clone(),
        objects,
        init: request.init.iter().filter(|a| !derived.contains(&a.predicate)).cloned().collect(),
        costs,
        goal: request.goal.clone(),
        minimise_cost: has_costs,
    };
    let names = plain(&mut domain, &mut problem);
    Ok(Encoded { domain: print_domain(&domain), problem: print_problem(&problem), copies, names })
}

/// The effect with `cost` in place of what it costs.
fn with_cost(effect: &Effect, cost: Option<Effect>) -> Effect {
    fn without(effect: &Effect) -> Effect {
        match effect {
            Effect::And(parts) => Effect::And(parts.iter().map(without).collect()),
            Effect::Cost(_) => Effect::And(Vec::new()),
            Effect::When(condition, inner) => {
                Effect::When(condition.clone(), Box::new(without(inner)))
            }
            Effect::Forall(vars, inner) => Effect::Forall(vars.clone(), Box::new(without(inner))),
            Effect::Add(_) | Effect::Delete(_) => effect.clone(),
        }
    }
    let mut parts = vec![without(effect)];
    parts.extend(cost);
    Effect::And(parts)
}

/// Most digits behind the point of a cost.
fn decimals(domain: &Domain, costs: &BTreeMap<Atom, Number>) -> u32 {
    fn of(effect: &Effect) -> u32 {
        match effect {
            Effect::And(parts) => parts.iter().map(of).max().unwrap_or(0),
            Effect::When(_, inner) | Effect::Forall(_, inner) => of(inner),
            Effect::Cost(CostTerm::Number(number)) => number.decimals(),
            Effect::Cost(CostTerm::Function(_)) | Effect::Add(_) | Effect::Delete(_) => 0,
        }
    }
    let numbers = domain.actions.iter().map(|action| of(&action.effect));
    numbers.chain(costs.values().map(|cost| cost.decimals())).max().unwrap_or(0)
}

/// Puts the costs of an effect in units of `1 / 10^decimals`.
fn scale(effect: &mut Effect, decimals: u32) -> Result<(), String> {
    match effect {
        Effect::And(parts) => parts.iter_mut().try_for_each(|part| scale(part, decimals)),
        Effect::When(_, inner) | Effect::Forall(_, inner) => scale(inner, decimals),
        Effect::Cost(CostTerm::Number(number)) => in_units(number, decimals),
        Effect::Cost(CostTerm::Function(_)) | Effect::Add(_) | Effect::Delete(_) => Ok(()),
    }
}

fn in_units(cost: &mut Number, decimals: u32) -> Result<(), String> {
    let units = cost.scaled(decimals).and_then(|units| u32::try_from(units).ok());
    let Some(units) = units.filter(|&units| units <= COST_MAX) else {
        let unit = Number::new(1, decimals);
        return Err(format!("the cost {cost}: at most {COST_MAX} units of {unit}"));
    };
    *cost = Number::from(u64::from(units));
    Ok(())
}

/// Makes one action for each penalised step; returns their names with those that they come from.
fn split(
    domain: &mut Domain,
    penalties: &BTreeMap<Step, u32>,
    decimals: u32,
) -> Result<BTreeMap<Name, Name>, String> {
    let (mut copies, mut added) = (BTreeMap::new(), Vec::new());
    for (number, (step, penalty)) in penalties.iter().enumerate() {
        let action = domain.actions.iter_mut().find(|a| a.name == step.action);
        let Some(action) = action.filter(|a| a.params.len() == step.args.len()) else { continue };
        let pairs = action.params.iter().zip(&step.args);
        let is_step = Condition::And(
            pairs
                .map(|(param, object)| {
                    Condition::Equal(Term::Var(param.name.clone()), Term::Object(object.clone()))
                })
                .collect(),
        );
        let also =
            |condition: &Condition, more: Condition| Condition::And(vec![condition.clone(), more]);
        let name = Name::new(format!("{}{PENALISED}{number}", action.name));
        let mut penalty = Number::from(u64::from(*penalty));
        in_units(&mut penalty, decimals)?;
        added.push(Action {
            name: name.clone(),
            params: action.params.clone(),
            precondition: also(&action.precondition, is_step.clone()),
            effect: plus(&action.effect, penalty),
        });
        action.precondition = also(&action.precondition, Condition::Not(Box::new(is_step)));
        copies.insert(name, action.name.clone());
    }
    domain.actions.append(&mut added);
    Ok(copies)
}

/// The effect at a cost that is higher by a penalty. Fast Downward adds up one term alone, so a
/// number is added here; a function stands where it is, and the penalty with it as a second term.
fn plus(effect: &Effect, penalty: Number) -> Effect {
    fn raise(effect: &Effect, by: Number) -> Option<Effect> {
        match effect {
            Effect::And(parts) => {
                let at = parts.iter().position(|part| raise(part, by).is_some())?;
                let mut parts = parts.clone();
                parts[at] = raise(&parts[at], by)?;
                Some(Effect::And(parts))
            }
            Effect::Cost(CostTerm::Number(n)) => {
                Some(Effect::Cost(CostTerm::Number(n.checked_add(by)?)))
            }
            Effect::Cost(CostTerm::Function(_))
            | Effect::Add(_)
            | Effect::Delete(_)
            | Effect::When(..)
            | Effect::Forall(..) => None,
        }
    }
    raise(effect, penalty).unwrap_or_else(|| {
        Effect::And(vec![effect.clone(), Effect::Cost(CostTerm::Number(penalty))])
    })
}

impl Encoded {
    /// Reads a plan file.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn plan(&self, text: &str) -> Result<Vec<Step>, String> {
        let source = SourceText::new("plan", text);
        let steps = parse_plan(&source).map_err(|error| error.to_string())?;
        let own = |step: Step| {
            let action = self.names.own(&step.action);
            let args = step.args.iter().map(|name| self.names.own(name)).collect();
            Step { action: self.copies.get(&action).cloned().unwrap_or(action), args }
        };
        Ok(steps.into_iter().map(own).collect())
    }

    /// What Fast Downward says, with the problem's own names.
    pub(super) fn in_own_names(&self, text: &str) -> String {
        self.names.in_text(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pddl::{parse_domain, parse_problem};

    const DOMAIN: &str = "(define (domain d) (:requirements :strips) (:predicates (p ?x) (q ?x))
        (:action a :parameters (?x) :precondition (p ?x) :effect (q ?x)))";

    #[test]
    fn penalised_steps_become_actions_of_their_own() {
        let domain = parse_domain(&SourceText::new("domain", DOMAIN)).unwrap().value;
        let objects = ["o1", "o2"].map(|name| Typed::new(name, "object"));
        let penalties = BTreeMap::from([(Step::new("a", &["o1"]), 7)]);
        let request = PlanRequest {
            objects: &objects,
            init: &BTreeSet::from([Atom::new("p", &["o1"])]),
            goal: &Condition::True,
            costs: &BTreeMap::new(),
            minimise_cost: false,
            penalties: &penalties,
        };
        let encoded = encode(&domain, &request).unwrap();
        let read = parse_domain(&SourceText::new("printed", &*encoded.domain)).unwrap().value;
        assert_eq!(read.actions.len(), 2);
        assert!(encoded.domain.contains("(not (and (= ?x o1)))"), "{}", encoded.domain);
        assert!(encoded.domain.contains("(increase (total-cost) 8)"), "{}", encoded.domain);
        parse_problem(&SourceText::new("printed", &*encoded.problem), &read).unwrap();
        let plan = encoded.plan("(a--penalised-0 o1)\n(a o2)\n; cost = 9\n").unwrap();
        assert_eq!(plan, [Step::new("a", &["o1"]), Step::new("a", &["o2"])]);
    }

    /// What is read back from the printed domain and problem.
    fn printed(encoded: &Encoded) -> (Domain, Problem) {
        let read = parse_domain(&SourceText::new("printed", &*encoded.domain));
        let domain = read.unwrap_or_else(|e| panic!("{}", e.render())).value;
        let read = parse_problem(&SourceText::new("printed", &*encoded.problem), &domain);
        (domain, read.unwrap_or_else(|e| panic!("{}", e.render())).value)
    }

    #[test]
    fn foreign_names_and_types_with_several_parents_are_written_plainly() {
        let domain = "(define (domain größe) (:requirements :adl) (:types kiste - (either ort ding) ort ding)
            (:predicates (in ?x - ding ?y - ort) (groß ?x - (either ort ding)))
            (:action lege :parameters (?ä - ding ?y - ort)
              :precondition (and (groß ?ä) (exists (?z - kiste) (in ?z ?y)))
              :effect (and (in ?ä ?y) (forall (?z - kiste) (when (in ?z ?y) (groß ?z))))))";
        let problem =
            "(define (problem p) (:domain größe) (:objects käse - ding k1 k2 - kiste o - ort)
            (:init (groß käse) (in k1 k2)) (:goal (and (groß k1) (forall (?x - ding) (or (groß ?x) (in ?x k2) (= ?x k2))))))";
        let own = parse_domain(&SourceText::new("domain", domain)).unwrap().value;
        let problem = parse_problem(&SourceText::new("problem", problem), &own).unwrap().value;
        let request = PlanRequest::new(&problem);
        let encoded = encode(&own, &request).unwrap();
        assert!(encoded.domain.is_ascii() && encoded.problem.is_ascii(), "{}", encoded.domain);
        assert!(!encoded.domain.contains("(either"), "{}", encoded.domain);
        let (plain_domain, plain_problem) = printed(&encoded);
        let budget = crate::planning::Budget::standard();
        let plan = |domain: &Domain, problem: &Problem| {
            let answer = crate::planning::plan(domain, &PlanRequest::new(problem), &budget);
            answer.outcome.plan().unwrap().steps.clone()
        };
        let found = plan(&plain_domain, &plain_problem);
        let text: Vec<String> = found.iter().map(ToString::to_string).collect();
        let text = text.join("\n");
        assert!(text.is_ascii());
        let steps = encoded.plan(&text).unwrap();
        assert_eq!(steps.len(), plan(&own, &problem).len());
        assert!(crate::planning::validate(&own, &request, &steps).is_valid(), "{steps:?}");
        assert_eq!(encoded.in_own_names("no k--e4--se"), "no käse");
    }

    #[test]
    fn fractions_are_scaled_and_what_is_too_large_is_refused() {
        let text = DOMAIN.replace("(q ?x)))", "(and (q ?x) (increase (total-cost) 0.25))))");
        let text = text.replace("(:action", "(:functions (total-cost)) (:action");
        let domain = parse_domain(&SourceText::new("domain", text)).unwrap().value;
        let costs =
            |cost: &str| BTreeMap::from([(Atom::new("far", &[]), Number::parse(cost).unwrap())]);
        let (small, large) = (costs("1.5"), costs("100000001"));
        let request = PlanRequest {
            objects: &[],
            init: &BTreeSet::new(),
            goal: &Condition::True,
            costs: &small,
            minimise_cost: true,
            penalties: &BTreeMap::new(),
        };
        let encoded = encode(&domain, &request).unwrap();
        assert!(encoded.domain.contains("(increase (total-cost) 25)"), "{}", encoded.domain);
        assert!(encoded.problem.contains("(= (far) 150)"), "{}", encoded.problem);
        let refused = encode(&domain, &PlanRequest { costs: &large, ..request }).unwrap_err();
        assert_eq!(refused, "the cost 100000001: at most 100000000 units of 0.01");
        let plain = PlanRequest { minimise_cost: false, ..request };
        assert!(!encode(&domain, &plain).unwrap().domain.contains("increase"));
    }
}
