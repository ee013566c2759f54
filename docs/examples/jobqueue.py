"""A study on the nodes of a batch system, by dask-jobqueue.

    pip install 'dusttaichi[cluster]' dask-jobqueue
    python jobqueue.py sweep FILE KEY=VALUES...
    python jobqueue.py collide FILE

The workers start as jobs and end with this program; results come back through the network.
"""

import subprocess
import sys


def open_cluster():
    """Ten jobs of sixteen runs at a time each."""
    from dask_jobqueue import SLURMCluster

    cluster = SLURMCluster(
        cores=16,
        memory="32 GB",
        walltime="04:00:00",  # longer than the longest run
        # What your cluster may need:
        # account="PROJECT",
        # queue="QUEUE",  # the partition
        # job_extra_directives=["--constraint=cpu"],
        # job_script_prologue=["module load python", 'source "$HOME/dust/bin/activate"'],
        # interface="ib0",  # network between the nodes, if the workers do not find the scheduler
    )
    cluster.scale(jobs=10)
    return cluster


def study(cluster, command, file, settings, *options):
    """`dust COMMAND` with its runs on the cluster; returns its exit code."""
    keys = [word for setting in settings for word in ("--set", setting)]
    address = cluster.scheduler_address
    words = ["dust", command, file, *keys, "--scheduler", address, "--resume", *options]
    return subprocess.run(words).returncode


if __name__ == "__main__":
    with open_cluster() as cluster:
        sys.exit(study(cluster, sys.argv[1], sys.argv[2], sys.argv[3:]))
