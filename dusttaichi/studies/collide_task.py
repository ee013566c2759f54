"""Task of a worker process of a study of collisions: some of them, side by side."""

from functools import lru_cache

from dusttaichi import samples
from dusttaichi.errors import DustError, StartError
from dusttaichi.scene import from_yaml
from dusttaichi.studies.collide_batch import make_collisions
from dusttaichi.studies.collide_course import Collision


def run(parent, *, calls, abreast, room):
    """Make collisions, at most `abreast` at a time and as many as have `room` grains together.

    calls: of each the `label`, `scene` (text of its YAML), block `sample` and whether `phases` are
    measured and `files` are wanted. Each is answered as soon as it is over.
    """

    def answer(label, row, error=None):
        code = 0 if error is None else error.exit_code
        parent.report(
            answered={"label": label, "code": code, "text": str(error or ""), "found": row}
        )

    make_collisions(_prepared(calls, answer), abreast, room, answer)


def make_collision(scene, phases=False):
    """The row of one collision of a scene (collide_course.Collision).

    Raises GuardStop where the numbers can no longer be trusted, and DustError.
    """
    answers = []
    one = iter([Collision("", scene, samples.make(scene), phases)])
    make_collisions(one, 1, 0, lambda *answer: answers.append(answer))
    [(_, row, *error)] = answers
    if error:
        raise error[0]
    return row


_base = lru_cache(1)(from_yaml)  # the same for all collisions of a study


def _prepared(calls, answer):
    """The Collisions of calls; those that cannot be made are answered."""
    for call in calls:
        try:
            scene = _base(call["scene"]).with_value("sample", call["sample"])
            how = {name: call.get(name, False) for name in ("phases", "files")}
            collision = Collision(call["label"], scene, samples.make(scene), **how)
        except StartError:
            raise
        except DustError as error:
            answer(call["label"], {}, error)
        else:
            yield collision
