"""Pages of Markdown run block by block, each page in a folder of its own: the README and the documents."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import click
import pytest

from catalogue.cli import app, main
from catalogue.errors import MissingExtra

ROOT = Path(__file__).resolve().parents[2]
#: Beginnings of lines that are not run here, and why; of those of the command itself the options are checked.
NOT_RUN = {
    "python3 -m venv": "installs; `.ci/run` does it",
    ".venv/bin/": "what was installed so",
    "pip install": "installs",
    "python -m sphinx": "`test_build.py` builds the documents",
    "datasette": "a server, of another package",
    "duckdb": "of another package",
    "catalogue build": "minutes; tests/populate builds",
    "catalogue study atlas.toml": "two minutes; four requests of the same page are run",
    "catalogue atlas": "draws all plates; `test_build.py` does",
    "catalogue serve": "a server",
}


@dataclass(frozen=True)
class Block:
    """A fenced block: its language with what follows it, its text, and its line in the page."""

    language: str
    text: str
    line: int


def blocks(page: Path) -> Iterator[Block]:
    """Yield the fenced blocks of a page, those that Sphinx reads as directives left out."""
    text = page.read_text("utf-8")
    for found in re.finditer(r"^```([a-z][^\n{]*)\n(.*?)^```$", text, re.M | re.S):
        yield Block(found[1].strip(), found[2], text.count("\n", 0, found.start()) + 1)


class Session:
    """A shell and a Python in one folder, for the blocks of one page in their order."""

    def __init__(self, folder: Path, argv: Callable[[list[str]], None]) -> None:
        self.folder = folder
        self.argv = argv
        self.names: dict[str, object] = {"__name__": "__main__"}
        self.printed = ""
        self.code = ""

    def run(self, block: Block) -> None:
        """Run a block of sh or python, compare one of text with what was printed last, write one named by a file."""
        language, _, more = block.language.partition(" ")
        if more.startswith("title="):  # a file that the page has its reader write
            (self.folder / more.removeprefix("title=").strip('"')).write_text(block.text, "utf-8")
        elif language == "python":
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(compile(block.text, f"line {block.line}", "exec"), self.names)
            self.printed = out.getvalue()
        elif language == "sh":
            lines = block.text.replace("\\\n", " ").splitlines()
            self.printed = "".join([self._line(line) for line in lines if line.strip()])
        elif language == "text":
            compare(block.text, self.printed, exact=more != "similar")

    def _line(self, line: str) -> str:
        """Run a line of shell, and return what it prints; CODE is that of the best answer so far."""
        line = re.sub(r"\bCODE\b", self.code, line)
        start = next((start for start in NOT_RUN if line.startswith(start)), "")
        if not line.startswith("catalogue ") or "|" in shlex.split(line, comments=True):
            if not start:
                subprocess.run(["bash", "-euc", line], cwd=self.folder, check=True)
            return ""
        words, _, file = " ".join(map(shlex.quote, shlex.split(line, comments=True))).partition(" '>' ")
        arguments = shlex.split(words)[1:]
        if start:
            _parsed(arguments)
            return ""
        self.argv(["catalogue", *arguments])
        with (
            contextlib.redirect_stdout(io.StringIO()) as out,
            contextlib.redirect_stderr(io.StringIO()) as said,
            pytest.raises(SystemExit) as end,
        ):
            main()
        if end.value.code == MissingExtra.exit_code:
            return ""
        assert end.value.code == 0, f"{line}\n{said.getvalue()}"
        if file:
            (self.folder / shlex.split(file)[0]).write_text(out.getvalue(), "utf-8")
            return ""
        codes = re.findall(r"^ *([a-z](?=[a-z]*\d)[a-z0-9]{6,7})\b", out.getvalue(), re.M)
        self.code = codes[0] if codes else self.code
        return out.getvalue()


def _parsed(arguments: list[str]) -> None:
    """Check the options of a command without running it."""
    group: click.Command | None = app
    context = click.Context(app, info_name="catalogue")
    while isinstance(group, click.Group):
        group = group.get_command(context, arguments.pop(0))
    assert group is not None
    group.make_context(group.name, arguments, parent=context)


def compare(shown: str, printed: str, *, exact: bool) -> None:
    """Hold what a page shows against what was printed: the beginnings of lines, ... standing for what is left out.

    Headings of tables are not held against anything: a terminal breaks them as it has room.  Where the two are only
    similar, because numbers hang on the database, words of four letters and more are to be there in their order, but no
    words of seven small letters, which may be codes.
    """
    plain = [" ".join(line.split()) for line in printed.splitlines() if line.strip()]
    for line in shown.splitlines():
        if not line.strip() or (re.search(r"\S {2,}\S", line) and not re.search(r"\d", line)):
            continue
        wanted = " ".join(line.split())
        pattern = re.escape(wanted).replace(r"\.\.\.", ".*")
        if not exact:
            words = re.findall(r"\b[A-Za-z]{4,}\b", wanted)
            pattern = ".*".join(["", *(word for word in words if not re.fullmatch("[a-z]{7}", word))])
        assert any(re.match(pattern, one) for one in plain), f"{wanted!r} is not in\n{printed}"


@pytest.fixture(autouse=True)
def _brief(brief: None) -> None:
    """Search briefly: numbers of the pages hang on the database anyway."""


@pytest.fixture
def session(tmp_path: Path, small_db: Path, monkeypatch: pytest.MonkeyPatch) -> Session:
    """Return a session in a folder with what pages take for granted, and the database of the tests."""
    shutil.copy(small_db, tmp_path / "small.db")
    (tmp_path / "data").mkdir()
    shutil.copytree(ROOT / "data" / "spatial", tmp_path / "data" / "spatial")
    (tmp_path / "my_plugins").mkdir()
    shutil.copy(ROOT / "tests" / "plugins" / "dropin" / "my_x0.py", tmp_path / "my_plugins")
    (tmp_path / "pivots.json").write_text("[[[-1, 0.6], [0, 0.6]], [[1, -0.6], [0, -0.6]]]", "utf-8")  # Watt's
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CATALOGUE_DB", str(tmp_path / "small.db"))
    monkeypatch.setenv("COLUMNS", "130")  # narrower tables leave columns out
    return Session(tmp_path, lambda argv: monkeypatch.setattr("sys.argv", argv))
