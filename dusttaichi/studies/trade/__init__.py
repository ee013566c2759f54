"""The trade between speed and accuracy of a scene, measured: `dust trade`.

A point is a changed scene. Each runs in a worker process of its own (task, runner); errors are
relative to a converged reference (judge); changes that pay are combined (path). Only `task` imports
Taichi, and `scenes` where it needs a time step.
"""

from dusttaichi.studies.trade.trade import Trade, trade

__all__ = ["Trade", "trade"]
