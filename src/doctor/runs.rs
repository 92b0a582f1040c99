//! The runs that are on, and who they are.

use std::collections::{BTreeMap, BTreeSet};

use super::finding::Judgement;
use super::{Check, RunNeeds};
use crate::transport::{BusCensus, BusProcess};

pub(super) const CHECK: Check = Check {
    name: "runs",
    look: |_: Option<&RunNeeds>| match BusCensus::take() {
        Ok(census) => judge(&census.runs),
        Err(error) => vec![unreadable(&error.to_string())],
    },
};

fn unreadable(reason: &str) -> Judgement {
    let remedy = "end all processes of groundloop, then: groundloop doctor --clean";
    Judgement::fault(format!("the bus cannot be looked through: {reason}"), remedy)
}

fn judge(runs: &BTreeMap<String, BTreeSet<BusProcess>>) -> Vec<Judgement> {
    if runs.is_empty() {
        return vec![Judgement::ok("none is on")];
    }
    let told = runs.iter().map(|(run, processes)| {
        let processes = processes.iter().map(|p| format!("{} ({})", p.program, p.pid));
        let processes = processes.collect::<Vec<_>>().join(", ");
        Judgement::ok(format!("{run} is on: {processes}"))
    });
    told.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_told_with_their_processes() {
        assert_eq!(judge(&BTreeMap::new()), [Judgement::ok("none is on")]);
        let process = |pid, program: &str| BusProcess { pid, program: program.to_owned() };
        let processes = [process(7, "groundloop"), process(9, "python3")].into_iter().collect();
        let runs = [("kitchen".to_owned(), processes)].into_iter().collect();
        assert_eq!(judge(&runs), [Judgement::ok("kitchen is on: groundloop (7), python3 (9)")]);
    }
}
