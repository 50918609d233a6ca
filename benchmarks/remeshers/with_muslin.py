"""muslin's own remesher with one target area, seed 0."""

from __future__ import annotations

from benchmarks.remesh import garment
from benchmarks.remeshers.exchange import Panels, Task, contend
from muslin.sim.remesh.topology import remesh


def remesh_garment(task: Task) -> Panels:
    """All panels at once, sewn again, world positions carried over."""
    mesh = remesh(garment(task.panels, task.uv), task.positions, task.target_area, seed=0).mesh
    return Panels(mesh.panel_vertices, mesh.panel_faces, mesh.face_panel, mesh.panel_to_vertex)


if __name__ == "__main__":
    contend(remesh_garment, ("muslin", "warp-lang", "numpy"), {"seed": 0})
