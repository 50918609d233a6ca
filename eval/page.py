"""The pieces of an HTML page that needs nothing but itself."""

from __future__ import annotations

import base64
import io
import os
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from PIL import Image

from muslin.garments.errors import InputError

JPEG_QUALITY = 88


def render_page(template: str, **values: Any) -> str:
    """A template of this package with values; everything is escaped but what the template marks as safe."""
    environment = Environment(
        loader=PackageLoader("muslin.eval", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(version=version("muslin"), **values)


def picture_source(picture: np.ndarray) -> str:
    """A picture (height, width, 3) uint8 as the address that an <img> carries it in."""
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "JPEG", quality=JPEG_QUALITY, subsampling=0, optimize=True)
    return bytes_source(stream.getvalue(), "image/jpeg")


def bytes_source(data: bytes, mime: str) -> str:
    """Bytes as a data: address."""
    return f"data:{mime};base64,{base64.b64encode(data).decode()}"


def tile(label: str, value: str, mood: str = "") -> dict[str, str]:
    """A figure with its name; mood "good" or "bad" colours it."""
    return {"label": label, "value": value, "mood": mood}


def column(name: str, text: bool = False) -> dict[str, Any]:
    """A column of a table; text is aligned to the left."""
    return {"name": name, "text": text}


def number(value: float | None, digits: int = 3) -> str:
    """A number with so many significant digits, without exponent where it can be; a dash for None."""
    if value is None:
        return "–"
    if value != 0 and not 1e-4 <= abs(value) < 1e6:
        return f"{value:.{digits - 1}e}"
    decimals = max(0, digits - 1 - int(np.floor(np.log10(abs(value))))) if value else 0
    return f"{value:.{decimals}f}"


def duration(seconds: float) -> str:
    """Seconds for people."""
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes} min {rest:02} s"


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file whole or not at all. Raises InputError if its folder is missing or may not be written."""
    try:
        handle, partial = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place") from error
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        os.chmod(partial, 0o644)
        os.replace(partial, path)
    except OSError as error:
        Path(partial).unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place") from error
