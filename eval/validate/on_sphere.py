"""A square sheet laid on a sphere, from where several cases begin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.eval.validate.case import CaseTable
from muslin.eval.validate.colliders import sphere
from muslin.eval.validate.meshes import centred
from muslin.eval.validate.world import DOWN, exact, level
from muslin.garments.mesh import GarmentMesh
from muslin.sim.cloth import build_cloth
from muslin.sim.contact.system import ContactSettings
from muslin.sim.material import isotropic_fabric
from muslin.sim.solve.simulator import ClothSimulator
from muslin.sim.tables import Positive
from muslin.sim.world.tables import Subdivisions

START_GAP = 0.8
"""Height of the sheet above the sphere, in ranges of the barrier."""
UPRIGHT = np.eye(3)


class SheetOnSphere(CaseTable):
    """`side`, `thickness` m, `young` Pa, `density` kg/m^2 of the sheet; `radius` m of the sphere; `dt` s of
    the steps to equilibrium, and `tolerance` m, the largest move in the last."""

    side: Positive
    radius: Positive
    sphere_subdivisions: Subdivisions
    young: Positive
    poisson: float
    thickness: Positive
    density: Positive
    dt: Positive
    tolerance: Positive

    def laid(
        self, mesh: GarmentMesh, friction: float, accuracy: float, turn: NDArray[np.float64] = UPRIGHT
    ) -> ClothSimulator:
        """The sheet level above the sphere, held at its centre, both turned by `turn` (3, 3).

        `accuracy`: metres to which steps are solved.
        """
        contact = ContactSettings(friction_body=friction, friction_cloth=friction)
        panel = centred(mesh)
        flat = level(panel, self.radius + START_GAP * contact.range)
        vertices, faces = sphere(self.radius, self.sphere_subdivisions)
        cloth = build_cloth(mesh, isotropic_fabric(self.young, self.poisson, self.thickness, self.density))
        solver = exact(DOWN, accuracy)
        sim = ClothSimulator(cloth, flat @ turn.T, vertices @ turn.T, faces, contact, solver)
        sim.pins[np.argmin(np.linalg.norm(panel, axis=1))] = True
        return sim
