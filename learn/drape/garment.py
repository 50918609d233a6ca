"""A triangulation of a garment with all that the networks know of it, whatever body wears it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from muslin.garments.mesh import GarmentMesh
from muslin.learn.drape.body_surface import BodySurface
from muslin.learn.drape.mean import MeanDrape
from muslin.learn.drape.world import shape_tensor
from muslin.learn.graph.pyramid import Pyramid, PyramidCache
from muslin.sim.body.skinning import bind


@dataclass(frozen=True, eq=False)
class PreparedGarment:
    """What there is of a vertex is that of the point of the mean body which is nearest to it there.

    mean      (V, 3) drape on the mean body, metres, float32
    weights   (V, 24) skinning weights
    moves     (V, 3, B) metres by which one standard deviation of each shape coefficient moves the skin
    pyramid   of the mean drape
    """

    mesh: GarmentMesh
    mean: Tensor
    weights: Tensor
    moves: Tensor
    pyramid: Pyramid

    def skinned(self, beta: Any) -> Tensor:
        """(V, 3) the mean drape carried along by the skin to a body of shape beta (n,), metres."""
        return self.mean + self.moves @ shape_tensor(beta, self.moves.shape[-1])


def prepare_garment(
    mesh: GarmentMesh, network: MeanDrape, body: BodySurface, cache: PyramidCache
) -> PreparedGarment:
    """Place a garment on the mean body, and build its operators.

    Raises InputError for a garment that the network does not know.
    """
    mean = network.at(mesh)
    binding = bind(mean, body.model, None, body.theta)
    weights, moves = binding.weights, binding.interpolate(body.directions)
    mean32, weights32, moves32 = (
        torch.from_numpy(values.astype(np.float32)) for values in (mean, weights, moves)
    )
    return PreparedGarment(mesh, mean32, weights32, moves32, cache.get(mean, mesh.faces))
