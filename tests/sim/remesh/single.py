"""One split, flip or collapse of a garment, alone."""

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.sim.remesh.edge_collapse import collapse_if_fine
from muslin.sim.remesh.edge_flip import flip_if_better
from muslin.sim.remesh.edge_split import split_edge
from muslin.sim.remesh.obstacle import Obstacle
from muslin.sim.remesh.panel_mesh import DEAD
from muslin.sim.remesh.sewn_mesh import GarmentState, SewnMesh, load
from muslin.sim.remesh.surroundings import Surroundings, Tree

wp.set_module_options({"enable_backward": False})

SPLIT, FLIP, COLLAPSE = wp.constant(0), wp.constant(1), wp.constant(2)


@wp.kernel
def operate(mesh: SewnMesh, around: Surroundings, kind: int, h: int, p: int, done: wp.array(dtype=wp.int32)):
    if kind == SPLIT and split_edge(mesh, h):
        done[0] = 1
    if kind == FLIP and flip_if_better(mesh, around, h):
        done[0] = 1
    if kind == COLLAPSE and collapse_if_fine(mesh, around, h, p, wp.float64(0.0)):
        done[0] = 1


class Table:
    """A garment loaded into tables, and half-edges of it by the panel vertices that they join."""

    def __init__(
        self,
        state: GarmentState,
        metric: NDArray[np.float64],
        body: tuple[NDArray[np.float64], NDArray[np.int32]],
    ) -> None:
        self.mesh = load(state, metric, 2 * len(state.mesh.panel_vertices) + 100)
        self._tree = Tree(state.positions, state.mesh.faces)
        self._obstacle = Obstacle(*body)
        around = Surroundings()
        around.x = wp.array(state.positions, dtype=wp.vec3d, device="cpu")
        around.faces = wp.array(state.mesh.faces, dtype=wp.int32, device="cpu")
        around.point = wp.array(state.mesh.panel_vertices, dtype=wp.vec2d, device="cpu")
        around.panel_faces = wp.array(state.mesh.panel_faces, dtype=wp.int32, device="cpu")
        around.panel = wp.array(state.mesh.face_panel, dtype=wp.int32, device="cpu")
        around.tree = self._tree.id
        around.body_x = wp.array(body[0], dtype=wp.vec3d, device="cpu")
        around.body_faces = wp.array(body[1], dtype=wp.int32, device="cpu")
        around.body_tree = self._obstacle.tree
        self._around = around

    def faces(self) -> set[tuple[int, ...]]:
        """Faces as panel vertices, the smallest first."""
        corners = self.mesh.panels.corner.numpy()[: 3 * int(self.mesh.panels.size.numpy()[1])]
        return {canonical(face) for face in corners.reshape(-1, 3).tolist() if face[0] != int(DEAD)}

    def half_edge(self, a: int, b: int) -> int:
        """The half-edge from the panel vertex a to b."""
        corners = self.mesh.panels.corner.numpy()[: 3 * int(self.mesh.panels.size.numpy()[1])]
        tips = np.roll(corners.reshape(-1, 3), -1, axis=1).ravel()
        (found,) = np.flatnonzero((corners == a) & (tips == b))
        return int(found)

    def split(self, a: int, b: int) -> bool:
        return self._operate(int(SPLIT), a, b, -1)

    def flip(self, a: int, b: int) -> bool:
        return self._operate(int(FLIP), a, b, -1)

    def collapse(self, a: int, b: int, gone: int) -> bool:
        """Takes `gone`, one of a and b, onto the other, if nothing speaks against it."""
        return self._operate(int(COLLAPSE), a, b, gone)

    def _operate(self, kind: int, a: int, b: int, gone: int) -> bool:
        done = wp.zeros(1, dtype=wp.int32, device="cpu")
        inputs = [self.mesh, self._around, kind, self.half_edge(a, b), gone, done]
        wp.launch(operate, 1, inputs=inputs, device="cpu")
        return bool(done.numpy()[0])


def canonical(face: list[int] | tuple[int, ...]) -> tuple[int, ...]:
    """A face, turned until its smallest vertex is the first."""
    first = face.index(min(face))
    return (*face[first:], *face[:first])
