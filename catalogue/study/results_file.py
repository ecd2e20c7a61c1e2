"""A results file: requests in order, results by round; a killed study resumes from it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, ClassVar

from sqlalchemy import func, insert, null, select
from sqlalchemy.orm import aliased

from .. import __version__
from ..errors import DatabaseError
from ..problem.problem import Request
from ..store import Database
from .models import RESULTS, AnswerRow, RequestRow, ResultRow, Setting
from .task import Done, request_texts


class ResultsFile:
    """An open file of results; only one process writes it."""

    chunk: ClassVar[int] = 1000  #: number of results read at a time: some megabytes of text

    def __init__(self, path: str | PathLike[str], *, create: bool = True, writable: bool = True) -> None:
        self.database = Database.open(path, create=create, writable=writable, layout=RESULTS)
        self.path = self.database.path

    def add(self, requests: Sequence[Request]) -> None:
        """Append the requests that the file does not yet hold."""
        texts = dict.fromkeys(request_texts(requests))
        with self.database.begin() as connection:
            held = {*connection.scalars(select(RequestRow.request))}
            new = [{"request": text} for text in texts if text not in held]
            if new:
                connection.execute(insert(RequestRow), new)

    def requests(self) -> dict[int, str]:
        """Return the requests as JSON by number, in order."""
        return dict(self._rows(select(RequestRow.id, RequestRow.request).order_by(RequestRow.id)))

    def settings(self) -> dict[str, str]:
        """Return all settings."""
        return dict(self._rows(select(Setting.key, Setting.value)))

    def note(self, **values: str) -> None:
        """Store settings."""
        with self.database.begin() as connection:
            rows = [{"key": key, "value": value} for key, value in values.items()]
            connection.execute(insert(Setting).prefix_with("OR REPLACE"), rows)

    def belongs_to(self, digest: str) -> None:
        """Store the identity of the catalogue from which the answers are.

        Raises
        ------
        DatabaseError
            If the file holds answers from another catalogue or version.
        """
        now = {"catalogue": digest, "version": __version__}
        held = self.settings()
        if "catalogue" in held and {name: held.get(name) for name in now} != now:
            raise DatabaseError(
                f"{self.path} holds results from another catalogue or version ({held.get('version')}): "
                "name a new file with --out"
            )
        self.note(**now)

    def write(self, results: Iterable[tuple[int, int, Done]]) -> None:
        """Add results, each for a request in a round, in one transaction."""
        rows: list[dict[str, Any]] = []
        answers: list[dict[str, Any]] = []
        for number, place, done in results:
            key = {"request_id": number, "round": place}
            status = "failed" if done.failed else "answers" if done.records else "none"
            advice = json.dumps(done.advice) if done.advice else None
            told = {"status": status, "reason": done.reason, "advice": advice, "cost": done.cost}
            rows.append({**key, **told, "seconds": done.seconds})
            listed = zip(done.codes, done.records, strict=True)
            answers += [{**key, "place": k, "code": code, "record": text} for k, (code, text) in enumerate(listed)]
        if rows:
            with self.database.begin() as connection:
                connection.execute(insert(ResultRow), rows)
                if answers:
                    connection.execute(insert(AnswerRow), answers)

    def done(self, before: int | None = None) -> dict[int, tuple[int, str, float | None]]:
        """Return round, status and cost of the last result of each request."""
        columns = (ResultRow.request_id, ResultRow.round, ResultRow.status, ResultRow.cost)
        query = select(*columns).order_by(ResultRow.round)
        if before is not None:
            query = query.where(ResultRow.round < before)
        return {number: (place, status, cost) for number, place, status, cost in self._rows(query)}

    def of_round(self, place: int) -> set[int]:
        """Return the requests with a result in a round."""
        return {number for (number,) in self._rows(select(ResultRow.request_id).where(ResultRow.round == place))}

    def records(self, keys: Mapping[int, int], most: int | None = None) -> dict[int, list[str]]:
        """Return the records of answers by request, best first.

        Parameters
        ----------
        keys : mapping of int to int
            Rounds by request.
        most : int, optional
            Maximum number per request.
        """
        found: dict[int, list[str]] = {}
        query = select(AnswerRow.record).order_by(AnswerRow.place).limit(most)
        with self.database.engine.connect() as connection:
            for number, place in keys.items():
                where = (AnswerRow.request_id == number, AnswerRow.round == place)
                found[number] = [*connection.scalars(query.where(*where))]
        return found

    def last(self, number: int | None = None, shown: Sequence[str] = ()) -> Iterator[Any]:
        """Yield the last result of each request, or of one, in order.

        Parameters
        ----------
        number : int, optional
        shown : sequence of str
            Names of values of the best answer, which `best` holds as a list in JSON.
        """
        newest = select(ResultRow.request_id, func.max(ResultRow.round).label("round")).group_by(ResultRow.request_id)
        last, counted = newest.subquery(), aliased(AnswerRow)
        of_last = (counted.request_id == RequestRow.id) & (counted.round == last.c.round)
        count = select(func.count(counted.place)).where(of_last).correlate(RequestRow, last).scalar_subquery()
        best = (AnswerRow.request_id == RequestRow.id) & (AnswerRow.round == last.c.round) & (AnswerRow.place == 0)
        columns = (ResultRow.status, ResultRow.reason, ResultRow.advice, ResultRow.seconds, AnswerRow.code)
        values = func.json_extract(AnswerRow.record, *(f"$.{name}" for name in shown)) if shown else null()
        query = (
            select(RequestRow.id, RequestRow.request, *columns, count.label("answers"), values.label("best"))
            .outerjoin(last, last.c.request_id == RequestRow.id)
            .outerjoin(ResultRow, (ResultRow.request_id == RequestRow.id) & (ResultRow.round == last.c.round))
            .outerjoin(AnswerRow, best)
            .order_by(RequestRow.id)
        )
        if number is not None:
            query = query.where(RequestRow.id == number)
        with self.database.engine.connect() as connection:
            yield from connection.execution_options(yield_per=self.chunk).execute(query)

    def by_code(self, code: str) -> str | None:
        """Return the record of an answer by its code; None if there is none."""
        for (text,) in self._rows(select(AnswerRow.record).where(AnswerRow.code == code).limit(1)):
            return str(text)
        return None

    def _rows(self, query: Any) -> list[Any]:
        with self.database.engine.connect() as connection:
            return [tuple(row) for row in connection.execute(query)]
