"""The `[remesh]` table: what a garment is refined by, and within which bounds."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Annotated

from pydantic import Field, ValidationError, model_validator

from muslin.garments.errors import InputError
from muslin.sim.table_errors import explain
from muslin.sim.tables import Table

Angle = Annotated[float, Field(ge=0.01, le=3.2)]
Speed = Annotated[float, Field(ge=1e-3, le=100.0)]
Amplitude = Annotated[float, Field(ge=1e-4, le=1.0)]
Size = Annotated[float, Field(ge=1e-4, le=10.0)]
Aspect = Annotated[float, Field(ge=0.01, le=1.0)]
Every = Annotated[int, Field(ge=1, le=10_000)]


class RemeshTable(Table):
    """Refinement of the cloth where it needs it; see `RemeshSettings` for keys, units and ranges. What is
    left out of the `refine_` keys is off."""

    refine_angle: Angle | None = None
    refine_compression: Amplitude | None = None
    refine_velocity: Speed | None = None
    refine_obstacle: bool = False
    size_min: Size = 0.01
    size_max: Size = 0.2
    aspect_min: Aspect = 0.2
    every: Every = 2

    @model_validator(mode="after")
    def _ordered(self) -> RemeshTable:
        if self.size_min > self.size_max:
            raise ValueError(f"size_min = {self.size_min}: must be at most size_max = {self.size_max}")
        return self

    @property
    def settings(self) -> RemeshSettings:
        return RemeshSettings(**self.model_dump())


@dataclass(frozen=True)
class RemeshSettings:
    """How far an edge may reach, by the names of Narain, Samii, O'Brien 2012; None is off.

    refine_angle: rad, 0.01 to 3.2; the normal turns by at most this from end to end
    refine_compression: m, 1e-4 to 1; of the waves into which compressed cloth buckles, those of about this
        height and more are resolved (`muslin.sim.remesh.sizing.compression`)
    refine_velocity: m/s, 1e-3 to 100; the velocity differs by at most this from end to end
    refine_obstacle: whether, near a collider, the distance from it changes by at most itself
    size_min, size_max: m, 1e-4 to 10; no edge has to be shorter, and none may be longer
    aspect_min: 0.01 to 1; shortest over longest edge of size 1 in one place, 1 for isotropic meshes
    every: time steps, 1 to 10,000, from one remeshing to the next

    InputError for a value out of its range, or size_min > size_max.
    """

    refine_angle: float | None = None
    refine_compression: float | None = None
    refine_velocity: float | None = None
    refine_obstacle: bool = False
    size_min: float = 0.01
    size_max: float = 0.2
    aspect_min: float = 0.2
    every: int = 2

    def __post_init__(self) -> None:
        try:
            RemeshTable.model_validate(asdict(self))
        except ValidationError as error:
            raise InputError(f"remesh: {explain(error.errors()[0], RemeshTable)}") from error
