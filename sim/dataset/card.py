"""The card of a dataset: README.md in its folder, for who finds the folder and knows nothing of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import astuple
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from muslin.sim.dataset.header import Header, digest
from muslin.sim.dataset.jobs import Job
from muslin.sim.dataset.licences import sources_of
from muslin.sim.dataset.root import Root
from muslin.sim.dataset.schema import CARD, PICTURE

MARK = "<!-- Dataset card, written anew by `muslin generate`. Take this line away to keep changes. -->"
MOST_NAMES = 12
"""Longer lists of names are cut."""
BINS = 12

Table = Sequence[Sequence[object]]


def write_card(root: Root, header: Header, rows: Sequence[Mapping[str, Any]], jobs: Iterable[Job]) -> bool:
    """Write the card of a dataset. False, and nothing written, if README.md is there and not a card."""
    try:
        if not root.read(CARD).startswith(MARK.encode()):
            return False
    except FileNotFoundError:
        pass
    except IsADirectoryError:
        return False
    root.write(CARD, card_text(header, rows, jobs, root.exists(PICTURE)).encode())
    return True


def card_text(
    header: Header, rows: Sequence[Mapping[str, Any]], jobs: Iterable[Job], picture: bool = False
) -> str:
    """The card, Markdown: a function of what the dataset holds alone, so the same dataset has the same card.

    rows      the index
    jobs      the plan of the dataset; of those that are in `rows` it tells the parameters
    picture   whether there is one beside it

    What differs from run to run or from place to place is left out: dates, computing time, bytes on disk, and
    the folders of files that the config names by absolute paths.
    """
    made = {row["id"] for row in rows}
    scenes = {job.id: job.scene for job in jobs if job.id in made}
    parts = [
        f"{MARK}\n# {header.config.get('name', 'dataset')}",
        *([f"![Some of the samples]({PICTURE})"] if picture else []),
        _what(header, rows),
        "## Samples\n\n" + _counts(rows),
        "## Parameters\n\n" + _parameters([*scenes.values()]),
        "## Certificates\n\n" + _certificates(rows),
        "## Sources\n\n" + _sources(rows, scenes),
        "## Loading\n\n" + _loading(rows),
        "## How it was made\n\n" + _making(header, rows),
    ]
    return "\n\n".join(parts) + "\n"


def _what(header: Header, rows: Sequence[Mapping[str, Any]]) -> str:
    kinds = Counter(row["kind"] for row in rows)
    lines = [
        "Simulated garments on bodies, made by muslin. Units are SI, y is up, triangles "
        "are counter-clockwise seen from outside.",
        "",
        f"- {len(rows)} samples: {kinds['drape']} drapes (one frame at rest), "
        f"{kinds['sequence']} sequence{'' if kinds['sequence'] == 1 else 's'}",
        f"- {sum(row['frames'] for row in rows)} frames"
        + _range("; frames in a sequence", [row["frames"] for row in rows if row["kind"] == "sequence"])
        + _range("; frames a second", [row["fps"] for row in rows if row["fps"] is not None]),
    ]
    if rows:
        lines.append("- cloth vertices" + _range("", [row["vertices"] for row in rows]))
    if remeshed := sum(row["topologies"] > 1 for row in rows):
        lines.append(f"- in {remeshed} sequences the mesh changes from frame to frame")
    if missing := len(header.splits.keys() - {row["id"] for row in rows}):
        lines.append(f"- **not complete**: {missing} planned samples are not made (yet)")
    return "\n".join(lines)


def _range(label: str, values: Sequence[float]) -> str:
    if not values:
        return ""
    low, high = min(values), max(values)
    return f"{label} {low:g}" if low == high else f"{label} {low:g} to {high:g}"


def _counts(rows: Sequence[Mapping[str, Any]]) -> str:
    lines: list[list[object]] = []
    for key in ("split", "design", "shape", "sequence", "topology", "fabric"):
        groups: dict[str, list[Mapping[str, Any]]] = {}
        for row in rows:
            if row[key]:
                groups.setdefault(_file_name(row[key]), []).append(row)
        names = list(groups)
        shown = names if len(names) <= MOST_NAMES else names[: MOST_NAMES - 1]
        entries = [(name, groups[name]) for name in shown]
        if rest := names[len(shown) :]:
            others = [row for name in rest for row in groups[name]]
            entries.append((f"{len(rest)} others, to {rest[-1]}", others))
        for place, (name, group) in enumerate(entries):
            lines.append(["" if place else key, name, len(group), sum(row["frames"] for row in group)])
    return _table(("", "name", "samples", "frames"), lines) if lines else "None yet."


def _parameters(scenes: Sequence[Mapping[str, Any]]) -> str:
    columns: dict[str, list[float]] = {}
    betas = [scene["body"].get("beta") or [] for scene in scenes if scene.get("body")]
    for k in range(max(map(len, betas), default=0)):
        # Coefficients that are not given are zero.
        columns[f"body.beta[{k}]"] = [beta[k] if k < len(beta) else 0.0 for beta in betas]
    for scene in scenes:
        garment = scene.get("garment") or {}
        for key, value in (garment.get("parameters") or {}).items():
            columns.setdefault(f"{garment.get('design', 'garment')}.{key}", []).append(value)
    constant = {name: column[0] for name, column in columns.items() if min(column) == max(column)}
    varied = [
        [f"`{name}`", _number(min(column)), _number(np.median(column)), _number(max(column)), _bars(column)]
        for name, column in columns.items()
        if name not in constant
    ]
    same = [f"`{name}` {_number(value)}" for name, value in constant.items()]
    text = "Each sample counts once. Lengths are in metres, body shape (`beta`) in standard deviations.\n\n"
    if varied:
        text += _table(("", "least", "median", "most", "samples from least to most"), varied)
    else:
        text += "No body shape or garment parameter varies."
    return text + (f"\n\nThe same in all samples: {', '.join(same)}." if same else "")


def _bars(values: Sequence[float]) -> str:
    counts, _ = np.histogram(values, bins=BINS)
    # Ceiling: one sample is seen, however many the fullest bin holds.
    heights = -(-counts * 8 // counts.max())
    return "`" + "".join("·▁▂▃▄▅▆▇█"[height] for height in heights) + "`"


_MEANING = {
    "cloth_cloth_intersections": "cloth-cloth intersections",
    "cloth_body_intersections": "cloth-body intersections",
    "masked_body_faces_max": "body faces left out of contact, where the body cuts into itself",
    "min_distance_m": "smallest distance, m",
    "force_residual": "force residual, share of the weight",
    "largest_strain": "largest strain",
}


def _certificates(rows: Sequence[Mapping[str, Any]]) -> str:
    lines = []
    for key, meaning in _MEANING.items():
        values = [row[key] for row in rows if row[key] is not None]
        figures = [_number(f(values)) for f in (min, np.median, max)] if values else ["", "", ""]
        lines.append([meaning, *figures, f"{len(values)} of {len(rows)}"])
    return (
        "What was measured of every sample when it was made, over all its frames. `muslin verify` counts the "
        "intersections again.\n\n" + _table(("", "least", "median", "most", "samples measured"), lines)
    )


def _sources(rows: Sequence[Mapping[str, Any]], scenes: Mapping[str, Mapping[str, Any]]) -> str:
    found = {source for row in rows for source in sources_of(scenes[row["id"]], row["body"], row["fabric"])}
    text = "The licence of the dataset is its maker's to choose. These are the terms of what went into it"
    if not found:
        return text + ": nothing but muslin (Apache-2.0)."
    lines = [astuple(source) for source in sorted(found)]
    return (
        text
        + "; `NOTICE` of muslin (Apache-2.0) has them in full.\n\n"
        + _table(("", "name", "source", "terms"), lines)
    )


def _loading(rows: Sequence[Mapping[str, Any]]) -> str:
    if not rows:
        return "No sample is there yet."
    row = next((row for row in rows if row["topologies"] == 1), rows[0])
    shape = "(frames, vertices, 3)" if row["topologies"] == 1 else "(vertices of all frames, 3)"
    return f"""In this folder, with muslin (`pip install muslin`):

