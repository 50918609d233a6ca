"""A lock in a store that knows no locks: a file that its holder keeps changing.

A holder that died stops changing it. Whoever comes looks at it for a while by a clock of its own that only
goes forward, so that neither clocks that disagree nor clocks that jump make a difference.
"""

from __future__ import annotations

import json
import os
import socket
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from muslin.garments.errors import InputError
from muslin.sim.dataset.root import Root

BEAT_S = 5.0
"""Between two changes."""
DEAD_S = 30.0
"""Without a change after which a holder is taken for dead."""


class LeaseLostError(InputError):
    """Another process took over, because this one could not reach the store for too long."""


@contextmanager
def hold_lease(root: Root, name: str, beat: float = BEAT_S, dead: float = DEAD_S) -> Iterator[None]:
    """Hold the file `name` of a root while the block runs.

    Raises InputError if another process holds it, within `dead` seconds; LeaseLostError at the end of the
    block if it was lost on the way: samples are committed so that even then none is lost or wrong.
    """
    lease = _Lease(root, name)
    lease.take(beat, dead)
    stop = threading.Event()
    keeper = threading.Thread(target=lease.keep, args=(stop, beat), daemon=True)
    keeper.start()
    try:
        yield
    finally:
        stop.set()
        keeper.join()
        lease.give_back()
    if lease.lost:
        raise LeaseLostError(
            f"{root}: another process took over the dataset, for this one did not reach the store for "
            f"{dead:.0f} s; wait for its end and run again: what is there is kept"
        )


class _Lease:
    def __init__(self, root: Root, name: str) -> None:
        self.root, self.name = root, name
        self.token = uuid.uuid4().hex
        self.beats = 0
        self.lost = False

    def take(self, beat: float, dead: float) -> None:
        # It may be created already, where only the store's answer was lost.
        if self.root.create(self.name, self._content()) or self._mine():
            return
        before, since = self._seen(), time.monotonic()
        while time.monotonic() - since < dead:
            time.sleep(min(beat / 2.0, dead / 4.0))
            now = self._seen()
            if now is None and self.root.create(self.name, self._content()):
                return
            if now is not None and now != before:
                raise InputError(
                    f"{self.root}: another process ({now.get('holder', 'unknown')}) is writing here; "
                    "wait for its end, or write elsewhere"
                )
        self.root.write(self.name, self._content())
        time.sleep(beat / 2.0)  # of several who find it dead at once, the last to write has it
        if not self._mine():
            raise InputError(f"{self.root}: another process is writing here; wait for its end")

    def keep(self, stop: threading.Event, beat: float) -> None:
        while not stop.wait(beat) and not self.lost:
            try:
                if not self._mine():
                    self.lost = True
                    return
                self.beats += 1
                self.root.write(self.name, self._content())
            except OSError:
                continue  # the next beat tries again; if it takes too long, another holds the lease by then

    def give_back(self) -> None:
        try:
            if not self.lost and self._mine():
                self.root.remove(self.name)
        except OSError:
            return  # nobody changes it any more, so it is dead soon

    def _mine(self) -> bool:
        seen = self._seen()
        return seen is not None and seen.get("token") == self.token

    def _seen(self) -> dict[str, Any] | None:
        try:
            return dict(json.loads(self.root.read(self.name)))
        except FileNotFoundError:
            return None

    def _content(self) -> bytes:
        holder = f"process {os.getpid()} of {socket.gethostname()}"
        return json.dumps({"holder": holder, "token": self.token, "beats": self.beats}).encode()
