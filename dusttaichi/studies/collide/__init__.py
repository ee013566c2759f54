"""`dust collide`: one collision at many speeds, impact parameters, mass ratios, bodies and seeds.

Collisions go one after another through worker processes, whose compiled kernels serve all of them:
at a thousand grains a step costs as much for each grain as in one large scene, and each collision
has its own ledger and ends when its fragments no longer change.
"""

from dusttaichi.studies.collide.plan import Collision, Study, make_study
from dusttaichi.studies.collide.runner import collide, collide_and_refine, write

__all__ = ["Collision", "Study", "collide", "collide_and_refine", "make_study", "write"]