```python
from muslin.sim.dataset.reader import open_dataset

dataset = open_dataset(".")  # dataset.split("train"), dataset.where(kind="drape")
sample = dataset["{row["id"]}"]
print(sample.frame_positions(0).shape, sample.frame_garment(0).faces.shape, sample.body_vertices(0).shape)
```

Without it (`pip install zarr pcodec`):

```python
import zarr

packed = zarr.storage.ZipStore("samples/{row["id"]}.zarr.zip", mode="r")
group = zarr.open_group(packed, mode="r")
positions, faces = group["positions"][...], group["faces"][...]  # float32 {shape}, m; int32
print(positions.shape, faces.shape, group.attrs["meta"]["certificate"])
```

`index.parquet` has one row a sample. `docs/data-format.md` of muslin tells what every array means."""


def _making(header: Header, rows: Sequence[Mapping[str, Any]]) -> str:
    versions = [[name, version] for name, version in header.versions.items()]
    geometry = digest({row["id"]: row["geometry_sha256"] for row in rows})
    config = tomli_w.dumps(_given(_without_folders(header.config)))
    return f"""{_table(("", "version"), versions)}

| | sha256 |
| --- | --- |
| geometry, as `muslin info` tells | `{geometry}` |
| solver | `{header.solver_digest}` |
| config | `{header.config_hash}` |

<details>
<summary>Config: <code>muslin generate config.toml --out DIR</code> makes the dataset again</summary>

```toml
{config}```

Of files named by absolute paths only the names are shown; `muslin.json` has the config as it was given.

</details>"""


def _given(value: Any) -> Any:
    """Without None, which TOML does not know, and without tables and lists that hold nothing."""
    if isinstance(value, Mapping):
        inner = {key: _given(entry) for key, entry in value.items() if entry is not None}
        return {key: entry for key, entry in inner.items() if entry not in ({}, [])}
    return [_given(entry) for entry in value] if isinstance(value, list) else value


def _without_folders(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _without_folders(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_without_folders(entry) for entry in value]
    return _file_name(value) if isinstance(value, str) else value


def _file_name(name: str) -> str:
    """The name without its folder, where it is an absolute path."""
    return Path(name).name if name.startswith(("/", "~")) else name


def _number(value: Any) -> str:
    return f"{float(value):.4g}"


def _table(head: Sequence[str], lines: Table) -> str:
    rows = [[str(cell).replace("|", "\\|").replace("\n", " ") for cell in line] for line in lines]
    return "\n".join(f"| {' | '.join(row)} |" for row in ([*head], ["---"] * len(head), *rows))
