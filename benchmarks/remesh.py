"""muslin's remesher beside others on the same panels: the quality of what they make, and their time."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.contenders.catalogue import Contender
from benchmarks.isolated import run
from benchmarks.remeshers.catalogue import MUSLIN
from benchmarks.remeshers.exchange import RECORD_FILE, Panels, Task, load_panels
from benchmarks.spread import paired_ratio, spread
from muslin.eval.metrics.mesh_quality import MeshQuality, quality
from muslin.eval.metrics.panel_curves import pattern_corners
from muslin.garments.designs.tee import TEE
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.sim.body.load import load_body
from muslin.sim.dress import place

BODY = "neutral"
SOURCE = "source"


@dataclass(frozen=True)
class Case:
    """A preset of the tee on its template of `source` vertices, to be remeshed to about `target` vertices."""

    preset: str
    source: int
    target: int

    @property
    def name(self) -> str:
        """Name of its files and in the table."""
        return f"{self.preset} {self.source} to {self.target}"


@dataclass
class Result:
    """What one remesher made: the quality of each case by name, and its seconds, a value a round.

    `failure`: why it did not get through, and then it is run no more.
    """

    remesher: Contender
    seconds: dict[str, list[float]] = field(default_factory=dict)
    quality: dict[str, MeshQuality] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    options: dict[str, object] = field(default_factory=dict)
    failure: str | None = None


def cases_of(presets: str, sizes: str) -> list[Case]:
    """Cases of lists such as `top,sweater` and `4000:1400,17246:3600`; ValueError for anything else."""
    pairs = [pair.split(":") for pair in sizes.split(",")]
    if any(len(pair) != 2 or not all(number.strip().isdigit() for number in pair) for pair in pairs):
        raise ValueError(f"sizes = {sizes}; give SOURCE:TARGET vertices, as in 4000:1400,17246:3600")
    return [Case(p.strip(), int(a), int(b)) for p in presets.split(",") for a, b in pairs]


def source_mesh(case: Case) -> GarmentMesh:
    """The template that a case starts from."""
    return template("tee", TEE.preset(case.preset), case.source)


def make_task(case: Case) -> Task:
    """What remeshers are given: a triangulation of V vertices has some 2 V triangles, so the target area is
    that of all panels over 2 V. World positions are those in which a garment is put on."""
    mesh = source_mesh(case)
    body = load_body(BODY)
    beta = np.zeros(body.num_betas)
    return Task(
        panels_of(mesh),
        float(mesh.face_areas.sum()) / (2.0 * case.target),
        pattern_corners(mesh),
        mesh.uv,
        place(mesh, body, beta, body.vertices(beta)),
    )


def panels_of(mesh: GarmentMesh) -> Panels:
    """The arrays that remeshers exchange."""
    return Panels(mesh.panel_vertices, mesh.panel_faces, mesh.face_panel, mesh.panel_to_vertex)


def garment(panels: Panels, uv: NDArray[np.float64] | None = None) -> GarmentMesh:
    """Panels of a tee as a mesh; its uv layout is left at zero without `uv`."""
    return GarmentMesh(
        faces=panels.panel_to_vertex[panels.panel_faces],
        panel_faces=panels.panel_faces,
        panel_vertices=panels.panel_vertices,
        panel_to_vertex=panels.panel_to_vertex,
        face_panel=panels.face_panel,
        panel_names=("front", "back", "sleeve_left", "sleeve_right"),
        uv=np.zeros_like(panels.panel_vertices) if uv is None else uv,
        name="tee",
        parameters={},
    )


def compare(
    cases: Sequence[Case],
    remeshers: Iterable[Contender],
    environments: Path,
    out: Path,
    rounds: int,
    core: int,
    tell: Callable[[str], None],
) -> list[Result]:
    """Run every remesher once a round on all cases, on one core; results in the order of `remeshers`."""
    tasks = out / "tasks"
    shutil.rmtree(tasks, ignore_errors=True)
    for case in cases:
        make_task(case).save(tasks / f"{case.name}.npz")
    results = [Result(remesher) for remesher in remeshers]
    for number in range(1, rounds + 1):
        for result in results:
            if result.failure is not None:
                continue
            module = result.remesher.module
            command: list[str | Path] = [result.remesher.interpreter(environments), "-m"]
            command += [f"benchmarks.remeshers.{module}", tasks, out / module]
            tell(f"round {number} of {rounds}: {result.remesher.name}")
            try:
                run(command, {core}, out / f"{module}.log")
            except RuntimeError as error:
                result.failure = str(error)
                tell(f"  {error}")
                continue
            record = json.loads((out / module / RECORD_FILE).read_text(encoding="utf-8"))
            for name, seconds in record["seconds"].items():
                result.seconds.setdefault(name, []).append(seconds)
            result.versions, result.options = record["versions"], record["options"]
            tell(f"  {sum(record['seconds'].values()):.2f} CPU s")
    for case in cases:
        source = source_mesh(case)
        for result in results:
            if result.failure is None:
                made = garment(load_panels(out / result.remesher.module / f"{case.name}.npz"))
                result.quality[case.name] = quality(made, source)
    return results


def table(cases: Sequence[Case], results: list[Result]) -> str:
    """The results in markdown, case after case, then how each remesher was asked."""
    head = (
        "panel vertices",
        "faces",
        "smallest angle, °",
        "angles ≥ 30°, %",
        "CV of areas",
        "degenerate, inverted",
        "largest length error, %",
        "boundary moved, mm",
        "largest error of a panel's area, %",
        "unmatched seam vertices",
        "CPU s",
        "over muslin",
    )
    lines = [f"| | {' | '.join(head)} |", "| --- |" + " --- |" * len(head)]
    base = next((r for r in results if r.remesher is MUSLIN and r.failure is None), None)
    for case in cases:
        lines.append(f"| **{case.name}** |" + " |" * len(head))
        source = source_mesh(case)
        lines.append(f"| {SOURCE} | {' | '.join(_quality_cells(quality(source, source)))} | | |")
        for result in results:
            if result.failure is not None:
                lines.append(f"| {result.remesher.name} | failed |" + " |" * (len(head) - 1))
                continue
            taken = result.seconds[case.name]
            ratio = "" if base is None else paired_ratio(taken, base.seconds[case.name]).text()
            cells = [*_quality_cells(result.quality[case.name]), spread(taken).text(3), ratio]
            lines.append(f"| {result.remesher.name} | {' | '.join(cells)} |")
    lines.append("")
    for result in results:
        lines += result.remesher.footnote(result.versions, result.failure)
    return "\n".join(lines) + "\n"


def as_json(results: list[Result]) -> list[dict[str, object]]:
    """The results as plain values; angles in radians."""
    return [asdict(result) for result in results]


def _quality_cells(found: MeshQuality) -> list[str]:
    errors = found.curve_error, found.curve_distance, found.panel_area_error
    length, distance, area = (np.nan if error is None else error for error in errors)
    return [
        str(found.panel_vertices),
        str(found.faces),
        f"{np.degrees(found.min_angle):.1f}",
        f"{100.0 * (1.0 - found.below_good):.2f}",
        f"{found.area_variation:.3f}",
        f"{found.degenerate}, {found.inverted}",
        f"{100.0 * length:.3f}",
        f"{1e3 * distance:.2f}",
        f"{100.0 * area:.3f}",
        str(found.seam_mismatches),
    ]
