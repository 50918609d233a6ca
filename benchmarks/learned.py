"""The commands that measure what is learned."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from benchmarks.options import OUT, Out, Rounds
from benchmarks.record import write

app = typer.Typer()


@app.command()
def inference(
    model: Annotated[Path | None, typer.Option(help="What `muslin train drape` wrote.")] = None,
    threads: Annotated[int, typer.Option(min=1, help="Of the networks.")] = 2,
    batch: Annotated[int, typer.Option(min=1, help="Drapes in a batch.")] = 8,
    rounds: Rounds = 3,
    out: Out = OUT,
) -> None:
    """Learned drapes a second, and how much faster than a simulated one."""
    from benchmarks.inference import measure_inference
    from benchmarks.spread import spread

    found = measure_inference(model, threads, batch, rounds)
    for name, seconds in ((1, found.one), (batch, found.batched)):
        typer.echo(f"{name} at a time: {spread([1.0 / value for value in seconds]).text(1)} drapes a second")
    typer.echo(f"simulated: {spread(found.simulated).text(1)} s, {found.times_faster.text(0)} times as long")
    write(out / "inference.json", asdict(found))


@app.command()
def maps(
    dataset: Annotated[Path, typer.Option(help="Sequences.")] = OUT / "thesis_animated",
    sizes: Annotated[str, typer.Option(help="Texels along a side.")] = "64,128,256",
    out: Out = OUT,
) -> None:
    """What displacement maps lose by themselves, design by design."""
    from benchmarks.maps import measure_maps

    found = measure_maps(dataset, [int(size) for size in sizes.split(",")], typer.echo)
    write(out / "maps.json", {"maps": [asdict(own) for own in found]})


@app.command()
def animation(
    model: Annotated[Path | None, typer.Option(help="What `muslin train wrinkles` wrote.")] = None,
    network: Annotated[str, typer.Option(help="Untrained, of this size, instead of the model's.")] = "",
    sampler: Annotated[str, typer.Option(help="See `muslin predict --draw`.")] = "",
    steps: Annotated[int, typer.Option(min=0)] = 0,
    device: Annotated[str, typer.Option(help="Of the network: cpu or cuda.")] = "cpu",
    threads: Annotated[int, typer.Option(min=1, help="Of the network.")] = 2,
    simulated: Annotated[bool, typer.Option(help="Turn by turn with the simulator.")] = True,
    rounds: Rounds = 3,
    out: Out = OUT,
) -> None:
    """Learned frames a second, and how much faster than simulated ones."""
    from benchmarks.animation import measure_animation
    from benchmarks.spread import spread
    from muslin.learn.wrinkles.process import Drawing

    found = measure_animation(model, network, Drawing(sampler, steps), device, threads, rounds, simulated)
    typer.echo(
        f"{found.drawing}: {spread(found.frames_a_second).text(1)} frames a second, of seconds a frame:"
    )
    for name in ("told", "maps", "positions", "push_out"):
        typer.echo(f"  {name} {spread(getattr(found, name)).text(4)}")
    if found.times_faster is not None:
        typer.echo(
            f"simulated: {spread(found.simulated).text(2)} s, {found.times_faster.text(0)} times as long"
        )
    write(out / "animation.json", asdict(found))
