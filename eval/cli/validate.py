"""`muslin validate`: the simulator against known solutions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from muslin.eval.cli.options import check_place, make_parent


def validate(
    json_file: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="Write the rows there, replacing the last."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Write validation.html and its plots as PNG there."),
    ] = None,
    small: Annotated[
        bool, typer.Option("--small", help="Coarse meshes and few values: under a minute.")
    ] = False,
    case: Annotated[
        str | None, typer.Option("--case", metavar="NAME", help="Only this case, e.g. cantilever.")
    ] = None,
    scenes: Annotated[
        Path, typer.Option("--scenes", metavar="DIR", help="Folder of the cases' files.")
    ] = Path("scenes/validation"),
) -> None:
    """Run the validation suite: known solutions, conservation, convergence, freedom from intersections.

    The cases' parameters and bars are the files of scenes/validation; docs/validation.md says what each
    computes. Every row is printed; exit code 1 if one fails.

    \b
    Examples:
      muslin validate --out out/validation --json out/validation/rows.json
      muslin validate --small
      muslin validate --case cantilever --out out/cantilever
    """
    from muslin.eval.validate.load import load_cases

    cases = load_cases(scenes, small, case)
    if json_file is not None:
        make_parent(json_file)
    if out is not None:
        check_place(out)
        out.mkdir(parents=True, exist_ok=True)

    from muslin.eval.cli.progress import progress_bar
    from muslin.eval.page import duration, number
    from muslin.eval.validate.report import write_report
    from muslin.eval.validate.runner import rows_of, run_cases, write_json

    findings = []
    with progress_bar("validate") as update:
        for finding in run_cases(cases, update):
            findings.append(finding)
            for row in rows_of(finding):
                verdict = "pass" if row.passed else "FAIL"
                unit = "" if row.unit == "1" else f" {row.unit}"
                figures = f"{number(row.measured, 5)}{unit}, known {number(row.expected, 5)}"
                typer.echo(f"{verdict}  {row.name}: {figures}")
            if finding.error:
                typer.echo(f"muslin: {finding.name}: {finding.error}", err=True)
    if json_file is not None:
        write_json(json_file, findings, small)
    if out is not None:
        typer.echo(str(write_report(out, findings, small)))
    passed = sum(finding.passed for finding in findings)
    seconds = duration(sum(finding.seconds for finding in findings))
    typer.echo(f"{passed} of {len(findings)} cases pass, {seconds}")
    if passed < len(findings):
        raise typer.Exit(1)
