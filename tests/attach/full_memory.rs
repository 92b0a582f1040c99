//! Shared memory of the size that containers have, and shared memory that others fill: a run ends by name.
//!
//! Each call has a small `/dev/shm` of its own; where this user may not mount one, the tests say so and are skipped.
#![cfg(feature = "sim")]

use std::process::{Command, Output};

use crate::common::project;

/// Runs a shell script with an own `/dev/shm` of so many megabytes; `$RUN` is the program.
#[expect(clippy::print_stdout, reason = "a skipped test says so")]
fn in_small_memory(megabytes: u32, script: &str) -> Option<Output> {
    let mount = format!("mount -t tmpfs -o size={megabytes}m tmpfs /dev/shm || exit 99\n");
    let shell = |text: &str| {
        let mut command = Command::new("unshare");
        command.args(["-m", "sh", "-c", text]).current_dir(project(""));
        command.env("RUN", env!("CARGO_BIN_EXE_groundloop")).output()
    };
    let output = shell(&format!("{mount}{script}")).ok();
    let output = output.filter(|output| {
        !(output.status.code() == Some(99)
            || String::from_utf8_lossy(&output.stderr).contains("unshare failed"))
    });
    if output.is_none() {
        println!("skipped: this user may not mount a /dev/shm of its own");
    }
    output
}

fn said(output: &Output) -> String {
    [&output.stdout[..], &output.stderr].map(String::from_utf8_lossy).concat()
}

#[test]
fn a_large_camera_in_a_container_is_told_the_size_that_is_needed() {
    let size = "--set sim.camera.width=1600 --set sim.camera.height=1200";
    for verb in ["run", "doctor"] {
        let Some(output) = in_small_memory(64, &format!("$RUN {verb} blocksworld {size}")) else {
            return;
        };
        let said = said(&output);
        let code = if verb == "run" { 5 } else { 6 };
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(said.contains("the run needs 6") && said.contains("--shm-size"), "{said}");
    }
}

/// Another process takes what is left while the robot moves.
#[test]
fn memory_that_others_fill_in_mid_run_ends_it_by_name() {
    let script = "
        lines=$(mktemp -u) && mkfifo $lines
        $RUN run blocksworld --set clock=realtime --set sim.camera.width=320 --set sim.camera.height=240 \
            --set perception.exemplar.folder=sim_320x240 >$lines 2>&1 &
        run=$!
        while read -r line; do
            echo \"$line\"
            case $line in *' skill '*) dd if=/dev/zero of=/dev/shm/others bs=4k 2>/dev/null ;; esac
        done <$lines
        rm $lines
        wait $run";
    let Some(output) = in_small_memory(64, script) else { return };
    let said = said(&output);
    if output.status.code() == Some(0) {
        // All pages that it needs are taken: it does not even notice.
        assert!(said.contains("reached"), "{said}");
        return;
    }
    assert_eq!(output.status.code(), Some(5), "{said}");
    assert!(said.contains("error: no room in shared memory for "), "{said}");
}

#[test]
fn memory_that_is_full_before_the_start_is_told() {
    let script = "dd if=/dev/zero of=/dev/shm/others bs=4k 2>/dev/null; $RUN run blocksworld";
    let Some(output) = in_small_memory(64, script) else { return };
    let said = said(&output);
    assert_eq!(output.status.code(), Some(5), "{said}");
    let expect =
        "error: no room in shared memory for the bus: it needs 1024 kB of /dev/shm, where 0 kB";
    assert!(said.contains(expect), "{said}");
}
