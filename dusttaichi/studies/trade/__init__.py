"""The trade between speed and accuracy of a scene, measured: `dust trade`.

A point is a scene with something changed. Each is run in a worker process of its own (task,
runner); errors are those against a converged reference (judge); what pays is combined (path).
Nothing here imports Taichi but `task`, and `scenes` where a step must be known.
"""

from dusttaichi.studies.trade.trade import Trade, trade

__all__ = ["Trade", "trade"]
