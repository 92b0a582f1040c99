//! The folder of the bus's bookkeeping: each user has one.

use super::finding::Judgement;
use super::{Check, RunNeeds};
use crate::transport::RootFolder;

pub(super) const CHECK: Check =
    Check { name: "folders", look: |_: Option<&RunNeeds>| vec![judge(&RootFolder::look())] };

fn judge(folder: &RootFolder) -> Judgement {
    let RootFolder { path, user, owner, is_writable, others } = folder;
    let path = path.display();
    if let Some(owner) = owner.filter(|owner| owner != user) {
        let measured = format!("{path} belongs to user {owner}, and this is user {user}");
        return Judgement::fault(
            measured,
            format!("remove it, as that user or as root: rm -r {path}"),
        );
    }
    if !is_writable {
        let remedy = format!("chmod u+rwx {path}, and let this user write in the folder above it");
        return Judgement::fault(format!("this user may not write in {path}"), remedy);
    }
    let state =
        if owner.is_some() { "this user's, and may be written" } else { "made at the first run" };
    let beside = match others.len() {
        0 => String::new(),
        _ => format!("; apart from it those of other users ({})", others.join(", ")),
    };
    Judgement::ok(format!("{path}: {state}{beside}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Health;

    #[test]
    fn a_folder_is_this_users_and_may_be_written() {
        let good = RootFolder {
            path: "/dev/shm/groundloop-1000".into(),
            user: 1000,
            owner: Some(1000),
            is_writable: true,
            others: Vec::new(),
        };
        assert_eq!(judge(&good).health, Health::Ok);
        let new = RootFolder { owner: None, others: vec!["0".to_owned()], ..good.clone() };
        let expect = "/dev/shm/groundloop-1000: made at the first run; apart from it those of other users (0)";
        assert_eq!(judge(&new), Judgement::ok(expect));
        let health = |folder: RootFolder| judge(&folder).health;
        assert_eq!(health(RootFolder { owner: Some(0), ..good.clone() }), Health::Fault);
        assert_eq!(health(RootFolder { is_writable: false, ..good }), Health::Fault);
    }
}
