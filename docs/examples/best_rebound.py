"""Speed at which two grains rebound best: golden section on their restitution."""

from dusttaichi.analysis import measure_restitution
from dusttaichi.studies.user_study import UserStudy

GOLDEN = (5**0.5 - 1) / 2
LOW, HIGH = 0.2, 20.0  # m/s
WIDTH = 1.5  # ratio of the last two speeds


class Study(UserStudy):
    def points(self, results):
        low, high = LOW, HIGH
        while high > WIDTH * low:
            speeds = [low * (high / low) ** fraction for fraction in (1 - GOLDEN, GOLDEN)]
            labels = [f"{speed:.4g}" for speed in speeds]
            if any(label not in results for label in labels):
                return [self.point(label, {"sample.speed": f"{label} m/s"}) for label in labels]
            slow, fast = (results[label].measured["restitution"] for label in labels)
            low, high = (low, speeds[1]) if slow > fast else (speeds[0], high)
        return []

    def measure(self, run):
        return {"restitution": measure_restitution(run).coefficient}
