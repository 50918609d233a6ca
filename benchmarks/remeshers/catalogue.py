"""The remeshers, what each needs installed, and how each was asked."""

from __future__ import annotations

from benchmarks.contenders.catalogue import Contender

MUSLIN = Contender(
    "muslin",
    "with_muslin",
    None,
    "muslin",
    "One target area, seed 0. All panels in one call: sewing them again, and carrying world positions and uv "
    "over, are counted.",
)

REMESHERS = (
    MUSLIN,
    Contender(
        "MMG",
        "mmg",
        "mmg",
        "mmgpy",
        "mmg2d panel by panel: `hsiz` the edge length of an equilateral triangle of the target area, `hausd` "
        "1 mm, corners of the pattern required. It remeshes boundaries too, each panel for itself.",
    ),
    Contender(
        "MMG, boundary kept",
        "mmg_kept",
        "mmg",
        "mmgpy",
        "The same with `nosurf`: seams stay matched and lengths exact, but the boundary has the source's "
        "edges, of whatever length.",
    ),
    Contender(
        "gpytoolbox",
        "botsch",
        "gpytoolbox",
        "gpytoolbox",
        "`remesh_botsch` panel by panel in z = 0 with that edge length, 10 iterations, projected onto the "
        "source. It keeps the source's boundary vertices.",
    ),
)
