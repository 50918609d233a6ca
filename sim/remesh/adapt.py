"""Adaptive remeshing of a garment in motion: as few edges as keep all of them within size 1."""

from dataclasses import dataclass

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.garments.half_edges import half_edges
from muslin.sim.remesh.edge_collapse import collapse_if_fine
from muslin.sim.remesh.edge_flip import flip_if_better
from muslin.sim.remesh.edge_split import size_squared, split_edge
from muslin.sim.remesh.metric import edge_lengths, triangles_asked
from muslin.sim.remesh.obstacle import Obstacle
from muslin.sim.remesh.panel_mesh import DEAD, PanelMesh, apex, head
from muslin.sim.remesh.sewn_mesh import PINNED, GarmentState, SewnMesh, load, unload, was_refused
from muslin.sim.remesh.surroundings import Surroundings, Tree

wp.set_module_options({"enable_backward": False})

SPARE = 3.0
"""Room for so many times the vertices that the metric asks for: bisected edges are 0.7 long in the mean, so
there are twice as many as of unit edges."""

SHORT = wp.constant(wp.float64(0.8))  # size of the edges that are looked at for collapse

MOST_VERTICES = 2_000_000
"""Room beyond which a sizing field is taken for an error."""

FLIPS, ROUNDS, COLLAPSES = 4, 30, 6
"""Most passes of flips after one of splits or collapses; of splits; of collapses."""


@dataclass(frozen=True)
class Changes:
    """How often edges were split, flipped and collapsed."""

    splits: int
    flips: int
    collapses: int

    @property
    def total(self) -> int:
        """All of them."""
        return self.splits + self.flips + self.collapses


@wp.func
def is_edge(panels: PanelMesh, h: int) -> bool:
    """Whether h stands for its edge: each edge is once, a hem by its only half-edge, others by one of two."""
    t = panels.twin[h]
    return panels.corner[h] != DEAD and t < h and (t >= -1 or -2 - t < h)


@wp.func
def flip_all(mesh: SewnMesh, around: Surroundings, made: wp.array(dtype=wp.int32)):
    """Passes of flips over all edges, FLIPS at most, until none is made."""
    panels = mesh.panels
    for _ in range(FLIPS):
        before = int(made[1])
        for h in range(3 * panels.size[1]):
            t = panels.twin[h]
            if panels.corner[h] != DEAD and t >= 0 and t < h:
                v = mesh.vertex[panels.corner[h]]
                w = mesh.vertex[head(panels, h)]
                again = was_refused(mesh, h, 0, v, w)
                if again:
                    c = mesh.vertex[apex(panels, h)]
                    d = mesh.vertex[apex(panels, t)]
                    again = was_refused(mesh, h, 0, c, d)
                if not again:
                    if flip_if_better(mesh, around, h):
                        made[1] += 1
                    else:
                        mesh.refused[h, 0] = mesh.clock[0]
        if made[1] == before:
            break


@wp.func
def split_long(mesh: SewnMesh, limit: wp.float64, made: wp.array(dtype=wp.int32)):
    """A pass over all edges that splits those of size > limit; made[3] is set where there is no more room."""
    panels = mesh.panels
    for h in range(3 * panels.size[1]):
        if is_edge(panels, h) and made[3] == 0 and size_squared(mesh, h) > limit * limit:
            v = mesh.vertex[panels.corner[h]]
            w = mesh.vertex[head(panels, h)]
            if mesh.locked[v] != PINNED or mesh.locked[w] != PINNED:
                if split_edge(mesh, h):
                    made[0] += 1
                else:
                    made[3] = 1


@wp.func
def collapse_short(mesh: SewnMesh, around: Surroundings, least: wp.float64, made: wp.array(dtype=wp.int32)):
    """A pass over all edges that collapses those that may be."""
    panels = mesh.panels
    for h in range(3 * panels.size[1]):
        if is_edge(panels, h) and size_squared(mesh, h) < SHORT * SHORT:
            tail = panels.corner[h]
            tip = head(panels, h)
            if not was_refused(mesh, h, 1, mesh.vertex[tail], mesh.vertex[tip]):
                done = collapse_if_fine(mesh, around, h, tail, least)
                if not done:
                    done = collapse_if_fine(mesh, around, h, tip, least)
                if done:
                    made[2] += 1
                else:
                    mesh.refused[h, 1] = mesh.clock[0]


