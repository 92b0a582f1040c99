//! Whether all frames of a run fit into what is free.

use super::finding::{Judgement, in_words};
use super::{Check, RunNeeds};
use crate::transport::{SharedMemory, room_for};

pub(super) const CHECK: Check = Check {
    name: "room",
    look: |needs: Option<&RunNeeds>| {
        let free_bytes = SharedMemory::look().free_bytes;
        needs.map(|needs| judge(&needs.frame_bytes, free_bytes)).into_iter().collect()
    },
};

fn judge(cameras: &[(String, u64)], free_bytes: Option<u64>) -> Judgement {
    let needed = room_for(cameras.iter().map(|(_, bytes)| *bytes));
    let frames = cameras.iter().map(|(name, bytes)| format!("{name} {}", in_words(*bytes)));
    let frames = frames.collect::<Vec<_>>().join(", ");
    let what = format!("the run needs {} (a frame of {frames})", in_words(needed));
    let Some(free) = free_bytes else {
        return Judgement::warning(
            what,
            "see to it that there is as much: the system does not say",
        );
    };
    let measured = format!("{what}, {} are free", in_words(free));
    if free >= needed {
        return Judgement::ok(measured);
    }
    let remedy = format!(
        "docker run --shm-size={}m, or mount -o remount,size={0}m /dev/shm; or remove what lies there, or use \
         smaller frames",
        needed.div_ceil(1 << 20)
    );
    Judgement::fault(measured, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Health;

    /// What containers have without being asked: 64 MB.
    #[test]
    fn a_twelve_megapixel_camera_does_not_fit_into_a_container() {
        let free = Some(64 << 20);
        let camera = |pixels: u64| [("main".to_owned(), pixels * 7)];
        assert_eq!(judge(&camera(640 * 480), free).health, Health::Ok);
        let large = judge(&camera(4000 * 3000), free);
        assert_eq!(large.health, Health::Fault);
        assert_eq!(large.measured, "the run needs 336 MB (a frame of main 80 MB), 64 MB are free");
        assert!(
            large.remedy.unwrap().starts_with("docker run --shm-size=337m"),
            "as it is asked for"
        );
        let two = [camera(640 * 480), camera(2_000_000)].concat();
        assert_eq!(judge(&two, free).health, Health::Fault, "all cameras count");
        assert_eq!(judge(&two, None).health, Health::Warning);
    }
}
