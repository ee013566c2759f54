"""Cache of the last compile configuration of this process, for scenes that need the same."""

from dusttaichi.compute.engine import program
from dusttaichi.compute.memory import Lease


class LastCompiled:
    """The last compile configuration of this process, reused where the next scene needs the same.

    Taichi holds one program at a time, so that a simulation is of no more use once another is
    built, whether that compiles anew or takes its fields over.
    """

    def __init__(self):
        self._compiled, self._lease, self._program = None, None, None

    def of(self, compile_key):
        """The Compiled of that key; None where it is another, or Taichi was started anew."""
        if self._compiled is None or self._compiled.compile_key != compile_key:
            return None
        return self._compiled if program() is self._program else None

    def tables(self, compiled, particles):
        """Tables of a Compiled for a scene of so many particles; those before are at their end."""
        if self._lease is not None:
            self._lease.end()
        self._compiled, self._lease = compiled, Lease()
        self._program = program()
        return compiled.tables(particles, self._lease)
