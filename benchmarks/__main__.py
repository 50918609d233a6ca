"""`python -m benchmarks COMMAND`, from the root of the repository; see benchmarks/README.md."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from benchmarks import at_scale, learned
from benchmarks.options import OUT, Core, Out, Rounds, Setting
from benchmarks.record import machine, write

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
app.add_typer(at_scale.app)
app.add_typer(learned.app)


@app.command("setting")
def make(
    setting: Setting = OUT / "setting.npz",
    frames: Annotated[int, typer.Option(min=1, help="Frames of 1/60 s.")] = 120,
    edge_length: Annotated[float | None, typer.Option(help="Of the cloth, metres.")] = None,
) -> None:
    """Make what all contenders are given: dress, pose, settle, and walk the body."""
    from benchmarks.make_setting import make_setting

    made = make_setting(frames, edge_length)
    made.save(setting)
    typer.echo(
        f"{setting}: {len(made.positions)} cloth and {made.body.shape[1]} body vertices, {frames} frames"
    )


@app.command()
def compare(
    setting: Setting = OUT / "setting.npz",
    out: Out = OUT,
    peers: Annotated[Path, typer.Option(help="Folder of the peers' environments.")] = OUT / "peers",
    frames: Annotated[int | None, typer.Option(min=1, help="Only the first so many.")] = 60,
    rounds: Rounds = 3,
    core: Core = 0,
    only: Annotated[
        str, typer.Option(help="Contenders to run beside muslin.")
    ] = "blender,newton_style3d,newton_vbd",
) -> None:
    """Run muslin and every peer side by side; write compare.md and compare.json."""
    from benchmarks import compare as side_by_side
    from benchmarks.contenders.catalogue import named

    chosen = named(only)
    absent = {c.name: why for c in chosen if (why := c.missing(peers)) is not None}
    for name, why in absent.items():
        typer.echo(f"left out: {name}: {why}", err=True)
    present = [c for c in chosen if c.name not in absent]
    results = side_by_side.compare(setting, present, peers, out, frames, rounds, core, typer.echo)
    left_out = "".join(f"- **{name}** was left out: {why}\n" for name, why in absent.items())
    table = side_by_side.table(results) + left_out
    (out / "compare.md").write_text(f"{machine()}\n\n{table}", encoding="utf-8")
    write(out / "compare.json", {"results": side_by_side.as_json(results), "left_out": absent})
    typer.echo(table)


@app.command()
def remesh(
    out: Out = OUT / "remesh",
    peers: Annotated[Path, typer.Option(help="Folder of the peers' environments.")] = OUT / "peers",
    presets: Annotated[str, typer.Option(help="Presets of the tee.")] = "top,sweater,long_dress",
    sizes: Annotated[
        str, typer.Option(help="Vertices of source and target, about.")
    ] = "4000:1400,4000:3600,17246:3600,17246:17000",
    rounds: Rounds = 5,
    core: Core = 0,
    only: Annotated[str, typer.Option(help="Remeshers to run beside muslin.")] = "mmg,mmg_kept,botsch",
) -> None:
    """Remesh the same panels with muslin and every peer; write remesh.md and remesh.json."""
    from benchmarks import remesh as side_by_side
    from benchmarks.contenders.catalogue import named
    from benchmarks.remeshers.catalogue import REMESHERS

    chosen = named(only, REMESHERS)
    absent = {c.name: why for c in chosen if (why := c.missing(peers)) is not None}
    for name, why in absent.items():
        typer.echo(f"left out: {name}: {why}", err=True)
    present = [c for c in chosen if c.name not in absent]
    cases = side_by_side.cases_of(presets, sizes)
    results = side_by_side.compare(cases, present, peers, out, rounds, core, typer.echo)
    left_out = "".join(f"- **{name}** was left out: {why}\n" for name, why in absent.items())
    table = side_by_side.table(cases, results) + left_out
    (out / "remesh.md").write_text(f"{machine()}\n\n{table}", encoding="utf-8")
    write(out / "remesh.json", {"results": side_by_side.as_json(results), "left_out": absent})
    typer.echo(table)


@app.command()
def transfer(
    source: Annotated[Path, typer.Argument(help="A dataset of one sample, or the folder of a sample.")],
    out: Out = OUT / "transfer",
    sizes: Annotated[str, typer.Option(help="Vertices of the targets, about.")] = "1400,3600,17000",
    seeds: Annotated[int, typer.Option(min=1, help="Topologies of each size.")] = 3,
) -> None:
    """What a drape loses on its way to other topologies; write transfer.md and transfer.json."""
    from benchmarks.transfer import table, transfers

    given, found = transfers(source, [int(size) for size in sizes.split(",")], seeds, typer.echo)
    text = table(given, found)
    write(out / "transfer.json", [asdict(row) for row in found])
    (out / "transfer.md").write_text(text, encoding="utf-8")
    typer.echo(text)


@app.command()
def wrinkles(
    source: Annotated[Path, typer.Argument(help="A dataset; the last frame of its first sample is taken.")],
    out: Out = OUT / "wrinkles",
) -> None:
    """What metrics of shape say of a drape that is smoothed, and what they cost; write wrinkles.md."""
    from benchmarks.wrinkles import Drape, cost_table, table

    drape = Drape(source)
    text = f"{len(drape.truth)} vertices\n\n{table(drape.rows())}\n\n{cost_table(drape.costs())}\n"
    out.mkdir(parents=True, exist_ok=True)
    (out / "wrinkles.md").write_text(text, encoding="utf-8")
    typer.echo(text)


@app.command()
def standard(
    source: Annotated[Path, typer.Argument(help="A dataset; its first long enough sequence is taken.")],
    out: Out = OUT / "standard",
    frames: Annotated[int, typer.Option(help="Of the sequence.", min=4)] = 120,
    rounds: Rounds = 3,
) -> None:
    """What all standard metrics of `muslin eval` cost on a sequence; write standard.md."""
    from benchmarks.standard import costs

    text = costs(source, frames, rounds).table()
    out.mkdir(parents=True, exist_ok=True)
    (out / "standard.md").write_text(text, encoding="utf-8")
    typer.echo(text)


@app.command()
def storage(
    source: Annotated[Path, typer.Argument(help="A dataset.")],
    out: Out = OUT / "storage",
    reads: Annotated[int, typer.Option(help="Frames to read at random.", min=20)] = 400,
) -> None:
    """What positions cost on disk, coded in several ways, and reading one frame; write storage.md."""
    from benchmarks.storage import measure

    text = measure(source, reads).table()
    out.mkdir(parents=True, exist_ok=True)
    (out / "storage.md").write_text(f"{machine()}\n\n{text}\n", encoding="utf-8")
    typer.echo(text)


@app.command()
def surface(
    out: Out = OUT / "surface",
    peers: Annotated[Path, typer.Option(help="Folder of the peers' environments.")] = OUT / "peers",
    presets: Annotated[str, typer.Option(help="Presets of the tee.")] = "long_dress,sweater",
    vertices: Annotated[int, typer.Option(help="Of the garments, about.")] = 17246,
    drape: Annotated[Path | None, typer.Option(help="Folder of a simulated sample to add.")] = None,
    rounds: Rounds = 3,
    core: Core = 0,
) -> None:
    """Hausdorff and mean distance of garments beside PyMeshLab's; write surface.md and surface.json."""
    from benchmarks import surface as side_by_side
    from benchmarks.garment_pairs import drape_pair, wrinkled_pairs
    from benchmarks.surfaces.exchange import Pair

    if (why := side_by_side.PYMESHLAB.missing(peers)) is not None:
        raise typer.BadParameter(why)
    pairs: dict[str, Pair] = {}
    for preset in presets.split(","):
        pairs |= wrinkled_pairs(preset, vertices)
    if drape is not None:
        pairs["drape near"] = drape_pair(drape)
    results = side_by_side.compare(pairs, peers, out, rounds, core, typer.echo)
    text = side_by_side.table(results)
    (out / "surface.md").write_text(f"{machine()}\n\n{text}", encoding="utf-8")
    write(out / "surface.json", {name: asdict(result) for name, result in results.items()})
    typer.echo(text)


