"""Reference panels of a design and the triangulations of them that its templates and its uv layout use.

Triangulations of designs that networks are trained on are stored in `assets/`, so that the connectivity, on
which trained networks depend, is the same on every machine and with every version of SciPy. `python -m
muslin.garments.bake` writes them.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from muslin.garments import catalogue
from muslin.garments.atlas import Atlas
from muslin.garments.cut import Cut, cut_pattern
from muslin.garments.pattern import Pattern
from muslin.garments.sampling import BoundarySampling
from muslin.garments.seams import EdgeRef

ASSETS = Path(__file__).parent / "assets"


@dataclass(frozen=True, eq=False)
class Reference:
    """The reference member of a design and the uv atlas of its panels."""

    pattern: Pattern
    atlas: Atlas


@lru_cache(maxsize=8)
def reference(design_name: str) -> Reference:
    """The reference of a design in the catalogue."""
    design = catalogue.get(design_name)
    pattern = design.pattern(**design.reference)
    return Reference(pattern, Atlas.of(pattern))


@lru_cache(maxsize=16)
def topology(design_name: str, resolution: str, edge_length: float) -> Cut:
    """Triangulation of the reference panels: the stored one, or a new one for a design without stored ones.

    Raises RuntimeError if the stored one was made for other reference panels or another edge length.
    """
    path = asset_path(design_name, resolution)
    pattern = reference(design_name).pattern
    if not path.exists():
        return cut_pattern(pattern, edge_length, seed=0)
    with np.load(path, allow_pickle=False) as stored:
        if str(stored["digest"]) != digest(pattern, edge_length):
            raise RuntimeError(f"{path} is out of date: run `python -m muslin.garments.bake`")
        refs = [EdgeRef(panel.name, edge.name) for panel in pattern.panels for edge in panel.edges]
        segments = dict(zip(refs, stored["segments"].tolist(), strict=True))
        return Cut(
            panel_faces=stored["panel_faces"].astype(np.int32),
            panel_vertices=stored["panel_vertices"],
            panel_to_vertex=stored["panel_to_vertex"].astype(np.int32),
            face_panel=stored["face_panel"].astype(np.int32),
            panel_starts=stored["panel_starts"],
            sampling=BoundarySampling(segments),
        )


def store(cut: Cut, design_name: str, resolution: str, edge_length: float) -> Path:
    """Write a triangulation of the reference panels where `topology` finds it; returns the path."""
    path = asset_path(design_name, resolution)
    path.parent.mkdir(exist_ok=True)
    np.savez_compressed(
        path,
        panel_faces=cut.panel_faces.astype(np.uint16),
        panel_vertices=cut.panel_vertices,
        panel_to_vertex=cut.panel_to_vertex.astype(np.uint16),
        face_panel=cut.face_panel.astype(np.uint8),
        panel_starts=cut.panel_starts,
        segments=np.array(list(cut.sampling.segments.values())),
        digest=np.array(digest(reference(design_name).pattern, edge_length)),
    )
    return path


def asset_path(design_name: str, resolution: str) -> Path:
    """Where a triangulation of a design's reference panels is stored."""
    return ASSETS / f"{design_name}_{resolution}.npz"


def digest(pattern: Pattern, edge_length: float) -> str:
    """Hash of what a triangulation depends on: curves (to 1e-9 m), seams and edge length."""
    text = [f"{edge_length!r}"]
    for panel in pattern.panels:
        for edge in panel.edges:
            points = np.round(edge.curve.at(np.linspace(0.0, 1.0, 7)), 9) + 0.0
            text.append(f"{panel.name}.{edge.name} {points.tolist()}")
    text += [f"{seam.first} {seam.second}" for seam in pattern.seams]
    return hashlib.sha256("\n".join(text).encode()).hexdigest()
