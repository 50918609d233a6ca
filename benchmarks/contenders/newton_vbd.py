"""newton's SolverVBD, set as in newton's own cloth examples (`cloth_twist`, `cloth_franka`).

The membrane is a stable neo-Hookean one with Lamé parameters mu and lambda, isotropic: for small strains
s_11 = (2 mu + lambda) G_11 + lambda G_22. The mean over warp and weft of muslin's at rest is
mu = (c11 + c22) / 2 - c12, lambda = 2 c12. Bending is 1/2 k_e l (theta - theta_rest)^2 an edge; a hinge of
the fabric's table, k l^2 theta^2 / (8 A), has k_e = k l / (4 A), A its two triangles' area. All rest angles
are zero.
"""

from __future__ import annotations

import newton
import numpy as np
import warp as wp
from newton.solvers import SolverVBD

from benchmarks.contenders.newton_run import PACKAGES, MovingBody, run
from benchmarks.contenders.record import Record, contend
from benchmarks.setting import Setting

SUBSTEPS = 10
ITERATIONS = 5
PARTICLE_RADIUS = 3.0e-3
SELF_CONTACT_MARGIN = 2.0e-3
SELF_CONTACT_GAP = 1.5e-3
CONTACT_STIFFNESS = 1.0e3
CONTACT_DAMPING = 1.0e-1
STRETCH_DAMPING = 2.0e-4


def simulate(setting: Setting) -> Record:
    """Every frame of the setting; rest shapes from the panels, penetration-free self-contact on."""
    wp.init()
    c11, c12, c22, _ = (float(c) for c in setting.stretch)
    builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=(0.0, -9.81, 0.0))
    builder.add_cloth_mesh(
        pos=wp.vec3(0.0),
        rot=wp.quat_identity(),
        scale=1.0,
        vel=wp.vec3(0.0),
        vertices=setting.positions.tolist(),
        indices=setting.faces.ravel().tolist(),
        density=float(setting.density),
        tri_ke=0.5 * (c11 + c22) - c12,
        tri_ka=2.0 * c12,
        tri_kd=STRETCH_DAMPING,
        edge_ke=0.0,
        edge_kd=0.0,
        particle_radius=PARTICLE_RADIUS,
    )
    body = MovingBody(builder, setting)
    builder.color()
    model = builder.finalize(device="cpu")
    _rest_in_panels(model, setting)
    model.soft_contact_ke = CONTACT_STIFFNESS
    model.soft_contact_kd = CONTACT_DAMPING
    model.soft_contact_mu = float(setting.friction)
    solver = SolverVBD(
        model,
        iterations=ITERATIONS,
        particle_enable_self_contact=True,
        particle_self_contact_margin=SELF_CONTACT_MARGIN,
        particle_self_contact_gap=SELF_CONTACT_GAP,
        particle_vertex_contact_buffer_size=64,
        particle_edge_contact_buffer_size=128,
    )
    record = Record(PACKAGES)
    record.options = {"substeps": SUBSTEPS, "iterations": ITERATIONS}
    run(record, setting, model, body, solver, SUBSTEPS)
    return record


def _rest_in_panels(model: newton.Model, setting: Setting) -> None:
    """Replace the rest shape that newton took from the draped positions, and the masses with it."""
    corners = setting.panel_vertices[setting.panel_faces]
    edges = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
    area = 0.5 * np.linalg.det(edges)
    model.tri_poses.assign(np.linalg.inv(edges).astype(np.float32))
    model.tri_areas.assign(area.astype(np.float32))
    model.particle_mass.assign(setting.mass.astype(np.float32))
    model.particle_inv_mass.assign((1.0 / setting.mass).astype(np.float32))

    stencils = model.edge_indices.numpy()
    length, both = _rest_of_edges(stencils[:, 2:], setting, corners, area)
    stiffness = float(setting.bend.mean()) * length / (4.0 * both)
    model.edge_rest_angle.zero_()
    model.edge_rest_length.assign(length.astype(np.float32))
    properties = np.stack([stiffness, np.zeros_like(stiffness)], axis=1)
    model.edge_bending_properties.assign(properties.astype(np.float32))


def _rest_of_edges(
    edges: np.ndarray, setting: Setting, corners: np.ndarray, area: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Of edges (E, 2): rest length, mean over the panels, and area of the one or two triangles, each (E,)."""
    v = len(setting.positions)
    sides = setting.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    rest = np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2).ravel()
    keys, index = np.unique(np.sort(sides, axis=1) @ np.array([v, 1]), return_inverse=True)
    count = np.bincount(index)
    wanted = np.searchsorted(keys, np.sort(edges.astype(np.int64), axis=1) @ np.array([v, 1]))
    length = np.bincount(index, rest) / count
    both = np.bincount(index, np.repeat(area, 3))
    return length[wanted], both[wanted]


if __name__ == "__main__":
    contend(simulate)
