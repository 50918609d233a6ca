"""newton's SolverStyle3D: substeps as in its example of a garment on a mannequin, `cloth_style3d`, contact as
in its example of a garment on a moving robot, `cloth_h1`.

Stretch is E = 1/2 k_u (|F_u| - 1)^2 + 1/2 k_v (|F_v| - 1)^2 + 1/2 k_s (F_u.F_v)^2 per rest area, u the weft,
v the warp. With G_uu = |F_u| - 1 to first order and G_uv = F_u.F_v / 2, muslin's c22, c11 and c33 at rest are
k_u = 2 c22, k_v = 2 c11, k_s = c33 / 2; there is nothing for c12. Bending is 3 k l^2 theta^2 / (2 A) for
small angles theta, a hinge of the fabric's table k l^2 theta^2 / (8 A), so that k is a twelfth of its k.
"""

from __future__ import annotations

import newton
import warp as wp
from newton.solvers import SolverStyle3D, style3d

from benchmarks.contenders.newton_run import PACKAGES, MovingBody, run
from benchmarks.contenders.record import Record, contend
from benchmarks.setting import Setting

SUBSTEPS = 10
ITERATIONS = 4
PARTICLE_RADIUS = 3.0e-3
SELF_CONTACT_RADIUS = 3.5e-3
CONTACT_STIFFNESS = 5.0e3


def simulate(setting: Setting) -> Record:
    """Every frame of the setting; rest shapes from the panels, self-contact as the solver always has it."""
    wp.init()
    warp, _, weft, shear = (float(c) for c in setting.stretch)
    along_warp, diagonal, along_weft = (float(k) / 12.0 for k in setting.bend)
    builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=(0.0, -9.81, 0.0))
    SolverStyle3D.register_custom_attributes(builder)
    style3d.add_cloth_mesh(
        builder,
        pos=wp.vec3(0.0),
        rot=wp.quat_identity(),
        vel=wp.vec3(0.0),
        vertices=setting.positions.tolist(),
        indices=setting.faces.ravel().tolist(),
        panel_verts=setting.panel_vertices.tolist(),
        panel_indices=setting.panel_faces.ravel().tolist(),
        density=float(setting.density),
        tri_aniso_ke=wp.vec3(2.0 * weft, 2.0 * warp, 0.5 * shear),
        edge_aniso_ke=wp.vec3(along_warp, along_weft, diagonal),
        particle_radius=PARTICLE_RADIUS,
    )
    body = MovingBody(builder, setting)
    model = builder.finalize(device="cpu")
    model.soft_contact_ke = CONTACT_STIFFNESS
    model.soft_contact_mu = float(setting.friction)
    solver = SolverStyle3D(model, config=SolverStyle3D.Config(iterations=ITERATIONS))
    solver.collision.radius = SELF_CONTACT_RADIUS
    record = Record(PACKAGES)
    record.options = {"substeps": SUBSTEPS, "iterations": ITERATIONS}
    run(record, setting, model, body, solver, SUBSTEPS)
    return record


if __name__ == "__main__":
    contend(simulate)
