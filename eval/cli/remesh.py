"""`muslin remesh`: other triangulations of a draped garment."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from muslin.eval.cli.options import Force, SampleId, check_new
from muslin.garments.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from muslin.eval.remesh_source import RemeshSource
    from muslin.sim.remesh.settings import RemeshSettings
    from muslin.sim.remesh.topology import Remeshed

MOST_TOPOLOGIES = 10_000


def remesh(
    source: Annotated[
        Path,
        typer.Argument(metavar="SOURCE", help="A sample (DIR/samples/ID.zarr.zip), a dataset, or MESH.obj."),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="FILE.obj.")],
    target_area: Annotated[
        float | None, typer.Option("--target-area", metavar="A", help="Mean triangle area, square metres.")
    ] = None,
    panel_areas: Annotated[
        list[str] | None,
        typer.Option("--panel-area", metavar="NAME=A", help="Another one for this panel. Repeatable."),
    ] = None,
    max_distortion: Annotated[
        float | None,
        typer.Option(
            "--max-distortion", metavar="D", help="Of any triangle; 1 is equilateral, by default 2.5."
        ),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", min=0, metavar="S", help="Another one, another mesh.")] = 0,
    topologies: Annotated[
        int,
        typer.Option("--topologies", min=1, max=MOST_TOPOLOGIES, metavar="N", help="Seeds S to S + N - 1."),
    ] = 1,
    refine_angle: Annotated[
        float | None,
        typer.Option("--refine-angle", help="Radians that normals may turn along an edge; finer at bends."),
    ] = None,
    refine_compression: Annotated[
        float | None,
        typer.Option("--refine-compression", help="Metres; finer where cloth is compressed into waves."),
    ] = None,
    size_min: Annotated[
        float | None, typer.Option("--size-min", help="Metres, with --refine-…; by default 0.01.")
    ] = None,
    size_max: Annotated[
        float | None, typer.Option("--size-max", help="Metres, with --refine-…; by default 0.2.")
    ] = None,
    aspect_min: Annotated[
        float | None,
        typer.Option("--aspect-min", help="Of triangles, with --refine-…; 1 for isotropic, by default 0.2."),
    ] = None,
    interpolate: Annotated[
        bool, typer.Option("--interpolate", help="Vertices on the source's surface, not fitted to it.")
    ] = False,
    binding: Annotated[
        bool, typer.Option("--binding", help="Beside each OBJ an NPZ: where vertices lie, skinning weights.")
    ] = False,
    sample_id: SampleId = None,
    frame: Annotated[int, typer.Option("--frame", min=0, help="Of a sequence.")] = 0,
    force: Force = False,
) -> None:
    """Triangulate the panels of a garment anew; the same drape, seams matched, nothing cut through.

    With --topologies, the seed is put into the name of each file: FILE_0.obj, FILE_1.obj … A flat OBJ has no
    drape: its panels are triangulated, and written flat. With a sample as source the body of that frame is
    kept out of.

    \b
    Examples:
      muslin remesh out/demo --sample ID --target-area 4e-4 --out coarse.obj
      muslin remesh out/demo --sample ID --target-area 4e-4 --topologies 20 --out topologies/dress.obj
      muslin remesh dress.obj --target-area 4e-4 --panel-area front=1e-4 --out dress_front.obj
      muslin remesh dress.obj --target-area 4e-4 --refine-angle 0.3 --aspect-min 0.3 --out folds.obj
    """
    from muslin.eval.remesh_source import remesh_source
    from muslin.sim.device import open_device

    if out.suffix.lower() != ".obj":
        raise InputError(f"{out}: a garment is written as .obj, not {out.suffix!r}")
    settings = _settings(refine_angle, refine_compression, size_min, size_max, aspect_min)
    given = remesh_source(source, sample_id, frame)
    target = _target(given, target_area, dict(_area(entry) for entry in panel_areas or []), settings)
    files = {seed + k: _numbered(out, seed + k, topologies) for k in range(topologies)}
    for file in files.values():
        check_new(file, force)
        if binding:
            check_new(file.with_suffix(".npz"), force)
    if given.crossings:
        typer.echo(
            f"note: the source has {given.crossings} intersections itself, so new ones are left",
            err=True,
        )
    open_device("cpu")
    for number, file in files.items():
        typer.echo(_write(given, file, _drawn(given, target, number, max_distortion, interpolate), binding))


def _settings(
    refine_angle: float | None,
    refine_compression: float | None,
    size_min: float | None,
    size_max: float | None,
    aspect_min: float | None,
) -> RemeshSettings | None:
    from muslin.sim.remesh.settings import RemeshSettings

    if refine_angle is None and refine_compression is None:
        bounds = {"--size-min": size_min, "--size-max": size_max, "--aspect-min": aspect_min}
        for name, value in bounds.items():
            if value is not None:
                raise InputError(
                    f"{name} bounds what is refined; give --refine-angle or --refine-compression too"
                )
        return None
    usual = RemeshSettings()
    return RemeshSettings(
        refine_angle=refine_angle,
        refine_compression=refine_compression,
        size_min=usual.size_min if size_min is None else size_min,
        size_max=usual.size_max if size_max is None else size_max,
        aspect_min=usual.aspect_min if aspect_min is None else aspect_min,
    )


def _area(entry: str) -> tuple[str, float]:
    name, separator, value = entry.rpartition("=")
    try:
        if not separator or not name:
            raise ValueError
        return name, float(value)
    except ValueError as error:
        raise InputError(f"--panel-area {entry!r}: must be NAME=AREA, for example front=4e-4") from error


def _target(
    given: RemeshSource,
    target_area: float | None,
    panel_areas: dict[str, float],
    settings: RemeshSettings | None,
) -> float | dict[str, float] | NDArray[np.float64]:
    if settings is not None:
        from muslin.sim.remesh.drape_metric import drape_metric

        if panel_areas:
            raise InputError("--panel-area beside --refine-…: sizes come from the drape; give one of the two")
        if given.positions is None:
            raise InputError("--refine-…: a flat file has no drape to follow; give one with positions")
        return drape_metric(given.mesh, given.positions, settings, target_area)
    names = given.mesh.panel_names
    unknown = [name for name in panel_areas if name not in names]
    if unknown:
        raise InputError(f"--panel-area {unknown[0]}: no such panel; the garment has {', '.join(names)}")
    rest = [name for name in names if name not in panel_areas]
    if target_area is None and rest:
        raise InputError(
            f"panel {rest[0]} has no target; give --target-area, the mean triangle area in square metres"
        )
    if not panel_areas:
        assert target_area is not None
        return target_area
    return dict.fromkeys(rest, target_area or 0.0) | panel_areas


def _numbered(out: Path, seed: int, count: int) -> Path:
    return out if count == 1 else out.with_name(f"{out.stem}_{seed}{out.suffix}")


@dataclass(frozen=True, eq=False)
class Drawn:
    """A topology; `moved` (V',) metres by which each vertex gave way to what it crossed."""

    remeshed: Remeshed
    moved: NDArray[np.float64]


def _drawn(
    given: RemeshSource,
    target: float | dict[str, float] | NDArray[np.float64],
    seed: int,
    max_distortion: float | None,
    interpolate: bool,
) -> Drawn:
    import numpy as np

    from muslin.sim.remesh import topology
    from muslin.sim.remesh.distortion import MAX_DISTORTION
    from muslin.sim.remesh.fit import fit
    from muslin.sim.remesh.untangle import untangle

    flat = given.positions is None
    positions = np.zeros((given.mesh.num_vertices, 3)) if given.positions is None else given.positions
    allowed = MAX_DISTORTION if max_distortion is None else max_distortion
    made = topology.remesh(given.mesh, positions, target, seed=seed, max_distortion=allowed)
    if flat:
        return Drawn(made, np.zeros(made.mesh.num_vertices))
    if not interpolate:
        made = fit(made, positions)
    if given.crossings:
        return Drawn(made, np.zeros(made.mesh.num_vertices))
    free = untangle(made, positions, given.body_vertices, given.body_faces)
    return Drawn(free, np.linalg.norm(free.positions - made.positions, axis=1))


def _write(given: RemeshSource, file: Path, drawn: Drawn, binding: bool) -> str:
    """Writes the files of one topology; the line that tells of it."""
    import numpy as np

    from muslin.eval.metrics.mesh_quality import quality
    from muslin.garments.obj import write_garment

    made = drawn.remeshed
    write_garment(made.mesh, file, None if given.positions is None else made.positions)
    if binding:
        corners, weights = made.at_vertices
        none = np.zeros((made.mesh.num_vertices, 0))
        skinning = none if given.skinning is None else made.carry(given.skinning)
        npz = file.with_suffix(".npz")
        np.savez(npz, source_vertices=corners, source_weights=weights, skinning=skinning)
    shape = quality(made.mesh, given.mesh)
    told = [
        f"{file}: {shape.vertices} vertices, {shape.faces} faces",
        f"mean area {1e4 * made.mesh.face_areas.mean():.4g} cm²",
        f"smallest angle {np.degrees(shape.min_angle):.1f}°",
        f"largest distortion {made.distortion:.2f}",
    ]
    count = np.count_nonzero(drawn.moved)
    told.append(f"{count} vertices moved" + (f" by up to {1e3 * drawn.moved.max():.2g} mm" if count else ""))
    return ", ".join(told)
