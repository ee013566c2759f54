"""Attraction of the particles of a continuum to each other, as kernels sum it now. SI."""


class SelfGravity:
    """Energy of the particles of a DustState in the field of each other.

    kernels: those of a Compiled. scratch: memory.Table of its lists, by name. state: DustState.
    numbers: KernelNumbers.
    """

    def __init__(self, kernels, scratch, state, numbers):
        self._kernels, self._scratch = kernels, scratch
        self._state, self._numbers = state, numbers

    def energy(self):
        """Energy now [J]."""
        self._kernels.potential(self._numbers.of_step)
        return 0.5 * self._scratch["potential"].to_numpy(self._state.count).sum()
