"""What each metric of shape says of a drape that is smoothed more and more, and what it costs."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from muslin.eval.fabric_energy import FabricEnergy
from muslin.eval.metrics.change import area_changes, edge_length_changes, side_weights
from muslin.eval.metrics.checks import corner_areas
from muslin.eval.metrics.curvature import curvature_distance, mean_curvature
from muslin.eval.metrics.dihedral import dihedral_errors, edge_areas, hinges
from muslin.eval.metrics.laplace_beltrami import harmonic_basis
from muslin.eval.metrics.motion import acceleration_errors, jerk_errors, jerk_sizes
from muslin.eval.metrics.normals import normal_distance, normal_errors
from muslin.eval.metrics.panel_spectrum import PANEL_BAND_EDGES, panel_energies, panel_images
from muslin.eval.metrics.spectrum import band_energies, curvature_normals, spectrum_score
from muslin.eval.metrics.strain import green_strain, percentiles
from muslin.eval.metrics.vertex import statistics, triangle_areas, vertex_areas, vertex_errors
from muslin.sim.dataset.reader import open_dataset

AMOUNTS = (0.0, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3)
"""Of smoothing, m^2: heights of a wave shrink by 1 / (1 + amount (2 pi / wavelength)^2)."""
NOISE = 1e-3  # of the last row, m
WINDOW = 30  # frames that are given to the spectra together
REPEATS = 5


@dataclass(frozen=True)
class Row:
    """A drape against itself smoothed by `amount`, or with noise where that is None.

    vertex    mean error, m; `normal` mean, rad; `dihedral` root mean square, rad; `curvature` distance, 1/m
    waves     kept below 0.1 m over eigenfunctions; `panels` over the panels, in each of their bands
    decibels  log-spectral distance; `strain` 99th percentile; `energy` elastic and of gravity, J
    """

    amount: float | None
    vertex: float
    normal: float
    dihedral: float
    curvature: float
    waves: float | None
    panels: tuple[float | None, ...]
    decibels: float
    strain: float
    energy: float


class Drape:
    """The last frame of the first sample of a dataset, and all metrics of this table on it."""

    def __init__(self, path: Path) -> None:
        sample = open_dataset(path)[0]
        last = sample.num_frames - 1
        self.mesh = sample.frame_garment(last)
        self.truth = sample.frame_positions(last).astype(np.float64)
        self.energy = FabricEnergy.of_sample(sample, last)
        self.faces = self.mesh.faces
        self.panels = self.mesh.panel_vertices[self.mesh.panel_faces]
        self.areas = corner_areas(self.panels)
        self.edges = hinges(self.faces)
        self.basis = harmonic_basis(self.faces, self.panels)
        self.images = panel_images(self.faces, self.panels, self.mesh.face_panel)

    def smoothed(self, amount: float) -> np.ndarray:
        """Positions after a step of heat flow over the cloth at rest, metres."""
        matrix = csc_array(diags_array(self.basis.mass) + amount * self.basis.stiffness)
        return splu(matrix).solve(self.basis.mass[:, None] * self.truth)

    def score(self, amount: float | None, x: np.ndarray) -> Row:
        y = self.truth
        h, k = (curvature_normals(self.basis, side) for side in (x, y))
        waves = spectrum_score(band_energies(self.basis, h), band_energies(self.basis, k))
        panels = spectrum_score(
            panel_energies(self.images, h), panel_energies(self.images, k), band_edges=PANEL_BAND_EDGES
        )
        return Row(
            amount,
            statistics(vertex_errors(x, y), vertex_areas(y, self.faces)).mean,
            statistics(normal_errors(x, y, self.faces), triangle_areas(y, self.faces)).mean,
            statistics(
                dihedral_errors(x, y, self.edges), edge_areas(self.panels, self.edges, self.faces)
            ).rms,
            curvature_distance(mean_curvature(x, self.faces), mean_curvature(y, self.faces)),
            waves.wrinkles_kept,
            panels.kept,
            panels.log_spectral_distance,
            percentiles(green_strain(x, self.faces, self.panels).major, self.areas).p99,
            self.energy.energy(x).total,
        )

    def rows(self) -> list[Row]:
        found = [self.score(amount, self.smoothed(amount)) for amount in AMOUNTS]
        noise = NOISE / np.sqrt(3.0) * np.random.default_rng(0).normal(size=self.truth.shape)
        return [*found, self.score(None, self.truth + noise)]

    def costs(self) -> list[tuple[str, float]]:
        """(what, processor seconds): of a frame of prediction and truth, or once a topology."""
        f, panels, areas, edges, basis = self.faces, self.panels, self.areas, self.edges, self.basis
        y = np.repeat(self.truth[None], WINDOW, axis=0)
        x = y + 1e-4 * np.random.default_rng(0).normal(size=y.shape)
        weights = triangle_areas(y[0], f), edge_areas(panels, edges, f)

        def spectra(bands: Callable[[np.ndarray], np.ndarray]) -> None:
            a, b = curvature_normals(basis, x), curvature_normals(basis, y)
            for side in (a, b, a - b):
                bands(side)

        def strains() -> None:
            found = green_strain(x[0], f, panels)
            for part in (found.warp, found.weft, found.shear, found.major, found.minor):
                percentiles(part, areas)

        return [
            ("once: hinges", _seconds(lambda: hinges(f))),
            ("once: harmonic_basis to 0.1 m", _seconds(lambda: harmonic_basis(f, panels * _fresh()), 2)),
            ("once: panel_images", _seconds(lambda: panel_images(f, panels, self.mesh.face_panel))),
            ("acceleration_errors", _seconds(lambda: acceleration_errors(x[:3], y[:3], 30.0))),
            ("jerk_errors", _seconds(lambda: jerk_errors(x[:4], y[:4], 30.0))),
            ("jerk_sizes, both", _seconds(lambda: [jerk_sizes(side[:4], 30.0) for side in (x, y)])),
            ("normal_errors", _seconds(lambda: statistics(normal_errors(x[0], y[0], f), weights[0]))),
            ("normal_distance, 4,000 points", _seconds(lambda: normal_distance(x[0], f, y[0], f))),
            ("dihedral_errors", _seconds(lambda: statistics(dihedral_errors(x[0], y[0], edges), weights[1]))),
            (
                "mean_curvature, both",
                _seconds(lambda: curvature_distance(*(mean_curvature(s[0], f) for s in (x, y)))),
            ),
            ("band_energies, both", _seconds(lambda: spectra(lambda h: band_energies(basis, h))) / WINDOW),
            (
                "panel_energies, both",
                _seconds(lambda: spectra(lambda h: panel_energies(self.images, h))) / WINDOW,
            ),
            ("green_strain", _seconds(strains)),
            (
                "edge_length_changes, area_changes",
                _seconds(
                    lambda: (
                        percentiles(edge_length_changes(x[0], f, y[0]), side_weights(areas)),
                        percentiles(area_changes(x[0], f, y[0]), areas),
                    )
                ),
            ),
            ("energy, both", _seconds(lambda: [self.energy.energy(s[0]) for s in (x, y)])),
        ]


def table(rows: list[Row]) -> str:
    """Markdown."""
    edges = [f"{1e3 * edge:g}" for edge in PANEL_BAND_EDGES]
    bands = [f"> {edges[0]}", *(f"{short} to {long}" for long, short in pairwise(edges)), f"< {edges[-1]}"]
    head = ["smoothing mm^2", "vertex mm", "normal °", "dihedral °", "curvature 1/m", "kept < 100 mm"]
    head += [f"kept {band} mm" for band in bands] + ["dB", "strain p99", "energy mJ"]
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    for row in rows:
        cells = [
            "noise" if row.amount is None else f"{1e6 * row.amount:g}",
            f"{1e3 * row.vertex:.2f}",
            f"{np.degrees(row.normal):.2f}",
            f"{np.degrees(row.dihedral):.2f}",
            f"{row.curvature:.2f}",
            *("" if kept is None else f"{kept:.3g}" for kept in (row.waves, *row.panels)),
            f"{row.decibels:.2f}",
            f"{row.strain:.3f}",
            f"{1e3 * (row.energy - rows[0].energy):.3g}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def cost_table(costs: list[tuple[str, float]]) -> str:
    """Markdown."""
    return "\n".join(["| | ms |", "| --- | --- |", *(f"| {what} | {1e3 * s:.2f} |" for what, s in costs)])


def _seconds(call: Callable[[], Any], repeats: int = REPEATS) -> float:
    """Least processor time of some calls."""
    found = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        found.append(time.process_time() - start)
    return min(found)


def _fresh() -> float:
    """A factor next to 1 that no earlier call had, so that nothing kept is taken."""
    return 1.0 + 1e-12 * (time.perf_counter_ns() % 10_000)
