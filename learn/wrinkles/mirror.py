"""Left and right exchanged: as good a sequence as the one that was simulated."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.sim.body.model import BodyModel
from muslin.sim.dataset.sample import BodyTrack
from muslin.sim.motion.skeleton import MIRRORED

FLIP = np.array([-1.0, 1.0, 1.0])
"""The reflection of space."""


def mirrored_uv(mesh: GarmentMesh) -> NDArray[np.float64]:
    """(P, 2) uv of where each panel vertex is in the mirror: panels are symmetric, or a left and a right one.

    Raises InputError for a family whose layout is not so.
    """
    boxes, partners = _panels(mesh.name)
    panel = mesh.panel_vertex_panel
    low, high = boxes[panel].swapaxes(0, 1)
    across = boxes[partners[panel], 0]
    u, v = mesh.uv.T
    return np.stack([across[:, 0] + high[:, 0] - u, across[:, 1] + v - low[:, 1]], axis=1)


def mirrored_track(track: BodyTrack, body: BodyModel) -> BodyTrack:
    """The motion in the mirror, on the same body: as `muslin.sim.motion.Motion.mirror`."""
    poses = track.poses[:, list(MIRRORED)] * np.array([1.0, -1.0, -1.0])
    pelvis = body.rest_joints(track.beta)[0]
    return replace(track, poses=poses, translations=(track.translations + pelvis) * FLIP - pelvis)


@lru_cache(maxsize=8)
def _panels(design: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(N, 2, 2) lowest and highest uv of each panel, and (N,) its partner in the mirror."""
    mesh = template(design)
    corners = [mesh.uv[mesh.panel_vertex_panel == k] for k in range(len(mesh.panel_names))]
    boxes = np.array([(own.min(0), own.max(0)) for own in corners])
    partners = []
    for name in mesh.panel_names:
        other = name.replace("left", "RIGHT").replace("right", "left").replace("RIGHT", "right")
        partners.append(mesh.panel_names.index(other) if other in mesh.panel_names else -1)
    partner = np.array(partners)
    sizes = np.ptp(boxes, axis=1)
    if partner.min() < 0 or not np.allclose(sizes, sizes[partner], atol=1e-4):
        raise InputError(f"design {design!r}: its layout has no mirror image; train without mirror images")
    return boxes, partner
