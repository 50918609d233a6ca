"""Options of the benchmarks' commands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

OUT = Path("out/benchmarks")
Setting = Annotated[Path, typer.Option("--setting", help="File of the setting.")]
Out = Annotated[Path, typer.Option("--out", help="Folder for logs, frames and reports.")]
Core = Annotated[int, typer.Option("--core", help="The processor core to run on.")]
Rounds = Annotated[int, typer.Option("--rounds", min=1, help="Alternating repetitions.")]
