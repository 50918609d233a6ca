"""Scene files: one garment on one body (or another collider), draped or in motion, as typed TOML."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from muslin.garments.errors import InputError
from muslin.sim.material import fabric_names
from muslin.sim.toml_values import read_values

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0.0, le=2.0)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class GarmentTable(_Table):
    """What is worn: a catalogue design (`design`, `preset`, `parameters`) or a `pattern` file, cut at
    `edge_length` metres, or a design's `template` of about that many vertices."""

    design: str = "tee"
    preset: str | None = None
    parameters: dict[str, Finite] = {}
    pattern: str | None = None
    edge_length: Annotated[float, Field(ge=2e-3, le=0.2)] = 0.02
    template: int | None = None
    seed: Annotated[int, Field(ge=0)] = 0


class BodyTable(_Table):
    """Who wears it: `model` female, male, neutral or an SMPL file; `beta` in standard deviations; `pose` of
    drapes."""

    model: str = "female"
    beta: list[Annotated[float, Field(ge=-5.0, le=5.0)]] = Field(default=[], max_length=300)
    pose: Literal["a", "t"] = "a"


class ColliderTable(_Table):
    """Instead of a body: a sphere (metres)."""

    sphere_radius: Positive
    sphere_centre: tuple[Finite, Finite, Finite] = (0.0, 0.0, 0.0)


class MotionTable(_Table):
    """`clip` by name or AMASS file, from `start` to `end` seconds of it, stored at `fps` frames a second.

    `spread_arms` turns arms that sink into this body's trunk or thighs outwards, as `muslin.sim.motion.arms`
    tells.
    """

    clip: str
    start: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 0.0
    end: Positive | None = None
    fps: Annotated[float, Field(gt=0.0, le=240.0)] = 30.0
    spread_arms: bool = True


class FabricScale(_Table):
    """Multipliers of the fabric's density, stretch and bending stiffness."""

    density: Positive = 1.0
    stretch: Positive = 1.0
    bend: Positive = 1.0


class SolverTable(_Table):
    """`dt` s: the largest time step of sequences. See `SolverSettings` and `ContactSettings` for the rest."""

    dt: Annotated[float, Field(ge=1e-3, le=0.05)] = 1.0 / 60.0
    damping: Annotated[float, Field(ge=0.0, le=1.0)] = 2.0e-3
    drag: Annotated[float, Field(ge=0.0, le=100.0)] = 0.5
    tolerance: Annotated[float, Field(ge=1e-7, le=1e-2)] = 5.0e-4
    max_iterations: Annotated[int, Field(ge=1, le=200)] = 4
    contact_range: Annotated[float, Field(ge=5e-4, le=1e-2)] = 2.0e-3
    contact_stiffness: Positive = 1.0
    settle_steps: Annotated[int, Field(ge=1, le=10_000)] = 150
    settle_tolerance: Annotated[float, Field(ge=1e-6, le=1e-2)] = 2.0e-4


class ExpectTable(_Table):
    """What must hold of the result; `muslin simulate` checks it. Intersections must always be zero.

    At most: `largest_stretch`, the largest principal stretch in any frame, and `residual`, the force left on
    a drape as a share of its weight. At least: `smallest_distance`, metres. From low to high: `lowest_point`
    and `highest_point`, heights of the cloth in metres over all frames. Exactly: `frames`, and `at_rest`,
    whether a drape came to rest.
    """

    largest_stretch: Positive | None = None
    smallest_distance: Positive | None = None
    residual: Positive | None = None
    lowest_point: tuple[Finite, Finite] | None = None
    highest_point: tuple[Finite, Finite] | None = None
    frames: Annotated[int, Field(ge=1)] | None = None
    at_rest: bool | None = None


class Scene(_Table):
    """One garment on one body. Without `motion` a drape at equilibrium, with it a sequence."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")] = "scene"
    garment: GarmentTable = GarmentTable()
    body: BodyTable | None = None
    collider: ColliderTable | None = None
    motion: MotionTable | None = None
    fabric: str = "gray-interlock"
    fabric_scale: FabricScale = FabricScale()
    friction_body: Share = 0.3
    friction_cloth: Share = 0.3
    gravity: tuple[Finite, Finite, Finite] = (0.0, -9.81, 0.0)
    solver: SolverTable = SolverTable()
    seed: Annotated[int, Field(ge=0)] = 0
    expect: ExpectTable = ExpectTable()

    @model_validator(mode="after")
    def _consistent(self) -> Scene:
        if self.fabric not in fabric_names():
            raise ValueError(f"fabric = {self.fabric!r}: unknown; choose one of {', '.join(fabric_names())}")
        if (self.body is None) == (self.collider is None):
            raise ValueError("give exactly one of [body] and [collider]")
        if self.motion is not None and self.body is None:
            raise ValueError("[motion] needs a [body]")
        return self


def load_scene(path: str | Path, overrides: Sequence[str] = ()) -> Scene:
    """Read a scene file; `overrides` are `key=value`, dots for tables, TOML values (`body.beta=[2.0]`)."""
    return parse_scene(read_values(path, "scene", overrides, "solver.dt=0.01"), str(path))


def parse_scene(values: dict[str, Any], source: str = "scene") -> Scene:
    """Check a scene's values; InputError names the first key that is wrong, its value and what is allowed."""
    try:
        return Scene.model_validate(values)
    except ValidationError as error:
        entry = error.errors()[0]
        key = ".".join(str(part) for part in entry["loc"]) or "scene"
        if entry["type"] == "extra_forbidden":
            allowed = ", ".join(_allowed_keys(entry["loc"][:-1]))
            reason = f"unknown key {key}; allowed here are {allowed}; correct or remove it"
            raise InputError(f"{source}: {reason}") from error
        value = entry.get("input")
        shown = f" = {json.dumps(value, default=str)}" if entry["loc"] else ""
        reason = entry["msg"].removeprefix("Value error, ")
        raise InputError(f"{source}: {key}{shown}: {reason}; correct it") from error


def _allowed_keys(location: tuple[int | str, ...]) -> list[str]:
    model: Any = Scene
    for part in location:
        annotation = model.model_fields[part].annotation
        options = [annotation, *getattr(annotation, "__args__", ())]
        model = next(a for a in options if isinstance(a, type) and issubclass(a, BaseModel))
    return sorted(model.model_fields)
