"""Tortures: `python tests/torture KIND --count N --seed S`.

kills: SIGKILL, SIGTERM, SIGINT at random moments. faults: writes that fail, at every call. mutate:
scenes with faults. damage: damaged files. aimed: kills at every rename, and while parts are joined.
extreme: numbers at the ends of what may be. places: disks that are full or read-only. --write puts
the figures into the docs.
"""

import argparse
import importlib
import sys
import time
from pathlib import Path

HERE = Path(__file__).parent
COUNTS = {"kills": 100, "mutate": 10_000, "damage": 200, "aimed": 60, "extreme": 300}
KINDS = (*COUNTS, "faults", "places")


def main():
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__, prog="python tests/torture")
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--count", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", help="kills: of these runs alone, by commas")
    parser.add_argument("--write", action="store_true", help="put the figures into the docs")
    arguments = parser.parse_args()
    sys.path[:0] = [str(HERE), str(HERE.parent), str(HERE.parent / "running"), str(HERE.parents[1])]
    from tally import Tally, write_row

    count = COUNTS.get(arguments.kind, 0) if arguments.count is None else arguments.count
    began = time.perf_counter()
    module = importlib.import_module(arguments.kind)
    if arguments.only:
        module.SHARES = dict.fromkeys(arguments.only.split(","), 1 / len(arguments.only.split(",")))
    module.run(count, arguments.seed, tally := Tally())
    print(tally.text(arguments.kind, began))
    if arguments.write:
        options = f" --count {count} --seed {arguments.seed}" if count else ""
        options += f" --only '{arguments.only}'" if arguments.only else ""
        name = f"{arguments.kind} of {arguments.only}" if arguments.only else arguments.kind
        write_row(name, tally, f"python tests/torture {arguments.kind}{options}")
    return bool(tally.failures)


if __name__ == "__main__":
    sys.exit(main())