@app.command()
def agreement(
    out: Out = OUT / "agreement",
    peers: Annotated[Path, typer.Option(help="Folder of the peers' environments.")] = OUT / "peers",
    presets: Annotated[str, typer.Option(help="Presets of the tee.")] = "sweater",
    vertices: Annotated[int, typer.Option(help="Of the garments, about.")] = 17246,
) -> None:
    """Surface distances beside those of libigl, trimesh, PyMeshLab and others; write agreement.md."""
    from benchmarks import agreement as side_by_side
    from benchmarks.garment_pairs import wrinkled_pairs

    if (why := side_by_side.PEERS.missing(peers)) is not None:
        raise typer.BadParameter(why)
    pairs = side_by_side.closed_forms()
    for preset in presets.split(","):
        pairs |= wrinkled_pairs(preset, vertices)
    rows = side_by_side.compare(pairs, peers, out, typer.echo)
    text = side_by_side.table(rows)
    (out / "agreement.md").write_text(text, encoding="utf-8")
    write(out / "agreement.json", [asdict(row) for row in rows])
    typer.echo(text)


@app.command()
def reach(
    out: Out = OUT / "reach",
    presets: Annotated[str, typer.Option(help="Presets of the tee.")] = (
        "top,tshirt,sweater,short_dress,long_dress"
    ),
    vertices: Annotated[str, typer.Option(help="Of the targets, about.")] = "200,700,1400,3600",
    distortions: Annotated[str, typer.Option(help="Largest ones to ask for.")] = "2.5,2.2,2.1,2.0,1.9",
    seeds: Annotated[int, typer.Option(min=1, help="Draws of each preset.")] = 6,
) -> None:
    """Which largest distortion triangulations reach; write reach.json."""
    from benchmarks.reach import reach as reached

    sizes, asked = [int(n) for n in vertices.split(",")], [float(d) for d in distortions.split(",")]
    found = reached(presets.split(","), sizes, asked, seeds, typer.echo)
    write(out / "reach.json", [asdict(row) for row in found])


