//! Limits of one planning call, all counts: how fast the machine is changes nothing.

/// What guides the optimal search. All are admissible, so all prove plans cheapest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OptimalHeuristic {
    /// Blind while states are few; then LM-cut beside it, each given about the same time.
    Auto,
    /// Nothing: fastest by state, and the best choice while states are few.
    Blind,
    /// The delete relaxation's dearest goal part: several times fewer states, each dearer.
    Max,
    /// Pattern databases, made once for a task: the best choice where many states are planned from.
    /// Blind where they do not apply (axioms).
    Patterns,
    /// Cuts in the delete relaxation: far fewer states, each far dearer.
    LmCut,
}

/// How much may be spent, and how it is shared between the searches.
///
/// A call first searches for a cheapest plan and, when that meets its limit, for any plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Budget {
    /// Most states the optimal searches may expand together; 0 leaves them out.
    pub optimal_expansions_max: u64,
    /// What guides the optimal search.
    pub optimal_heuristic: OptimalHeuristic,
    /// Most states the satisficing search may expand; 0 leaves it out.
    pub greedy_expansions_max: u64,
    /// Most states that may be expanded to make a plan cheaper that is not known to be cheapest; 0
    /// leaves it as it was found.
    pub improve_expansions_max: u64,
    /// Most states one search may keep.
    pub states_max: usize,
    /// Most memory one search may use for its states and queues, in bytes (estimated).
    pub bytes_max: usize,
    /// Limits of grounding.
    pub grounding: GroundingLimits,
}

/// Limits of turning a domain and objects into a ground task.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GroundingLimits {
    /// Most ground actions, before those that cannot matter are left out.
    pub actions_max: usize,
    /// Most ground atoms that a condition or effect names.
    pub atoms_max: usize,
    /// Most elementary steps: bindings tried, parts of conditions expanded.
    pub steps_max: u64,
}

impl Budget {
    /// A budget for tasks of the size of a table top, good for larger ones within seconds.
    pub fn standard() -> Self {
        Self {
            optimal_expansions_max: 100_000,
            optimal_heuristic: OptimalHeuristic::Auto,
            greedy_expansions_max: 1_000_000,
            improve_expansions_max: 0,
            states_max: 20_000_000,
            bytes_max: 1 << 30,
            grounding: GroundingLimits::standard(),
        }
    }
}

impl GroundingLimits {
    /// Limits that keep grounding below about a gigabyte.
    pub fn standard() -> Self {
        Self { actions_max: 1_000_000, atoms_max: 1_000_000, steps_max: 50_000_000 }
    }
}
