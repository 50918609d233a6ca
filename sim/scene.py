"""Scene files: garments on one body, or cloth among other colliders, at rest or in motion, as typed TOML."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, ValidationError, model_validator

from muslin.garments.errors import InputError
from muslin.sim.material import fabric_names
from muslin.sim.motion_table import MotionTable
from muslin.sim.remesh.distortion import MAX_DISTORTION
from muslin.sim.remesh.settings import RemeshTable
from muslin.sim.table_errors import explain
from muslin.sim.tables import ZERO, Finite, Positive, RepeatTable, Table, Vector
from muslin.sim.toml_values import read_values
from muslin.sim.world.tables import AirTable, ColliderTable, PinTable, SequenceTable

Share = Annotated[float, Field(ge=0.0, le=2.0)]


class IsotropicTable(Table):
    """A fabric alike in every direction: `young` Pa, `poisson`, `thickness` m, `density` kg/m^2."""

    young: Positive
    poisson: Annotated[float, Field(gt=-1.0, le=0.5)]
    thickness: Positive
    density: Positive


def _is_table(value: Any) -> str:
    return "isotropic" if isinstance(value, dict | IsotropicTable) else "name"


FabricChoice = Annotated[
    Annotated[str, Tag("name")] | Annotated[IsotropicTable, Tag("isotropic")], Discriminator(_is_table)
]
"""A measured fabric by name, a fabric file (`FILE.toml`, or `FILE.toml:NAME` where it holds several), or a
table {young, poisson, thickness, density}."""


class FabricScale(Table):
    """Multipliers of the fabric's density, stretch and bending stiffness."""

    density: Positive = 1.0
    stretch: Positive = 1.0
    bend: Positive = 1.0


class GarmentTable(Table):
    """What is worn: a catalogue design (`design`, `preset`, `parameters`) or a `pattern` file, cut at
    `edge_length` metres, or a design's `template` of about that many vertices.

    Without a body one flat panel: its origin at `position` m, its x along +x and its y along -z, face up,
    then turned by `rotation`, an axis-angle vector in radians; `repeat` gives it copies.
    """

    design: str = "tee"
    preset: str | None = None
    parameters: dict[str, Finite] = Field(default={})
    pattern: str | None = None
    edge_length: Annotated[float, Field(ge=2e-3, le=0.2)] = 0.02
    template: int | None = None
    seed: Annotated[int, Field(ge=0)] = 0
    position: Vector = ZERO
    rotation: Vector = ZERO
    repeat: RepeatTable | None = None


class LayerTable(GarmentTable):
    """One more garment, worn over those before it, or one more sheet.

    Of the scene's fabric and multipliers if it names none; multipliers of a fabric of its own are 1.
    """

    fabric: FabricChoice | None = None
    fabric_scale: FabricScale | None = None


class BodyTable(Table):
    """Who wears it: `model` female, male, neutral or an SMPL file; `beta` in standard deviations; `pose` of
    drapes."""

    model: str = "female"
    beta: list[Annotated[float, Field(ge=-5.0, le=5.0)]] = Field(default=[], max_length=300)
    pose: Literal["a", "t"] = "a"


class TopologyTable(Table):
    """Another triangulation of the garment, of triangles of `target_area` m^2 in the mean, drawn by `seed`.

    With `fit` the scene is simulated on the garment's own mesh, and the other one fitted to the result in
    every frame; without, the other mesh is simulated.
    """

    seed: Annotated[int, Field(ge=0)] = 0
    target_area: Annotated[float, Field(gt=0.0, le=1.0)]
    max_distortion: Annotated[float, Field(gt=1.0, le=100.0)] = MAX_DISTORTION
    fit: bool = True


class SolverTable(Table):
    """`dt` s: the largest time step of sequences. `max_work`: Newton iterations that a frame, or a step of a
    drape, may take. See `SolverSettings` and `ContactSettings` for the rest."""

    dt: Annotated[float, Field(ge=1e-3, le=0.05)] = 1.0 / 60.0
    damping: Annotated[float, Field(ge=0.0, le=1.0)] = 2.0e-3
    drag: Annotated[float, Field(ge=0.0, le=100.0)] = 0.5
    tolerance: Annotated[float, Field(ge=1e-7, le=1e-2)] = 5.0e-4
    max_iterations: Annotated[int, Field(ge=1, le=200)] = 4
    max_work: Annotated[int, Field(ge=1, le=1_000_000)] = 2000
    contact_range: Annotated[float, Field(ge=5e-4, le=1e-2)] = 2.0e-3
    contact_stiffness: Positive = 1.0
    settle_steps: Annotated[int, Field(ge=1, le=10_000)] = 300
    settle_tolerance: Annotated[float, Field(ge=1e-6, le=1e-2)] = 5.0e-5

    def substeps(self, fps: float) -> int:
        """The fewest equal steps of at most `dt` in a frame of 1 / `fps` seconds."""
        return math.ceil(1.0 / (fps * self.dt) - 1e-9)


