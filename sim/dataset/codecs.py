"""How an array is laid out in zarr: chunks, shards and codecs.

Coordinates (float32, ..., xyz) are coded by pcodec, one chunk for each of x, y and z: it codes differences of
successive numbers, which are small from vertex to vertex of one coordinate. What lies on a grid of a power of
two (`muslin.sim.rounding`) has zeros at the end of its significands, which pcodec finds and leaves out. All
else goes through Blosc. Either is without loss, and every chunk carries its crc32c, so that a chunk can be
trusted without the others.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import zarr
from zarr.codecs import BloscCname, BloscCodec, BloscShuffle, Crc32cCodec
from zarr.codecs.numcodecs import PCodec
from zarr.errors import ZarrUserWarning

from muslin.sim.dataset.schema import ArraySpec, chunk_rows

_PCODEC_LEVEL = 8


def create_array(group: zarr.Group, name: str, array: np.ndarray, spec: ArraySpec) -> None:
    """Write an array into a group of a sample; the same bytes for the same values."""
    whole = tuple(max(1, n) for n in array.shape)
    rows = chunk_rows(array.shape, array.itemsize) if spec.by_rows else whole[0]
    chunk = (rows, *whole[1:])
    form: dict[str, Any]
    if spec.is_coordinates:
        chunk = (*chunk[:-1], 1)
        # A chunk that is missing reads as NaN, which no coordinate is.
        form = {"serializer": _pcodec(), "fill_value": np.nan, "compressors": [Crc32cCodec()]}
    else:
        blosc = BloscCodec(cname=BloscCname.zstd, clevel=5, shuffle=BloscShuffle.shuffle)
        form = {"compressors": [blosc, Crc32cCodec()]}
    with numcodecs_unremarked():
        group.create_array(
            name,
            data=array,
            chunks=chunk,
            shards=None if chunk == whole else (-(-whole[0] // rows) * rows, *whole[1:]),
            dimension_names=spec.dimensions,
            attributes={"meaning": spec.meaning},
            **form,
        )


@contextmanager
def numcodecs_unremarked() -> Iterator[None]:
    """Without zarr's remark that pcodec is no part of zarr's specification; `docs/data-format.md` says it."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Numcodecs codecs are not in", category=ZarrUserWarning)
        yield


def _pcodec() -> PCodec:
    with numcodecs_unremarked():
        return PCodec(level=_PCODEC_LEVEL)
