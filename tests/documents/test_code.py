"""All code of the README and of the documents runs, and prints what the pages show."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "data" / "documents").glob("[!m]*.md")),
         *sorted((ROOT / "data" / "documents" / "how-to").glob("*.md"))]  # fmt: skip
HELPER: Any = runpy.run_path(str(Path(__file__).with_name("conftest.py")))


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_a_page_does_what_it_says(page: Path, session: Any) -> None:
    for block in HELPER["blocks"](page):
        session.run(block)


def test_a_difference_is_seen() -> None:
    compare = HELPER["compare"]
    compare("  code   size\n\n  a 1 ... 3\n", "x\na  1 2 3 4\n", exact=True)
    compare("t5ase55  found 12 guides\n", "abcdef1 found 7 nice guides\n", exact=False)
    others = (("a 1\n", "a 2\n", True), ("True\n", "False\n", True), ("found 1\n", "lost 1\n", False))
    for shown, printed, exact in others:
        with pytest.raises(AssertionError):
            compare(shown, printed, exact=exact)
