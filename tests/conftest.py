"""What holds for the whole suite: the order of tests that compile, and the collector of cycles."""

import gc

from dusttaichi.compute.collector import collect_seldom

# parameters that decide what is compiled, and what a test without them has
MAKE = {"precision": "f64", "damping": "none"}


def _make(item):
    """File of a test, and which kernels it needs there as far as its parameters tell."""
    params = getattr(item, "callspec", None)
    chosen = {} if params is None else params.params
    return str(item.path), *(str(chosen.get(name, usual)) for name, usual in MAKE.items())


def pytest_collection_modifyitems(items):
    """Tests of a file that need the same kernels stand together: a process keeps those that it has
    compiled last. Otherwise the order of the files stays."""
    places = {}
    for item in items:
        places.setdefault(_make(item), len(places))
    files = {}
    for item in items:
        files.setdefault(str(item.path), len(files))
    items.sort(key=lambda item: (files[str(item.path)], places[_make(item)]))


def pytest_collection_finish():
    """What is imported and collected stays: the collector need not go over it again and again,
    which took a tenth of the time of the tests."""
    gc.collect()
    gc.freeze()
    collect_seldom()
