"""The project's files agree with one another and say nothing of the machine they were written on."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path, PurePosixPath

import pytest

from catalogue import __version__

TOP_LEVEL = {
    "CHANGELOG.md",
    "CITATION.cff",
    "CONTRIBUTING.md",
    "LICENSE",
    "README.md",
    "SECURITY.md",
    "catalogue",
    "data",
    "migrations",
    "plugins",
    "pyproject.toml",
    "tests",
}
REGISTRY_HOST = re.compile(
    r"(?:pypi|pythonhosted|anaconda|npmjs|rubygems|crates|proxy[.]golang)[.](?:org|com|io)\b", re.IGNORECASE
)
MACHINE_PATH = re.compile(r"(?<![\w.~/-])/(?:home|Users|root|work)/\w|\b[A-Z]:\\+Users\\")


@pytest.mark.slow
@pytest.mark.parametrize("forbidden", [REGISTRY_HOST, MACHINE_PATH], ids=["registry host", "machine path"])
def test_no_file_names(forbidden: re.Pattern[str], root: Path, project_files: list[PurePosixPath]) -> None:
    named = {}
    for path in project_files:
        found = forbidden.search((root / path).read_text(encoding="utf-8", errors="replace"))
        if found:
            named[str(path)] = found.group()
    assert named == {}


@pytest.mark.parametrize(
    ("forbidden", "text"),
    [
        (REGISTRY_HOST, "see https://" + "pypi" + ".org/project/x"),
        (REGISTRY_HOST, "files." + "pythonhosted" + ".org"),
        (MACHINE_PATH, "open('" + "/home" + "/ann/x')"),
        (MACHINE_PATH, "C:" + "\\Users\\ann"),
    ],
)
def test_forbidden_text_is_recognised(forbidden: re.Pattern[str], text: str) -> None:
    assert forbidden.search(text)


@pytest.mark.parametrize(
    ("marker", "last"),
    [
        ("main-command", ".venv/bin/catalogue find straight-line --stroke 150 --deviation 0.05"),
        ("test-command", ".venv/bin/python -m pytest -n 3 --dist worksteal"),
    ],
)
def test_readme_marks_its_command(root: Path, marker: str, last: str) -> None:
    readme = (root / "README.md").read_text("utf-8")
    blocks = re.findall(rf"^<!-- {marker} -->\n```\w*\n(.+?)\n```$", readme, re.M | re.S)
    assert len(blocks) == 1
    assert blocks[0].startswith("python3 -m venv .venv && ")
    assert blocks[0].endswith(f" && {last}")


def test_changelog_and_citation_name_this_version_and_its_day(root: Path) -> None:
    headings = re.findall(r"^## \[([^\]]+)\](.*)", (root / "CHANGELOG.md").read_text("utf-8"), re.M)
    number, day = next(heading for heading in headings if heading[0] != "Unreleased")
    assert number == __version__
    assert re.fullmatch(r" - \d{4}-\d\d-\d\d", day)
    citation = (root / "CITATION.cff").read_text("utf-8")
    assert f"\nversion: {number}\n" in citation
    assert f"\ndate-released: {day.removeprefix(' - ')}\n" in citation


def test_the_change_of_the_first_hour_is_one_line_of_the_code(root: Path) -> None:
    """A newcomer tries it as it stands in CONTRIBUTING.md."""
    text = (root / "CONTRIBUTING.md").read_text("utf-8")
    (old,) = re.findall(r"^   -( .*)$", text, re.M)
    assert (root / "catalogue" / "guidance" / "metrics.py").read_text("utf-8").count(f"{old}\n") == 1
    for path in re.findall(r"`((?:catalogue|tests)/[\w./-]*)`|\]\(([\w./-]+)\)", text):
        assert (root / "".join(path)).exists(), path


def test_top_level_holds_only_the_agreed_entries(project_files: list[PurePosixPath]) -> None:
    entries = {path.parts[0] for path in project_files}
    assert {entry for entry in entries if not entry.startswith(".")} <= TOP_LEVEL


def test_example_plugin_of_the_guide_is_the_one_that_is_tested(root: Path) -> None:
    _, _, rest = (root / "plugins/README.md").read_text("utf-8").partition("<!-- example-plugin -->\n```python\n")
    shown, _, _ = rest.partition("```")
    assert shown == (root / "tests/plugins/dropin/my_x0.py").read_text()
    assert len(shown.splitlines()) <= 40


def test_example_family_of_the_guide_is_the_one_that_is_tested(root: Path) -> None:
    _, _, rest = (root / "plugins/README.md").read_text("utf-8").partition("<!-- example-family -->\n```python\n")
    shown, _, _ = rest.partition("```")
    assert shown == (root / "tests/collections/dropin/level_tables.py").read_text()
    assert len(shown.splitlines()) <= 40


def test_the_oldest_versions_are_those_that_are_promised(root: Path) -> None:
    project = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["project"]
    extras = project["optional-dependencies"]
    tested = ("plot", "parquet", "cad", "fast", "web", "share")
    named = [*project["dependencies"], *(line for extra in tested for line in extras[extra])]
    promised = {line.replace(">=", "==") for line in named}
    oldest = (root / "tests" / "packaging" / "oldest.txt").read_text("utf-8").split("# what the oldest")[0]
    assert {line for line in oldest.splitlines() if not line.startswith("#")} == promised


def test_conda_recipe_states_the_version_and_requirements_of_the_project(root: Path) -> None:
    recipe = (root / ".conda" / "recipe.yaml").read_text("utf-8")
    assert f'\n  version: "{__version__}"\n' in recipe
    project = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["project"]
    promised = {f"python{project['requires-python']}", *project["dependencies"]}
    run = re.search(r"\n  run:\n((?:    - .+\n)+)", recipe)
    assert run
    assert {line.replace(" ", "") for line in re.findall(r"- (.+)", run[1])} == promised


def test_news_fragments_become_a_section_of_the_changelog(root: Path, tmp_path: Path) -> None:
    shutil.copytree(root / ".news", tmp_path / ".news")
    for name in ("pyproject.toml", "CHANGELOG.md"):
        shutil.copy(root / name, tmp_path / name)
    (tmp_path / ".news" / "+a.added.md").write_text("`--b` is new.\n", "utf-8")
    command = [sys.executable, "-m", "towncrier", "build", "--yes", "--version", "9.9.9", "--date", "2030-01-02"]
    subprocess.run(command, cwd=tmp_path, capture_output=True, check=True)
    _, section, *_ = re.split(r"^## ", (tmp_path / "CHANGELOG.md").read_text("utf-8"), flags=re.M)
    assert section.startswith("[9.9.9] - 2030-01-02\n\n### Added\n\n- ")
    assert "- `--b` is new.\n" in section
    # a fragment of an unknown kind is left behind
    assert [path.name for path in (tmp_path / ".news").iterdir()] == ["README.md"]


def test_the_install_line_brings_what_the_next_commands_need(root: Path) -> None:
    """All extras of users but STEP and clusters; a plugin's contract tests need few packages."""
    extras = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    (every,) = extras["all"]
    named = set(every.partition("[")[2].rstrip("]").split(","))
    assert named == {*extras} - {"all", "dask", "docs", "plugin", "step", "test"}
    assert ".venv/bin/pip install -q '.[all]' && .venv/bin/catalogue find" in (root / "README.md").read_text("utf-8")
    assert {re.split(r"[>\[]", line)[0] for line in extras["plugin"]} == {"mechanism-catalogue", "mpmath", "pytest"}
