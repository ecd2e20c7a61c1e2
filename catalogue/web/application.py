"""Routes of the page."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator, Awaitable, Callable, Hashable, Iterable, Sequence
from contextlib import asynccontextmanager
from dataclasses import replace
from functools import partial
from mimetypes import guess_type
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

from ..draw.moving_style import DARK, LIGHT, STYLE, properties
from ..engines import Begin
from ..errors import CatalogueError, DatabaseError, InvalidRequest, MissingExtra, shortened
from ..markup import element
from ..units import MILLIMETRES, millimetres

try:
    from jinja2 import Environment, FileSystemLoader
    from starlette.applications import Starlette
    from starlette.exceptions import HTTPException
    from starlette.middleware import Middleware
    from starlette.middleware.trustedhost import TrustedHostMiddleware
    from starlette.requests import Request
    from starlette.responses import HTMLResponse, JSONResponse, RedirectResponse, Response
    from starlette.routing import Mount, Route
    from starlette.staticfiles import StaticFiles
except ImportError as error:
    raise MissingExtra(
        'the page needs starlette, jinja2 and uvicorn: pip install "mechanism-catalogue[web]"'
    ) from error

from . import asked, guides
from .desk import Busy, Desk, NobodyWaits, process
from .gallery import gallery
from .guard import HOSTS, Guard
from .own import EXAMPLE as OWN_EXAMPLE
from .own import Own, measured
from .wish import Form, Wish, WishError, unit_shown

if TYPE_CHECKING:
    from ..find.explain import Relaxation

HERE = Path(__file__).parent
#: Largest number of guides in a comparison: more columns do not fit a screen.
SIDE_BY_SIDE = 6
#: Request shown to a visitor without one; it has answers.
EXAMPLE = {"path": "straight-line", "stroke": "150", "deviation": "0.05"}


class Page:
    """Routes of the page, with its form and desk."""

    def __init__(self, form: Form, begin: Begin, make: Callable[..., Any]) -> None:
        self.form, self._begin, self._make = form, begin, make
        self.desk: Desk
        self.templates = Environment(
            loader=FileSystemLoader(HERE / "templates"), autoescape=True, trim_blocks=True, lstrip_blocks=True
        )
        self.templates.globals["drawings"] = element(
            "style",
            f"{STYLE}:root{{{properties(LIGHT)}}}@media(prefers-color-scheme:dark){{:root{{{properties(DARK)}}}}}"
            ".guide-drawing{--guide-paper:var(--sheet)}",
        )
        self.templates.filters["address"] = urlencode
        self.templates.tests["given"] = lambda name, values: any(values.get(name, ()))

    @asynccontextmanager
    async def open(self, _: Starlette) -> AsyncIterator[None]:
        """Start the worker processes, and stop them at the end."""
        self.desk = Desk(self._begin, self._make)
        try:
            yield
        finally:
            await self.desk.close()

    async def warm(self) -> None:
        """Ask the most frequent questions in advance, to cache their answers."""

        async def never() -> bool:
            return False

        wish = self.form.wish(EXAMPLE.items())
        lanes = [(self.desk.quick, "draft"), (self.desk.thorough, "refined")]
        first = [
            self.desk.ask(
                ("warm", lane.count - k, stage),
                lane,
                never,
                partial(asked.search, stage=stage),
                wish.request,
                wish.starts,
            )
            for lane, stage in lanes
            for k in range(lane.count)
        ]
        await asyncio.gather(*first)
        await self.desk.ask(("gallery",), self.desk.thorough, never, gallery)

    def show(self, template: str, request: Request, code: int = 200, **values: Any) -> HTMLResponse:
        """Render a page, or a part of one."""
        values = {
            "unit": unit_shown(request.query_params.get("unit", "")),
            "units": [*MILLIMETRES],
            "query": request.url.query,
            "path": request.url.path,
            **values,
        }
        return HTMLResponse(self.templates.get_template(template).render(values), code)

    async def ask(
        self, request: Request, key: tuple[Hashable, ...], task: Callable[..., Any], *arguments: Any, quick: bool
    ) -> Any:
        lane = self.desk.quick if quick else self.desk.thorough
        return await self.desk.ask(key, lane, request.is_disconnected, task, *arguments)

    async def _answers(self, request: Request, wish: Wish, stage: str) -> asked.Answers:
        task, quick = partial(asked.search, stage=stage), stage != "refined"
        key = ("answers", wish.request, wish.starts, stage)
        found: asked.Answers = await self.ask(request, key, task, wish.request, wish.starts, quick=quick)
        return found

    async def _search_values(self, request: Request) -> dict[str, Any]:
        """Return the values to render for a search: answers and request, or the error."""
        given = request.query_params.multi_items()
        try:
            wish = self.form.wish(given)
            known = self.desk.knows(("answers", wish.request, wish.starts, "refined"))
            stage = request.query_params.get("stage", "draft")
            answers = await self._answers(request, wish, "refined" if known or stage not in asked.STAGES else stage)
        except WishError as error:
            return {"error": str(error), "field": error.field}
        except InvalidRequest as error:
            return {"error": str(error), "field": self.form.field_of(str(error))}
        kept = [pair for pair in given if pair[0] != "stage"]
        offers = answers.advice.alternatives if answers.advice else ()
        advice = [(said(one), self.form.relaxed(kept, one)) for one in offers]
        return {"wish": wish, "answers": answers, "advice": advice, "error": "", "field": ""}

    async def home(self, request: Request) -> Response:
        """Show the form with its answers; those of an example for an empty form."""
        given = request.query_params.multi_items()
        asking = any(name in self.form.fields for name, _ in given)
        found = await self._search_values(request) if asking else {"error": "", "field": ""}
        values: dict[str, list[str]] = {}
        for name, value in given if asking else EXAMPLE.items():
            values.setdefault(name, []).append(value)
        picked = request.query_params.getlist("pick")
        return self.show(
            "home.html",
            request,
            400 if found["error"] else 200,
            form=self.form,
            values=values,
            picked=picked,
            asking=asking,
            **found,
        )

    async def answers(self, request: Request) -> Response:
        """Show the answers alone, for the script."""
        found = await self._search_values(request)
        picked = request.query_params.getlist("pick")
        return self.show("answers.html", request, 400 if found["error"] else 200, picked=picked, **found)

    async def guide(self, request: Request) -> Response:
        """Show the page of one guide."""
        name = request.path_params["name"]
        unit = unit_said(request)
        found = await self.ask(request, ("guide", name, unit), guides.guide_page, name, unit, quick=True)
        if isinstance(found, tuple):
            return RedirectResponse(f"/own?{urlencode(found)}")
        return self.show(
            "guide.html",
            request,
            guide=found,
            unit=found.unit,
            files=guides.offered(),
            seconds=guides.GUIDE_PAGE.seconds,
        )

    async def file(self, request: Request) -> Response:
        """Send a file of a guide."""
        name, kind = request.path_params["name"], request.path_params["kind"]
        if kind not in guides.FILES:
            raise HTTPException(404)
        unit = request.query_params.get("unit")
        if unit is not None:
            millimetres(unit)
        content = await self.ask(request, ("file", name, kind, unit), guides.file_of, name, kind, unit, quick=True)
        plain, suffix = re.sub(r"[^\w.-]", "_", name, flags=re.ASCII), guides.FILES[kind][0]
        plain += f"-{kind}" * (kind in ("fusion", "solidworks"))
        headers = {"Content-Disposition": f'attachment; filename="{plain}.{suffix}"'}
        return Response(content, media_type=guess_type(f"x.{suffix}")[0] or "text/plain", headers=headers)

    async def compare(self, request: Request) -> Response:
        """Show guides side by side."""
        names = tuple(dict.fromkeys(request.query_params.getlist("pick")))
        if len(names) > SIDE_BY_SIDE:
            raise InvalidRequest(f"{SIDE_BY_SIDE} guides fit side by side: leave some out")
        unit, found = unit_shown(request.query_params.get("unit", "")), []
        if names:
            found = await self.ask(request, ("compare", names, unit), guides.compare_pages, names, unit, quick=True)
        return self.show("compare.html", request, guides=found, groups=guides.side_by_side(found))

    async def own(self, request: Request) -> Response:
        """Show the user's own linkage, typed or dragged."""
        found, error = None, ""
        try:
            found = await self._measure_own(request)
        except CatalogueError as fault:
            error = str(fault)
        given = request.query_params
        shown = {name: given.get(name, default) for name, default in (("x", "0"), ("y", "0"), ("stroke", "40"))}
        if "linkage" in given:
            shown |= {name: given.get(name, "") for name in shown}
        return self.show(
            "own.html",
            request,
            400 if error else 200,
            own=found,
            error=error,
            linkage=given.get("linkage", OWN_EXAMPLE),
            **shown,
        )

    async def measured(self, request: Request) -> Response:
        """Show measurements of an own linkage, for the script; no drawing while it is dragged."""
        try:
            found = await self._measure_own(request)
        except CatalogueError as fault:
            return JSONResponse({"error": str(fault)}, 400)
        shown = self.show("measured.html", request, own=found)
        return JSONResponse(
            {
                "pivots": found.pivots,
                "guided": found.guided,
                "path": found.path,
                "stretch": found.stretch,
                "told": bytes(shown.body).decode(),
                "error": found.error,
            }
        )

    async def _measure_own(self, request: Request) -> Own:
        given = request.query_params
        if "linkage" in given:
            arguments = tuple(given.get(name, "") for name in ("linkage", "x", "y", "stroke"))
        else:
            arguments = (OWN_EXAMPLE, "0", "0", "40")
        arguments += (unit_shown(given.get("unit", "")),)
        kept = given.get("stage") != "draft"
        found: Own = await self.ask(request, ("own", arguments, kept), measured, *arguments, kept, quick=True)
        return found

    async def gallery(self, request: Request) -> Response:
        """Show the named guides and the series."""
        named, series = await self.ask(request, ("gallery",), gallery, quick=False)
        return self.show("gallery.html", request, guides=named, series=series)

    async def failed(self, request: Request, error: Exception) -> Response:
        """Show any error as one line on a page."""
        code, text = 400, str(error)
        if isinstance(error, NobodyWaits):
            return Response(status_code=499)
        if isinstance(error, HTTPException):
            code, text = (
                error.status_code,
                {404: "there is no such page", 405: "this page is only read"}.get(error.status_code, error.detail),
            )
        elif isinstance(error, DatabaseError | Busy):
            code = 503
        elif isinstance(error, MissingExtra):
            code = 501
        elif isinstance(error, InvalidRequest) and request.url.path.startswith("/guide/"):
            code = 404
        return self.show("failed.html", request, code, text=shortened(text, 500))


