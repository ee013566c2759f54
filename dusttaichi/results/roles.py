"""Roles of the particles in a result: dust, or parts of bodies and walls."""

ROLES = ("dust", "rigid", "fixed", "wall", "elastic")
"""Names of the roles: free dust; part of a rigid body; dust of a layer that moves with its face; a
row of a rigid wall; part of an elastic body."""
DUST, RIGID, FIXED, WALL, ELASTIC = range(len(ROLES))  # as they are in files
MEANING = ", ".join(f"{number} {name}" for number, name in enumerate(ROLES))
"""Meaning of the numbers, for attributes of files."""
