"""`muslin export`: samples and meshes for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def export(
    source: Annotated[Path, typer.Argument(metavar="DIR", help="A dataset, or a mesh file.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files.")],
    file_format: Annotated[
        str, typer.Option("--format", metavar="FORMAT", help="obj, ply, glb, usd, pc2 or npz.")
    ] = "obj",
    samples: Annotated[
        list[str] | None, typer.Option("--sample", metavar="ID", help="Only these samples. Repeatable.")
    ] = None,
    body: Annotated[bool, typer.Option("--body/--no-body", help="With the body, or the cloth alone.")] = True,
) -> None:
    """Write samples as files for Blender, Houdini and others. No file is overwritten.

    \b
    Examples:
      muslin export out/demo --format obj --out out/obj
      muslin export out/walk --format usd --out out/usd --no-body
      muslin export mesh.obj --format ply --out out/ply
    """
    from muslin.eval.cli.progress import progress_bar
    from muslin.eval.read.check import check_mesh
    from muslin.sim.dataset.export import export_dataset, export_parts
    from muslin.sim.dataset.parts import read_mesh

    if source.is_file():
        mesh = read_mesh(source)
        check_mesh(mesh.positions, mesh.faces, str(source))
        files = export_parts(source.stem, [mesh], None, out, file_format)
    else:
        with progress_bar("export") as update:
            files = export_dataset(source, out, file_format, ids=samples or None, body=body, progress=update)
    typer.echo(f"{out}: {len(files)} files")
