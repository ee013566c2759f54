"""Snapshots that a scene leaves to the run: some thirty, evenly over it, within a size."""

from dusttaichi.names import NEVER

SNAPSHOTS = 30  # over a run: enough to be played
LARGEST = 40e6  # bytes that they may take before they are compressed
STRAIN = 1.0  # over which they are spread where the stage ends at no strain known beforehand


def bytes_of(records):
    """Bytes of (group, record) pairs of a frame."""
    return sum(getattr(value, "nbytes", 8) for _, record in records for value in record.values())


def steps_apart(plans, clock, plan, size):
    """Steps between two snapshots of a stage, 0 for none on the way.

    plans: all StagePlans of the scene, of which those that leave it to the run share the number.
    clock: of the stage, at its start; plan: its StagePlan; size: bytes of its first frame.
    """
    sharing = sum(one.snapshots == "auto" for one in plans)
    count = min(SNAPSHOTS, LARGEST // max(size, 1)) // max(sharing, 1)
    end, _ = clock.last_step(plan.stop)
    if end == NEVER and clock.moves:
        end = clock.step_of_strain(STRAIN)
    if count < 2 or end == NEVER:
        return 0
    return max(1, -(-(end - clock.first) // int(count)))