def unit_said(request: Request) -> str | None:
    """Return the unit in an address; None for a missing or unknown one."""
    unit = request.query_params.get("unit")
    return unit if unit in MILLIMETRES else None


def said(relaxations: Iterable[Relaxation]) -> str:
    """Format relaxations in the labels of the form."""
    words = (replace(one, option=one.option.removeprefix("--").replace("-", " ")) for one in relaxations)
    text = " with ".join(map(str, words))
    return text[:1].upper() + text[1:]


def application(
    path: Path,
    form: Form,
    plugins: Sequence[str] = (),
    *,
    tokens: Sequence[str],
    make: Callable[..., Any] = process,
    warm: bool = False,
) -> Starlette:
    """Build the page of a database as an ASGI application.

    Parameters
    ----------
    path : Path
        Absolute path of the database, which is only read.
    form : Form
    plugins : sequence of str
        Folders with plugins.
    tokens : sequence of str
        Tokens that admit a browser; see `Guard`.
    make : callable
        Factory of workers: `process` or `Thread`.
    warm : bool
        Ask the most frequent questions at the start.
    """
    page = Page(form, asked.begin(path, plugins), make)

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        async with page.open(app):
            warming = asyncio.create_task(page.warm()) if warm else None
            yield
            if warming is not None:
                warming.cancel()
                await asyncio.gather(warming, return_exceptions=True)

    routes = [
        Route("/", page.home, name="home"),
        Route("/answers", page.answers),
        Route("/guide/{name}", page.guide, name="guide"),
        Route("/guide/{name}/{kind}", page.file),
        Route("/compare", page.compare),
        Route("/own", page.own, name="own"),
        Route("/own/measured", page.measured),
        Route("/gallery", page.gallery),
        Mount("/static", StaticFiles(directory=HERE / "static")),
    ]
    handlers: dict[Any, Callable[[Request, Any], Awaitable[Response]]] = dict.fromkeys(
        (CatalogueError, HTTPException, NobodyWaits), page.failed
    )
    return Starlette(
        routes=routes,
        middleware=[Middleware(Guard, tokens=[*tokens]), Middleware(TrustedHostMiddleware, allowed_hosts=HOSTS)],
        exception_handlers=handlers,
        lifespan=lifespan,
    )
