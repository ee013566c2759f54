"""Many collisions side by side: independent members of one simulation (grains.members)."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from dusttaichi.errors import DustError, GuardStop, Interrupted, StartError
from dusttaichi.grains.build import make
from dusttaichi.samples.side_by_side import join_members
from dusttaichi.studies.collide_course import Collision
from dusttaichi.studies.result_store import CHECKPOINT

if TYPE_CHECKING:
    from dusttaichi.grains.members import Look
    from dusttaichi.method import State


RESTING = 0.25  # share of the grains that are over, from which on the next ones begin
COMPACT = 0.5  # the same where none is waiting
PAUSE = 10_000_000  # steps of a grain between two looks at the signals: about a second
LEAST = 50  # steps between two of these, at least


class Waiting:
    """Collisions that wait: an iterator whose next item is known."""

    def __init__(self, collisions: Iterable[Collision]) -> None:
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
    answer, signals: see make_collisions. live: those under way, by their members of `run`, the
    GrainEngine that they are in; grains: of all these.
    """

    def __init__(
        self,
        waiting: Waiting,
        answer: Callable[..., Any],
        *,
        abreast: int,
        room: int,
        signals: Sequence[int],
    ) -> None:
        self.waiting, self.abreast, self.room, self.answer = waiting, abreast, room, answer
        self.signals, self.grains = signals, 0
        self._live: dict[int, Collision] = {}
        self.run: Any = None
        self._examinations: list[tuple[int, int]] = []  # a heap of the next (step, member)

    @property
    def live(self) -> list[Collision]:
        """Collisions under way."""
        return list(self._live.values())

    def make(self) -> None:
        """All collisions that wait and have the key of the first, until a signal comes.

        Raises GuardStop and DustError where nothing says which of `live` is the reason.
        """
        while not self.signals:
            self._fill()
            if not self._live:
                return
            steps = self._examinations[0][0] - self.run.step
            self.run.advance(min(steps, max(LEAST, PAUSE // self.run.size)))
            due = self._take_due()
            members, energies = [c.member for c in due], [c.needs_energies for c in due]
            self._continue(due, self.run.members.measure(members, energies) if due else [])
        for collision, state in zip(self.live, self._states(), strict=True):
            self.answer(collision.label, {CHECKPOINT: collision.save(state)}, Interrupted())

    def _take_due(self) -> list[Collision]:
        """Remove those that are to be examined now from the heap, and return them."""
        due = []
        while self._examinations and self._examinations[0][0] == self.run.step:
            due.append(self._live[heapq.heappop(self._examinations)[1]])
        return due

    def _states(self) -> list[State]:
        """The State of each that is under way."""
        if not self._live:
            return []
        members = self.run.members
        if members.surrounded:  # a single one
            return [self.run.state()]
        states: list[State] = members.states(list(self._live))
        return states

    def _fill(self) -> None:
        """Begin the next ones once there is space for some."""
        resting = 1.0 - self.grains / self.run.size if self._live else 0.0
        entering: list[Collision] = []
        if not self._live or resting >= RESTING:
            while not self.signals and (
                following := self.waiting.take(lambda following: self._fits(following, entering))
            ):
                entering.append(following)
        if entering or resting >= COMPACT:
            self._compose(entering)

    def _fits(self, collision: Collision, entering: list[Collision]) -> bool:
        inside = self.live + entering
        if not inside:
            return True
        grains = sum(len(member.sample) for member in (*inside, collision))
        fits_kernels = collision.batch_key == inside[0].batch_key
        return fits_kernels and len(inside) < self.abreast and grains <= self.room

    def _compose(self, entering: list[Collision]) -> None:
        """A simulation of those under way and of others, which begin or continue a checkpoint."""
        states: list[State | None] = [*self._states()]
        for collision in self.live:
            collision.leave()
        states += [collision.load() for collision in entering]
        self._live = dict(enumerate([*self.live, *entering]))
        first = self._live[0]
        scene: Any = first.scene  # of grains, which has a material
        sample = join_members([c.sample for c in self.live], scene.material.radius)
        self.run, self.grains = make(scene, sample, step=first.time_step), len(sample)
        members = self.run.members
        fresh = [member for member, state in enumerate(states) if state is None]
        looks = members.measure(fresh, [True] * len(fresh)) if fresh else []
        if len(fresh) < len(states):
            self._put({member: state for member, state in enumerate(states) if state is not None})
        for member, collision in self._live.items():
            collision.enter(self.run, member)
        self._examinations = [
            (self._live[member].next_step, member)
            for member, state in enumerate(states)
            if state is not None
        ]
        heapq.heapify(self._examinations)
        beginning = [self._live[member] for member in fresh]
        for collision, look in zip(beginning, looks, strict=True):
            collision.begin(look)
        self._continue(beginning, looks)

    def _put(self, states: Mapping[int, State]) -> None:
        """Continue the States of members, by their numbers."""
        if self.run.members.surrounded:
            self.run.restore(states[0])
        else:
            self.run.members.put(states)

    def _continue(self, collisions: Sequence[Collision], looks: Sequence[Look]) -> None:
        """Continue collisions with looks at them; those that are over are answered and rest."""
        ended = []
        for collision, look in zip(collisions, looks, strict=True):
            error: tuple[GuardStop, ...] = ()
            try:
                row = collision.resume(look)
            except GuardStop as stop:
                row, error = {}, (stop,)
            if row is None:
                heapq.heappush(self._examinations, (collision.next_step, collision.member))
                continue
            del self._live[collision.member]
            self.grains -= len(collision.sample)
            ended.append(collision.member)
            self.answer(collision.label, row, *error)
        if self._live:  # else nothing is advanced any more
            for member in ended:
                self.run.members.rest(member)


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
