"""How long commands end when they are asked to: by Ctrl-C, or by the system's SIGTERM."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import typer


@contextmanager
def terminated_like_interrupted(note: str) -> Iterator[None]:
    """Within the block SIGTERM unwinds it as Ctrl-C does, so that workers end and what is half done is put
    back; then `note` is told, and the exit code is that of the signal (130 or 143)."""

    def unwind(number: int, frame: FrameType | None) -> None:
        raise SystemExit(128 + number)

    before = signal.signal(signal.SIGTERM, unwind)
    try:
        yield
    except KeyboardInterrupt:
        typer.echo(f"muslin: stopped; {note}", err=True)
        raise typer.Exit(128 + signal.SIGINT) from None
    except SystemExit:
        typer.echo(f"muslin: stopped; {note}", err=True)
        raise
    finally:
        signal.signal(signal.SIGTERM, before)
