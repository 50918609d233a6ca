"""`muslin simulate`: one scene to one sample."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from muslin.eval.cli.options import Device, Overrides, check_device, check_empty_folder, check_place


def simulate(
    scene: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="The scene.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="New folder for the sample.")],
    overrides: Overrides = None,
    device: Device = "cpu",
) -> None:
    """Simulate one scene and store it, with its certificate, as a dataset of one sample.

    What the result violates of the scene's [expect] table is listed, and the exit code is then 1. Where the
    simulation cannot go on, DIR.last_good.npz holds its last state without intersections.

    \b
    Examples:
      muslin simulate scenes/tshirt_walk.toml --out out/walk
      muslin simulate scenes/cloth_on_sphere.toml --out out/sphere --set garment.edge_length=0.03
      muslin simulate scenes/dress_dance.toml --out out/dance --device cuda:0
    """
    from muslin.sim.scene import load_scene

    check_empty_folder(out)
    loaded = load_scene(scene, overrides or [])
    name = check_device(device)
    check_place(out)

    from muslin.eval.cli.progress import progress_bar
    from muslin.sim.dataset.reader import write_dataset
    from muslin.sim.expect import check_expectations
    from muslin.sim.run import simulate as run
    from muslin.sim.solve.errors import SimulationError

    try:
        with progress_bar("simulate") as update:
            sample = run(loaded, name, lambda done, total: update(done, total, ""))
    except SimulationError as error:
        if error.state is None:
            raise
        kept = out.with_name(f"{out.name}.last_good.npz")
        with kept.open("wb") as stream:
            error.state.save(stream)
        raise SimulationError(f"{error}; the last good state is in {kept}", error.state) from error
    write_dataset(out, [sample], config=loaded.model_dump(mode="json"))
    found = sample.certificate
    typer.echo(
        f"{out}: {sample.kind} {sample.id}, {sample.num_frames} frames, "
        f"{sample.num_vertices} vertices, "
        f"{found.cloth_cloth_intersections} cloth-cloth and {found.cloth_body_intersections} cloth-body "
        f"intersections, {found.seconds:.1f} s"
    )
    violations = check_expectations(loaded, sample)
    for violation in violations:
        typer.echo(f"muslin: {scene}: {violation}", err=True)
    if violations:
        raise typer.Exit(1)
