"""Commands and options of earlier versions: what to use instead of them."""

from itertools import pairwise

from typer.core import TyperGroup

from dusttaichi.errors import DustError

_SURFACES = "--to vtk; ParaView's Glyph filter of kind Sphere makes surfaces"

REMOVED = {
    "selftest": "dust bench states the energy ledger of its two scenes; to check a device, "
    "compare a run with numerics.backend: cuda with one with cpu (dust compare)",
    "run --error-bar": "dust trade SCENE --knobs step_fraction --quick measures the error of the "
    "time step, by some twenty times the cost of a run; of a continuum dust sweep SCENE --set "
    "numerics.cfl=0.5,0.25",
    "run --fresh": "stages are no longer stored, and a run computes all of its own; leave it out. "
    "A sample can be taken from a finished run, also in a sweep: {kind: explicit, file: RUN}",
    "export --to stl": f"{_SURFACES}, which File > Save Data writes as .stl",
    "export --to vtp": _SURFACES,
    "export --to xyz": "--to extxyz, which programs that read XYZ read as well",
    "trade --pairs": "the cost is the processor time of the steps, and needs no second run",
    "trade --no-pairs": "points have no second run beside them any more; leave the option out",
    "trade --grid": "a sweep makes the same runs: dust sweep FILE --set "
    "numerics.stiffness_scaling=1,0.1 --set numerics.mass_scaling=1,4 --set replicas=4",
}
"""Message by "COMMAND", "COMMAND --option" or "COMMAND --option VALUE"."""


class Commands(TyperGroup):
    """The group of commands; a removed command or option is answered by its message."""

    def resolve_command(self, ctx, args):
        """The command of these words. Raises DustError for a removed command or option."""
        command, *words = (word for arg in args for word in arg.split("="))
        words += [" ".join(two) for two in pairwise(words)]
        given = {command, *(f"{command} {word}" for word in words)}
        for removed in given & REMOVED.keys():
            raise DustError(f"dust {removed} was removed: {REMOVED[removed]}")
        return super().resolve_command(ctx, args)
