"""A triangulation of a garment with all that it takes to go from maps to positions and back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256

import numpy as np
from numpy.typing import NDArray

from muslin.garments.correspondence import correspondence
from muslin.garments.mesh import GarmentMesh
from muslin.garments.template import template
from muslin.learn.drape.mean import MeanDrape
from muslin.learn.wrinkles.codec import MapCodec
from muslin.learn.wrinkles.fields import motion_fields
from muslin.learn.wrinkles.layout import map_layout
from muslin.learn.wrinkles.mirror import FLIP, mirrored_uv
from muslin.learn.wrinkles.skin import GarmentSkin, garment_skin
from muslin.learn.wrinkles.world import SequenceWorld
from muslin.sim.body.model import BodyModel
from muslin.sim.dataset.sample import BodyTrack


@dataclass(frozen=True, eq=False)
class UnposedGarment:
    """x = pose(T + D m): template T (V, 3) of the design, on the mean body in T-pose; displacement D m of the
    map m; `pose` of the skin. places: maps of the size of the network's places, for `fields`."""

    mesh: GarmentMesh
    template: NDArray[np.float64]
    skin: GarmentSkin
    codec: MapCodec
    places: MapCodec

    def maps(self, positions: NDArray[np.floating], track: BodyTrack) -> NDArray[np.float32]:
        """m (T, N, 3), metres, of positions x (T, V, 3) on a moving body.

        Raises InputError for poses that cannot be taken back.
        """
        apart = self.skin.unposed(positions, track.beta, track.poses, track.translations) - self.template
        return self.codec.encode(apart).astype(np.float32)

    def mirrored_maps(self, positions: NDArray[np.floating], track: BodyTrack) -> NDArray[np.float32]:
        """m (T, N, 3) of the mirror image of positions x, on that of the moving body (see `mirrored_track`).

        Body and template are as good as symmetric, or else it is of a body slightly another.
        """
        unposed = self.skin.unposed(positions, track.beta, track.poses, track.translations)
        codec, template_map = self._mirror
        return (codec.encode(FLIP * unposed) - template_map).astype(np.float32)

    @cached_property
    def _mirror(self) -> tuple[MapCodec, NDArray[np.float64]]:
        """The codec of the mirror image of the mesh, and (N, 3) the template on this side."""
        reflected = MapCodec(self.codec.layout, replace(self.mesh, uv=mirrored_uv(self.mesh)))
        return reflected, self.codec.encode(self.template)

    def fields(self, track: BodyTrack, fps: float) -> NDArray[np.float32]:
        """(T, FIELDS, S, S) `motion_fields` on a moving body, as images of the size of `places`."""
        told = motion_fields(self.skin, self.template, track, fps)
        return self.places.layout.image(self.places.encode(told))

    def positions(self, maps: NDArray[np.floating], track: BodyTrack) -> NDArray[np.float32]:
        """x (T, V, 3), metres, of maps m (T, N, 3)."""
        moved = self.template + self.codec.decode(maps)
        return self.skin.posed(moved, track.beta, track.poses, track.translations).astype(np.float32)


def unposed_garment(
    mesh: GarmentMesh, network: MeanDrape, body: BodyModel, size: int, places: int
) -> UnposedGarment:
    """With the template that the network (G_design) says for the design of a mesh, and maps of two sizes.

    Skin data is that of the network's own triangulation, whatever the mesh: all triangulations of a design
    follow the body alike. Raises InputError for a garment that the network does not know.
    """
    codec, coarse = (MapCodec(map_layout(network.design, texels), mesh) for texels in (size, places))
    own = template(network.design, mesh.parameters, network.resolution)
    positions = network.template_of(mesh.parameters)
    place = correspondence(own, mesh)
    skin = garment_skin(own, positions, body).carried(place)
    return UnposedGarment(mesh, place.carry(positions), skin, codec, coarse)


class GarmentCache:
    """Unposed garments, each made once a design and triangulation."""

    def __init__(self, network: MeanDrape, world: SequenceWorld, size: int, places: int) -> None:
        self.network, self.world, self.body = network, world, world.load_body()
        self.size, self.places = size, places
        self._known: dict[str, UnposedGarment] = {}

    def of(self, mesh: GarmentMesh) -> UnposedGarment:
        key = sha256(mesh.panel_vertices.tobytes() + mesh.panel_faces.tobytes()).hexdigest()
        if key not in self._known:
            self._known[key] = unposed_garment(mesh, self.network, self.body, self.size, self.places)
        return self._known[key]
