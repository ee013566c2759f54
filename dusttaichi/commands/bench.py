"""`dust bench`: speed of this machine, and whether its ledgers close."""

from dusttaichi.commands.console import remark, say


def bench():
    """Measure how fast this machine is.

    Steps/s of two scenes, relative error of their energy balance, width of vectors.
    """
    from dusttaichi.studies import machine_speed

    say(machine_speed.text(machine_speed.main(log=remark)))
