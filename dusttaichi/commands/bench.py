"""`dust bench`: speed of this machine, and whether its ledgers close."""

from dusttaichi.commands.console import remark, say


def bench():
    """Measure how fast this machine is: steps/s of two scenes, and how far their ledgers close."""
    from dusttaichi.studies import bench

    say(bench.text(bench.main(log=remark)))
