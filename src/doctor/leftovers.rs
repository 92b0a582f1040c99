//! What dead processes have left behind.

use super::finding::{Judgement, in_words};
use super::{Check, RunNeeds};
use crate::transport::BusCensus;

pub(super) const CHECK: Check = Check {
    name: "leftovers",
    look: |_: Option<&RunNeeds>| match BusCensus::take() {
        Ok(census) => vec![judge(&census)],
        Err(_) => Vec::new(), // told of the runs
    },
};

const CLEAN: &str = "groundloop doctor --clean";

fn judge(census: &BusCensus) -> Judgement {
    if census.n_unseen > 0 {
        let measured = format!(
            "cannot be told: {} of the bus live in another container, or are another user's",
            counted(census.n_unseen, "process", "processes")
        );
        return Judgement::warning(measured, "look from where they run, or once they have ended");
    }
    let (n_nodes, n_files) = (census.n_dead_nodes, census.leftovers.len());
    if n_nodes + n_files == 0 {
        return Judgement::ok("none");
    }
    let measured = format!(
        "{} and {} ({}) of runs that were killed",
        counted(n_nodes, "dead process", "dead processes"),
        counted(n_files, "file", "files"),
        in_words(census.leftover_bytes())
    );
    Judgement::warning(measured, CLEAN)
}

fn counted(n: usize, one: &str, more: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { more })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Health;
    use crate::transport::Leftover;

    #[test]
    fn leftovers_are_counted_with_their_bytes() {
        assert_eq!(judge(&BusCensus::default()).health, Health::Ok);
        let file = |bytes| Leftover { path: "x".into(), bytes };
        let left = BusCensus {
            n_dead_nodes: 1,
            leftovers: vec![file(2 << 20), file(1 << 20)],
            ..BusCensus::default()
        };
        let expect = "1 dead process and 2 files (3.0 MB) of runs that were killed";
        assert_eq!(judge(&left), Judgement::warning(expect, CLEAN));
        let unseen = BusCensus { n_unseen: 2, ..left };
        assert!(judge(&unseen).measured.starts_with("cannot be told: 2 processes"));
    }
}
