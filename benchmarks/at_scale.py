"""The commands that measure generation on several processes."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from benchmarks.options import OUT, Core, Out, Rounds
from benchmarks.record import machine, write

app = typer.Typer()


@app.command()
def workers(
    samples: Annotated[int, typer.Option(min=2, help="Drapes to make, each from the sewn start.")] = 4,
    edge_length: Annotated[float, typer.Option(help="Of the cloth, metres.")] = 0.0142,
    rounds: Rounds = 2,
    out: Out = OUT / "workers",
    cores: Annotated[tuple[int, int], typer.Option(help="Two processor cores.")] = (0, 1),
) -> None:
    """Samples an hour of `muslin generate` with one worker and with two."""
    from benchmarks.workers import measure_workers

    found = measure_workers(samples, edge_length, rounds, out, cores, typer.echo)
    typer.echo(f"two over one: {found.gain.text()}")
    write(out / "workers.json", asdict(found))


@app.command()
def engine(
    chains: Annotated[int, typer.Option(min=2, help="An even number, so that both have as many.")] = 4,
    chain: Annotated[int, typer.Option(min=1, help="Drapes in a chain.")] = 8,
    edge_length: Annotated[float, typer.Option(help="Of the cloth, metres.")] = 0.02,
    rounds: Rounds = 3,
    out: Out = OUT / "engine",
) -> None:
    """Wall time of `muslin generate --workers 2` over that of two bare processes."""
    from benchmarks.engine import measure_overhead

    found = measure_overhead(chains, chain, edge_length, rounds, out, typer.echo)
    typer.echo(f"engine over bare, {found.samples} drapes: {found.ratio.text(3)}")
    write(out / "engine.json", asdict(found))


@app.command()
def memory(
    seconds: Annotated[float, typer.Option(help="Of the walk.")] = 0.5, out: Out = OUT, core: Core = 0
) -> None:
    """Peak memory of making one certified sequence."""
    from benchmarks.workers import peak_memory

    peak = peak_memory(seconds, out, core)
    typer.echo(f"{peak / 1e9:.2f} GB")
    write(out / "memory.json", {"peak_bytes": peak})


@app.command()
def soak(
    samples: Annotated[int, typer.Option(min=9, help="Of the dataset.")] = 200,
    faults: Annotated[int, typer.Option(min=1, help="That befall its making, at least.")] = 50,
    seed: Annotated[int, typer.Option(help="Of their order and moments.")] = 0,
    out: Out = OUT / "soak",
) -> None:
    """Make a dataset in peace and amid faults; exit code 1 unless both are the same; write soak.md."""
    from benchmarks.soak import soak as endure

    found = endure(out, samples, faults, seed, typer.echo)
    write(out / "soak.json", asdict(found))
    (out / "soak.md").write_text(f"{machine()}\n\n{found.table()}", encoding="utf-8")
    typer.echo(found.table())
    if not found.passed:
        raise typer.Exit(1)
