"""Many collisions side by side: independent members of one simulation (grains.members)."""

import numpy as np

from dusttaichi.errors import DustError, GuardStop, StartError
from dusttaichi.grains.build import make
from dusttaichi.samples.side_by_side import join_members

RESTING = 0.25  # share of the grains that are over, from which on the next ones take their place
COMPACT = 0.5  # the same where none is waiting


class Waiting:
    """Collisions that wait: an iterator whose next item is known."""

    def __init__(self, collisions):
        self._others, self._next = iter(collisions), None

    @property
    def is_empty(self):
        """True where none waits any more."""
        self._next = self._next or next(self._others, None)
        return self._next is None

    def take(self, fits):
        """The next one if fits(collision), else None."""
        if self.is_empty or not fits(self._next):
            return None
        taken, self._next = self._next, None
        return taken


class Batch:
    """Collisions of one time step side by side; those that are over are replaced by the next.

    waiting: Waiting. abreast: members at most; room: grains at most, where there are several.
    answer: see make_collisions. live: those under way. run: the GrainEngine that they are in.
    """

    def __init__(self, waiting, abreast, room, answer):
        self.waiting, self.abreast, self.room, self.answer = waiting, abreast, room, answer
        self.live, self.run = [], None

    def make(self):
        """All collisions that wait and have the time step of the first.

        Raises GuardStop and DustError where nothing says which of `live` is the reason.
        """
        while True:
            self._fill()
            if not self.live:
                return
            steps = min(collision.due - collision.step for collision in self.live)
            self.run.advance(steps)
            self._resume([collision for collision in self.live if collision.due == collision.step])

    def _fill(self):
        """Begin the next ones once there are places for some."""
        grains = sum(len(collision.sample) for collision in self.live)
        resting = 0.0 if self.run is None or not self.live else 1.0 - grains / self.run.size
        entering = []
        if not self.live or resting >= RESTING:
            while (
                following := self.waiting.take(lambda following: self._fits(following, entering))
            ) is not None:
                entering.append(following)
        if entering or resting >= COMPACT:
            self._compose(entering)

    def _fits(self, collision, entering):
        inside = self.live + entering
        if not inside:
            return True
        grains = sum(len(other.sample) for other in (*inside, collision))
        same = collision.chosen.dt == inside[0].chosen.dt
        return same and len(inside) < self.abreast and grains <= self.room

    def _compose(self, entering):
        """A simulation of those under way and of others, which begin."""
        staying, states, forming = self.live, [], []
        if staying:
            members = self.run.members
            numbers = [collision.member for collision in staying]
            states, forming = members.states(numbers), members.forming[numbers]
        steps = [collision.step for collision in staying]
        self.live = [*staying, *entering]
        first = self.live[0]
        sample = join_members(
            [collision.sample for collision in self.live], first.scene.material.radius
        )
        self.run = make(first.scene, sample, step=first.chosen)
        members, count = self.run.members, len(staying)
        new = range(count, len(self.live))
        begun = members.measure(new)
        if staying:
            states += members.states(new)
            members.put(states, np.concatenate([forming, members.forming[count:]]))
        for member, (collision, step) in enumerate(zip(staying, steps, strict=True)):
            collision.move(self.run, member, step)
        for member, collision, measurement in zip(new, entering, begun, strict=True):
            collision.enter(self.run, member, measurement)
        self._resume(entering, begun)

    def _resume(self, collisions, measurements=None):
        """Continue collisions that are to be examined now."""
        members = self.run.members
        measurements = measurements or members.measure(
            [collision.member for collision in collisions]
        )
        for collision, now in zip(collisions, measurements, strict=True):
            try:
                row, error = collision.resume(now), None
            except GuardStop as stop:
                row, error = {}, stop
            if row is not None:
                self.live.remove(collision)
                members.rest(collision.member)
                self.answer(collision.label, row, *([] if error is None else [error]))


def make_collisions(collisions, abreast, room, answer):
    """Make Collisions (an iterator), those of the same time step side by side.

    abreast, room: see Batch. answer: called with label, row and, of one that failed, the GuardStop
    or DustError. Where a guard stops a step of many, both halves of them begin again, until it is
    known whose it is. Raises StartError.
    """
    groups = [Waiting(collisions)]
    while groups:
        batch = Batch(groups[-1], abreast, room, answer)
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
