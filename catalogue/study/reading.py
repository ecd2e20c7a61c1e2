"""Read requests from tables and files, and span grids."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from os import PathLike
from pathlib import Path
from typing import Any

from ..errors import InvalidRequest, MissingExtra, quoted
from ..folders import expanded
from ..given import listed
from ..problem.problem import Request

#: Largest number of requests of a study: a slip makes a grid huge.
MOST = 1_000_000


def grid(base: Mapping[str, Any], axes: Mapping[str, Any]) -> list[Request]:
    """Span a grid of requests.

    Parameters
    ----------
    base : mapping of str to object
        Common values of all requests; see `Request.from_dict`.
    axes : mapping of str to sequence, or to a mapping ``{"scale": numbers}``
        Values by name, the last name varying fastest; or factors by which a box, or a number, of
        the base is scaled, a box about its centre.

    Returns
    -------
    list of Request

    Raises
    ------
    InvalidRequest
        If a value is invalid, an axis is empty, or the grid has more than 1,000,000 requests.
    """
    if not isinstance(axes, Mapping) or not axes:
        raise InvalidRequest(f"a grid has one axis or more, names with lists of values, not {quoted(axes)}")
    values = {str(name): _values(base, str(name), given) for name, given in axes.items()}
    count = 1
    for each in values.values():
        count *= len(each)
    if count > MOST:
        raise InvalidRequest(f"this grid has {count:,} requests: {MOST:,} at most")
    return [Request.from_dict({**base, **dict(zip(values, point, strict=True))}) for point in product(*values.values())]


def _values(base: Mapping[str, Any], name: str, given: object) -> list[Any]:
    if isinstance(given, Mapping):
        factors = listed(given.get("scale")) if {*given} == {"scale"} else None
        if not factors or name not in base:
            raise InvalidRequest(f"the axis {name} must be a list of values, or scale = [...] of a value of the base")
        return [_scaled(name, base[name], factor) for factor in factors]
    found = listed(given)
    if not found:
        raise InvalidRequest(f"the axis {name} must be a list of one value or more, not {quoted(given)}")
    return found


def _scaled(name: str, value: Any, factor: Any) -> Any:
    """Scale a number, or a box about its centre."""
    try:
        if listed(value) is None:
            return float(value) * float(factor)
        x0, y0, x1, y1 = (float(part) for part in value)
        x, y, a, b = 0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (x1 - x0) * factor, 0.5 * (y1 - y0) * factor
    except (TypeError, ValueError):
        raise InvalidRequest(f"{name} cannot be scaled: it must be a number or x0, y0, x1, y1") from None
    return [x - a, y - b, x + a, y + b]


def of_rows(rows: Iterable[Mapping[str, Any]]) -> list[Request]:
    """Build requests from rows; an error names the row, from 1."""
    found = []
    for number, row in enumerate(rows, 1):
        try:
            found.append(Request.from_dict(row))
        except InvalidRequest as error:
            raise InvalidRequest(f"row {number}: {error}") from None
    return found


def of_table(table: Any) -> list[Request]:
    """Build requests from a data frame, one per row."""
    names = [str(name) for name in table.columns]
    return of_rows(dict(zip(names, row, strict=True)) for row in table.itertuples(index=False, name=None))


def read(file: str | PathLike[str]) -> list[Request]:
    """Read requests from a file: TOML (``[grid]`` or ``[[request]]``), CSV or Parquet.

    Raises
    ------
    InvalidRequest
        If the file cannot be read, or holds no requests.
    MissingExtra
        If the extra ``parquet`` is not installed.
    """
    path = expanded(Path(file))
    try:
        if path.suffix == ".toml":
            return _requests_of_toml(path, tomllib.loads(path.read_text("utf-8-sig")))
        if path.suffix == ".csv":
            import pandas as pd

            found = of_table(pd.read_csv(path, dtype=str, keep_default_na=False, skipinitialspace=True))
        elif path.suffix == ".parquet":
            import pandas as pd

            found = of_table(pd.read_parquet(path))
        else:
            raise InvalidRequest(f"{path} has none of the suffixes .toml, .csv and .parquet")
    except InvalidRequest as error:
        raise InvalidRequest(f"{path}: {error}") from None
    except ImportError as error:
        raise MissingExtra('Parquet needs pyarrow: pip install "mechanism-catalogue[parquet]"') from error
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidRequest(f"cannot read {path}: {error}") from None
    return _some(path, found)


def _requests_of_toml(path: Path, given: dict[str, Any]) -> list[Request]:
    axes, rows = given.pop("grid", None), given.pop("request", None)
    if (axes is None) == (rows is None):
        raise InvalidRequest("a study has a table [grid], or requests [[request]]")
    if axes is not None:
        return _some(path, grid(given, axes))
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InvalidRequest("requests are tables [[request]]")
    return _some(path, of_rows({**given, **row} for row in rows))


def _some(path: Path, found: Sequence[Request]) -> list[Request]:
    if not found:
        raise InvalidRequest(f"{path} holds no requests")
    return list(found)
