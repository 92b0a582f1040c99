"""Runs the shards of a sweep as tasks of HyperQueue: PROGRAM SPEC OUT N_SHARDS."""

import sys

from hyperqueue import Job, LocalCluster
from hyperqueue.cluster import WorkerConfig

program, spec, out, n_shards = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4])
with LocalCluster() as cluster:
    cluster.start_worker(WorkerConfig(cores=2))
    client = cluster.client()
    job = Job()
    for shard in range(1, n_shards + 1):
        job.program([program, "sweep", "run", spec, "--out", out, "--jobs", "1", "--shard", f"{shard}/{n_shards}"])
    client.wait_for_jobs([client.submit(job)])
