"""The wheel, built through the sdist, holds what it should and nothing else."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from dataclasses import dataclass
from email.message import Message
from email.parser import Parser
from pathlib import Path, PurePosixPath

import pytest

from catalogue import __version__

PACKED = {"plugins": "catalogue/_plugins", "migrations": "catalogue/_migrations", "data": "catalogue/_data"}
DIST_INFO = f"mechanism_catalogue-{__version__}.dist-info"
STRAYS = (
    "catalogue/__pycache__/stray.cpython-311.pyc",
    "catalogue/stray.db",
    "data/stray.db-wal",
    "migrations/__pycache__/stray.cpython-311.pyc",
    "plugins/__pycache__/stray.cpython-311.pyc",
    "plugins/stray.db",
)


@dataclass(frozen=True)
class Built:
    """The two archives of one build."""

    sdist: Path
    wheel: Path

    def wheel_text(self, name: str) -> str:
        with zipfile.ZipFile(self.wheel) as archive:
            return archive.read(f"{DIST_INFO}/{name}").decode()


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory, root: Path, project_files: list[PurePosixPath]) -> Built:
    """Build once, from a copy of the project's files among which lie strays that git ignores."""
    copy = tmp_path_factory.mktemp("copy")
    for path in project_files:
        (copy / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(root / path, copy / path)
    for name in STRAYS:
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        (copy / name).write_bytes(b"stray")
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), str(copy)]
    run = subprocess.run(command, cwd=out, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    (sdist,), (wheel,) = out.glob("*.tar.gz"), out.glob("*.whl")
    return Built(sdist, wheel)


@pytest.fixture(scope="session")
def metadata(built: Built) -> Message:
    return Parser().parsestr(built.wheel_text("METADATA"))


def test_wheel_holds_exactly_the_package_its_folders_and_its_metadata(
    built: Built, project_files: list[PurePosixPath]
) -> None:
    expected = {f"{DIST_INFO}/{name}" for name in ("METADATA", "RECORD", "WHEEL", "entry_points.txt")}
    expected.add(f"{DIST_INFO}/licenses/LICENSE")
    for path in project_files:
        top, *rest = path.parts
        if top == "catalogue":
            expected.add(str(path))
        elif top in PACKED and rest[0] != "documents":
            expected.add("/".join([PACKED[top], *rest]))
    with zipfile.ZipFile(built.wheel) as archive:
        names = archive.namelist()
    assert sorted(names) == sorted(expected)
    assert "catalogue/py.typed" in names
    assert any(path.match("data/documents/*.md") for path in project_files)  # which stay out


def test_sdist_holds_every_file_of_the_project_and_no_stray(built: Built, project_files: list[PurePosixPath]) -> None:
    with tarfile.open(built.sdist) as archive:
        names = {member.name.split("/", 1)[1] for member in archive.getmembers() if member.isfile()}
    assert names == {str(path) for path in project_files} | {"PKG-INFO"}


def test_metadata_names_the_distribution_its_version_licence_and_python(metadata: Message) -> None:
    assert metadata["Name"] == "mechanism-catalogue"
    assert metadata["Version"] == __version__
    assert metadata["License-Expression"] == "MIT"
    assert metadata.get_all("License-File") == ["LICENSE"]
    assert metadata["Requires-Python"] == ">=3.11"


def test_matplotlib_comes_only_with_an_extra(metadata: Message) -> None:
    needs = [need for need in metadata.get_all("Requires-Dist", []) if need.startswith("matplotlib")]
    assert needs
    assert all("; extra == " in need for need in needs)


def test_wheel_installs_the_command(built: Built) -> None:
    assert built.wheel_text("entry_points.txt").split("\n")[:2] == [
        "[console_scripts]",
        "catalogue = catalogue.cli:main",
    ]


def test_unpacked_wheel_finds_its_own_folders(built: Built, tmp_path: Path) -> None:
    site = tmp_path / "site"
    with zipfile.ZipFile(built.wheel) as archive:
        archive.extractall(site)
    code = f"from catalogue.folders import folder\nfor name in {list(PACKED)}: print(folder(name))"
    environment = {**os.environ, "PYTHONPATH": str(site)}
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert [Path(line) for line in run.stdout.splitlines()] == [site / place for place in PACKED.values()]
