//! groundloop's ladder, as the planner actor climbs it.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use groundloop::planners::PlannerConfig;
use groundloop::replanning::{Adoption, Patience, Replanner};
use groundloop::messages::{GoalMessage, PlanVerdict};
use groundloop::pddl::Step;
use groundloop::logic::Facts;
use groundloop::stress::{Instance, View};

use super::{Failure, cpu_ns};

/// A replanner with its goal.
pub struct Own {
    replanner: Replanner,
    goal: GoalMessage,
    failures: BTreeMap<Step, u32>,
    cycle: u64,
    /// What the distance table took.
    pub table_ns: u64,
}

impl Own {
    /// A replanner that has seen nothing yet.
    pub fn new(
        instance: &Instance,
        config: &PlannerConfig,
        folder: &Path,
    ) -> Result<Self, Failure> {
        let planner = config.planner(&folder.join("peers.toml"), |_| None)?;
        let domain = Arc::new(instance.folder.domain.clone());
        let problem = &instance.problem;
        let known_right = vec![Facts::new(problem.init.clone())];
        let replanner = Replanner::new(domain, planner.into(), config, known_right);
        Ok(Self {
            replanner: replanner.adopting(Adoption::WhenReady),
            goal: GoalMessage::new(problem.goal.clone(), Vec::new(), &problem.objects),
            failures: BTreeMap::new(),
            cycle: 0,
            table_ns: 0,
        })
    }

    /// Processor time of one replan, and the plan.
    pub fn ask(&mut self, view: &View) -> (u64, Option<Vec<Step>>) {
        self.cycle += 1;
        let scene = view.scene(self.cycle);
        let started_ns = cpu_ns();
        self.replanner.observe(&scene, &self.goal);
        let decided = self.replanner.decide(&scene, &self.goal, &self.failures, Patience::ENDLESS);
        let verdict = self.replanner.verdict(decided.end);
        let spent_ns = cpu_ns() - started_ns;
        // Done between two scenes, as the actor does.
        self.replanner.prepare(self.cycle);
        let plan = match verdict {
            PlanVerdict::Plan { steps, .. } => Some(steps),
            _ => None,
        };
        (spent_ns, plan)
    }

    /// Makes the table that the actor would make beside the loop.
    pub fn make_table(&mut self) {
        let Some(request) = self.replanner.pending() else { return };
        let job = Arc::clone(&request.job);
        let started_ns = cpu_ns();
        let end = job.run(&|| false);
        self.table_ns = cpu_ns() - started_ns;
        self.replanner.adopt(end);
    }
}
