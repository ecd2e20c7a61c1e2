"""Convert guided bodies, answers of the collection ``spatial-guidance``, to tables of a file."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import InvalidRequest
from ...given import array, whole
from ..geometry.guides import KINDS, Guides
from ..geometry.rotation import fitted, matrix
from .located_guide import MAX_GUIDE_DISTANCE


def answers_in(given: Any) -> list[dict[str, Any]]:
    """List the guided bodies of a file of answers, or of one answer."""
    every = given.get("answers", [given]) if isinstance(given, dict) else given
    if not isinstance(every, list):
        return []
    return [one for one in every if isinstance(one, dict) and _is_guided(one.get("parameters"))]


def tables(given: Any, answer: int, file: str) -> dict[str, Any]:
    """Convert a guided body to the tables of a file: guides, drives, the guided point.

    The design pose is the start of the stroke.  Drives are the driving coordinates, named by the
    numbers of their points; the title gives their ranges in the syntax of `spatial sweep`.

    Parameters
    ----------
    given : list or dict
        Parsed JSON.
    answer : int
        Number of the answer in the file, from 1.
    file : str
        For messages.

    Raises
    ------
    InvalidRequest
        If the file has no answer of that number, or it is no guided body.
    """
    every = answers_in(given)
    held = every[whole("answer", answer, 1, len(every)) - 1]
    one = held["parameters"]
    try:
        body, point = (array(f"{file}: {name}", one[name]) for name in ("body", "point"))
        path = array(f"{file}: path", one["path"])
        start = np.array([[np.nan if v is None else float(v) for v in row] for row in one["start"]])
        drivers = [(int(i), str(axis)) for i, axis in one["drivers"]]
        guides = [dict(guide) for guide in one["guides"]]
        shapes = [[float(g["shape"][k]) for k in KINDS[g["kind"]].parameters] for g in guides]
        seats = [_locate_on_guide(g, shape, at) for g, shape, at in zip(guides, shapes, start, strict=True)]
        world = np.array([place for place, _ in seats])
        shown = _driver_ranges(path.T, drivers, [found for _, found in seats], guides)
        turn, shift = _fit_pose(body, world)
        ends = [f"{name(i, axis)}={a:.15g}:{b:.15g}" for (i, axis), (a, b) in zip(drivers, shown, strict=True)]
    except (KeyError, TypeError, ValueError, IndexError, InvalidRequest) as error:
        raise InvalidRequest(f"{file}: answer {answer} is no guided body: {error}") from None
    size = float(np.ptp(body, axis=0).max())
    if not np.abs(body @ turn.T + shift - world).max() <= MAX_GUIDE_DISTANCE * size:
        raise InvalidRequest(f"{file}: answer {answer} is not closed at the start of its stroke")
    return {
        "title": f"Guided body: {', '.join(ends)}",
        "unit": str(held.get("unit") or "length"),
        "guide": [
            {
                "name": f"guide {i + 1}",
                "body": "body",
                "at": world[i].tolist(),
                "guide": g["kind"],
                "parameters": shape,
                "origin": g["origin"],
                "quaternion": g["quaternion"],
            }
            for i, (g, shape) in enumerate(zip(guides, shapes, strict=True))
        ],
        "drive": {
            name(i, axis): {"kind": "guide", "guide": f"guide {i + 1}", "coordinate": axis} for i, axis in drivers
        },
        "point": [{"name": "point", "body": "body", "at": (turn @ point + shift).tolist()}],
    }


def name(point: int, coordinate: str) -> str:
    """Return the name of a driving coordinate, such as ``u1``."""
    return f"{coordinate}{point + 1}"


def _is_guided(parameters: Any) -> bool:
    return isinstance(parameters, dict) and {"body", "guides", "drivers", "path", "start"} <= set(parameters)


def _driver_ranges(path: Any, drivers: list[tuple[int, str]], located: Any, guides: list[dict[str, Any]]) -> Any:
    """Return start and end (k, 2) of the driving coordinates, angles in degrees.

    The start is the located one.  Angles of a chart are known up to half turns: a plane's distance
    from the pole may be negative.
    """
    out = path.copy()
    for row, (i, axis) in zip(out, drivers, strict=True):
        kind, k = KINDS[guides[i]["kind"]], "uw".index(axis)
        off = located[i][k] - row[0]
        is_angle = kind.spans[k] == np.pi and axis not in kind.lengths
        if abs(off - (np.pi * np.round(off / np.pi) if is_angle else 0.0)) > MAX_GUIDE_DISTANCE * (1 + abs(row[0])):
            raise InvalidRequest(f"{name(i, axis)} starts at {row[0]:g}, its point is at {located[i][k]:g}")
        row[:] = np.degrees(row + off) if is_angle else row + off
    return out


def _locate_on_guide(guide: dict[str, Any], shape: list[float], at: Any) -> tuple[Any, tuple[float, ...]]:
    """Return the position (3,) of a point on a guide, and its coordinates there."""
    placed = Guides(guide["kind"], shape, guide["origin"], guide["quaternion"])
    kind, _, parameters = placed.each()[0]
    u, w = (np.atleast_1d(np.nan_to_num(v)) for v in at)
    local = np.array([np.ravel(v) for v in np.broadcast_arrays(*kind.point(u, w, parameters))])
    found = tuple(float(np.ravel(v)[0]) for v in kind.locate(local, parameters))
    return placed.origin[0] + matrix(placed.quaternion.T)[:, :, 0] @ local[:, 0], found


def _fit_pose(body: Any, world: Any) -> tuple[Any, Any]:
    """Fit the rotation and translation that carry points of the body to their positions."""
    turn = matrix(fitted(*(v.reshape(-1, 3, 1) for v in (body, world))))[:, :, 0]
    return turn, world.mean(0) - turn @ body.mean(0)
