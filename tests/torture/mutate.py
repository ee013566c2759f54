"""Scenes with one or several faults: each is refused with path and line, or accepted, at once."""

import copy
import random
import re
import resource
import signal
import time

import yaml
from tally import ROOT

from dusttaichi.errors import DustError
from dusttaichi.method import make_sample
from dusttaichi.scene import from_yaml

SECONDS, BYTES = 2.0, 500e6  # of processor time, and of memory more than before
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
FEW = 200  # grains up to which an accepted scene's sample is made
VALUES = (
    None, True, False, "", "on", "off", "auto", "fit", 0, -1, 1, 3, 1e300, -1e300, 1e-300, 1e12,
    10**30, float("nan"), float("inf"), "nan", "inf m", "1 um", "-1 um", "1e200 m", "1e-300 m/s",
    "1e9999999 um", "0.6", "0.6 parsec^2", "1 kPa", "1e300 kPa", "1 m/s", "1e300 m/s", "3 us",
    "x" * 5000, "\u00b5m", "a/b", "../..", "/dev/zero", [], {}, [1, 2, 3], ["1 um"] * 3,
    [["0 m"] * 3] * 2,
    {"kind": "chain", "grains": 1e12}, {"kind": "x"}, {"a": {"b": {}}}, "silicate_s12",
)  # fmt: skip
TEXTS = (
    "\t", ":", "- ", "{", "}", "[", "]", "&a ", "*a", "!!timestamp xyz", "!!bool maybe", "? ", "|",
    ">",
    "'", '"', "#", "%", "@", "\x00", "\x07", "\u2028", "\ufeff", "---\n", "...\n", "e", "9" * 5000,
)  # fmt: skip


def originals():
    """The scenes that are mutated: those of configs and docs."""
    files = sorted((ROOT / "configs").rglob("*.yaml")) + sorted(
        (ROOT / "docs" / "examples").glob("cake.yaml")
    )
    return [file.read_text() for file in files]


def mutate(text, rng):
    """The text with a fault, in its characters or in its data."""
    if rng.random() < 0.4:
        at = rng.randrange(len(text))
        number = rng.randrange(4)
        if number == 0:
            return text[:at] + rng.choice(TEXTS) + text[at:]
        if number == 1:
            return text[:at] + text[at + rng.randrange(1, 30) :]
        if number == 2:
            return text[:at] + chr(rng.randrange(32, 0x2FFF)) + text[at + 1 :]
        lines = text.splitlines()
        first, second = rng.randrange(len(lines)), rng.randrange(len(lines))
        lines[first], lines[second] = lines[second], lines[first]
        return "\n".join(lines)
    data = yaml.load(text, LOADER)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        _change(data, rng)
    return yaml.dump(data, Dumper=DUMPER, allow_unicode=True, sort_keys=False)


def _change(data, rng):
    locations = list(_places(data))
    block, key = rng.choice(locations)
    number = rng.randrange(5)
    if number == 0 and isinstance(block, dict):
        block[f"{key}{rng.choice('xyz')}"] = block.pop(key)
    elif number == 1:
        del block[key]
    elif number == 2:
        other_block, other_key = rng.choice(locations)
        try:
            block[key] = copy.deepcopy(other_block[other_key])
        except (KeyError, IndexError):
            block[key] = copy.deepcopy(rng.choice(VALUES))
    else:
        block[key] = copy.deepcopy(rng.choice(VALUES))


def _places(data):
    """(block, key) of everything below."""
    for key in list(data) if isinstance(data, dict) else range(len(data)):
        yield data, key
        if isinstance(data[key], (dict, list)):
            yield from _places(data[key])


def outcome(text):
    """("accepted" or "refused", what is wrong with that or None) of a scene's text."""
    try:
        scene = from_yaml(text)
        grains = getattr(getattr(scene, "sample", None), "grains", None)
        if scene.method == "grains" and (grains or 0) <= FEW and _small(scene.sample):
            make_sample(scene)
    except DustError as error:
        message = str(error)
        if not message.strip() or len(message) > 50_000:
            return "refused", f"a message of {len(message)} characters"
        if message.startswith("the scene cannot be used") and not re.search(
            r"\(line \d+\)", message
        ):
            return "refused", f"a message without a line: {message[:300]}"
        return "refused", None
    return "accepted", None


def _small(sample):
    """True for a sample that is made at once: its size is given by its number of grains."""
    inner = [getattr(sample, name, None) for name in ("target", "projectile")]
    if any(inner):
        return all(_small(body) and (body.grains or 10**9) <= FEW for body in inner if body)
    return sample.kind in ("chain", "pair", "explicit", "bcca") or bool(
        getattr(sample, "grains", None) and getattr(sample, "aspect", 1) in (1, 1.0)
    )


def run(count, seed, tally):
    """So many mutated scenes."""
    texts = originals()
    for text in texts:  # what is imported at first use does not count
        outcome(text)
    resource_before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    signal.signal(signal.SIGVTALRM, _too_long)
    for number in range(count):
        rng = random.Random(f"{seed} {number}")
        text = mutate(rng.choice(texts), rng)
        began = time.process_time()
        signal.setitimer(signal.ITIMER_VIRTUAL, 5 * SECONDS)
        try:
            outcome_kind, problem = outcome(text)
        except Exception as error:  # noqa: BLE001, this is what is looked for
            outcome_kind, problem = "traceback", f"{type(error).__name__}: {str(error)[:200]}"
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        took = time.process_time() - began
        growth = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - resource_before)
        if problem is None and took > SECONDS:
            problem = f"{took:.1f} s"
        if problem is None and growth > BYTES:
            problem = f"{growth / 1e6:.0f} MB"
            resource_before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        if problem:
            problem = f"seed {seed}: {problem}\n{text[:3000]}"
        tally.case(outcome_kind, problem, number)


def _too_long(*_):
    raise TimeoutError("it does not end")
