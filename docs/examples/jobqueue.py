"""A sweep on the nodes of a batch system, by dask-jobqueue: python jobqueue.py FILE KEY=VALUES...

    pip install 'dusttaichi[cluster]' dask-jobqueue

The workers start as jobs and end with this program; results come back through the network.
"""

import subprocess
import sys


def open_cluster():
    """Ten jobs of sixteen runs at a time each."""
    from dask_jobqueue import SLURMCluster

    cluster = SLURMCluster(cores=16, memory="32 GB", walltime="04:00:00")
    cluster.scale(jobs=10)
    return cluster


def sweep(cluster, file, settings, *more):
    """`dust sweep` with its runs on the cluster; returns its exit code."""
    keys = [word for setting in settings for word in ("--set", setting)]
    address = cluster.scheduler_address
    command = ["dust", "sweep", file, *keys, "--scheduler", address, "--resume", *more]
    return subprocess.run(command).returncode


if __name__ == "__main__":
    with open_cluster() as cluster:
        sys.exit(sweep(cluster, sys.argv[1], sys.argv[2:]))
