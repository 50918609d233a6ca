"""What a remesher is given and what it writes: panels in panel space, seconds, versions."""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

RECORD_FILE = "record.json"


@dataclass(frozen=True, eq=False)
class Panel:
    """points (N, 2), metres; faces (M, 3) over them; corners: the vertices at which a seam or a hem ends."""

    points: NDArray[np.float64]
    faces: NDArray[np.int32]
    corners: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Panels:
    """Triangulated panels.

    panel_vertices (P, 2) float64, metres; panel_faces (F, 3) int32; face_panel (F,) int32; panel_to_vertex
    (P,) int32, the sewn vertex of each, panel vertices by themselves where nothing is sewn
    """

    panel_vertices: NDArray[np.float64]
    panel_faces: NDArray[np.int32]
    face_panel: NDArray[np.int32]
    panel_to_vertex: NDArray[np.int32]

    def save(self, file: Path) -> None:
        """Write the arrays to an npz file."""
        file.parent.mkdir(parents=True, exist_ok=True)
        np.savez(file, **{entry.name: getattr(self, entry.name) for entry in fields(self)})


def join(meshes: Sequence[tuple[NDArray[np.float64], NDArray[np.int32]]]) -> Panels:
    """Panels (points, faces) beside each other, nothing sewn."""
    starts = np.cumsum([0] + [len(points) for points, _ in meshes])
    shifted = [faces + start for (_, faces), start in zip(meshes, starts[:-1], strict=True)]
    return Panels(
        np.concatenate([points for points, _ in meshes]),
        np.concatenate(shifted).astype(np.int32),
        np.repeat(np.arange(len(meshes)), [len(faces) for _, faces in meshes]).astype(np.int32),
        np.arange(starts[-1], dtype=np.int32),
    )


@dataclass(frozen=True, eq=False)
class Task:
    """Panels to remesh with triangles of `target_area`, square metres, on average.

    corner (P,) bool: panel vertices at which a seam or a hem ends; uv (P, 2) and positions (V, 3), metres:
    what muslin carries over besides, no peer needs them.
    """

    panels: Panels
    target_area: float
    corner: NDArray[np.bool_]
    uv: NDArray[np.float64]
    positions: NDArray[np.float64]

    @property
    def edge_length(self) -> float:
        """Side of an equilateral triangle of the target area, metres."""
        return equilateral_side(self.target_area)

    def save(self, file: Path) -> None:
        """Write the task to an npz file."""
        file.parent.mkdir(parents=True, exist_ok=True)
        arrays = {entry.name: getattr(self.panels, entry.name) for entry in fields(self.panels)}
        arrays |= {name: getattr(self, name) for name in ("target_area", "corner", "uv", "positions")}
        np.savez(file, **arrays)

    def split(self) -> list[Panel]:
        """Panel after panel, each over its own vertices."""
        found = []
        for k in range(int(self.panels.face_panel.max()) + 1):
            here = self.panels.panel_faces[self.panels.face_panel == k]
            used, faces = np.unique(here, return_inverse=True)
            corners = np.flatnonzero(self.corner[used]).astype(np.int32)
            found.append(
                Panel(self.panels.panel_vertices[used], faces.reshape(-1, 3).astype(np.int32), corners)
            )
        return found


def equilateral_side(area: float) -> float:
    """l with sqrt(3)/4 l^2 = area."""
    return math.sqrt(4.0 * area / math.sqrt(3.0))


def load_panels(file: Path) -> Panels:
    """What `Panels.save` or `Task.save` wrote."""
    with np.load(file) as stored:
        return Panels(**{entry.name: stored[entry.name] for entry in fields(Panels)})


def load_task(file: Path) -> Task:
    """What `Task.save` wrote."""
    with np.load(file) as stored:
        own = {name: stored[name] for name in ("corner", "uv", "positions")}
        return Task(load_panels(file), float(stored["target_area"]), **own)


@dataclass
class Record:
    """CPU seconds of each task, all threads; versions and the options that were given."""

    packages: tuple[str, ...]
    options: dict[str, object]
    seconds: dict[str, float] = field(default_factory=dict)

    def save(self, folder: Path) -> None:
        """Write the record into a folder."""
        summary = {
            "seconds": self.seconds,
            "versions": {name: version(name) for name in self.packages},
            "options": self.options,
        }
        (folder / RECORD_FILE).write_text(json.dumps(summary, indent=1), encoding="utf-8")


def contend(remesh: Callable[[Task], Panels], packages: tuple[str, ...], options: dict[str, object]) -> None:
    """The command line of a remesher: remesh the first task once unmeasured, then every one by name."""
    parser = argparse.ArgumentParser()
    parser.add_argument("tasks", type=Path)
    parser.add_argument("out", type=Path)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    tasks = {file.stem: load_task(file) for file in sorted(given.tasks.glob("*.npz"))}
    remesh(next(iter(tasks.values())))
    record = Record(packages, options)
    for name, task in tasks.items():
        start = time.process_time()
        result = remesh(task)
        record.seconds[name] = time.process_time() - start
        result.save(given.out / f"{name}.npz")
    record.save(given.out)


def panel_by_panel(
    remesh_panel: Callable[[Panel, float], tuple[NDArray[np.float64], NDArray[np.int32]]],
) -> Callable[[Task], Panels]:
    """A remesher of garments from one of panels, which gets a panel and the edge length, metres."""
    return lambda task: join([remesh_panel(panel, task.edge_length) for panel in task.split()])
