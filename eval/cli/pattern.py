"""`muslin pattern`: a sewing pattern to a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from muslin.eval.cli.options import Force, check_new
from muslin.garments.errors import InputError

SUFFIXES = (".json", ".obj", ".svg", ".png")


def pattern(
    name: Annotated[
        str, typer.Argument(metavar="NAME", help="A design, e.g. tee, or a pattern file (.json).")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="FILE.json, .obj, .svg or .png.")],
    parameters: Annotated[
        list[str] | None,
        typer.Option(
            "-p", "--parameter", metavar="KEY=VALUE", help="A design parameter, metres. Repeatable."
        ),
    ] = None,
    preset: Annotated[
        str | None, typer.Option("--preset", help="A named set of parameters, e.g. long_dress.")
    ] = None,
    edge_length: Annotated[
        float, typer.Option("--edge-length", min=0.002, max=0.2, help="Of the triangles in OBJ, metres.")
    ] = 0.02,
    force: Force = False,
) -> None:
    """Draw a sewing pattern, or write it as a pattern file or as a mesh of its panels.

    \b
    Examples:
      muslin pattern tee --out tee.png
      muslin pattern tee --preset long_dress -p sleeve_length=0.4 --out dress.svg
      muslin pattern tee -p garment_length=0.7 --out tee.json
      muslin pattern tee.json --edge-length 0.01 --out tee.obj
    """
    from muslin.garments import catalogue
    from muslin.garments.pattern_file import read_pattern, write_pattern

    if out.suffix.lower() not in SUFFIXES:
        raise InputError(f"{out}: a pattern is written as {', '.join(SUFFIXES)}, not {out.suffix!r}")
    values = dict(_split(entry) for entry in parameters or [])
    if name.endswith(".json"):
        if values or preset:
            raise InputError(f"{name}: a pattern file has fixed measures; leave out -p and --preset")
        drawn = read_pattern(name)
    else:
        design = catalogue.get(name)
        drawn = design.pattern(**((design.preset(preset) if preset else {}) | values))
    check_new(out, force)
    if out.suffix.lower() == ".json":
        write_pattern(drawn, out)
    elif out.suffix.lower() == ".obj":
        from muslin.garments.obj import write_garment
        from muslin.garments.triangulate import triangulate

        write_garment(triangulate(drawn, edge_length), out)
    else:
        from muslin.garments.drawing import save_drawing

        save_drawing(drawn, out)
    typer.echo(str(out))


def _split(entry: str) -> tuple[str, float]:
    key, separator, text = entry.partition("=")
    try:
        return key.strip(), float(text)
    except ValueError as error:
        reason = "a number of metres is needed after =" if separator else "KEY=VALUE is needed"
        raise InputError(f"-p {entry!r}: {reason}, for example -p sleeve_length=0.25") from error
