"""`muslin info`: what a dataset holds."""

from __future__ import annotations

import json
import time
from datetime import timedelta
from typing import Annotated, Any

import typer

from muslin.eval.cli.options import DatasetPlace


def info(
    dataset: DatasetPlace,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    samples: Annotated[bool, typer.Option("--samples", help="List the samples too.")] = False,
) -> None:
    """Tell what a dataset holds, and how far it is: counts, splits, worst certificate, size, time.

    \b
    Examples:
      muslin info out/demo
      muslin info out/demo --samples
      muslin info out/demo --json
    """
    from muslin.sim.dataset.info import info as summarise
    from muslin.sim.dataset.reader import open_dataset

    facts = summarise(dataset).to_dict()
    rows = open_dataset(dataset).rows if samples else ()
    if as_json:
        typer.echo(json.dumps(facts | ({"rows": list(rows)} if samples else {}), indent=1))
        return
    run = facts.pop("run")
    for key, value in facts.items():
        typer.echo(f"{key.replace('_', ' '):18} {_text(value)}")
    if run is not None:
        typer.echo(f"{'last run':18} {_run(run, time.time())}")
    for row in rows:
        about = " ".join(str(row[key]) for key in ("design", "shape", "sequence", "fabric") if row[key])
        typer.echo(f"  {row['id']}  {row['kind']:8} {row['frames']:5} frames  {about}")


def _run(run: dict[str, Any], now: float) -> str:
    """A `Status` in one line."""
    parts = [run["stage"], f"{run['done']:.1f} of {run['total']} samples"]
    if run["failed"]:
        parts.append(f"{run['failed']} failed")
    if run["rate"]:
        parts.append(f"{run['rate']:.4g} samples/h")
    if run["stage"] not in ("finished", "stopped"):
        if run["left_s"]:
            parts.append(f"{timedelta(seconds=round(run['left_s']))} left")
        parts.append(f"heard of {timedelta(seconds=max(0, round(now - run['updated'])))} ago")
        if run["dashboard"]:
            parts.append(run["dashboard"])
    return ", ".join(parts)


def _text(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {_text(entry)}" for key, entry in value.items()) or "none"
    if isinstance(value, (tuple, list)):
        return " to ".join(map(_text, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)
