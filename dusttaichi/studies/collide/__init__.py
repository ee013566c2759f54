"""`dust collide`: one collision at many speeds, impact parameters, mass ratios, bodies and seeds.

Collisions are requests of the engine: at a thousand grains a step costs as much for each grain as
in one large scene, and each collision has its own ledger and ends when its fragments no longer
change.
"""

from dusttaichi.studies.collide.plan import Collisions

__all__ = ["Collisions"]
