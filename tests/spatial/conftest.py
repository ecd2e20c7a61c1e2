"""The solver of the six classes, its golden cases, and random mechanisms."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

GOLDEN = Path(__file__).with_name("golden.json")
MODULES = {
    "geometry": ("kinds", "power_series", "rotation", "guides"),
    "continuation": ("elimination",),
    "guided": ("mechanism", "unknowns", "equations", "newton", "series",
               "formulation", "position", "derivatives", "filling", "walk", "follow",
               "roots", "closed_form", "assemblies"),
}  # fmt: skip
SURFACES = ("cylinder", "cone", "hyperboloid:sinh", "torus", "sphere", "plane")
CURVES = ("circle", "helix", "line")
#: Guides of each class, c for a curve and s for a surface, and how many of them are driven.
CLASSES = {
    "I": ("sssss", 1),
    "II": ("csss", 1),
    "III": ("ccs", 1),
    "IV": ("ssss", 2),
    "V": ("css", 2),
    "VI": ("sss", 3),
}


def solver() -> SimpleNamespace:
    """Return the public names of the modules."""
    names: dict[str, Any] = {}
    for room, modules in MODULES.items():
        for module in modules:
            loaded = import_module(f"catalogue.spatial.{room}.{module}")
            names |= {k: v for k, v in vars(loaded).items() if not k.startswith("_")} | {f"{module}_": loaded}
    return SimpleNamespace(**names)


def cases() -> list[dict[str, Any]]:
    """Return the golden cases; numbers are decimal strings."""
    read: list[dict[str, Any]] = json.loads(GOLDEN.read_text("utf-8"))["cases"]
    return read


def numbers(text: Any) -> Any:
    """Return nested lists of decimal strings as an array; None is NaN."""
    if isinstance(text, list):
        return np.array([numbers(t) for t in text])
    return np.nan if text is None else float(text)


def kind_name(guide: dict[str, Any]) -> str:
    chart = guide.get("chart", "table")
    return guide["type"] if chart == "table" else f"{guide['type']}:{chart}"


def mechanism(spatial: SimpleNamespace, case: dict[str, Any]) -> Any:
    """Return the mechanism of a golden case."""
    guides = []
    for g in case["guides"]:
        kind = spatial.KINDS[kind_name(g)]
        shape = [float(g["params"][k]) for k in kind.parameters]
        guides.append(spatial.Guides(kind, shape, numbers(g["origin"]), numbers(g["quat"])))
    drivers = [(d["point"] - 1, d["coordinate"]) for d in case["drivers"]]
    return spatial.Mechanisms(numbers(case["body_points"]), guides, drivers)


def start(case: dict[str, Any]) -> Any:
    """Return the rough coordinates of a golden case, shape (p, 2)."""
    return np.stack([numbers(case["start"]["u"]), numbers(case["start"]["w"])], axis=1)


def driver(case: dict[str, Any]) -> Any:
    """Return driver values and their derivatives, shape (k, 5)."""
    return numbers([d["q"] for d in case["drivers"]])


def random_mechanisms(
    spatial: SimpleNamespace, name: str, n: int, seed: int = 1, kinds: tuple[str, ...] = SURFACES, scale: float = 1.0
) -> tuple[Any, Any]:
    """Return n random mechanisms of a class, assembled as they are made, and their coordinates (n, p, 2)."""
    draw = np.random.default_rng(seed)
    shape, freedom = CLASSES[name]
    body = draw.uniform(-1, 1, (n, len(shape), 3))
    coordinates = np.full((n, len(shape), 2), np.nan)
    guides = []
    for i, letter in enumerate(shape):
        chosen = draw.choice(kinds if letter == "s" else CURVES, n)
        p = draw.uniform(0.3, 1.2, (n, 2))
        p[chosen == "torus"] = draw.uniform((0.6, 0.2), (1.2, 0.5), ((chosen == "torus").sum(), 2))
        p[chosen == "helix", 1] = draw.uniform(0.1, 0.5, (chosen == "helix").sum())
        u, w = draw.uniform(-np.pi, np.pi, n), draw.uniform(0.3, 1.2, n)
        turn = draw.normal(size=(n, 4))
        local = np.zeros((3, n))
        for kind, where, values in spatial.Guides(chosen, p, np.zeros((n, 3)), turn).each():
            local[:, where] = np.stack(np.broadcast_arrays(*kind.point(u[where], w[where], values)))
        origin = body[:, i] - np.einsum("ijn,jn->ni", spatial.matrix(turn.T), local)
        lengths = np.ones((2, n))
        units = np.ones((2, n))
        made = spatial.Guides(chosen, p, origin, turn)
        for kind, where, _ in made.each():
            for k, parameter in enumerate(kind.parameters):
                lengths[k, where] = scale if parameter in kind.lengths else 1
            for axis in (0, 1):
                units[axis, where] = kind.coordinate_unit(axis, np.full(len(where), scale))
        guides.append(spatial.Guides(chosen, p * lengths.T, origin * scale, turn))
        coordinates[:, i, 0] = u * units[0]
        if letter == "s":
            coordinates[:, i, 1] = w * units[1]
    drivers = [(i, "u") for i in range(freedom)]
    return spatial.Mechanisms(body * scale, guides, drivers), coordinates


def driven(mechanisms: Any, coordinates: Any) -> Any:
    """Return the driver values (n, k) among coordinates (n, p, 2)."""
    return np.stack([coordinates[:, i, "uw".index(k)] for i, k in mechanisms.drivers], axis=1)


@pytest.fixture(scope="session")
def spatial() -> SimpleNamespace:
    """Return the public names of the solver."""
    return solver()


@pytest.fixture(scope="session")
def make(spatial: SimpleNamespace) -> Callable[..., tuple[Any, Any]]:
    """Return `random_mechanisms`."""
    return lambda *args, **kwargs: random_mechanisms(spatial, *args, **kwargs)


@pytest.fixture(scope="session")
def golden_cases(spatial: SimpleNamespace) -> list[SimpleNamespace]:
    """Return each golden case with its mechanism, its position and its derivatives."""
    out = []
    for case in cases():
        m, q = mechanism(spatial, case), driver(case)
        at = spatial.solve_positions(m, q[:, 0], start(case))
        out.append(
            SimpleNamespace(id=case["id"], case=case, mechanism=m, q=q, at=at, jets=spatial.jets(m, at, q[:, 1:]))
        )
    return out


@pytest.fixture(scope="session")
def tools() -> SimpleNamespace:
    """Return what tests need besides."""
    return SimpleNamespace(numbers=numbers, driven=driven, start=start, kind_name=kind_name, classes=CLASSES)
