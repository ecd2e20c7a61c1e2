"""The map of the core leads to what it names."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import catalogue

ROOT = Path(catalogue.__file__).parent
MAP = ROOT / "README.md"
PLACES = re.findall(r"^\| [^|]+ \| `([a-z_/]+\.py)` `(\w+)` \| (\d) \|$", MAP.read_text("utf-8"), re.MULTILINE)


def test_a_stranger_finds_ten_formulas_and_ten_numbers() -> None:
    assert len(PLACES) >= 20
    assert max(int(guesses) for _, _, guesses in PLACES) <= 2


@pytest.mark.parametrize(("path", "name"), [place[:2] for place in PLACES])
def test_every_place_is_there(path: str, name: str) -> None:
    tree = ast.parse((ROOT / path).read_text("utf-8"))
    assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)}


def test_every_file_of_the_map_is_there() -> None:
    floors = MAP.read_text("utf-8").split("## Where is it computed?")[0]
    rows = re.findall(r"^\| \d+ \| (.*?) \| .*? \| (.*?) \|$", floors, re.MULTILINE)
    assert len(rows) >= 15
    for rooms, files in rows:
        folders = [ROOT / name.strip("/") for name in re.findall(r"`([^`]+)`", rooms)]
        for name in re.findall(r"`([\w/]+\.py)`", files):
            assert (ROOT / name).is_file() or any((folder / name).is_file() for folder in folders), (rooms, name)


def test_every_place_and_room_of_the_map_in_space_is_there() -> None:
    here = ROOT / "spatial"
    read = (here / "README.md").read_text("utf-8")
    cells = re.findall(r"^\| [^|`]+ \| (`.*`) \|$", read, re.MULTILINE)
    places = [name for cell in cells for name in re.findall(r"`([^`]+)`", cell)]
    assert len(places) >= 25
    for name in places:
        assert (here / name).is_file(), name
    rooms = re.findall(r"^\| `(\w+)/` \|", read, re.MULTILINE)
    assert set(rooms) == {path.parent.name for path in here.glob("*/__init__.py")}


def test_the_folders_of_the_tests_are_the_ones_that_are_described() -> None:
    here = Path(__file__).parent
    rows = re.findall(r"^\| (`.*?`) \|", (here / "README.md").read_text("utf-8"), re.MULTILINE)
    told = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    assert told == {path.name for path in here.iterdir() if path.is_dir() and not path.name.startswith("_")}


@pytest.mark.slow
def test_a_find_passes_few_modules_and_never_climbs(small_db: Path) -> None:
    command = ["find", "straight-line", "--stroke", "150", "--deviation", "0.5", "--db", str(small_db)]
    walk = Path(__file__).with_name("walk.py")
    done = subprocess.run(
        [sys.executable, str(walk), *command], capture_output=True, text=True, check=True, timeout=300
    )
    found = re.fullmatch(r"(\d+) modules, (\d+) climbs", done.stdout.splitlines()[-1])
    assert found is not None
    assert int(found[1]) <= 48
    assert found[2] == "0"
