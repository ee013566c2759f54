"""Time step, precision and device of a run, and presets of these."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import model_validator

from dusttaichi.scene.fields import Block, Field, Number
from dusttaichi.scene.quantities import Quantity

DRAFT = "draft"
PRESETS: dict[str, dict[str, Any]] = {
    DRAFT: {
        "step_fraction": 0.28,
        "precision": "mixed",
        "newton_steps": 1,
        "mass_scaling": 4.0,
        "stiffness_scaling": 0.1,
    },
    "fast": {"step_fraction": 0.28, "precision": "mixed", "newton_steps": 1},
    "balanced": {"step_fraction": 0.2, "precision": "mixed", "newton_steps": 1},
    "reference": {"step_fraction": 0.05, "precision": "f64", "newton_steps": 3},
}
"""Presets of `accuracy`, for keys that the YAML does not have: numerics alone, no physics, except
for a draft, whose grains are heavier and softer."""


class CommonNumerics(Block):
    """Numerics of every method."""

    time_step: Annotated[float | Literal["auto"], Quantity("time", gt=0, word="auto")] = Field(
        "auto",
        description="time step, refused where it cannot be stable; auto: step_fraction of the "
        "stiffest period",
    )
    ledger_tolerance: Annotated[float, Number(gt=0, le=1)] = Field(
        0.01,
        description="share of the energy that has gone through the system by which the ledger may "
        "be open before a guard stops the run",
    )
    backend: Literal["cpu", "cuda"] = Field("cpu", description="device of the kernels")
    threads: Annotated[int | Literal["auto"], Number(whole=True, ge=1, word="auto")] = Field(
        "auto",
        description="CPU threads, no more than there are cores; auto: as many as are fastest "
        "on the cores that are free",
    )
    debug: bool = Field(
        False,
        description="for debugging kernels: bounds are checked, fast math and patches of the "
        "compiler are off, its variables TI_* of the shell are used; slower",
    )


class Numerics(CommonNumerics):
    """Numerics of the equations of motion of the grains."""

    order: ClassVar[str] = (
        "accuracy time_step step_fraction precision newton_steps mass_scaling stiffness_scaling "
        "scaling_anyway ledger_tolerance backend threads skin debug"
    )

    default: ClassVar[str] = "balanced"

    accuracy: Literal["draft", "fast", "balanced", "reference"] = Field(
        default,
        description="preset of step_fraction, precision and newton_steps, for a draft of "
        "mass_scaling and stiffness_scaling too, each of which may be given as well; `dust trade` "
        "measures their run time and error",
    )
    # Leapfrog is stable up to 1/pi = 0.318 of the period.
    step_fraction: Annotated[
        float, Number(gt=0, le=0.31, note="; from 0.318 (1/pi) on the step is unstable")
    ] = Field(
        PRESETS[default]["step_fraction"],
        description="time step over the stiffest period, with time_step auto; less where bodies "
        "are fast",
    )
    precision: Literal["f64", "mixed", "f32"] = Field(
        PRESETS[default]["precision"],
        description="f64; mixed: positions, velocities, spins and sums in f64, contacts in f32; "
        "f32: everything but the energy ledger",
    )
    newton_steps: Annotated[int, Number(whole=True, ge=0, le=3)] = Field(
        PRESETS[default]["newton_steps"],
        description="Newton steps of the contact radius of JKR after a fit; each squares its "
        "error: 8e-5, 1e-8, 1e-13",
    )
    mass_scaling: Annotated[float, Number(ge=1, le=1e6)] = Field(
        1.0,
        description="factor on the mass of all grains, for quasi-static runs: steps grow with its "
        "root, and inertia matters at lower speeds by the same factor",
    )
    stiffness_scaling: Annotated[float, Number(ge=1e-4, le=1)] = Field(
        1.0,
        description="factor s on the elastic moduli, for compression and tension: steps grow as "
        "s^(-1/3); pull-off force, rolling, largest sliding force, damping ratio and the filling "
        "factor at rest stay",
    )
    scaling_anyway: bool = Field(
        False,
        description="allow stiffness_scaling also in scenes on what it changes: sound, sticking, "
        "impacts",
    )
    skin: Annotated[float | Literal["auto"], Number(gt=0, le=10, word="auto")] = Field(
        "auto", description="extra reach of the neighbour search as a fraction of the radius"
    )

    @model_validator(mode="before")
    @classmethod
    def _fill(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        accuracy = data.get("accuracy", cls.default)
        preset = PRESETS.get(accuracy, {}) if isinstance(accuracy, str) else {}
        return {**preset, **data}

    @property
    def preset(self) -> dict[str, Any]:
        """Values of the preset of `accuracy`, where nothing else is given."""
        return PRESETS[self.accuracy]
