"""Common blocks of the scenes of the map."""

BASE = {
    "name": "extremes",
    "material": "silicate_s12",
    "interaction": {"rolling": {"modifier": 8}, "sliding": {"modifier": 2.5}, "damping": "viscous"},
    "sample": {"kind": "explicit", "positions": [["0 m", "0 m", "0 m"]]},
    "boundary": {"kind": "open"},
    "stop": {"steps": 1},
    "numerics": {"threads": 1},
}
BOTTOM = {"kind": "box", "omit": ["x_min", "x_max", "y_min", "y_max", "top"]}
PERIODIC = {"kind": "periodic"}


def scene(**blocks):
    """The blocks of BASE with others in their place; keys of `numerics` are added."""
    own = {**BASE, **blocks}
    own["numerics"] = {**BASE["numerics"], **blocks.get("numerics", {})}
    return own
