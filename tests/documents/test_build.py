"""The documents are built by one command, without a warning and without a network."""

from __future__ import annotations

import json
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import catalogue
from catalogue.draw.plate import plate
from catalogue.plugin.registry import Registry
from catalogue.series.named_guides import named_guides
from catalogue.store.schema import described

pytestmark = pytest.mark.slow

SOURCES = Path(__file__).resolve().parents[2] / "data" / "documents"


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the pages, built from a copy of the sources, with pictures that are there already: those of
    the sources, or one plate that stands for those of all series but one."""
    for needed in ("sphinx", "furo", "myst_parser", "numpydoc", "matplotlib"):
        pytest.importorskip(needed, reason='the documents need pip install "mechanism-catalogue[docs]"')
    folder = tmp_path_factory.mktemp("documents")
    shutil.copytree(SOURCES, folder / "sources", ignore=shutil.ignore_patterns("__pycache__"))
    pictures = folder / "sources" / "made" / "pictures"
    if not pictures.exists():
        pictures.mkdir(parents=True)
        maker = runpy.run_path(str(SOURCES / "pagemaker" / "pictures.py"))
        (pictures / "state.txt").write_text(maker["_digest"](), "utf-8")
        plate(Registry().get("II.ooo"), one := folder / "plate.svg")
        for code in {*Registry().series} - {"II.xy"}:
            shutil.copy(one, pictures / maker["plate_name"](code))
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "sources", "pages"]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return folder / "pages"


def _text(page: str) -> str:
    return re.sub(r"<[^>]+>", "", page)


def test_every_series_has_its_page_and_plate(built: Path) -> None:
    index = (built / "made" / "series.html").read_text("utf-8")
    for code, series in Registry().series.items():
        name = code.replace("*", "-star")
        assert f'href="series/{name}.html"' in index, code
        page = (built / "made" / "series" / f"{name}.html").read_text("utf-8")
        assert f"plate-{name}.svg" in page
        assert all(parameter.name in page for member in series.members for parameter in member.parameters)
        assert (built / "_images" / f"plate-{name}.svg").stat().st_size > 10_000


def test_every_named_guide_has_its_picture_and_source(built: Path) -> None:
    page = (built / "made" / "named.html").read_text("utf-8")
    for name in named_guides():
        assert f"_images/{name}.svg" in page
        assert f"catalogue show {name} · " in _text(page)
    assert page.count("Source: ") == len(named_guides())


def test_every_option_column_and_public_name_is_told(built: Path) -> None:
    commands = (built / "made" / "commands.html").read_text("utf-8")
    own = (Path(catalogue.__file__).parent / "cli" / "README.md").read_text("utf-8")
    for flag in set(re.findall(r"`(--[a-z-]+)`", own)):
        assert re.search(rf"\s{flag}\b", _text(commands)), flag
    columns = (built / "made" / "columns.html").read_text("utf-8")
    for name in {*catalogue.Candidate.columns(), *catalogue.Stretch.columns()}:
        assert f">{name}<" in columns, name
    tables = (built / "made" / "tables.html").read_text("utf-8")
    assert all(f">{one.column_name or one.table_name}<" in tables for one in described())
    names = (built / "made" / "python.html").read_text("utf-8")
    for name in set(catalogue.__all__) - {"__version__"}:
        assert re.search(rf'id="catalogue\.(\w+\.)*{name}"', names), name


def test_the_notebook_has_the_code_of_its_page(built: Path) -> None:
    page = (SOURCES / "how-to" / "study.md").read_text("utf-8")
    (file,) = built.rglob("study.ipynb")
    cells = json.loads(file.read_text("utf-8"))["cells"]
    code = [one["source"] for one in cells if one["cell_type"] == "code"]
    python = [one for one in code if not one.startswith(("!", "%%"))]
    assert python == [one.strip() for one in re.findall(r"^```python\n(.*?)^```", page, re.M | re.S)]
    for one in python:
        compile(one, "cell", "exec")
    assert "!catalogue study chart.toml --engine processes:2 --table chart.csv" in code
    assert any(one.startswith("%%writefile chart.toml\nstroke") for one in code)
    assert not [one for one in cells if one["cell_type"] == "markdown" and "```" in one["source"]]
    assert (built / "_static" / "atlas.html").exists()


def test_pages_ask_no_other_host(built: Path) -> None:
    for page in built.rglob("*.html"):
        loaded = re.findall(r'<(?:script|img|link|iframe)[^>]+(?:src|href)="(https?://[^"]+)"', page.read_text("utf-8"))
        assert loaded == [], page
