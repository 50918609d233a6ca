"""Elastic and gravitational energy of cloth in its fabric, by the energies that the simulator minimises."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin.eval.metrics.checks import checked_points
from muslin.garments.errors import InputError

if TYPE_CHECKING:
    from muslin.garments.mesh import GarmentMesh
    from muslin.sim.dataset.sample import Sample
    from muslin.sim.material import Fabric

EARTH: tuple[float, float, float] = (0.0, -9.81, 0.0)


@dataclass(frozen=True)
class Energy:
    """Joules.

    stretch   sum over faces of A W(G), W of `muslin.sim.energies.stretch`, G the Green strain
    bending   sum over faces of A W(K), W of `muslin.sim.energies.bending`, K the curvature
    gravity   - sum over vertices of m g . x; its zero is at the origin, so only differences mean something
    """

    stretch: float
    bending: float
    gravity: float

    @property
    def elastic(self) -> float:
        return self.stretch + self.bending

    @property
    def total(self) -> float:
        """What a drape at rest makes least, as far as what it lies on allows it."""
        return self.stretch + self.bending + self.gravity

    def __sub__(self, other: Energy) -> Energy:
        """Part by part: what a prediction has more than the truth."""
        return Energy(
            self.stretch - other.stretch, self.bending - other.bending, self.gravity - other.gravity
        )


class FabricEnergy:
    """Energies of the positions of one garment in its fabrics; what it needs of them is computed once.

    Contact, friction, air and damping are left out: they are none of the shape alone.

    mesh          with its panels, from which strain and curvature are measured
    fabrics       one for all of the mesh, or one each of its garments, from inside out
    gravity       m/s^2

    Raises InputError for a mesh that is no valid garment, or fabrics that do not fit it.
    """

    def __init__(
        self,
        mesh: GarmentMesh,
        fabrics: Fabric | Sequence[Fabric],
        gravity: Sequence[float] = EARTH,
    ) -> None:
        # Warp takes seconds to load, and nothing else of the evaluation needs it.
        import warp as wp

        from muslin.garments.merge import face_owner
        from muslin.sim.cloth import build_cloth
        from muslin.sim.device import open_device
        from muslin.sim.elastic import ElasticEnergy
        from muslin.sim.material import Fabric

        mesh.validate()
        several = (fabrics,) if isinstance(fabrics, Fabric) else tuple(fabrics)
        owner = face_owner(mesh)
        garments = int(owner.max()) + 1
        if len(several) not in (1, garments):
            raise InputError(
                f"energy of mesh '{mesh.name}': {len(several)} fabrics for {garments} garments; give one, or "
                "one for each"
            )
        if len(gravity) != 3 or not np.isfinite(gravity).all():
            raise InputError(f"energy: gravity = {gravity} is not allowed; give three finite numbers, m/s^2")
        open_device("cpu")
        self._wp = wp
        self._cloth = build_cloth(mesh, several, owner if len(several) > 1 else None)
        self._elastic = ElasticEnergy(self._cloth, "cpu")
        self._gravity = np.asarray(gravity, dtype=np.float64)

    @classmethod
    def of_sample(cls, sample: Sample, frame: int = 0) -> FabricEnergy:
        """Of the mesh of a frame, in the fabrics and the gravity of the scene that a sample was made from.

        Raises InputError if the sample names no fabric that is known here.
        """
        fabrics, gravity = setting_of(sample)
        return cls(sample.frame_garment(frame), fabrics, gravity)

    def energy(self, positions: np.ndarray) -> Energy:
        """Energy of positions (V, 3), metres. Raises InputError unless they are finite and fit the mesh."""
        points = checked_points(positions, "energy")
        if points.shape != (self._cloth.num_vertices, 3):
            raise InputError(
                f"energy: positions of shape {positions.shape} for a mesh of {self._cloth.num_vertices} "
                "vertices; give those of its frame"
            )
        x = self._wp.array(points, dtype=self._wp.vec3d, device="cpu")
        return Energy(
            stretch=self._value(self._elastic.add_stretch_value, x),
            bending=self._value(self._elastic.add_bend_value, x),
            gravity=-float(self._cloth.mass @ (points @ self._gravity)),
        )

    def _value(self, add: Callable[[Any, float, Any], None], x: Any) -> float:
        found = self._wp.zeros(1, dtype=self._wp.float64, device="cpu")
        add(x, 0.0, found)
        return float(found.numpy()[0])


def setting_of(sample: Sample) -> tuple[list[Fabric], tuple[float, float, float]]:
    """Fabrics of all garments of a sample from inside out, and gravity, m/s^2.

    Raises InputError if it names no fabric that is known here.
    """
    from muslin.sim.scene import parse_scene
    from muslin.sim.setting import fabric_of, load_choice
    from muslin.sim.world.placing import copies

    if not sample.scene:
        if not sample.fabric:
            raise InputError(
                f"sample {sample.id}: it names no fabric, so its energy is not known; give the fabric"
            )
        return [load_choice(sample.fabric)], EARTH
    scene = parse_scene(sample.scene, f"sample {sample.id}")
    tables = [scene.garment, *scene.layers]
    return [fabric_of(scene, table) for table in tables for _ in copies(table.repeat)], scene.gravity
