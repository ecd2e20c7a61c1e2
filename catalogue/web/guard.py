"""Who may ask the page, and what its answers may load.

Who knows the token that the command prints is given a cookie, and only the own site of a browser that has the cookie is
answered: neither another user of this machine nor a foreign page spends a search or keeps an answer.
"""

from __future__ import annotations

import re
from hashlib import sha256
from http.cookies import CookieError, SimpleCookie
from secrets import compare_digest
from urllib.parse import parse_qsl, urlencode

from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ..markup import element, fill

#: Names by which the page is asked for; another site that gives our address its own name is refused.
HOSTS = ["localhost", "127.0.0.1", "[::1]"]
#: Name of the token in the address that the command prints.
TOKEN = "token"  # nosec B105  # a name, no secret
#: Letters of an address at most; every field of the form filled in takes about 2,000.
MAX_ADDRESS = 8000
#: What a browser says of a request that no foreign page began; an older one says nothing.
OWN = ("same-origin", "none", "")
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; style-src 'self' 'unsafe-inline'; "
    "base-uri 'none'; form-action 'self'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Referrer-Policy": "same-origin",
    "Cache-Control": "no-cache",
}
#: Leads on without the token: the site itself begins what follows, so that the browser sends the cookie.
_ENTERED = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Guide mechanisms</title>$refresh</head></html>
"""


class Guard:
    """Sets the headers of every answer, and refuses who has not been given the token.

    Parameters
    ----------
    app : ASGIApp
    tokens : list of str
        The first is for good; each of the others lets in once: it may be seen among the arguments of a browser.
    """

    def __init__(self, app: ASGIApp, tokens: list[str]) -> None:
        self.app = app
        self._token, self._once = tokens[0], tokens[1:]
        digest = sha256(self._token.encode()).hexdigest()
        self._cookie = f"catalogue-{digest[:8]}"  # cookies do not know ports: servers must not take each other's

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [
                    *message["headers"],
                    *((name.lower().encode(), value.encode()) for name, value in HEADERS.items()),
                ]
            await send(message)

        await (self._answer(scope) or self.app)(scope, receive, guarded)

    def _answer(self, scope: Scope) -> Response | None:
        """Return what a request is told at once: it is refused, or let in by its token; else None."""
        given = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        query = scope["query_string"].decode("latin-1")
        if len(scope["path"]) + len(query) > MAX_ADDRESS:
            return PlainTextResponse(f"this address is longer than {MAX_ADDRESS} letters: ask the command", 414)
        said = parse_qsl(query, keep_blank_values=True)
        if scope["path"] == "/" and (tokens := [value for name, value in said if name == TOKEN]):
            return self._entered(tokens[-1], [pair for pair in said if pair[0] != TOKEN])
        if given.get("sec-fetch-site", "") not in OWN:
            return PlainTextResponse("asked for by another site: open the page itself", 403)
        if not self._knows(given.get("cookie", "")):
            return PlainTextResponse("open the address that `catalogue serve` has printed: it holds the token", 403)
        return None

    def _entered(self, token: str, said: list[tuple[str, str]]) -> Response:
        """Return what gives the cookie, and leads on to the wish."""
        if token in self._once:
            self._once.remove(token)
        elif not compare_digest(token.encode(), self._token.encode()):
            return PlainTextResponse(
                "this is not the token of this server, or it has let somebody in already: open the address that "
                "`catalogue serve` has printed",
                403,
            )
        onward = f"0;url=/?{urlencode(said)}" if said else "0;url=/"
        page = HTMLResponse(fill(_ENTERED, refresh=element("meta", http_equiv="refresh", content=onward)))
        page.set_cookie(self._cookie, self._token, httponly=True, samesite="strict", path="/")
        return page

    def _knows(self, cookies: str) -> bool:
        try:
            found = SimpleCookie(re.sub(r"[^\x20-\x7e]", "", cookies)).get(self._cookie)
        except CookieError:
            return False
        return found is not None and compare_digest(found.value.encode(), self._token.encode())
