"""Serve the page on loopback."""

from __future__ import annotations

import os
import socket
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from secrets import token_urlsafe

from ..errors import InvalidRequest, MissingExtra
from .application import application
from .guard import TOKEN
from .wish import Form

#: Largest number of simultaneous connections: a browser opens six for each of its windows.
MAX_CONNECTIONS = 64


def serve(path: Path, form: Form, plugins: Sequence[str], port: int, *, browser: bool = False) -> None:
    """Serve the page on loopback until interrupted, to holders of the printed address.

    Raises
    ------
    InvalidRequest
        If the port is in use.
    MissingExtra
        If uvicorn is not installed.
    """
    try:
        import uvicorn

        from .connection import ImpatientProtocol
    except ImportError as error:
        raise MissingExtra('the page needs uvicorn: pip install "mechanism-catalogue[web]"') from error
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as listening:
        if os.name != "nt":  # on Windows this option would share a port that is in use
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind(("127.0.0.1", port))
        except OSError as error:
            raise InvalidRequest(f"port {port} cannot be used ({error.strerror}): name another with --port") from None
        listening.listen()  # early requests wait until the server accepts them
        tokens = [token_urlsafe(), token_urlsafe()]
        printed, once = (f"http://127.0.0.1:{listening.getsockname()[1]}/?{TOKEN}={token}" for token in tokens)
        print(f"{printed}  (Ctrl-C ends it)", flush=True)
        if browser:
            import webbrowser

            webbrowser.open(once)  # other users can see a browser's arguments
        config = uvicorn.Config(
            application(path, form, plugins, tokens=tokens, warm=True),
            http=ImpatientProtocol,
            ws="none",
            limit_concurrency=MAX_CONNECTIONS,
            log_level="error",
            access_log=False,
            lifespan="on",
        )
        with suppress(KeyboardInterrupt):  # the usual way to stop a server
            uvicorn.Server(config).run([listening])
