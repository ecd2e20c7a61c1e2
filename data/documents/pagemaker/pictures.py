"""Pictures of the documents: the plates of the series, the named guides; drawn anew only if the program changed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import catalogue
from catalogue.draw.plate import file_name, plate
from catalogue.find.stored import as_published
from catalogue.folders import folder
from catalogue.plugin.registry import Registry
from catalogue.series.named_guides import named_guides
from catalogue.series.series import Series


def plate_name(code: str) -> str:
    """Return the name of the file of a plate."""
    return f"plate-{file_name(code)}.svg"


def draw(into: Path, every: Iterable[Series]) -> None:
    """Draw what is not there, or was drawn by another state of the program."""
    into.mkdir(parents=True, exist_ok=True)
    state, digest = into / "state.txt", _digest()
    if not state.exists() or state.read_text("utf-8") != digest:
        for old in into.glob("*.svg"):
            old.unlink()
        state.write_text(digest, "utf-8")
    plates = [one.code for one in every if not (into / plate_name(one.code)).exists()]
    guides = [name for name in named_guides() if not (into / f"{name}.svg").exists()]
    if plates or guides:  # in processes of their own: they share nothing
        with ProcessPoolExecutor(2, get_context("spawn")) as pool:
            tasks = [pool.submit(_named, guides, into), *(pool.submit(_plate, code, into) for code in plates)]
            for task in tasks:
                task.result()


def _plate(code: str, into: Path) -> None:
    plate(Registry().get(code), into / plate_name(code))


def _named(names: list[str], into: Path) -> None:
    """Draw named guides as `catalogue show NAME --plot` does, from a small database that holds them."""
    with TemporaryDirectory() as folder, catalogue.open(Path(folder) / "named.db", build=False) as cat:
        cat.build(count=1, series=["II.ooo"], processes=1)
        for name in names:
            as_published(named_guides()[name], cat.guide(name), 100.0).plot(into / f"{name}.svg")


def _digest() -> str:
    """Return a digest of all that pictures depend on: the program and the named guides."""
    digest = hashlib.sha256()
    package = Path(catalogue.__file__).parent
    for place in (package, folder("plugins")):
        for file in sorted(place.rglob("*.py")):
            digest.update(file.read_bytes())
    digest.update((folder("data") / "named_guides.json").read_bytes())
    return digest.hexdigest()
