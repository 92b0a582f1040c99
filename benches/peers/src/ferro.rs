//! ferroplan's `Session`, as its documentation says that an agent should use it.

use ferroplan::{Mode, Options, Plan, Session};
use groundloop::pddl::{Atom, Domain, Problem, Step, print_domain, print_problem};
use groundloop::logic::Universe;
use groundloop::stress::View;

use super::{Failure, cpu_ns};

/// States that one replan may evaluate.
const EVALUATED_MAX: usize = 20_000;

/// A grounded session with the plan that it follows.
pub struct Ferro {
    session: Session,
    /// The facts that it takes, with its names.
    facts: Vec<(Atom, String)>,
    /// The plan that is followed, and how many of its steps are done.
    followed: Option<(Plan, usize)>,
}

impl Ferro {
    /// Grounds a problem.
    pub fn new(domain: &Domain, problem: &Problem) -> Result<Self, Failure> {
        let options = Options { mode: Mode::Auto, threads: 1, ..Options::default() };
        let mut session = Session::new(&print_domain(domain), &print_problem(problem), &options)?;
        let universe = Universe { types: &domain.types, objects: &problem.objects };
        let mut facts = Vec::new();
        for predicate in &domain.predicates {
            let mut tuples = vec![Vec::new()];
            for param in &predicate.params {
                let extend = |tuple: &Vec<_>| {
                    let tuple = tuple.clone();
                    universe
                        .of(&param.types)
                        .map(move |o| [tuple.clone(), vec![o.clone()]].concat())
                };
                tuples = tuples.iter().flat_map(extend).collect();
            }
            for args in tuples {
                let atom = Atom { predicate: predicate.name.clone(), args };
                let name = atom.to_string().to_ascii_uppercase();
                // It takes no facts that are static or cannot be reached.
                if let Some(value) = session.fact(&name)
                    && session.set_fact(&name, value).is_ok()
                {
                    facts.push((atom, name));
                }
            }
        }
        Ok(Self { session, facts, followed: None })
    }

    /// Processor time of one replan, and the plan.
    pub fn ask(&mut self, view: &View) -> (u64, Option<Vec<Step>>) {
        let sight: Vec<(&str, bool)> = self
            .facts
            .iter()
            .map(|(atom, name)| (name.as_str(), view.facts.known.contains(atom)))
            .collect();
        let started_ns = cpu_ns();
        let observed = self.session.observe(&sight).is_ok();
        let followed = self.followed.take().filter(|_| observed);
        // One step of the followed plan is done, or none.
        let kept = followed.and_then(|(plan, done)| {
            let valid = |from: usize| self.session.plan_still_valid(&plan, from);
            let from = [done + 1, done].into_iter().find(|&from| valid(from))?;
            Some((plan, from))
        });
        self.followed = kept.or_else(|| {
            let plan = self.session.replan_budgeted(EVALUATED_MAX, None).plan;
            plan.filter(|_| observed).map(|plan| (plan, 0))
        });
        let steps = self.followed.as_ref().map(|(plan, from)| {
            let steps = plan.steps[*from..].iter();
            steps.map(|step| (step.action.clone(), step.args.clone())).collect::<Vec<_>>()
        });
        let spent_ns = cpu_ns() - started_ns;
        let named = |(action, args): (String, Vec<String>)| {
            let args: Vec<&str> = args.iter().map(String::as_str).collect();
            Step::new(&action, &args)
        };
        (spent_ns, steps.map(|steps| steps.into_iter().map(named).collect()))
    }
}
