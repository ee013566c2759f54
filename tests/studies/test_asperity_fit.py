"""The fit of the asperities as a study, here with simulations that a power law answers."""

import pytest

from dusttaichi.errors import DustError
from dusttaichi.studies.asperity_fit import POPPE, AsperityFit, lines, sticking_speed_balance
from dusttaichi.studies.engine import Found


def answered(study, answer):
    """label -> Found of all that the study asks for, as the engine collects them."""
    found, rounds = {}, []
    while points := [point for point in study.points(found) if point.label not in found]:
        rounds.append([point.arguments for point in points])
        for point in points:
            found[point.label] = answer(point)
    return found, rounds


def test_it_asks_until_the_speed_is_that_wanted():
    """Simulations that are 1 % slower than the balance: the volume grows by some 1.2 %."""

    def answer(point):
        speed = 0.99 * sticking_speed_balance(**point.arguments)
        return Found(point, measured={"speed": speed, "sigma": 1e-4})

    study = AsperityFit()
    found, rounds = answered(study, answer)
    # the fit, one simulation at a time; then the other radius of Poppe
    assert len(rounds) > 2 and {len(some) for some in rounds} == {1}
    assert [some[0]["radius"] for some in rounds] == [None] * (len(rounds) - 1) + [0.25e-6]
    numbers = study.result(found)
    assert numbers["speed"] == pytest.approx(1.2, rel=2e-4)  # CLOSE is as much
    assert numbers["asperity_volume"] > rounds[0][0]["volume"] * 1.01
    assert [one["radius"] for one in numbers["grains"]] == list(POPPE)
    # the grain of the material is that of the fit
    assert numbers["grains"][0]["speed"] == numbers["speed"]
    assert len(list(lines(numbers))) == 1 + len(POPPE)


def test_what_fails_ends_the_fit():
    with pytest.raises(DustError, match="the process ended"):
        answered(AsperityFit(), lambda point: Found(point, 1, "the process ended (status -9)"))


def test_a_fit_that_does_not_converge_says_so():
    def stuck(point):
        return Found(point, measured={"speed": 1.0, "sigma": 1e-4})

    with pytest.raises(DustError, match="has not converged"):
        answered(AsperityFit(), stuck)
