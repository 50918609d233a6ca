"""What a drape loses on its way to another topology: by interpolation, and by fitting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from muslin.eval.metrics.hausdorff import hausdorff
from muslin.eval.metrics.surface_sampling import surface_distance
from muslin.eval.remesh_source import RemeshSource, remesh_source
from muslin.garments.mesh import GarmentMesh
from muslin.sim.dataset.intersections import find_crossings
from muslin.sim.remesh.fit import fit, transfer_error
from muslin.sim.remesh.sizing import PanelGradient
from muslin.sim.remesh.topology import Remeshed, remesh
from muslin.sim.remesh.untangle import untangle

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Transfer:
    """Means over the seeds of one way to one number of vertices, lengths in metres; the worst of the seeds
    for `largest`, `hausdorff` and `stretch`.

    mean, rms, largest   distance at equal places of panel space, at the source's vertices
    surface, hausdorff   mean distance of the surfaces, and the upper bound of the largest, both ways
    area                 area of the surface over that of the source, less 1
    stretch              largest principal stretch
    crossings, moved     points in which it crossed body or itself, and vertices that `untangle` then moved;
                         all other figures are those after it
    """

    way: str
    vertices: int
    mean: float
    rms: float
    largest: float
    surface: float
    hausdorff: float
    area: float
    stretch: float
    crossings: float
    moved: float


def transfers(
    path: Path, sizes: list[int], seeds: int, tell: Callable[[str], None]
) -> tuple[RemeshSource, list[Transfer]]:
    """Both ways to each number of vertices, of so many seeds; the drape is the one sample of the dataset."""
    source = remesh_source(path)
    if source.positions is None:
        raise ValueError(f"{path}: a flat file has no drape")
    found = []
    for size in sizes:
        area = float(source.mesh.face_areas.sum()) / (2.0 * size)
        drawn = [remesh(source.mesh, source.positions, area, seed=seed) for seed in range(seeds)]
        for way, made in (
            ("interpolated", drawn),
            ("fitted", [fit(one, source.positions) for one in drawn]),
        ):
            tell(f"{size} vertices, {way}")
            found.append(_figures(way, size, source, source.positions, made))
    return source, found


def table(source: RemeshSource, found: list[Transfer]) -> str:
    """The figures in markdown."""
    assert source.positions is not None
    length = float(np.ptp(source.positions[:, 1]))
    lines = [
        f"Source: {source.mesh.num_vertices} vertices, garment length {length:.3f} m, largest stretch "
        f"{_stretch(source.mesh, source.positions):.2f}.",
        "",
        "| vertices, about | | mean, mm | RMS, mm | largest, mm | RMS over length, % | surface: mean, mm | "
        "Hausdorff, mm | area, % | largest stretch | crossings before | vertices moved |",
        "| --- |" + " --- |" * 11,
    ]
    for row in found:
        cells = [
            str(row.vertices),
            row.way,
            *(f"{1e3 * value:.2f}" for value in (row.mean, row.rms, row.largest)),
            f"{100.0 * row.rms / length:.3f}",
            *(f"{1e3 * value:.2f}" for value in (row.surface, row.hausdorff)),
            f"{100.0 * row.area:+.2f}",
            f"{row.stretch:.2f}",
            f"{row.crossings:.0f}",
            f"{row.moved:.0f}",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _figures(way: str, size: int, source: RemeshSource, positions: Array, drawn: list[Remeshed]) -> Transfer:
    body = source.body_vertices, source.body_faces
    given = _area(positions, source.mesh.faces)
    rows = []
    for one in drawn:
        free = untangle(one, positions, *body)
        error = transfer_error(free, positions)
        pair = free.positions, free.mesh.faces, positions, source.mesh.faces
        back = positions, source.mesh.faces, free.positions, free.mesh.faces
        rows.append(
            (
                error.mean(),
                np.sqrt((error**2).mean()),
                error.max(),
                0.5 * (surface_distance(*pair).mean + surface_distance(*back).mean),
                max(hausdorff(*pair).upper, hausdorff(*back).upper),
                _area(free.positions, free.mesh.faces) / given - 1.0,
                _stretch(free.mesh, free.positions),
                len(find_crossings(one.positions, one.mesh.faces, *body)),
                np.count_nonzero((free.positions != one.positions).any(axis=1)),
            )
        )
    mean, worst = (reduce(np.array(rows), axis=0).tolist() for reduce in (np.mean, np.max))
    return Transfer(
        way,
        size,
        mean=mean[0],
        rms=mean[1],
        largest=worst[2],
        surface=mean[3],
        hausdorff=worst[4],
        area=mean[5],
        stretch=worst[6],
        crossings=mean[7],
        moved=mean[8],
    )


def _area(x: Array, faces: NDArray[np.int32]) -> float:
    a, b, c = x[faces].swapaxes(0, 1)
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def _stretch(mesh: GarmentMesh, positions: Array) -> float:
    return float(np.linalg.svd(PanelGradient(mesh)(positions), compute_uv=False).max())
