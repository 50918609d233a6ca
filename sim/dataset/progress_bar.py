"""A bar with the time left, for `generate` and `verify` in a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)


@contextmanager
def progress_bar(title: str, console: Console | None = None) -> Iterator[Callable[[float, int, str], None]]:
    """Show a bar on standard error; the block calls what it gets with (done, total, message)."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console or Console(stderr=True)) as bar:
        task = bar.add_task(title, total=None)

        def update(done: float, total: int, message: str) -> None:
            bar.update(task, completed=done, total=total or None)
            if message:
                bar.update(task, description=f"{title} {message}")

        yield update
