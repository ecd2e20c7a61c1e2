"""Access control of the page, and restrictions on the resources of its responses.

The printed token earns a cookie, and only same-site requests with the cookie are answered: neither
another user of this machine nor a foreign page can run a search or store an answer.
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

#: Permitted host names: a foreign site that resolves to our address (DNS rebinding) is refused.
HOSTS = ["localhost", "127.0.0.1", "[::1]"]
#: Name of the token in the address that the command prints.
TOKEN = "token"  # nosec B105  # a name, no secret
#: Longest address [characters]: the form with every field filled in takes about 2,000.
MAX_ADDRESS = 8000
#: Values of Sec-Fetch-Site for requests that come from no foreign page; older browsers send none.
OWN_SITES = ("same-origin", "none", "")
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
#: Redirect without the token: the browser sends the cookie only on a same-site request.
_ENTERED = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Guide mechanisms</title>$refresh</head></html>
"""


class Guard:
    """Middleware: sets security headers, and refuses clients without the token.

    Parameters
    ----------
    app : ASGIApp
    tokens : list of str
        The first is permanent; the others admit once, as they are visible in the arguments of a
        browser.
    """

    def __init__(self, app: ASGIApp, tokens: list[str]) -> None:
        self.app = app
        self._token, self._once = tokens[0], tokens[1:]
        digest = sha256(self._token.encode()).hexdigest()
        self._cookie = f"catalogue-{digest[:8]}"  # cookies ignore ports: servers need different names

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

        await (self._immediate_response(scope) or self.app)(scope, receive, guarded)

    def _immediate_response(self, scope: Scope) -> Response | None:
        """Return an immediate response, a refusal or an admission by token; else None."""
        given = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        query = scope["query_string"].decode("latin-1")
        if len(scope["path"]) + len(query) > MAX_ADDRESS:
            return PlainTextResponse(f"this address is longer than {MAX_ADDRESS} letters: ask the command", 414)
        said = parse_qsl(query, keep_blank_values=True)
        if scope["path"] == "/" and (tokens := [value for name, value in said if name == TOKEN]):
            return self._admit(tokens[-1], [pair for pair in said if pair[0] != TOKEN])
        if given.get("sec-fetch-site", "") not in OWN_SITES:
            return PlainTextResponse("asked for by another site: open the page itself", 403)
        if not self._has_cookie(given.get("cookie", "")):
            return PlainTextResponse("open the address that `catalogue serve` has printed: it holds the token", 403)
        return None

    def _admit(self, token: str, said: list[tuple[str, str]]) -> Response:
        """Set the cookie, and redirect to the request."""
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

    def _has_cookie(self, cookies: str) -> bool:
        try:
            found = SimpleCookie(re.sub(r"[^\x20-\x7e]", "", cookies)).get(self._cookie)
        except CookieError:
            return False
        return found is not None and compare_digest(found.value.encode(), self._token.encode())
