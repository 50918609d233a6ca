"""Dressing: panels sewn around a body shrunk to its bones, and the body grown back inside the garment.

The panels are laid on tubes around torso and arms and joined at once; their seam vertices sit halfway between
where the two panels would have them, so the first relaxation is the seams contracting. The body starts as its
skeleton, which every garment encloses, and grows to its true shape while contact keeps the cloth outside.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.body.model import BodyModel
from muslin.sim.dataset.intersections import count_intersections
from muslin.sim.solve.simulator import ClothSimulator

TORSO_DEPTH_TO_WIDTH = 0.6
SHOULDER_ROUNDING = 0.12
"""Metres below the shoulder line within which front and back part from each other."""

SHOULDER_SEAM_DROP = 0.1225
"""Metres below the neck point within which the outermost vertex of a front panel is the shoulder's tip."""

LEAST_GIRTH = 0.03
"""Share of its girth that the body has before it grows."""

RELAX_STEPS, GROW_STEPS = 6, 24
DRESS_DT = 1.0 / 30.0

MAIN_CHILD = {0: 3, 1: 4, 2: 5, 3: 6, 4: 7, 5: 8, 6: 9, 7: 10, 8: 11, 9: 12, 12: 15, 13: 16, 14: 17}
MAIN_CHILD |= {16: 18, 17: 19, 18: 20, 19: 21, 20: 22, 21: 23}
LEAF_LENGTH = {15: 0.15, 10: 0.06, 11: 0.06, 22: 0.08, 23: 0.08}
"""Metres that head, feet and hands reach beyond their joint."""

LEFT_SHOULDER, RIGHT_SHOULDER, NECK = 16, 17, 12


def grow_body(
    sim: ClothSimulator,
    model: BodyModel,
    beta: NDArray[np.float64],
    vertices: NDArray[np.float64],
    tick: Callable[[], None] | None = None,
    weights: NDArray[np.float64] | None = None,
) -> None:
    """Let the seams of a placed garment contract, then grow the body from its skeleton to `vertices`.

    `sim` holds the garment of `place` around `shrunk_body(..., LEAST_GIRTH)`. Weightless and without
    friction, so that the garment finds its own place on the body. With `weights`, the collider is the body
    and what it wears, as `shrunk_body` says. InputError where the garment does not enclose the skeleton: no
    step could bring it around.
    """
    worn = sim.contact.collider_faces
    counts = count_intersections(sim.positions, sim.cloth.faces, sim.collider_vertices, worn)
    if counts.cloth_cloth or counts.cloth_body:
        raise InputError(
            f"the garment cannot be put on: placed around the skeleton of body {model.name!r} it has "
            f"{counts.cloth_body} intersections with it and {counts.cloth_cloth} with itself; use a smaller "
            "garment.edge_length or a wider garment"
        )
    sim.set_gravity((0.0, 0.0, 0.0))
    for step in range(RELAX_STEPS + GROW_STEPS):
        share = max(0, step + 1 - RELAX_STEPS) / GROW_STEPS
        goal = shrunk_body(model, beta, vertices, LEAST_GIRTH + (1.0 - LEAST_GIRTH) * share, weights)
        # The last step lands on the body itself, not on what rounding makes of it.
        goal = vertices if share == 1.0 else goal
        sim.advance(goal, DRESS_DT, inertia=False, friction=False)
        if tick is not None:
            tick()
    sim.set_gravity(sim.settings.gravity)


