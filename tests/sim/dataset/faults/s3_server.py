"""A server that speaks S3, as a process; and what stands between it and its users when the net is bad."""

from __future__ import annotations

import asyncio
import contextlib
import random
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.faults import wait_until

S3_VARIABLES = {
    "AWS_ACCESS_KEY_ID": "test",
    "AWS_SECRET_ACCESS_KEY": "test",
    "AWS_DEFAULT_REGION": "us-east-1",
    "AWS_EC2_METADATA_DISABLED": "true",
}
_FULL = b"HTTP/1.1 503 Slow Down\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
_BROKEN = b"HTTP/1.1 500 Internal Server Error\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"


@contextmanager
def s3_server(folder: Path) -> Iterator[str]:
    """moto's server for as long as the block runs; its address."""
    port = _free_port()
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    with (
        (folder / "server.log").open("wb") as log,
        subprocess.Popen(command, stdout=log, stderr=log) as server,
    ):
        try:
            wait_until(lambda: _listens(port), "the server of S3")
            yield f"http://127.0.0.1:{port}"
        finally:
            server.kill()


class BadNet:
    """Listens in the place of a server and hands on what it hears, but not always, by a seed.

    A connection is answered with an error, or waits, or breaks after some thousand bytes: in the middle of a
    request, or of an answer to one that the server has done.
    """

    def __init__(self, address: str, seed: int) -> None:
        self.host, port = address.removeprefix("http://").split(":")
        self.port, self.draw = int(port), random.Random(seed)
        self.faults = 0

    @contextmanager
    def open(self) -> Iterator[str]:
        """Its own address."""
        loop, started = asyncio.new_event_loop(), threading.Event()
        port: list[int] = []

        async def serve() -> None:
            server = await asyncio.start_server(self._connected, "127.0.0.1", 0)
            port.append(server.sockets[0].getsockname()[1])
            started.set()

        thread = threading.Thread(target=lambda: (loop.run_until_complete(serve()), loop.run_forever()))
        thread.start()
        started.wait()
        try:
            yield f"http://127.0.0.1:{port[0]}"
        finally:
            loop.call_soon_threadsafe(loop.stop)
            thread.join()

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        fate = self.draw.random()
        with contextlib.suppress(OSError, asyncio.IncompleteReadError):
            if fate < 0.1:
                self.faults += 1
                await reader.readuntil(b"\r\n\r\n")
                writer.write(_FULL if fate < 0.05 else _BROKEN)
                await writer.drain()
            else:
                if fate < 0.2:
                    self.faults += 1
                    await asyncio.sleep(0.3)
                far_reader, far_writer = await asyncio.open_connection(self.host, self.port)
                left = [self.draw.randrange(4_000, 100_000)]
                ways = (_pass(reader, far_writer, left), _pass(far_reader, writer, left))
                tasks = [asyncio.ensure_future(way) for way in ways]
                await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
                for task in tasks:
                    task.cancel()
                self.faults += left[0] <= 0
                far_writer.close()
        writer.close()


async def _pass(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, left: list[int]) -> None:
    """Hand bytes on until none come, or no more are `left` for this connection."""
    with contextlib.suppress(OSError):
        while left[0] > 0 and (data := await reader.read(min(4096, left[0]))):
            left[0] -= len(data)
            writer.write(data)
            await writer.drain()


def _free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def _listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
