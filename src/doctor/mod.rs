//! What may keep a run from working on this machine, before anybody starts one.
//!
//! Each check is a file here: it measures, and a pure function judges what was measured. The table is [`CHECKS`].

mod finding;
mod needs;
mod clock;
mod cores;
mod folders;
mod leftovers;
mod open_files;
mod programs;
mod room;
mod runs;
mod services;
mod shared_memory;

pub use finding::{DoctorFinding, Health};
pub use needs::RunNeeds;

use finding::Judgement;

/// One check of the machine.
#[derive(Clone, Copy)]
#[expect(missing_debug_implementations, reason = "a row of a table of functions")]
pub struct Check {
    /// Its name, in a word or two.
    pub name: &'static str,
    /// Measures and judges; nothing where it has nothing to say of a run.
    look: fn(Option<&RunNeeds>) -> Vec<Judgement>,
}

/// All checks, in the order in which they are told.
pub const CHECKS: &[Check] = &[
    shared_memory::CHECK,
    room::CHECK,
    folders::CHECK,
    runs::CHECK,
    leftovers::CHECK,
    open_files::CHECK,
    clock::CHECK,
    cores::CHECK,
    programs::CHECK,
    services::CHECK,
];

/// Examines the machine; for a run, too, where its needs are known.
pub fn examine(needs: Option<&RunNeeds>) -> Vec<DoctorFinding> {
    let findings = CHECKS.iter().map(|check| {
        let judged = (check.look)(needs).into_iter();
        judged.map(|judgement| DoctorFinding::of(check.name, judgement)).collect::<Vec<_>>()
    });
    findings.flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_check_has_something_to_say_of_this_machine_and_says_what_to_change() {
        let findings = examine(None);
        for check in CHECKS.iter().filter(|check| !["room", "services"].contains(&check.name)) {
            assert!(findings.iter().any(|f| f.check == check.name), "{}", check.name);
        }
        for finding in findings {
            let has_remedy = finding.remedy.is_some();
            assert!(has_remedy || finding.health == Health::Ok, "{finding:?}");
        }
    }
}
