"""What holds for the whole suite: the order of tests, and the collector of cycles."""

import gc
import hashlib
import os
import re
import signal
from collections import Counter, defaultdict
from functools import cache
from pathlib import Path

import pytest

from dusttaichi.compute.collector import collect_seldom
from dusttaichi.physics.registry import copy_added

HERE = Path(__file__).parent
# files that take longest: they come first, so that at the end no process waits for another
LONG = (
    "running/test_run.py", "studies/test_ensemble.py", "continuum/test_contact.py",
    "continuum/test_options.py", "continuum/test_motion.py", "studies/test_sticking.py",
    "studies/test_collide.py", "studies/test_extremes.py", "docs/test_pages.py",
    "report/test_browser.py", "analysis/test_foreign.py", "benchmarks/test_parts.py",
    "running/test_stages.py",
)  # fmt: skip
# what is for one process, which keeps what it has compiled: scenes of grains that share structures
TOGETHER = ("grains/", "physics/", "domain/", "test_brute_force.py")
# files whose tests differ in nothing else that is compiled than these parameters tell
ALIKE = ("grains/test_pair.py", "grains/test_wall.py", "grains/test_integrator.py")
# parameters that decide what is compiled, and what a test without them has
MAKE = {"precision": "f64", "damping": "none"}


@cache
def _file(path):
    """Place of a file in the order, and the file, or the first of those like it. What is for one
    process comes first."""
    name = path.relative_to(HERE).as_posix() if HERE in path.parents else str(path)
    name = ALIKE[0] if name in ALIKE else name
    index = LONG.index(name) if name in LONG else len(LONG)
    return not name.startswith(TOGETHER), index, name


def _make(item):
    """File of a test, and which kernels it needs there as far as its parameters tell."""
    params = getattr(item, "callspec", None)
    chosen = {} if params is None else params.params
    return _file(item.path), *(str(chosen.get(name, usual)) for name, usual in MAKE.items())


def pytest_collection_modifyitems(items):
    """Tests of a file that need the same kernels stand together: a process that has compiled them
    stores them when it needs others, and loads them only once more."""
    indices = {}
    for item in items:
        indices.setdefault(_make(item), len(indices))
    items.sort(key=lambda item: (_file(item.path), indices[_make(item)]))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """A file goes to one process, and those of scenes of grains to the same one."""
    if config.getvalue("dist") != "loadfile":
        return None
    from scheduler import Files

    return Files(config, log, [f"{HERE.name}/{start}" for start in TOGETHER])


def pytest_addoption(parser):
    parser.addoption(
        "--structures",
        action="store_true",
        help="list the tests that compiled kernels of a scene, their time, and which structures",
    )


_compiled = defaultdict(list)  # structures by their test


def _note_structures():
    """Note each structure that a process compiles, or loads from the cache, for a test."""
    from dusttaichi.compute.compiled import Structures  # imports Taichi

    get_structure = Structures.get

    def get_noted(self, key, scene, threads, compile_for):
        def compile_noted(key):
            compiled = compile_for(key)
            effects = getattr(getattr(compiled.layout, "model", None), "effects", ())
            laws = [getattr(law, "law", None) for _, law in effects]  # of damping
            text = re.sub(r" at 0x\w+", "", repr((key, laws)))
            short = hashlib.sha256(text.encode()).hexdigest()[:4]
            _compiled[os.environ.get("PYTEST_CURRENT_TEST")].append(short)
            return compiled

        return get_structure(self, key, scene, threads, compile_noted)

    Structures.get = get_noted


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    phase = os.environ.get("PYTEST_CURRENT_TEST")
    item.user_properties += [("structure", short) for short in _compiled.pop(phase, ())]
    yield


def pytest_terminal_summary(terminalreporter, config):
    """How many structures were compiled, and for which tests, the slowest first."""
    if not config.option.structures:
        return
    seconds, structures = Counter(), {}
    for reports in terminalreporter.stats.values():
        for report in reports:
            if hasattr(report, "duration"):  # what was left out is no report
                seconds[report.nodeid] += report.duration
                structure_names = [
                    short for name, short in report.user_properties if name == "structure"
                ]
                structures[report.nodeid] = max(
                    structures.get(report.nodeid, []), structure_names, key=len
                )
    tests = sorted(
        (name for name, structure in structures.items() if structure), key=lambda n: -seconds[n]
    )
    loaded = [short for name in tests for short in structures[name]]
    terminalreporter.section(
        f"{len(set(loaded))} structures, {len(loaded)} times compiled or loaded by {len(tests)} "
        f"tests in {sum(seconds[n] for n in tests):.0f} of {sum(seconds.values()):.0f} s"
    )
    for name in tests:
        terminalreporter.line(f"{seconds[name]:6.1f} s  {name}  {' '.join(structures[name])}")


def pytest_configure(config):
    """Programs that tests start hear Ctrl-C, even if the shell has started pytest in the background
    and deaf to it: they inherit what pytest does with a signal."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if config.option.structures:
        _note_structures()


def pytest_collection_finish():
    """What is imported and collected stays: the collector need not go over it again and again,
    which took a tenth of the time of the tests."""
    gc.collect()
    gc.freeze()
    collect_seldom()


@pytest.fixture(autouse=True)
def registries_as_before():
    """A test that registers a law, a kind of sample or a method removes it again: what the schema
    says, and so other tests of the same process, depend on it."""
    names_before = {registry: set(table) for registry, table in copy_added().items()}
    yield
    names_after = {registry: set(table) for registry, table in copy_added().items()}
    new_names = {
        registry: names ^ names_before.get(registry, set())
        for registry, names in names_after.items()
    }
    assert not any(new_names.values()), f"the test leaves registered: {new_names}"


@pytest.fixture
def launches(monkeypatch):
    """Loops of the kind "launches" are those of launches.py, which the CPU can make."""
    from launches import advance_by

    for module in ("continuum.compiled_dust", "grains.compiled_grains"):
        monkeypatch.setattr(f"dusttaichi.{module}.advance_by", advance_by)
    # a CPU has no memory that a block of threads shares: the host sums over particles
    monkeypatch.setattr("dusttaichi.continuum.compiled_dust.make_sums", lambda *_: None)


@pytest.fixture
def toys(monkeypatch):
    """What preparing the toy's method changes (running/toy.py) holds for this test alone."""
    from dusttaichi import method
    from dusttaichi.results import pieces, writer
    from dusttaichi.running import loop

    monkeypatch.setattr(method.METHODS, "added", dict(method.METHODS.added))
    monkeypatch.setattr(loop, "BURST_SECONDS", loop.BURST_SECONDS)
    monkeypatch.setattr(writer, "PIECE", writer.PIECE)
    monkeypatch.setattr(pieces, "subprocess", pieces.subprocess)
