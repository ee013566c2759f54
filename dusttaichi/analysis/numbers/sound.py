"""The speed of sound after a push."""

from dusttaichi.analysis.arrival import arrival, sound_speed
from dusttaichi.analysis.numbers.registry import Family, Observable, uncertainty
from dusttaichi.errors import DustError


def _measure(run):
    try:
        fit = sound_speed(arrival(run))
    except DustError:  # no snapshots that tell, or it has not arrived
        return {}
    return {"sound_speed": fit.speed, "sound_speed_sigma": fit.sigma}


SOUND = Family(
    name="sound",
    title="a push",
    place=80,
    applies=lambda run: bool(run.pushes),
    measure=_measure,
    numbers=(
        Observable(name="sound_speed", title="speed of sound", unit="m/s",
                   error="sound_speed_sigma", column=("sound m/s", "{:.4g}", 1), wanted=4,
                   figure="sound_speed"),
        uncertainty("sound_speed_sigma", "m/s", column=("± m/s", "{:.1g}", 1)),
    ),
)  # fmt: skip
FAMILIES = (SOUND,)
