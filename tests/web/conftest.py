"""The page: in this process for its routes, as a command of its own for a browser."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from starlette.testclient import TestClient

import catalogue
from catalogue.cli.serve import wish_form
from catalogue.web.application import application
from catalogue.web.desk import Thread
from catalogue.web.wish import Form

if TYPE_CHECKING:
    from playwright.sync_api import Browser

TOKEN = "a token of these tests"
STORED = ("I.GG", "II.ooo", "II.xy", "II*.xy", "IV.l", "IV*.l")


@pytest.fixture(scope="module", autouse=True)
def _brief(brief_module: None) -> None:
    """Search briefly, for fixtures too: what the page makes of answers is tested here."""


@pytest.fixture(scope="session")
def form() -> Form:
    return wish_form(STORED)


@pytest.fixture(scope="session")
def page(small_db: Path, form: Form) -> Iterator[TestClient]:
    """Return a client of the page of the small database."""
    with TestClient(application(small_db, form, tokens=[TOKEN], make=Thread), base_url="http://127.0.0.1") as client:
        assert client.get("/", params={"token": TOKEN}).status_code == 200
        yield client


@pytest.fixture(scope="session")
def printed(small_db: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Return the address that the command `catalogue serve` prints."""
    home = str(tmp_path_factory.mktemp("home"))
    kept = {name: value for name, value in os.environ.items() if not name.startswith("CATALOGUE_")}
    kept |= {"PYTHONPATH": str(Path(catalogue.__file__).parents[1]), "XDG_DATA_HOME": home, "HOME": home}
    command = [sys.executable, "-m", "catalogue", "serve", "--port", "0", "--db", str(small_db)]
    with subprocess.Popen(command, env=kept, stdout=subprocess.PIPE, text=True) as served:
        assert served.stdout is not None
        try:
            line = served.stdout.readline()
            found = re.match(r"(http://127\.0\.0\.1:\d+/\?token=[\w-]{40,}) ", line)
            assert found, line
            yield found[1]
        finally:
            served.terminate()


@pytest.fixture(scope="session")
def address(printed: str) -> str:
    """Return the address without the token."""
    return printed.partition("/?")[0]


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Return Chromium without a window; skipped where there is none."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or os.environ.get("CHROMIUM")
    if chromium is None:
        pytest.skip("there is no chromium: apt-get install chromium")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    quiet = ["gpu", "quic", "background-networking", "component-update", "sync"]
    arguments = ["--no-first-run", *(f"--disable-{what}" for what in quiet)]
    with playwright.sync_playwright() as started:
        opened = started.chromium.launch(executable_path=chromium, chromium_sandbox=False, args=arguments)
        yield opened
        opened.close()
