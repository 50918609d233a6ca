"""The trained pipeline: from design, shape and fabric to a drape, on any triangulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.learn.drape.body_surface import BodySurface
from muslin.learn.drape.fabric import fabric_figures, file_stem
from muslin.learn.drape.garment import PreparedGarment, prepare_garment
from muslin.learn.drape.mean import MeanDrape, mean_drape_of
from muslin.learn.drape.network import DrapeNetwork, NetworkConfig
from muslin.learn.drape.world import World, shape_tensor
from muslin.learn.graph.batch import batch_pyramids
from muslin.learn.graph.pyramid import PyramidCache
from muslin.learn.training.checkpoint import read_tensors, write_tensors
from muslin.sim.dataset import durable

MEAN, SMOOTH, FINE, GRAPHS = "mean.safetensors", "smooth.safetensors", "fine", "graphs"
ANY_FABRIC = "any"
"""Name of the R_fine that sees the fabric."""


@dataclass(eq=False)
class DrapePipeline:
    """R_mean, R_smooth and R_fine.

        x = x_smooth + R_fine(x_smooth, w, beta[, fabric]),   x_smooth = x_0 + R_smooth(x_0, w, beta)

    skinned   whether x_0 is x_mean carried along by the skin to the shape beta, or x_mean, as in the thesis
    fine      {fabric: network}, or {ANY_FABRIC: one that sees the fabric}; {}: drapes stay smooth
    """

    world: World
    mean: MeanDrape
    smooth: DrapeNetwork
    fine: dict[str, DrapeNetwork] = field(default_factory=dict)
    skinned: bool = True
    cache: PyramidCache = field(default_factory=PyramidCache)

    def __post_init__(self) -> None:
        self.body = BodySurface(self.world)

    def prepare(self, mesh: GarmentMesh) -> PreparedGarment:
        """Once a triangulation, whatever the shapes and fabrics. Raises InputError for an unknown design."""
        return prepare_garment(mesh, self.mean, self.body, self.cache)

    def start(self, garment: PreparedGarment, beta: Any) -> Tensor:
        """x_0 (V, 3), metres."""
        return garment.skinned(beta) if self.skinned else garment.mean

    @torch.no_grad()
    def smooth_drapes(self, garments: Sequence[PreparedGarment], betas: Sequence[Any]) -> list[Tensor]:
        """Smooth part (V, 3) of the drape of each garment on the body of the shape beside it, metres."""
        return self._moved(self.smooth, garments, list(map(self.start, garments, betas)), betas, None)

    @torch.no_grad()
    def drapes(
        self, garments: Sequence[PreparedGarment], betas: Sequence[Any], fabrics: Sequence[str]
    ) -> list[Tensor]:
        """Drapes (V, 3) of the garments in these fabrics, metres.

        Raises InputError for a fabric that no network knows.
        """
        smooth = self.smooth_drapes(garments, betas)
        if not self.fine:
            return smooth
        if ANY_FABRIC in self.fine:
            return self._moved(self.fine[ANY_FABRIC], garments, smooth, betas, fabric_figures(fabrics))
        found: list[Tensor] = list(smooth)
        for fabric in dict.fromkeys(fabrics):
            if fabric not in self.fine:
                raise InputError(f"fabric {fabric!r}: there are networks for {', '.join(self.fine)}")
            places = [k for k, name in enumerate(fabrics) if name == fabric]
            own = [garments[k] for k in places], [smooth[k] for k in places], [betas[k] for k in places]
            for k, drape in zip(places, self._moved(self.fine[fabric], *own, None), strict=True):
                found[k] = drape
        return found

    def _moved(
        self,
        network: DrapeNetwork,
        garments: Sequence[PreparedGarment],
        starts: Sequence[Tensor],
        betas: Sequence[Any],
        fabric: Tensor | None,
    ) -> list[Tensor]:
        network.eval()
        start = torch.cat(list(starts))
        shapes = torch.stack([shape_tensor(beta, network.config.betas) for beta in betas])
        weights = torch.cat([garment.weights for garment in garments])
        graphs = batch_pyramids([garment.pyramid for garment in garments])
        moved = start + network(start, weights, shapes, graphs, fabric)
        return list(moved.split([len(positions) for positions in starts]))

    def save(self, folder: Path, dtype: torch.dtype = torch.float32) -> None:
        """One file of tensors a network; dtype: of what is stored, such as torch.bfloat16."""
        told = {
            **self.mean.described(),
            "world": asdict(self.world),
            "skinned": self.skinned,
        }
        durable.make_folder(folder / FINE)
        write_tensors(folder / MEAN, self.mean.state_dict(), told)
        _write(folder / SMOOTH, self.smooth, dtype)
        for fabric, network in self.fine.items():
            _write(folder / FINE / f"{file_stem(fabric)}.safetensors", network, dtype, fabric)


def load_pipeline(folder: Path, cache: Path | None = None) -> DrapePipeline:
    """The pipeline of a folder; cache: folder for the operators of meshes.

    Raises InputError if a file is missing or damaged, and if the body is not the one it was trained on.
    """
    tensors, told = _read(folder / MEAN)
    mean = mean_drape_of(told, tensors)
    world = World.of(told["world"])
    _, smooth = _network(folder / SMOOTH)
    fine = dict(_network(file) for file in sorted((folder / FINE).glob("*.safetensors")))
    pyramids = PyramidCache(cache, len(smooth.config.channels))
    return DrapePipeline(world, mean, smooth, fine, told["skinned"], pyramids)


def _write(file: Path, network: DrapeNetwork, dtype: torch.dtype, fabric: str = "") -> None:
    # Scalars (of normalisation) are kept as they are: they are few.
    tensors = {key: value.to(dtype) if value.ndim else value for key, value in network.state_dict().items()}
    write_tensors(file, tensors, {"config": asdict(network.config), "fabric": fabric})


def _network(file: Path) -> tuple[str, DrapeNetwork]:
    """A network, and the fabric that it is for."""
    tensors, told = _read(file)
    network = DrapeNetwork(NetworkConfig(**told["config"]))
    network.load_state_dict({name: value.float() for name, value in tensors.items()})
    return told["fabric"], network.eval()


def _read(file: Path) -> tuple[dict[str, Tensor], dict[str, Any]]:
    if not file.exists():
        raise InputError(
            f"{file}: is missing; give the folder of a trained model, or train one: `muslin train`"
        )
    return read_tensors(file)
