"""`dust bench`: how fast this machine is."""

from dusttaichi.commands.console import remark, say


def bench():
    """Measure how fast this machine is: steps/s of two scenes on one thread and on all cores."""
    from dusttaichi.studies import bench

    say(bench.text(bench.main(log=remark)))