@wp.kernel
def adapt_kernel(
    mesh: SewnMesh, around: Surroundings, least_quality: wp.float64, made: wp.array(dtype=wp.int32)
):
    """Flips, splits of edges of size > 1, the worst first, and collapses.

    made: splits, flips, collapses, and 1 if the table was full before all edges were short enough.
    """
    flip_all(mesh, around, made)
    limit = wp.float64(4.0)
    one = wp.float64(1.0)
    for _ in range(ROUNDS):
        before = int(made[0])
        split_long(mesh, limit, made)
        if made[0] > before:
            flip_all(mesh, around, made)
        elif limit <= one:
            break
        else:
            limit = wp.max(limit * wp.float64(0.7), one)
    for _ in range(COLLAPSES):
        before = int(made[2])
        collapse_short(mesh, around, least_quality, made)
        if made[2] == before:
            break
        flip_all(mesh, around, made)


def adapt(
    state: GarmentState,
    metric: NDArray[np.float64],
    obstacle: Obstacle,
    aspect_min: float = 0.2,
) -> tuple[GarmentState, NDArray[np.int32], Changes]:
    """The garment remeshed so that no edge is longer than 1 in the metric (P, 2, 2), 1/m^2.

    Edges that violate the Delaunay criterion of the metric are flipped; edges of size > 1 are split; then
    edges are collapsed as long as the new ones stay within 0.9 and triangles of a fair shape. Splits leave
    the surface as it is; flips and collapses, which change it, are made where they keep clear of the cloth
    and the obstacle. Panel space, mass and linear momentum stay; so do corners, curved boundaries and what is
    locked. Edges between two PINNED vertices stay too: the metric at their ends is lowered until they are
    within it. Returns the garment, the number (V',) that each of its vertices had, or -1, and what was done.

    Raises InputError if the metric asks for more vertices than make sense.
    """
    mesh = state.mesh
    metric = _within_led_edges(state, metric)
    asked = 0.5 * float(triangles_asked(mesh, metric).sum())
    room = int(SPARE * max(asked, len(mesh.panel_vertices))) + 256
    if room > MOST_VERTICES:
        raise InputError(
            f"remesh: the sizing field asks for some {asked:.3g} vertices; allowed are "
            f"{MOST_VERTICES / SPARE:.3g}: raise size_min or the refine_ keys"
        )
    sewn = load(state, metric, room)
    around = Surroundings()
    tree = Tree(state.positions, mesh.faces)
    around.x = wp.array(state.positions, dtype=wp.vec3d, device="cpu")
    around.faces = wp.array(mesh.faces, dtype=wp.int32, device="cpu")
    around.point = wp.array(mesh.panel_vertices, dtype=wp.vec2d, device="cpu")
    around.panel_faces = wp.array(mesh.panel_faces, dtype=wp.int32, device="cpu")
    around.panel = wp.array(mesh.face_panel, dtype=wp.int32, device="cpu")
    around.tree = tree.id
    around.body_x = wp.array(obstacle.vertices, dtype=wp.vec3d, device="cpu")
    around.body_faces = wp.array(obstacle.faces.reshape(-1, 3), dtype=wp.int32, device="cpu")
    around.body_tree = obstacle.tree
    made = wp.zeros(4, dtype=wp.int32, device="cpu")
    # An isosceles triangle of that height over its base has about this quality.
    inputs = [sewn, around, wp.float64(aspect_min), made]
    wp.launch(adapt_kernel, 1, inputs=inputs, device="cpu")
    splits, flips, collapses, full = made.numpy().tolist()
    if full:
        raise InputError(
            f"remesh: more than {room} vertices are not enough for the sizing field; raise size_min"
        )
    return *unload(sewn, state), Changes(splits, flips, collapses)


def _within_led_edges(state: GarmentState, metric: NDArray[np.float64]) -> NDArray[np.float64]:
    """The metric (P, 2, 2), scaled at the ends of edges between PINNED vertices until these are of size <= 1.

    Such an edge is not split, so a face at it keeps a side of half its size: splits towards a longer one
    would never end.
    """
    faces = state.mesh.panel_faces
    half = half_edges(faces)
    led = half[(state.locked[state.mesh.panel_to_vertex[half]] == int(PINNED)).all(axis=1)]
    sizes = np.maximum(edge_lengths(state.mesh.panel_vertices, led, metric), 1.0)
    largest = np.ones(len(metric))
    np.maximum.at(largest, led.ravel(), np.repeat(sizes, 2))
    return metric / (largest**2)[:, None, None]
