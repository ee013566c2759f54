"""What holds for the whole suite: the order of tests, and the collector of cycles."""

import gc
from functools import cache
from pathlib import Path

import pytest

from dusttaichi.compute.collector import collect_seldom

HERE = Path(__file__).parent
# files that take longest: they come first, so that at the end no process waits for another
LONG = (
    "studies/test_ensemble_run.py",
    "torture/test_torture.py",
    "benchmarks/test_speed.py",
    "docs/test_pages.py",
    "studies/test_extremes.py",
    "benchmarks/test_parts.py",
    "grains/test_pair.py",
    "grains/test_precision.py",
    "run/test_run.py",
    "run/test_error_bar.py",
    "run/test_stages.py",
    "physics/test_effects.py",
    "grains/test_polydisperse.py",
    "grains/test_sphere.py",
    "grains/test_rooms.py",
)
# files whose tests differ in nothing else that is compiled than these parameters tell
ALIKE = ("grains/test_pair.py", "grains/test_wall.py", "grains/test_integrator.py")
# parameters that decide what is compiled, and what a test without them has
MAKE = {"precision": "f64", "damping": "none"}


@cache
def _file(path):
    """Place of a file in the order, and the file, or the first of those like it."""
    name = path.relative_to(HERE).as_posix() if HERE in path.parents else str(path)
    name = ALIKE[0] if name in ALIKE else name
    return LONG.index(name) if name in LONG else len(LONG), name


def _make(item):
    """File of a test, and which kernels it needs there as far as its parameters tell."""
    params = getattr(item, "callspec", None)
    chosen = {} if params is None else params.params
    return _file(item.path), *(str(chosen.get(name, usual)) for name, usual in MAKE.items())


def pytest_collection_modifyitems(items):
    """Tests of a file that need the same kernels stand together: a process keeps those that it has
    compiled last."""
    places = {}
    for item in items:
        places.setdefault(_make(item), len(places))
    items.sort(key=lambda item: (_file(item.path), places[_make(item)]))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """A file goes to one process, and files that are alike to the same one."""
    if config.getvalue("dist") != "loadfile":
        return None
    from xdist.scheduler import LoadFileScheduling

    class Files(LoadFileScheduling):
        def _split_scope(self, nodeid):
            file = super()._split_scope(nodeid)
            return ALIKE[0] if file.endswith(ALIKE) else file

    return Files(config, log)


def pytest_collection_finish():
    """What is imported and collected stays: the collector need not go over it again and again,
    which took a tenth of the time of the tests."""
    gc.collect()
    gc.freeze()
    collect_seldom()
