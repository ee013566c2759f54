"""Task of a worker process of a study of collisions: some of them, side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import Any

from dusttaichi import samples
from dusttaichi.errors import DustError, StartError
from dusttaichi.running.interrupts import handled_by
from dusttaichi.scene import from_yaml
from dusttaichi.studies.collide_batch import make_collisions
from dusttaichi.studies.collide_course import Collision


def run(parent: Any, *, calls: list[dict[str, Any]], abreast: int, room: int) -> None:
    """Make collisions, at most `abreast` at a time and as many as have `room` grains together.

    calls: of each the `label`, `scene` (text of its YAML), block `sample`, whether `phases` are
    measured and `files` are wanted, and the `checkpoint` from which it continues. Each is answered
    as soon as it is over. Raises KeyboardInterrupt after a signal, with those under way answered.
    """
    signals: list[int] = []

    def answer(label: str, row: dict[str, Any], error: DustError | None = None) -> None:
        code = 0 if error is None else error.exit_code
        parent.report(
            answered={"label": label, "code": code, "text": str(error or ""), "values": row}
        )

    with handled_by(lambda number, _: signals.append(number)):
        collisions = _prepare_collisions(calls, answer)
        make_collisions(collisions, answer, abreast=abreast, room=room, signals=signals)
    if signals:
        raise KeyboardInterrupt


_base = lru_cache(1)(from_yaml)  # the same for all collisions of a study


def _prepare_collisions(
    calls: list[dict[str, Any]], answer: Callable[..., None]
) -> Iterator[Collision]:
    """The Collisions of calls; those that cannot be made are answered."""
    for call in calls:
        options: dict[str, Any] = {n: call.get(n) for n in ("phases", "files", "checkpoint")}
        try:
            scene = _base(call["scene"]).with_value("sample", call["sample"])
            collision = Collision(call["label"], scene, samples.make(scene), **options)
        except StartError:
            raise
        except DustError as error:
            answer(call["label"], {}, error)
        else:
            yield collision
