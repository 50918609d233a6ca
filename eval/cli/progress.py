"""A progress bar in a terminal, and silence in a file or pipe: there, errors stay the only line."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager


@contextmanager
def progress_bar(title: str) -> Iterator[Callable[[float, int, str], None]]:
    """Calls with (done, total, message) show a bar with the time left; it appears with the first of them."""
    shown: list[Callable[[float, int, str], None]] = []
    with ExitStack() as stack:

        def update(done: float, total: int, message: str = "") -> None:
            if not sys.stderr.isatty():
                return
            if not shown:
                from muslin.sim.dataset import progress_bar as terminal

                shown.append(stack.enter_context(terminal.progress_bar(title)))
            shown[0](done, total, message)

        yield update
