"""`muslin export`: samples and meshes for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from muslin.eval.cli.options import Where, conditions_of
from muslin.garments.errors import InputError


def export(
    source: Annotated[
        str, typer.Argument(metavar="DIR", help="A dataset, in a folder or at a URL, or a mesh file.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files.")],
    file_format: Annotated[
        str | None,
        typer.Option("--format", metavar="FORMAT", help="obj (the default), ply, glb, usd, pc2 or npz."),
    ] = None,
    layout: Annotated[
        str | None,
        typer.Option(
            "--layout",
            metavar="LAYOUT",
            help="Instead of a format, for whole datasets: obj, cloth3d or hood.",
        ),
    ] = None,
    split: Annotated[str | None, typer.Option("--split", metavar="NAME", help="Only this split.")] = None,
    where: Where = None,
    samples: Annotated[
        list[str] | None, typer.Option("--sample", metavar="ID", help="Only these samples. Repeatable.")
    ] = None,
    body: Annotated[bool, typer.Option("--body/--no-body", help="With the body, or the cloth alone.")] = True,
) -> None:
    """Write samples as files for Blender, Houdini and others. No file is overwritten.

    With --layout, a folder a sample as others' code reads it, a manifest with splits and licences; the same
    command goes on where it stopped.

    \b
    Examples:
      muslin export out/demo --format obj --out out/obj
      muslin export out/walk --format usd --out out/usd --no-body
      muslin export mesh.obj --format ply --out out/ply
      muslin export out/data --layout cloth3d --split train --out out/cloth3d
    """
    from muslin.eval.cli.progress import progress_bar
    from muslin.eval.read.check import check_mesh
    from muslin.sim.dataset.export import export_dataset, export_parts
    from muslin.sim.dataset.layouts.export import export_layout
    from muslin.sim.dataset.parts import read_mesh
    from muslin.sim.dataset.selection import select

    file = Path(source)
    if layout is not None and (file_format is not None or file.is_file()):
        raise InputError(
            "--layout is for whole datasets, and says the formats of files; give it without --format"
        )
    conditions = conditions_of(where)
    if layout is not None:
        with progress_bar("export") as update:
            done = export_layout(
                source,
                out,
                layout,
                split=split,
                where=conditions,
                ids=samples or None,
                body=body,
                progress=update,
            )
        typer.echo(f"{out}: {len(done.written)} samples written, {len(done.kept)} were there")
        return
    file_format = file_format or "obj"
    if file.is_file():
        mesh = read_mesh(file)
        check_mesh(mesh.positions, mesh.faces, source)
        files = export_parts(file.stem, [mesh], None, out, file_format)
    else:
        chosen = select(source, split, conditions, samples or None)
        with progress_bar("export") as update:
            files = export_dataset(chosen, out, file_format, body=body, progress=update)
    typer.echo(f"{out}: {len(files)} files")
