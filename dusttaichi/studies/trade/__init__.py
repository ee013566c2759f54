"""The trade between speed and accuracy of a scene, measured: `dust trade`.

A point is a changed scene, which the engine runs (study); errors are relative to a converged
reference, and changes that pay are combined (judge).
"""

from dusttaichi.studies.trade.trade import Trade, trade

__all__ = ["Trade", "trade"]
