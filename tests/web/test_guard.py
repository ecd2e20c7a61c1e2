"""Who is let in: a browser with the token, on its own site, that takes its answers; nobody else spends a search."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from catalogue import Catalogue
from catalogue.web.application import application
from catalogue.web.desk import Thread
from catalogue.web.guard import MAX_ADDRESS
from catalogue.web.wish import FORM, Form

WISH = {"path": "straight-line", "stroke": "150", "deviation": "0.5", "limit": "2", "stage": "draft"}
GOOD, ONCE = "the token that is printed", "the token of the browser"


@pytest.fixture
def stranger(small_db: Path, form: Form, monkeypatch: pytest.MonkeyPatch) -> Iterator[TestClient]:
    """Return a client without a cookie, of a page on which no search may be spent."""

    def spent(*_: Any, **__: Any) -> None:
        raise AssertionError("a search was spent")

    monkeypatch.setattr(Catalogue, "find", spent)
    with TestClient(application(small_db, form, tokens=[GOOD, ONCE], make=Thread), base_url="http://127.0.0.1") as one:
        yield one


PATHS = ["/", "/answers", "/own", "/own/measured", "/gallery", "/static/page.js", "/guide/watt", "/compare?pick=watt"]


@pytest.mark.parametrize("path", PATHS)
def test_without_the_token_nothing_is_answered(stranger: TestClient, path: str) -> None:
    for cookie in ("", "catalogue=1", "catalogue-00000000=" + GOOD, "=;", "\x00"):
        got = stranger.get(path, params=WISH, headers={"cookie": cookie})
        assert got.status_code == 403
        assert got.text == "open the address that `catalogue serve` has printed: it holds the token"


def test_a_wrong_token_is_refused_and_gives_no_cookie(stranger: TestClient) -> None:
    for token in ("", "x", GOOD[:-1], GOOD + "x", "é"):
        got = stranger.get("/", params={**WISH, "token": token})
        assert got.status_code == 403
        assert "set-cookie" not in got.headers


def test_the_token_becomes_a_cookie_that_only_this_site_sends(stranger: TestClient) -> None:
    got = stranger.get("/", params={"token": GOOD, "unit": "cm", "path": '"><script>'})
    assert got.status_code == 200
    cookie = got.headers["set-cookie"].lower()
    assert {"httponly", "samesite=strict", "path=/"} <= {part.strip() for part in cookie.split(";")}
    assert 'content="0;url=/?unit=cm&amp;path=%22%3E%3Cscript%3E"' in got.text
    assert GOOD not in got.text
    assert stranger.get("/compare").status_code == 200


def test_the_token_of_a_browser_lets_in_once(stranger: TestClient) -> None:
    assert stranger.get("/", params={"token": ONCE}).status_code == 200
    assert stranger.get("/compare").status_code == 200
    stranger.cookies.clear()
    assert stranger.get("/", params={"token": ONCE}).status_code == 403


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
@pytest.mark.parametrize("mode", ["navigate", "no-cors", "cors", "nested-navigate"])
def test_a_foreign_page_spends_no_search_even_with_the_cookie(stranger: TestClient, site: str, mode: str) -> None:
    stranger.get("/", params={"token": GOOD})
    got = stranger.get("/answers", params=WISH, headers={"sec-fetch-site": site, "sec-fetch-mode": mode})
    assert got.status_code == 403
    assert stranger.get("/compare", headers={"sec-fetch-site": "same-origin"}).status_code == 200
    assert stranger.get("/compare", headers={"sec-fetch-site": "none"}).status_code == 200


@pytest.mark.slow
def test_no_page_may_frame_it(page: TestClient) -> None:
    for path in ("/", "/own", "/static/page.js", "/nothing"):
        got = page.get(path)
        assert got.headers["x-frame-options"] == "DENY"
        assert "frame-ancestors 'none'" in got.headers["content-security-policy"]
        assert got.headers["cross-origin-resource-policy"] == "same-origin"


def test_a_long_address_is_refused_before_it_is_read(stranger: TestClient) -> None:
    stranger.get("/", params={"token": GOOD})
    zones = "\n".join(f"{k},0,{k + 1},1" for k in range(3000))
    got = stranger.get("/answers", params={**WISH, "keep_out": zones})
    assert got.status_code == 414
    assert got.text == f"this address is longer than {MAX_ADDRESS} letters: ask the command"


@pytest.mark.parametrize("zones", [
    [f"{k},0,{k + 1},1" for k in range(FORM.max_zones + 1)],
    [",".join(f"{x},{x * x}" for x in range(FORM.max_corners // 2 + 1))] * 2,
], ids=["zones", "corners"])  # fmt: skip
def test_more_zones_than_a_page_may_cost_are_refused(stranger: TestClient, zones: list[str]) -> None:
    stranger.get("/", params={"token": GOOD})
    got = stranger.get("/answers", params={**WISH, "keep_out": zones})
    assert got.status_code == 400
    assert f"at most {FORM.max_zones} zones with {FORM.max_corners} corners in all on this page" in got.text


def test_a_start_on_the_page_is_a_code_and_no_file(stranger: TestClient, tmp_path: Path) -> None:
    stranger.get("/", params={"token": GOOD})
    got = stranger.get("/answers", params={**WISH, "starts": str(tmp_path)})
    assert got.status_code == 400
    assert "is no code of an answer" in got.text


@pytest.mark.slow
def test_slow_connections_are_hung_up_on(small_db: Path) -> None:
    code = (
        "import sys; from catalogue.web import connection; connection.PATIENCE = 1.0; "
        f"sys.argv = ['catalogue', 'serve', '--port', '0', '--db', {str(small_db)!r}]; "
        "from catalogue.cli import main; main()"
    )
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as served, ExitStack() as stack:
        try:
            assert served.stdout is not None
            found = re.match(r"http://127\.0\.0\.1:(\d+)/", served.stdout.readline())
            assert found
            place = ("127.0.0.1", int(found[1]))
            silent, trickling, second = (stack.enter_context(socket.create_connection(place, 20)) for _ in range(3))
            second.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")  # refused, and kept alive
            assert second.recv(2000).startswith(b"HTTP/1.1 403")
            assert seconds_until_closed(trickling) < 8
            assert seconds_until_closed(second) < 8
            assert not receives(silent)
        finally:
            served.send_signal(signal.SIGINT)


def seconds_until_closed(connection: socket.socket) -> float:
    """Send a request letter by letter, and return how long that is suffered [s]."""
    start, begun = time.monotonic(), b""
    while time.monotonic() < start + 20:
        try:
            connection.sendall(begun or b"GET / HTTP/1.1\r\nX: ")
        except ConnectionError:
            break
        begun = b"x"
        time.sleep(0.2)
    return time.monotonic() - start


def receives(connection: socket.socket) -> bool:
    try:
        return bool(connection.recv(100))
    except ConnectionError:
        return False
