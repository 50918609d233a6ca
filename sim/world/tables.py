"""Tables of scene files for a world without a wearer: colliders, pins, sequences; and the air."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from muslin.sim.tables import ZERO, Finite, NotNegative, Positive, RepeatTable, Table, Vector


class MovingTable(Table):
    """Rigid motion: from `start` to `stop` seconds at `velocity` m/s, turning by `spin` rad/s, a vector along
    the axis."""

    velocity: Vector = ZERO
    spin: Vector = ZERO
    start: NotNegative = 0.0
    stop: Positive | None = None

    @model_validator(mode="after")
    def _forward(self) -> MovingTable:
        if self.stop is not None and self.stop <= self.start:
            raise ValueError(f"stop = {self.stop}: must be later than start = {self.start}")
        return self

    @property
    def moves(self) -> bool:
        return self.velocity != ZERO or self.spin != ZERO


class PlacedTable(MovingTable):
    """A collider whose own origin lies at `position` m, turned by `rotation`, an axis-angle vector in
    radians, and which spins about that origin; `repeat` gives it copies."""

    position: Vector = ZERO
    rotation: Vector = ZERO
    repeat: RepeatTable | None = None


Subdivisions = Annotated[int, Field(ge=0, le=6)]


class Sphere(PlacedTable):
    """Around the origin, metres; an icosahedron divided `subdivisions` times: 10 4^n + 2 vertices."""

    shape: Literal["sphere"]
    radius: Positive
    subdivisions: Subdivisions = 4


class Plane(PlacedTable):
    """A square of `size` metres around the origin, facing +y. Cloth can go round its border."""

    shape: Literal["plane"]
    size: Positive = 4.0


class Box(PlacedTable):
    """Around the origin, `size` metres along x, y and z."""

    shape: Literal["box"]
    size: tuple[Positive, Positive, Positive]


class Cylinder(PlacedTable):
    """Around the origin, its axis along y, metres."""

    shape: Literal["cylinder"]
    radius: Positive
    height: Positive
    sections: Annotated[int, Field(ge=3, le=1000)] = 48


class Cone(PlacedTable):
    """On the origin, its tip `height` metres above, along +y."""

    shape: Literal["cone"]
    radius: Positive
    height: Positive
    sections: Annotated[int, Field(ge=3, le=1000)] = 48


class Torus(PlacedTable):
    """A ring around the origin and the y axis: `radius` to the middle of the rod, `rod` the rod's own,
    metres."""

    shape: Literal["torus"]
    radius: Positive
    rod: Positive
    sections: Annotated[int, Field(ge=3, le=1000)] = 48

    @model_validator(mode="after")
    def _open(self) -> Torus:
        if self.rod >= self.radius:
            raise ValueError(
                f"rod = {self.rod}: must be less than radius = {self.radius}, or there is no hole"
            )
        return self


class MeshFile(PlacedTable):
    """A triangle mesh in a `file` that trimesh reads (OBJ, PLY, STL, GLB...), times `scale`."""

    shape: Literal["mesh"]
    file: str
    scale: Positive = 1.0


ColliderTable = Annotated[
    Sphere | Plane | Box | Cylinder | Cone | Torus | MeshFile, Field(discriminator="shape")
]

Corner = tuple[Finite, Finite]


class PinTable(MovingTable):
    """Vertices of a sheet that are held, or led along, until `release` seconds.

    Those within `box` = [[x, y], [x, y]], two corners in panel space, metres, or on one `side` of the panel.
    `layer` counts garments, copies included: 0 is [garment], then come the [[layers]]. Spins about `centre`,
    metres, which travels with `velocity`; about the middle of the held vertices where none is given.
    """

    layer: Annotated[int, Field(ge=0)] = 0
    box: tuple[Corner, Corner] | None = None
    side: Literal["left", "right", "bottom", "top"] | None = None
    centre: Vector | None = None
    release: Positive | None = None

    @model_validator(mode="after")
    def _region(self) -> PinTable:
        if (self.box is None) == (self.side is None):
            raise ValueError("give exactly one of box and side")
        if self.box is not None and not all(a <= b for a, b in zip(*self.box, strict=True)):
            raise ValueError(f"box = {[list(c) for c in self.box]}: must be [lower corner, upper corner]")
        return self


class SequenceTable(Table):
    """`duration` s of a world without a wearer, from its start, stored at `fps` frames a second."""

    duration: Annotated[float, Field(gt=0.0, le=3600.0)]
    fps: Annotated[float, Field(gt=0.0, le=240.0)] = 30.0


class AirTable(Table):
    """Air that pushes the cloth: see `muslin.sim.air.AirSettings`."""

    density: Positive = 1.2
    wind: Vector = ZERO
    across: NotNegative = 1.2
    along: NotNegative = 0.02
