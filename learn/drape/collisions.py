"""Losses of cloth that is inside the body, for learning without simulations."""

from __future__ import annotations

from typing import Literal

import igl
import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from muslin.garments.errors import InputError
from muslin.learn.drape.body_surface import BodySurface

MARGIN = 0.004
"""Metres by which cloth shall stay outside: more than it needs, for the loss is met in the mean alone."""

Kind = Literal["distance", "nearest-vertex"]


def collision_loss(points: Tensor, beta: Tensor, body: BodySurface, kind: Kind = "distance") -> Tensor:
    """Mean over points (P, 3) of max(MARGIN - d, 0)^2 / MARGIN^2, with

        distance          d the signed distance to the surface, negative inside: exact, and so is its
                          gradient, the direction away from the nearest point;
        nearest-vertex    d = (x - v) . n of the nearest body vertex v with normal n: wrong where vertices are
                          far apart and at creases. The loss of Vidaurre 2024, chapter 4.

    Raises InputError for another kind.
    """
    where = points.detach().double().cpu().numpy()
    if kind == "distance":
        distances, found, _ = body.nearest(where, beta.tolist())
        nearest, sign = (torch.from_numpy(values).to(points) for values in (found, np.sign(distances)))
        depth = sign * (points - nearest).norm(dim=1)
    elif kind == "nearest-vertex":
        vertices = body.vertices(beta.tolist())
        _, place = cKDTree(vertices).query(where)
        normals = igl.per_vertex_normals(vertices, body.model.faces)
        anchor, normal = (torch.from_numpy(np.asarray(v[place])).to(points) for v in (vertices, normals))
        depth = ((points - anchor) * normal).sum(1)
    else:
        raise InputError(f"kind = {kind!r} of collision loss; it must be distance or nearest-vertex")
    return ((MARGIN - depth).clamp_min(0.0) / MARGIN).square().mean()
