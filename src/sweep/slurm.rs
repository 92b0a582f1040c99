//! A job script for Slurm.

use std::path::Path;

use super::design::shell_word;

/// What a job array needs.
const CPUS_PER_TASK: u32 = 2;

/// A script for `sbatch`: an array of jobs, one a shard. Give absolute paths: jobs start where they were
/// submitted. `name` is what the queue shows.
pub fn slurm_script(name: &str, (spec, out): (&Path, &Path), n_shards: u64) -> String {
    let word = |path: &Path| shell_word(&path.display().to_string());
    let log = out.join("slurm-%A_%a.log");
    format!(
        "#!/bin/sh\n\
         #SBATCH --job-name={name}\n\
         #SBATCH --array=1-{n_shards}\n\
         #SBATCH --cpus-per-task={CPUS_PER_TASK}\n\
         #SBATCH --output={log}\n\
         # When all tasks are done: groundloop sweep merge {out}\n\
         exec groundloop sweep run {spec} --shard auto/{n_shards} --jobs \"${{SLURM_CPUS_PER_TASK:-{CPUS_PER_TASK}}}\" --out {out}\n",
        log = log.display(),
        spec = word(spec),
        out = word(out),
    )
}