def shrunk_body(
    model: BodyModel,
    beta: NDArray[np.float64],
    vertices: NDArray[np.float64],
    girth: float,
    weights: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """The body in its rest pose with every vertex drawn towards its bones: c + girth (v - c), (N, 3).

    c is the average, by skinning weight, of the closest points on the bones. The `weights` (N, J) are the
    model's own unless given, for vertices that are not the body's alone.
    """
    weights = model.weights if weights is None else weights
    joints = model.joints(beta)
    centre = np.zeros_like(vertices)
    for joint in range(len(joints)):
        a = joints[joint]
        if joint in MAIN_CHILD:
            b = joints[MAIN_CHILD[joint]]
        else:
            along = a - joints[model.parents[joint]]
            b = a + along / np.linalg.norm(along) * LEAF_LENGTH[joint]
        direction = b - a
        t = np.clip((vertices - a) @ direction / (direction @ direction), 0.0, 1.0)
        centre += weights[:, joint, None] * (a + t[:, None] * direction)
    return centre + girth * (vertices - centre)


def place(
    mesh: GarmentMesh, model: BodyModel, beta: NDArray[np.float64], vertices: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Positions (V, 3) of the sewn garment around the body in its rest pose.

    Panels are told by name: `front`, `back`, `sleeve_left`, `sleeve_right`, in the frames of `tee`.
    """
    unknown = set(mesh.panel_names) - {"front", "back", "sleeve_left", "sleeve_right"}
    if unknown:
        raise InputError(
            f"garment {mesh.name!r}: cannot place panels {', '.join(sorted(unknown))} on a body; "
            "allowed are front, back, sleeve_left and sleeve_right"
        )
    if "front" not in mesh.panel_names and set(mesh.panel_names) != {"back"}:
        raise InputError(
            f"garment {mesh.name!r}: sleeves are placed by the shoulder of a panel front, which it lacks; "
            "add one to the pattern"
        )
    joints = model.joints(beta)
    origin = np.array([0.0, _shoulder_height(vertices, joints) + 0.015, joints[LEFT_SHOULDER][2]])
    placed = np.zeros((len(mesh.panel_vertices), 3))
    for index, name in enumerate(mesh.panel_names):
        here = mesh.panel_vertex_panel == index
        flat = mesh.panel_vertices[here]
        if name in ("front", "back"):
            placed[here] = origin + _around_torso(flat, 1.0 if name == "front" else -1.0)
        else:
            left = name == "sleeve_left"
            shoulder = joints[LEFT_SHOULDER if left else RIGHT_SHOULDER]
            tip = mesh.panel_vertices[mesh.panel_vertex_panel == mesh.panel_names.index("front")]
            placed[here] = _around_arm(flat, shoulder, _shoulder_tip(tip), 1.0 if left else -1.0)
    count = np.bincount(mesh.panel_to_vertex, minlength=mesh.num_vertices)
    total = [np.bincount(mesh.panel_to_vertex, placed[:, k], minlength=mesh.num_vertices) for k in range(3)]
    return np.stack(total, axis=1) / count[:, None]


def _shoulder_height(vertices: NDArray[np.float64], joints: NDArray[np.float64]) -> float:
    """Height of the slope from neck to shoulder, halfway along it."""
    x = 0.6 * joints[LEFT_SHOULDER][0]
    near = (np.abs(vertices[:, 0] - x) < 0.015) & (vertices[:, 1] < joints[NECK][1] + 0.02)
    return float(vertices[near, 1].max())


def _shoulder_tip(front: NDArray[np.float64]) -> float:
    """x of the outer end of the shoulder seam of a front panel."""
    upper = front[front[:, 1] > -SHOULDER_SEAM_DROP]
    return float(upper[:, 0].max())


def _around_torso(flat: NDArray[np.float64], side: float) -> NDArray[np.float64]:
    x, y = flat.T
    half = np.interp(y, *_half_widths(flat, 25))
    # An ellipse whose half perimeter, pi (a + b) / 2, is the width of the panel.
    a = 4.0 * half / (np.pi * (1.0 + TORSO_DEPTH_TO_WIDTH))
    angle = 0.5 * np.pi * np.clip(x / half, -1.0, 1.0)
    neck = np.abs(x[y > y.max() - 1e-6]).max()
    shoulder_line = -np.maximum(np.abs(x) - neck, 0.0) * np.tan(np.radians(20.0))
    rounding = np.sqrt(np.clip((shoulder_line - y) / SHOULDER_ROUNDING, 0.0, 1.0))
    return np.stack(
        [side * a * np.sin(angle), y, side * TORSO_DEPTH_TO_WIDTH * a * np.cos(angle) * rounding], axis=1
    )


def _around_arm(
    flat: NDArray[np.float64], shoulder: NDArray[np.float64], tip: float, side: float
) -> NDArray[np.float64]:
    x, y = flat.T
    bins, width = _half_widths(flat, 15)
    bicep = int(np.argmax(width))
    width[bicep:] = width[bicep]  # the cap opens up instead of closing round the arm
    half = np.interp(y, bins, width)
    angle = np.pi * x / half
    radius = half / np.pi
    return np.stack(
        [side * (tip - y), shoulder[1] + radius * np.cos(angle), shoulder[2] - side * radius * np.sin(angle)],
        axis=1,
    )


def _half_widths(flat: NDArray[np.float64], count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Up to `count` rising heights and the half widths of a panel there: those of its widest vertices near.

    A short panel of large triangles has heights that no vertex is near, or only one on its centre line; they
    are left out.
    """
    x, y = flat.T
    bins = np.linspace(y.min(), y.max(), count)
    near = np.abs(y - bins[:, None]) <= bins[1] - bins[0]
    width = np.where(near, np.abs(x), 0.0).max(axis=1)
    held = width > 1e-6 * width.max()
    return bins[held], width[held]
