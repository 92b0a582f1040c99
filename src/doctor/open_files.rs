//! How many files a process may open.

use super::finding::Judgement;
use super::{Check, RunNeeds};
use crate::transport::OpenFilesLimit;

pub(super) const CHECK: Check =
    Check { name: "open files", look: |_: Option<&RunNeeds>| vec![judge(OpenFilesLimit::look())] };

fn judge(OpenFilesLimit { soft, hard, needed }: OpenFilesLimit) -> Judgement {
    let Some(soft) = soft else { return Judgement::ok("without a limit") };
    let measured = format!("{soft} at most, {needed} are needed");
    if soft >= needed {
        return Judgement::ok(measured);
    }
    if hard.is_none_or(|hard| hard >= needed) {
        return Judgement::ok(format!("{measured}: a run raises it by itself"));
    }
    Judgement::fault(measured, format!("ulimit -n {needed} (the hard limit, too: as root)"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Health;

    #[test]
    fn a_limit_that_a_run_can_raise_is_none() {
        let health = |soft, hard| judge(OpenFilesLimit { soft, hard, needed: 512 }).health;
        assert_eq!(health(Some(1024), Some(4096)), Health::Ok);
        assert_eq!(health(Some(64), Some(4096)), Health::Ok);
        assert_eq!(health(Some(64), None), Health::Ok);
        assert_eq!(health(None, None), Health::Ok);
        assert_eq!(health(Some(64), Some(64)), Health::Fault);
    }
}
