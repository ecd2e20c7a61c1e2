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
        elif top in ("plugins", "migrations") or (top == "data" and rest[0] in ("named_guides.json", "spatial")):
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


# -- the other distribution of this name ------------------------------------------------------------------------------
#: Files of the distribution `catalogue`, one of them with a name of ours.
THEIRS = {"catalogue/__init__.py": "from catalogue.registry import *\n", "catalogue/registry.py": "registries = {}\n"}
OTHER = "catalogue-2.0.10.dist-info"


def put(site: Path, *who: str, wheel: Path) -> None:
    """Install, or with a minus before it remove, one distribution after the other, as pip does."""
    for one in who:
        if one == "ours":
            with zipfile.ZipFile(wheel) as archive:
                archive.extractall(site)
        elif one == "theirs":
            (site / OTHER).mkdir(parents=True)
            (site / OTHER / "RECORD").write_text("".join(f"{name},sha256=x,1\n" for name in THEIRS))
            for name, text in THEIRS.items():
                (site / name).parent.mkdir(exist_ok=True)
                (site / name).write_text(text)
        else:
            shutil.rmtree(site / OTHER)
            for name in THEIRS:
                (site / name).unlink()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("order", "said", "mend"),
    [
        (("ours",), "", ""),
        (("theirs", "ours"), "the distribution `catalogue`, which owns a package of the same name, is installed here "
         "and broken: `import catalogue` is mechanism-catalogue, which works", "uninstall -y catalogue && python"),
        (("ours", "theirs"), "mechanism-catalogue is broken: its file catalogue/__init__.py is overwritten by the "
         "distribution `catalogue`", "uninstall -y catalogue && python -m pip install --force-reinstall --no-deps"),
        (("theirs", "ours", "-theirs"), "mechanism-catalogue is broken: its file catalogue/__init__.py is missing or "
         "changed", "`python -m pip install --force-reinstall --no-deps mechanism-catalogue` mends it"),
        (("ours", "theirs", "-theirs"), "mechanism-catalogue is broken: its file catalogue/__init__.py is missing or "
         "changed", "`python -m pip install --force-reinstall --no-deps mechanism-catalogue` mends it"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)  # fmt: skip
def test_what_the_other_distribution_breaks_is_said_with_the_command_that_mends_it(
    built: Built, tmp_path: Path, root: Path, order: tuple[str, ...], said: str, mend: str
) -> None:
    site = tmp_path / "site"
    put(site, *order, wheel=built.wheel)

    def ran(code: str) -> subprocess.CompletedProcess[str]:
        env = {**os.environ, "PYTHONPATH": str(site), "XDG_DATA_HOME": str(tmp_path), "COLUMNS": "1000"}
        alone = f"import sys; sys.path[:] = [one for one in sys.path if one != {str(root)!r}]"  # not this checkout
        command = [sys.executable, "-c", f"{alone}; {code}"]
        return subprocess.run(command, env=env, capture_output=True, text=True, check=False, cwd=tmp_path, timeout=120)

    def command(word: str) -> subprocess.CompletedProcess[str]:
        return ran(f"sys.argv[:] = ['catalogue', {word!r}]; from catalogue.cli import main; main()")

    version = command("--version")
    if order[-1] == "ours":  # its own files are whole: it works
        assert (version.returncode, version.stdout) == (0, f"mechanism-catalogue {__version__}\n")
        imported = ran("import catalogue; print(catalogue.StraightLine(150, 0.05).stroke)")
        assert imported.stdout == "150.0\n"
        assert said in imported.stderr
        assert mend in imported.stderr
        assert bool(imported.stderr) == bool(said)
        doctor = command("doctor")
        assert doctor.returncode == (5 if said else 0)
        assert said in doctor.stdout
    else:
        assert (version.returncode, version.stdout) == (5, "")
        (line,) = version.stderr.splitlines()
        assert line.startswith(f"catalogue: {said}")
        assert mend in line
    put(site, "ours", wheel=built.wheel)  # what the command does
    assert command("--version").stdout == f"mechanism-catalogue {__version__}\n"
