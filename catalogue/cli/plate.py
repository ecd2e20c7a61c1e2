"""``catalogue plate`` and ``catalogue atlas``: draw series as engraved plates."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

import click

from ..errors import InvalidRequest
from ..folders import make_folder, replacing
from ..markup import Markup, element, fill, join
from ..progress import busy
from .completion import complete_column
from .options import PATH, PLUGINS, Argument, option
from .tables import FORCE, FORCE_KEY, OUTPUT, refuse_existing

if TYPE_CHECKING:
    from ..series.series import Series


@click.command(
    params=[
        Argument(
            "series",
            "SERIES",
            "Code of a series, such as II.xy or 'III*.KK', or a named design of the series.",
            shell_complete=complete_column("series"),
        ),
        option("--out", "FILE", "File to write: PNG, SVG or PDF by suffix.", OUTPUT, show_default="CODE.svg, here"),
        FORCE,
        PLUGINS,
    ]
)
def plate(series: str, out: Path | None, plugins: Sequence[str]) -> None:
    """Draw a series: each family and configuration with circles, cubics and guided pairs."""
    from ..draw.plate import file_name
    from ..draw.plate import plate as draw
    from ..plugin.registry import Registry
    from ..series.named_guides import named_guide

    registry, design = Registry(plugins), named_guide(series)
    if design is not None:
        from ..series.classification import classify

        series = classify(design.linkage, registry.series)[0].series[0]
    chosen = registry.get(series)
    file = Path(f"{file_name(chosen.code)}.svg") if out is None else out
    refuse_existing(file, "--out", force=click.get_current_context().meta[FORCE_KEY])
    with busy("drawing"):
        draw(chosen, file)
    print(f"drawn: {file}", file=sys.stderr)


@click.command(
    params=[
        option("--out", "DIR", "Folder for the plates, created if missing.", PATH, required=True),
        FORCE,
        PLUGINS,
    ]
)
def atlas(out: Path, plugins: Sequence[str]) -> None:
    """Draw the plates of all series as SVG, with an index.html."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from ..draw.plate import plate as draw
    from ..plugin.registry import Registry

    every = list(Registry(plugins).series.values())
    files = _files(every)
    for name in (*files, "index.html"):
        refuse_existing(out / name, "--out", force=click.get_current_context().meta[FORCE_KEY])
    try:
        make_folder(out)
    except OSError as error:
        raise InvalidRequest(f"cannot write to {out}: {error.strerror}") from error
    console = Console(stderr=True)
    columns = (
        TextColumn("drawing the plates"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.description}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task("", total=len(every))
        for series, file in zip(every, files, strict=True):
            bar.update(task, description=series.code)
            draw(series, out / file)
            bar.advance(task)
    index = out / "index.html"
    try:
        with replacing(index) as part:
            part.write(_index(every, files).encode())
    except OSError as error:
        raise InvalidRequest(f"cannot write {index}: {error.strerror}") from error
    print(f"drawn: {len(every)} plates; open {index}", file=sys.stderr)


def _files(every: list[Series]) -> list[str]:
    """Return a unique file name for each plate, also on file systems that ignore case."""
    from ..draw.plate import file_name

    names: list[str] = []
    for series in every:
        plain, taken = file_name(series.code), {name.casefold() for name in names}
        numbered = (f"{plain}-{number}" for number in count(2))
        names.append(next(name for name in chain([plain], numbered) if name.casefold() not in taken))
    return [f"{name}.svg" for name in names]


def _index(every: list[Series], files: list[str]) -> Markup:
    plates = [
        element(
            "a",
            element("img", src=quote(file), alt="", loading="lazy"),
            element("b", series.code),
            " ",
            element("i", series.title),
            href=quote(file),
        )
        for series, file in zip(every, files, strict=True)
    ]
    return fill(_INDEX, count=str(len(every)), plates=join(plates, "\n"))


#: The page of all plates.
_INDEX = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Guide mechanisms: the plates</title>
<style>
body { margin: 3rem auto; max-width: 80rem; padding: 0 1.5rem; background: #f3f1ea; color: #26323d;
  font-family: STIXGeneral, "Times New Roman", serif; }
h1, p { text-align: center; }
main { display: grid; grid-template-columns: repeat(auto-fill, minmax(17rem, 1fr)); gap: 2.5rem; align-items: end; }
a { color: inherit; text-decoration: none; text-align: center; }
img { display: block; width: 100%; margin-bottom: .7rem; background: #fdfcf9; box-shadow: 0 1px 6px #0004; }
a:hover img, a:focus img { box-shadow: 0 3px 18px #0007; }
b { font-size: 1.25rem; }
</style>
</head>
<body>
<h1>Guide mechanisms</h1>
<p>$count series, each with its families and configurations</p>
<main>
$plates
</main>
</body>
</html>
"""
