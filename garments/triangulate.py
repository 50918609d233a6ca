"""From a pattern to the sewn garment mesh."""

from __future__ import annotations

import math

import numpy as np

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.garments.pattern import Pattern
from muslin.garments.planar import triangulate_polygon
from muslin.garments.sampling import BoundarySampling


def triangulate(pattern: Pattern, edge_length: float, seed: int = 0) -> GarmentMesh:
    """Sewn mesh of the pattern with edges of about `edge_length` metres.

    Both sides of a seam are sampled alike, so they match vertex for vertex; corners where several panels meet become
    one vertex. Different seeds give different interior vertices of the same quality; the same seed the same mesh.
    Raises InputError for an unsound pattern or an edge length too coarse for it.
    """
    if not (math.isfinite(edge_length) and edge_length > 0.0):
        raise InputError(f"edge_length = {edge_length} m; it must be a finite number greater than zero")
    pattern.validate()
    sampling = BoundarySampling.of(pattern, edge_length)
    sewn = sampling.sewn(pattern)
    rng = np.random.default_rng(seed)

    points, faces, face_panel, vertex = [], [], [], []
    first_boundary, first_point, next_vertex = 0, 0, int(sewn.max()) + 1
    for index, panel in enumerate(pattern.panels):
        boundary = sampling.points(pattern, panel.name)
        panel_points, panel_faces = triangulate_polygon(boundary, edge_length, rng, panel.name)
        inner = len(panel_points) - len(boundary)
        points.append(panel_points)
        faces.append(panel_faces + first_point)
        face_panel.append(np.full(len(panel_faces), index))
        vertex += [sewn[first_boundary : first_boundary + len(boundary)], next_vertex + np.arange(inner)]
        first_boundary += len(boundary)
        first_point += len(panel_points)
        next_vertex += inner

    panel_faces = np.concatenate(faces).astype(np.int32)
    panel_to_vertex = np.concatenate(vertex).astype(np.int32)
    panel_vertices = np.concatenate(points)
    low, high = panel_vertices.min(axis=0), panel_vertices.max(axis=0)
    mesh = GarmentMesh(
        faces=panel_to_vertex[panel_faces],
        panel_faces=panel_faces,
        panel_vertices=panel_vertices,
        panel_to_vertex=panel_to_vertex,
        face_panel=np.concatenate(face_panel).astype(np.int32),
        panel_names=tuple(panel.name for panel in pattern.panels),
        uv=(panel_vertices - low) / (high - low).max(),
        name=pattern.name,
        parameters=dict(pattern.parameters),
    )
    mesh.validate()
    return mesh
