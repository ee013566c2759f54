"""The trade between speed and accuracy of a scene, measured: `dust trade`.

A point is a changed scene, which the engine runs (study); errors are relative to a converged
reference (judge); changes that pay are combined (path).
"""

from dusttaichi.studies.trade.trade import Trade, trade

__all__ = ["Trade", "trade"]
