//! groundloop's plan-reuse cascade, as the planner actor asks it.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use groundloop::planners::PlannerConfig;
use groundloop::replanning::{
    Adoption, ReplanQuery, Replanner, TableBuilder, TableEnd, TableRequest,
};
use groundloop::messages::{GoalMessage, PlanVerdict, Spent};
use groundloop::pddl::Step;
use groundloop::planners::Deadlines;
use groundloop::logic::Facts;
use groundloop::stress::{Instance, View};

use super::{Failure, cpu_ns};

/// A replanner with its goal.
pub struct Own {
    replanner: Replanner,
    goal: GoalMessage,
    failures: BTreeMap<Step, u32>,
    tables: Tables,
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
        let reference_states = vec![Facts::new(problem.init.clone())];
        let replanner = Replanner::new(domain, planner.into(), config, reference_states);
        Ok(Self {
            replanner: replanner.adopting(Adoption::WhenReady),
            goal: GoalMessage::new(problem.goal.clone(), Vec::new(), &problem.objects),
            failures: BTreeMap::new(),
            tables: Tables::default(),
            cycle: 0,
            table_ns: 0,
        })
    }

    /// Processor time of one replan, and the plan.
    pub fn ask(&mut self, view: &View) -> (u64, Option<Vec<Step>>) {
        self.cycle += 1;
        let scene = view.scene(self.cycle);
        let started_ns = cpu_ns();
        let query = ReplanQuery { scene: &scene, goal: &self.goal, failures: &self.failures };
        let (tables, spent) = (&mut self.tables, &Spent::default);
        let message = self.replanner.plan(query, Deadlines::NONE, spent, tables);
        let spent_ns = cpu_ns() - started_ns;
        // Done between two scenes, as the actor does.
        self.replanner.prepare(&mut self.tables);
        let plan = match message.verdict {
            PlanVerdict::Plan { steps, .. } => Some(steps),
            _ => None,
        };
        (spent_ns, plan)
    }

    /// Makes the table that the actor would make beside the loop; the next question takes it over.
    pub fn make_table(&mut self) {
        let Some(request) = self.replanner.pending() else { return };
        let started_ns = cpu_ns();
        self.tables.made = Some(request.job.run(&|| false));
        self.table_ns = cpu_ns() - started_ns;
    }
}

/// Has a table when one was made before.
#[derive(Default)]
struct Tables {
    made: Option<TableEnd>,
}

impl TableBuilder for Tables {
    fn start(&mut self, _request: &TableRequest) {}

    fn ready(&mut self, _request: &TableRequest) -> Option<TableEnd> {
        self.made.take()
    }

    fn wait(&mut self, request: &TableRequest) -> TableEnd {
        self.made.take().unwrap_or_else(|| request.job.run(&|| false))
    }
}
