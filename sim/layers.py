"""Dressing in several garments: each is put on over the body and over what it wears already.

What is worn shrinks with the body: a cloth vertex at v goes to c + girth (v - c), c by the skinning weights
of the nearest point of the body. Shrunk, the layers within may cross each other and the body, but nothing
asks them not to: the outer garment meets them all as one collider. At full girth they are where they were,
without a crossing, and all garments become one cloth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from muslin.garments.mesh import GarmentMesh
from muslin.sim.body.model import BodyModel
from muslin.sim.body.skinning import bind
from muslin.sim.cloth import ClothModel, merge_cloths
from muslin.sim.contact.system import ContactSettings
from muslin.sim.dress import LEAST_GIRTH, grow_body, place, shrunk_body
from muslin.sim.failure import stopped
from muslin.sim.solve.errors import SimulationError
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.solve.simulator import ClothSimulator


def dress(
    meshes: Sequence[GarmentMesh],
    cloths: Sequence[ClothModel],
    model: BodyModel,
    beta: NDArray[np.float64],
    contact: ContactSettings,
    solver: SolverSettings,
    device: str,
    tick: Callable[[], None] | None = None,
) -> ClothSimulator:
    """Put on garments from inside out, on a body of shape `beta` in its rest pose; all as one cloth."""
    body = model.vertices(beta)
    worn, faces, weights = body, model.faces, model.weights
    for mesh, cloth in zip(meshes, cloths, strict=True):
        start = place(mesh, model, beta, body)
        bones = shrunk_body(model, beta, worn, LEAST_GIRTH, weights)
        sim = ClothSimulator(cloth, start, bones, faces, contact, solver, device)
        try:
            grow_body(sim, model, beta, worn, tick, weights)
        except SimulationError as error:
            raise stopped(f"dressing in {mesh.name}", error, sim) from error
        faces = np.concatenate([faces, cloth.faces + np.int32(len(worn))])
        worn = np.concatenate([worn, sim.positions])
        weights = np.concatenate([weights, bind(sim.positions, model, beta).weights])
    if len(cloths) == 1:
        return sim
    positions = worn[len(body) :]
    return ClothSimulator(merge_cloths(cloths), positions, body, model.faces, contact, solver, device)