@app.command()
def adaptive(out: Out = OUT / "adaptive", rounds: Rounds = 3) -> None:
    """Error of drapes for their vertices and seconds, uniform and remeshed; write adaptive.md and .png."""
    from benchmarks.adaptive import measure, plot, table

    drapes = measure(rounds, typer.echo)
    out.mkdir(parents=True, exist_ok=True)
    text = table(drapes)
    write(out / "adaptive.json", [asdict(drape) for drape in drapes])
    (out / "adaptive.md").write_text(text, encoding="utf-8")
    plot(drapes, out / "adaptive.png")
    typer.echo(text)


@app.command()
def drape(
    out: Out = OUT,
    neighbours: Annotated[int, typer.Option(min=0, help="Drapes that start from the one before.")] = 4,
    step: Annotated[float, typer.Option(help="Change of beta_1 from one to the next.")] = 0.03,
    edge_length: Annotated[float | None, typer.Option(help="Of the cloth, metres.")] = None,
    core: Core = 0,
) -> None:
    """CPU seconds of a drape from the sewn start, and of neighbours warm-started from it."""
    from benchmarks.drapes import drape_costs
    from benchmarks.isolated import held_to

    with held_to({core}):
        costs = drape_costs(neighbours, step, edge_length)
    for cost in costs:
        residual = "unknown" if cost.residual is None else f"{cost.residual:.1e}"
        typer.echo(
            f"beta {cost.beta:.2f}: {cost.cpu_seconds:.2f} CPU s, {cost.steps} steps, "
            f"at rest {cost.at_rest}, residual {residual}, {cost.intersections} intersections"
        )
    write(out / "drape.json", [asdict(cost) for cost in costs])


@app.command()
def growth(
    sizes: Annotated[str, typer.Option(help="Cloth vertices, about.")] = "1000,2000,4000,8000,16000",
    frames: Annotated[int, typer.Option(min=1, help="Frames of 1/60 s.")] = 30,
    out: Out = OUT / "growth",
    core: Core = 0,
) -> None:
    """Cost against the number of vertices, and the exponent of the power law through it."""
    from benchmarks.growth import measure_growth

    found = measure_growth([int(size) for size in sizes.split(",")], frames, out, core, typer.echo)
    typer.echo(f"exponent {found.exponent:.2f}")
    write(out / "growth.json", asdict(found))


@app.command()
def rest(
    presets: Annotated[str, typer.Option(help="Presets of the tee.")] = "tshirt,sweater,long_dress",
    edge_length: Annotated[float, typer.Option(help="Of the cloth, metres.")] = 0.02,
    out: Out = OUT,
    core: Core = 0,
) -> None:
    """How far drapes at the stop rule are from rest, and from those that came another way."""
    from benchmarks.isolated import held_to
    from benchmarks.rest import rest_figures

    found = []
    with held_to({core}):
        for preset in presets.split(","):
            figures = rest_figures(preset, edge_length)
            found.append(asdict(figures))
            rule, detour = figures.rule, figures.detour
            typer.echo(
                f"{preset}, {figures.vertices} vertices: mean {rule[0]:.2f}, p99 {rule[1]:.2f} mm from rest; "
                f"by a detour {detour[0]:.2f}, {detour[1]:.2f} mm"
            )
    write(out / "rest.json", found)


@app.command()
def steps(
    setting: Setting = OUT / "setting.npz",
    warm_up: Annotated[int, typer.Option(min=0, help="Frames before the first that is measured.")] = 24,
    count: Annotated[int, typer.Option(min=1, help="Frames that are measured.")] = 8,
    out: Out = OUT,
    core: Core = 0,
) -> None:
    """How far steps of few Newton iterations are from solved ones, and what they cost."""
    from benchmarks.isolated import held_to
    from benchmarks.setting import load_setting
    from benchmarks.steps import step_figures

    choices = [(4, 0.1), (4, 0.01), (4, 0.001), (3, 0.01), (3, 0.001)]
    with held_to({core}):
        found = step_figures(load_setting(setting), choices, warm_up, count)
    for row in found:
        typer.echo(
            f"{row.max_iterations} iterations, linear_tolerance {row.linear_tolerance}: "
            f"mean {row.mean:.2f}, p99 {row.p99:.2f} mm, {row.cpu_ms:.0f} CPU ms"
        )
    write(out / "steps.json", [asdict(row) for row in found])


if __name__ == "__main__":
    app()
