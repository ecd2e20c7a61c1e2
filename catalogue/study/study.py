"""`Study`: many requests, asked on an engine, with their results in a file."""

from __future__ import annotations

import json
import shutil
import tempfile
import weakref
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import islice
from math import nan
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from ..engines import engine as started
from ..errors import DatabaseError, InvalidRequest, quoted
from ..find.answers import of_record
from ..find.explain import Advice, Relaxation
from ..folders import replacing
from ..given import several, whole
from ..guides.candidate import Candidate
from ..problem.forms import column_order, columns_of
from ..problem.problem import Request
from ..quantities import QUANTITIES
from ..store.digest import content_digest
from . import task
from .reading import grid, of_table, read
from .results_file import ResultsFile
from .run import Run, State

if TYPE_CHECKING:
    import pandas as pd

    from ..api import Catalogue

#: Numbers of the best answer in the table.
SHOWN = (
    *("family", "series", "configuration", "score", "size", "deviation", "min_transmission", "allowance"),
    *(row.name for row in QUANTITIES if row.in_study),
)


@dataclass(frozen=True)
class Cell:
    """A request of a study with its result.

    Attributes
    ----------
    number : int
        Place in the study, from 1.
    request : Request
    status : str
        ``answers``, ``none``, ``failed`` (its worker was killed at every attempt), or ``open``.
    reason : str
        Why there is no answer.
    advice : Advice
        Remedies, each tested: looser requests of the study with an answer, or those of the search.
    """

    number: int
    request: Request
    status: str
    reason: str = ""
    advice: Advice = field(default_factory=lambda: Advice("there are answers"))
    records: tuple[str, ...] = field(default=(), repr=False)

    @cached_property
    def answers(self) -> list[Candidate]:
        """Answers, best first; each is measured again when it is read."""
        return [of_record(json.loads(text)) for text in self.records]


