"""Stepping a newton solver through a setting, with the body where it is in each substep."""

from __future__ import annotations

import newton
import numpy as np
import warp as wp

from benchmarks.contenders.record import Record
from benchmarks.setting import DT, Setting

PACKAGES = ("newton", "warp-lang", "numpy")


class MovingBody:
    """A mesh shape of `builder` that goes along straight lines from frame to frame of a setting."""

    def __init__(self, builder: newton.ModelBuilder, setting: Setting) -> None:
        self.setting = setting
        self.mesh = newton.Mesh(setting.body[0], setting.body_faces.ravel(), compute_inertia=False)
        config = newton.ModelBuilder.ShapeConfig(mu=float(setting.friction), density=0.0)
        self.shape = builder.add_shape_mesh(body=-1, mesh=self.mesh, cfg=config)

    def widen_bounds(self, model: newton.Model) -> None:
        """Have the shape's bounding box hold every frame; newton takes it from the first alone."""
        for array, bound in (
            (model.shape_collision_aabb_lower, self.setting.body.min(axis=(0, 1))),
            (model.shape_collision_aabb_upper, self.setting.body.max(axis=(0, 1))),
        ):
            values = array.numpy()
            values[self.shape] = bound
            array.assign(values)

    def move(self, frame: int, share: float) -> None:
        """Go to the place after `share` of the way from `frame` - 1 to `frame`."""
        before, after = self.setting.body[frame - 1], self.setting.body[frame]
        mesh: wp.Mesh = self.mesh.mesh
        mesh.points.assign((before + share * (after - before)).astype(np.float32))
        mesh.velocities.assign(((after - before) / DT).astype(np.float32))
        mesh.refit()


def run(
    record: Record,
    setting: Setting,
    model: newton.Model,
    body: MovingBody,
    solver: newton.solvers.SolverBase,
    substeps: int,
) -> None:
    """Every frame of a setting, contacts with the body searched in each substep."""
    body.widen_bounds(model)
    pipeline = newton.CollisionPipeline(model)
    contacts = pipeline.contacts()
    state, after = model.state(), model.state()
    control = model.control()

    def step(frame: int, share: float) -> None:
        body.move(frame, share)
        state.clear_forces()
        pipeline.collide(state, contacts)
        solver.step(state, after, control, contacts, DT / substeps)

    # Kernels compile at their first launch: one step that is then undone.
    step(1, 0.0)
    state, after = model.state(), model.state()
    for frame in range(1, setting.frames + 1):
        with record.frame():
            solver.rebuild_bvh(state)
            for k in range(1, substeps + 1):
                step(frame, k / substeps)
                state, after = after, state
        record.add(state.particle_q.numpy())
