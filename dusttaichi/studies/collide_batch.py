"""Many collisions side by side: independent members of one simulation (grains.members)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from dusttaichi.errors import DustError, GuardStop, Interrupted, StartError
from dusttaichi.grains.build import make
from dusttaichi.samples.side_by_side import join_members
from dusttaichi.studies.collide_course import Collision
from dusttaichi.studies.result_store import CHECKPOINT

RESTING = 0.25  # share of the grains that are over, from which on the next ones begin
COMPACT = 0.5  # the same where none is waiting
PAUSE = 10_000_000  # steps of a grain between two looks at the signals: about a second
LEAST = 50  # steps between two of these, at least


class Waiting:
    """Collisions that wait: an iterator whose next item is known."""

    def __init__(self, collisions: Iterable[Collision]):
        self._collisions = iter(collisions)
        self._next: Collision | None = None

    @property
    def is_empty(self) -> bool:
        """True where none waits any more."""
        self._next = self._next or next(self._collisions, None)
        return self._next is None

    def take(self, fits: Callable[[Collision], bool]) -> Collision | None:
        """The next one if fits(collision), else None."""
        if self.is_empty or self._next is None or not fits(self._next):
            return None
        collision, self._next = self._next, None
        return collision


class Batch:
    """Collisions of one `batch_key` side by side; those that are over are replaced by the next.

    waiting: Waiting. abreast: members at most; room: grains at most, where there are several.
    answer, signals: see make_collisions. live: those under way. run: the GrainEngine that they are
    in.
    """

    def __init__(self, waiting, answer, *, abreast, room, signals):
        self.waiting, self.abreast, self.room, self.answer = waiting, abreast, room, answer
        self.signals, self.live = signals, []
        self.run: Any = None

    def make(self) -> None:
        """All collisions that wait and have the key of the first, until a signal comes.

        Raises GuardStop and DustError where nothing says which of `live` is the reason.
        """
        while not self.signals:
            self._fill()
            if not self.live:
                return
            steps = min(collision.next_step for collision in self.live) - self.run.step
            self.run.advance(min(steps, max(LEAST, PAUSE // self.run.size)))
            step = self.run.step
            self._resume([collision for collision in self.live if collision.next_step == step])
        for collision, state in zip(self.live, self._states(), strict=True):
            self.answer(collision.label, {CHECKPOINT: collision.save(state)}, Interrupted())

    def _states(self):
        """The State of each that is under way."""
        if not self.live:
            return []
        members = self.run.members
        if members.surrounded:  # a single one
            return [self.run.state()]
        return members.states([collision.member for collision in self.live])

    def _fill(self):
        """Begin the next ones once there is space for some."""
        grains = sum(len(collision.sample) for collision in self.live)
        resting = 0.0 if self.run is None or not self.live else 1.0 - grains / self.run.size
        entering = []
        if not self.live or resting >= RESTING:
            while not self.signals and (
                following := self.waiting.take(lambda following: self._fits(following, entering))
            ):
                entering.append(following)
        if entering or resting >= COMPACT:
            self._compose(entering)

    def _fits(self, collision, entering):
        inside = self.live + entering
        if not inside:
            return True
        grains = sum(len(member.sample) for member in (*inside, collision))
        fits_kernels = collision.batch_key == inside[0].batch_key
        return fits_kernels and len(inside) < self.abreast and grains <= self.room

    def _compose(self, entering):
        """A simulation of those under way and of others, which begin or continue a checkpoint."""
        states = self._states()
        for collision in self.live:
            collision.leave()
        states += [collision.load() for collision in entering]
        self.live = [*self.live, *entering]
        scene, radius = self.live[0].scene, self.live[0].scene.material.radius
        sample = join_members([collision.sample for collision in self.live], radius)
        self.run = make(scene, sample, step=self.live[0].time_step)
        members = self.run.members
        fresh = [member for member, state in enumerate(states) if state is None]
        first_measurements = members.measure(fresh)
        if len(fresh) < len(states):
            self._put({member: state for member, state in enumerate(states) if state is not None})
        for member, collision in enumerate(self.live):
            collision.enter(self.run, member)
        beginning = [self.live[member] for member in fresh]
        for collision, measurement in zip(beginning, first_measurements, strict=True):
            collision.begin(measurement)
        self._resume(beginning, first_measurements)

    def _put(self, states):
        """Continue the States of members, by their numbers."""
        if self.run.members.surrounded:
            self.run.restore(states[0])
        else:
            self.run.members.put(states)

    def _resume(self, collisions, measurements=None):
        """Continue collisions that are to be examined now."""
        members = self.run.members
        measurements = measurements or members.measure(
            [collision.member for collision in collisions]
        )
        for collision, measurement in zip(collisions, measurements, strict=True):
            try:
                row, error = collision.resume(measurement), ()
            except GuardStop as stop:
                row, error = {}, (stop,)
            if row is not None:
                self.live.remove(collision)
                members.rest(collision.member)
                self.answer(collision.label, row, *error)


def make_collisions(
    collisions: Iterable[Collision],
    answer: Callable[..., Any],
    *,
    abreast: int = 1,
    room: int = 0,
    signals: Sequence[int] = (),
) -> None:
    """Make Collisions, those of the same `batch_key` side by side.

    abreast, room: see Batch. answer: called with label, row and, of one that failed, the GuardStop
    or DustError. signals: those received; once there is one, the collisions under way are answered
    by Interrupted and their checkpoints. Where a guard stops a step of many, both halves of them
    begin again, until it is known whose it is. Raises StartError.
    """
    groups = [Waiting(collisions)]
    while groups and not signals:
        batch = Batch(groups[-1], answer, abreast=abreast, room=room, signals=signals)
        try:
            batch.make()
        except StartError:
            raise
        except DustError as error:
            count = len(batch.live)
            if count == 1:
                answer(batch.live[0].label, {}, error)
            else:
                groups += [Waiting(batch.live[count // 2 :]), Waiting(batch.live[: count // 2])]
            continue
        if groups[-1].is_empty:
            groups.pop()