class Study:
    """Many requests as one map: no cell is worse than the answer to a tighter one.

    Parameters
    ----------
    requests : iterable of Request, or DataFrame
        Equal ones are asked once.  Further requests are added to those of the file.
    file : path, optional
        Results file, made if missing; default: a temporary one.

    Raises
    ------
    InvalidRequest
        If a request is invalid.
    DatabaseError
        If the file cannot be used.

    Examples
    --------
    >>> from catalogue import Study
    >>> base = {"stroke": 150, "deviation": 0.5, "limit": 2, "refine": False}
    >>> study = Study.grid(base, deviation=[0.2, 0.5], max_size=[300, 600])
    >>> study = study.run(cat, engine="serial")
    >>> study.to_pandas()[["deviation", "max_size", "status"]].shape
    (4, 3)
    >>> study[4].answers[0].size <= 600
    True
    """

    def __init__(
        self, requests: Iterable[Request] | pd.DataFrame = (), file: str | PathLike[str] | None = None
    ) -> None:
        if file is None:
            folder = tempfile.mkdtemp(prefix="catalogue-study-")
            weakref.finalize(self, partial(shutil.rmtree, folder, ignore_errors=True))
            file = Path(folder, "results.study")
        given: Sequence[Request]
        given = of_table(requests) if hasattr(requests, "itertuples") else several("requests", requests, Request)
        self._file = ResultsFile(file)
        self._file.add(given)

    @classmethod
    def grid(cls, base: Request | Mapping[str, Any], file: str | PathLike[str] | None = None, **axes: Any) -> Self:
        """Span a grid of requests.

        Parameters
        ----------
        base : Request or mapping
            Common values of all requests; see `Request.from_dict`.
        file : path, optional
            Results file.
        **axes
            Values by name, the last name varying fastest; or ``{"scale": factors}``, which multiply
            a box or a number of the base.
        """
        shared = base.to_dict() if isinstance(base, Request) else base
        if not isinstance(shared, Mapping):
            raise InvalidRequest(f"base must be a Request or a mapping, not {quoted(base)}")
        return cls(grid(shared, axes), file)

    @classmethod
    def read(cls, path: str | PathLike[str], file: str | PathLike[str] | None = None) -> Self:
        """Read requests from TOML, CSV or Parquet.

        Parameters
        ----------
        path : path
            TOML with a table ``[grid]`` or tables ``[[request]]``; a table with a request a row.
        file : path, optional
            Results file.
        """
        return cls(read(path), file)

    @classmethod
    def open(cls, file: str | PathLike[str]) -> Self:
        """Open a results file.

        Parameters
        ----------
        file : path

        Raises
        ------
        DatabaseError
            If it is missing, or no results file.
        """
        if not Path(file).exists():
            raise DatabaseError(f"{file} does not exist: `catalogue study FILE --out {file}` makes it")
        return cls((), file)

    @property
    def path(self) -> Path:
        """The results file."""
        return self._file.path

    @property
    def complete(self) -> bool:
        """Whether all requests have their last result."""
        return self._file.settings().get("complete") == str(len(self))

    def run(
        self, catalogue: Catalogue, *, engine: str = "processes", report: Callable[[State], None] = lambda _: None
    ) -> Self:
        """Answer all requests that have no final result yet.

        Parameters
        ----------
        catalogue : Catalogue
            Read by every worker; a copy is sent to machines without it.
        engine : str
            ``serial``, ``processes`` or ``dask``; see `catalogue.engines.engine`.  The table is the
            same on all of them.
        report : callable
            Receives the `State` after each result.

        Raises
        ------
        DatabaseError
            If the file holds results from another catalogue or version.
        EngineError
            If a cluster cannot be reached.
        """
        digest = content_digest(catalogue.database.path)
        self._file.belongs_to(digest)
        if self.complete:
            return self
        place = str(catalogue.database.path)
        with started(engine, task.begin(catalogue)) as pool:
            pool.spread(
                partial(task.holds, place, digest), partial(task.receive, digest), catalogue.database.path.read_bytes
            )
            Run(self._file, pool, report).run()
        self._file.note(complete=str(len(self)))
        return self

    def __len__(self) -> int:
        return len(self._file.requests())

    def __getitem__(self, number: int) -> Cell:
        """Return a request of the study by its number, from 1, with its result."""
        requests = self._file.requests()
        if not requests:
            raise self._empty_error
        number = whole("number", number, 1, len(requests))
        request = Request.from_json(requests[number])
        state = self._file.done().get(number)
        if state is None:
            return Cell(number, request, "open")
        row = next(self._file.last(number))
        advice = Advice("there are answers")
        if state[1] != "answers":
            offers = json.loads(row.advice or "[]")
            alternatives = tuple(tuple(Relaxation(*one) for one in offer) for offer in offers)
            advice = Advice(row.reason or "no guide found", alternatives)
        records = self._file.records({number: state[0]})[number]
        return Cell(number, request, state[1], row.reason or "", advice, tuple(records))

    @property
    def _empty_error(self) -> InvalidRequest:
        return InvalidRequest(f"{self.path} has no requests: give the study some")

    def answer(self, code: str) -> Candidate:
        """Return an answer by its code, on any machine that has the file.

        Parameters
        ----------
        code : str

        Raises
        ------
        InvalidRequest
            If no answer has this code.
        """
        text = self._file.by_code(code) if isinstance(code, str) else None
        if text is None:
            raise InvalidRequest(f"{self.path} has no answer {quoted(code)}")
        found: Candidate = of_record(json.loads(text))
        return found

    def to_pandas(self, *, seconds: bool = False) -> pd.DataFrame:
        """Return one row per request: its values, its status, and its best answer.

        Parameters
        ----------
        seconds : bool
            Add the processor time of the last search, which differs from run to run.

        Returns
        -------
        DataFrame
            number; the names of `Request.to_row`, defaults empty; status, answers (their number),
            reason, advice; code, family, series, configuration, score, size, deviation, as
            ``best_deviation``, and other numbers of the best answer.
        """
        import pandas as pd

        return pd.DataFrame(self._table(seconds=seconds))

    def _table(self, *, seconds: bool = False) -> dict[str, list[Any]]:
        """Return the columns of the table by name; none without requests."""
        last, chunk = self._file.last(shown=SHOWN), self._file.chunk
        parts = [_columns(rows, seconds=seconds) for rows in iter(lambda: [*islice(last, chunk)], [])]
        if not parts:
            return {}
        asked = column_order({name: None for part, _ in parts for name in part})
        blank = [nan] * chunk
        found: dict[str, list[Any]] = {"number": []}
        found |= {name: [] for name in (*asked, *parts[0][1])}
        for posed, results in parts:
            count = len(results["number"])
            for name, column in found.items():
                column += results[name] if name in results else posed.get(name, blank)[:count]
        return found

    def map(self, file: str | PathLike[str], *, value: str = "score", x: str = "", y: str = "") -> None:
        """Write the map as a page of HTML that stands alone.

        Cells over two axes are shaded by a value of their best answer, with contours, and steps
        where the series or the family changes; each leads to a card with its code, or its advice.

        Parameters
        ----------
        file : path
        value : str
            ``score``, ``size``, ``deviation``, ``min_transmission`` or ``allowance``.
        x, y : str
            Axes, such as ``deviation``; default: the two with the most values.  Other axes give
            charts of their own.

        Raises
        ------
        InvalidRequest
            If the study is empty, a name is unknown, there are too many charts, or the file
            cannot be written.
        """
        from .chart import LAYOUT, page

        columns = self._table()
        if not columns:
            raise self._empty_error
        few = len(columns["number"]) <= LAYOUT.drawn
        keys = {number: place for number, (place, _, _) in self._file.done().items()} if few else {}
        best = {number: records[0] for number, records in self._file.records(keys, 1).items() if records}
        _write(file, page(columns, best, value, x, y))

    def front(self, file: str | PathLike[str], number: int = 1, *, x: str = "", y: str = "") -> None:
        """Write the Pareto front of a request as a page of HTML that stands alone.

        Parameters
        ----------
        file : path
        number : int
            Number of a request that ranks by two criteria or more.
        x, y : str
            Criteria of the axes; default: the first two.

        Raises
        ------
        InvalidRequest
            If there is no front, a name is none of its criteria, or the file cannot be written.
        """
        from .front import page

        cell = self[number]
        criteria = cell.request.rank_by
        answers = [*zip(cell.records, cell.answers, strict=True)]
        _write(file, page(criteria if isinstance(criteria, tuple) else (), answers, x, y))

    def answers(self) -> pd.DataFrame:
        """Return one row per answer: number of the request, place, code and its columns."""
        import pandas as pd

        rows = []
        keys = {number: state[0] for number, state in self._file.done().items()}
        for number, records in sorted(self._file.records(keys).items()):
            codes = task.Done(tuple(records)).codes
            listed = zip(codes, records, strict=True)
            rows += [
                {"number": number, "place": k, "code": code, **json.loads(text)}
                for k, (code, text) in enumerate(listed)
            ]
        return pd.DataFrame(rows)


