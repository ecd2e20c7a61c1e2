"""The command `catalogue serve`: where it listens, how it ends, what is said where it cannot run."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import HTTPCookieProcessor, build_opener, urlopen

import pytest

import catalogue

pytestmark = pytest.mark.slow


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if not name.startswith("CATALOGUE_")}
    root = str(Path(catalogue.__file__).parents[1])
    return {**kept, "PYTHONPATH": root, "XDG_DATA_HOME": str(tmp_path), "HOME": str(tmp_path)}


@pytest.mark.skipif(os.name == "nt", reason="a signal is not sent so there")
def test_it_listens_on_loopback_and_ends_with_its_processes(small_db: Path, environment: dict[str, str]) -> None:
    before = small_db.read_bytes()
    command = [sys.executable, "-m", "catalogue", "serve", "--port", "0", "--db", str(small_db)]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, env=environment, stdout=pipe, stderr=pipe, text=True) as served:
        assert served.stdout is not None
        assert served.stderr is not None
        found = re.match(r"(http://127\.0\.0\.1:\d+/)(\?token=\S+) ", served.stdout.readline())
        assert found
        with pytest.raises(HTTPError, match="403"):
            urlopen(found[1], timeout=30)
        browser = build_opener(HTTPCookieProcessor())
        browser.open(found[1] + found[2], timeout=30).close()
        with browser.open(found[1], timeout=30) as got:
            assert b"Guide a point along" in got.read()
        served.send_signal(signal.SIGINT)
        assert served.wait(30) == 0
        assert served.stderr.read() == ""
    assert small_db.read_bytes() == before


def test_a_port_that_is_taken_is_told_in_one_line(small_db: Path, environment: dict[str, str]) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        command = [sys.executable, "-m", "catalogue", "serve", "--port", str(port), "--db", str(small_db)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert re.fullmatch(rf"catalogue: port {port} cannot be used \(.*\): name another with --port\n", done.stderr)


@pytest.mark.parametrize("missing", ["starlette", "jinja2", "uvicorn"])
def test_a_missing_extra_names_the_line_that_installs_it(
    small_db: Path, environment: dict[str, str], missing: str
) -> None:
    code = (
        f"import sys; sys.modules[{missing!r}] = None; sys.argv = ['catalogue', 'serve', '--port', '0', '--db', "
        f"{str(small_db)!r}]; from catalogue.cli import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=60)
    assert done.returncode == 6
    assert re.fullmatch(r'catalogue: the page needs .*: pip install "mechanism-catalogue\[web\]"\n', done.stderr)