class ExpectTable(Table):
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


class Scene(Table):
    """Cloth on one body, or without one among colliders and pins.

    With `motion` on a body, or `sequence` without one, frames of it; otherwise a drape at equilibrium.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")] = "scene"
    garment: GarmentTable = GarmentTable()
    layers: list[LayerTable] = Field(default=[], max_length=100)
    body: BodyTable | None = None
    colliders: list[ColliderTable] = Field(default=[], max_length=1000)
    pins: list[PinTable] = Field(default=[], max_length=1000)
    motion: MotionTable | None = None
    sequence: SequenceTable | None = None
    fabric: FabricChoice = "gray-interlock"
    fabric_scale: FabricScale = FabricScale()
    friction_body: Share = 0.3
    friction_cloth: Share = 0.3
    gravity: Vector = (0.0, -9.81, 0.0)
    air: AirTable | None = None
    solver: SolverTable = SolverTable()
    remesh: RemeshTable | None = None
    topology: TopologyTable | None = None
    seed: Annotated[int, Field(ge=0)] = 0
    expect: ExpectTable = ExpectTable()

    @model_validator(mode="after")
    def _consistent(self) -> Scene:
        for key, fabric in [("fabric", self.fabric)] + [
            (f"layers.{k}.fabric", layer.fabric) for k, layer in enumerate(self.layers)
        ]:
            if isinstance(fabric, str) and ".toml" not in fabric and fabric not in fabric_names():
                raise ValueError(
                    f"{key} = {fabric!r}: unknown; choose one of {', '.join(fabric_names())}, or a FILE.toml"
                )
        if self.topology is not None and self.topology.fit and self.remesh is not None:
            raise ValueError(
                "[topology] is fitted to a mesh that stays; remove [remesh], or say topology.fit = false"
            )
        if self.body is None:
            self._check_world()
        else:
            self._check_worn()
        return self

    def _check_worn(self) -> None:
        for key in ("colliders", "pins", "sequence"):
            if getattr(self, key):
                raise ValueError(f"[{key}] is for cloth without a body; remove it or [body]")
        for key, garment in self._garments():
            for extra in ("position", "rotation", "repeat"):
                if getattr(garment, extra) not in (ZERO, None):
                    raise ValueError(f"{key}.{extra}: a garment on a [body] is put on, not placed; remove it")

    def _check_world(self) -> None:
        if self.motion is not None:
            raise ValueError("[motion] needs a [body]; without one it is [sequence]")
        if not self.colliders and not self.pins and self.sequence is None:
            raise ValueError(
                "give a [body], or [[colliders]] or [[pins]], or a [sequence] for cloth in free flight"
            )
        if self.sequence is not None:
            return
        for key in ("colliders", "pins"):
            for k, table in enumerate(getattr(self, key)):
                released = isinstance(table, PinTable) and table.release is not None
                if table.moves or released:
                    raise ValueError(f"{key}.{k} moves or lets go, which takes time: add a [sequence]")

    def _garments(self) -> list[tuple[str, GarmentTable]]:
        return [("garment", self.garment), *((f"layers.{k}", v) for k, v in enumerate(self.layers))]


def load_scene(path: str | Path, overrides: Sequence[str] = ()) -> Scene:
    """Read a scene file; `overrides` are `key=value`, dots for tables, TOML values (`body.beta=[2.0]`)."""
    return parse_scene(read_values(path, "scene", overrides, "solver.dt=0.01"), str(path))


def parse_scene(values: dict[str, Any], source: str = "scene") -> Scene:
    """Check a scene's values; InputError names the first key that is wrong, its value and what is allowed."""
    try:
        return Scene.model_validate(values)
    except ValidationError as error:
        raise InputError(f"{source}: {explain(error.errors()[0], Scene)}") from error