def _columns(rows: Sequence[Any], *, seconds: bool) -> tuple[dict[str, list[Any]], dict[str, list[Any]]]:
    """Return the columns of requests and of their results."""
    asked = columns_of(json.loads(f"[{','.join(row.request for row in rows)}]"))
    blank = json.dumps([None] * len(SHOWN))
    best = zip(*json.loads(f"[{','.join(row.best or blank for row in rows)}]"), strict=True)
    results: dict[str, list[Any]] = {
        "number": [row.id for row in rows],
        "status": [row.status or "open" for row in rows],
        "answers": [row.answers for row in rows],
        "reason": [row.reason or "" for row in rows],
        "advice": [_told(row.advice) if row.advice else "" for row in rows],
        "code": [row.code or "" for row in rows],
    }
    results |= {f"best_{name}": [*values] for name, values in zip(SHOWN, best, strict=True)}
    return asked, results | ({"seconds": [row.seconds for row in rows]} if seconds else {})


def _told(advice: str) -> str:
    offers = json.loads(advice)
    return "; or ".join(" and ".join(f"{name} {value}".strip() for name, value, _ in offer) for offer in offers)


def _write(file: str | PathLike[str], text: str) -> None:
    try:
        with replacing(Path(file)) as part:
            part.write(text.encode())
    except OSError as error:
        raise InvalidRequest(f"cannot write {file}: {error.strerror}") from None
