"""What a reader meets who follows a scene through `make` (tests/walk.py)."""

from scenes import RADIUS, box, make_scene, sample_of
from walk import count_stays, follow

# stays in files, and returns to those that have been left: fewer are easier to follow
STAYS, RETURNS = 37, 6


def test_a_scene_is_followed_with_few_stays_and_returns():
    scene = make_scene(
        boundary=box("bottom", "x_min", "x_max"), dt="0.1 ns", numerics={"skin": 0.01}
    )
    walk = follow(scene, sample_of([(0, 0, 0), (2.0 * RADIUS - 1e-10, 0, 0)]))
    functions = [function for _, function in walk]
    assert functions[0] == "make" and "measure" in functions
    stays, returns = count_stays(walk)
    assert stays <= STAYS and returns <= RETURNS


def test_a_return_is_counted():
    assert count_stays([("a", "f"), ("a", "g"), ("b", "h"), ("a", "i"), ("c", "j")]) == (4, 1)
