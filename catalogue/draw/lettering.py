"""Title, captions, legend and frame of a plate."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from ..curvature_theory.analysis import PARALLEL
from ..curvature_theory.leading_error import EXACT
from ..paper import COUPLER, GREY, INK, PATH, SANS, SERIF
from ..series.series import Series
from .cells import Cell
from .vignette import DASHED, FIXED
from .words import FAMILIES

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.text import Text

#: Margin of the sheet [inch].
MARGIN = 0.75
GREEK = {"kappa": r"\kappa", "phi": r"\varphi", "psi": r"\psi", "chi": r"\chi", "alpha": r"\alpha"}
#: Parameters that are angles.
ANGLES = ("phi", "psi", "chi", "alpha")


def title(figure: Figure, series: Series, width: float, height: float) -> None:
    """Write code, title, inverse, dimension and source at the head of a sheet."""
    from matplotlib.patches import Polygon

    line = height - MARGIN
    inverse = "self-inverse" if series.inverse == series.code else f"inverse {series.inverse}"
    source = series.source
    if source == f"inversion of {series.inverse}":
        inverse, source = source, f"free parameters are those of {series.inverse}"
    told = "   ·   ".join([inverse, f"dimension {_dimension(series)}", source])
    rows: tuple[tuple[str, str, float, dict[str, Any]], ...] = (
        ("code", series.code, 0.08, {"family": SERIF, "weight": "bold", "size": 30, "color": INK}),
        ("title", series.title, 0.5, {"family": SERIF, "style": "italic", "size": 15, "color": INK}),
        ("facts", told, 0.8, {"family": SANS, "size": 7.5, "color": GREY}),
    )
    for gid, words, below, style in rows:
        text = figure.text(0.5, (line - below) / height, words, gid=gid, ha="center", va="center", **style)
        if gid != "code":
            _fit(text, width - 2 * MARGIN)
    # a rule that swells in the middle, as engravers close a title
    x = np.linspace(-1, 1, 81)
    x, top, middle = 0.5 + 0.9 / width * x, (line - 1.02 + 0.016 * (1 - x**2)) / height, (line - 1.02) / height
    border = np.stack([np.append(x, x[::-1]), np.append(top, 2 * middle - top[::-1])], axis=1)
    figure.add_artist(Polygon(border, facecolor=INK, linewidth=0, gid="rule-title", transform=figure.transFigure))


def _dimension(series: Series) -> str:
    """Return the number of free parameters: one for all families, or one per family."""
    free = {family: max(len(m.parameters) for m in series.members if m.family == family) for family in series.families}
    if len(set(free.values())) == 1:
        return str(next(iter(free.values())))
    return ", ".join(f"{count} ({FAMILIES.get(family, family)})" for family, count in free.items())


def caption(figure: Figure, cell: Cell, number: int, box: tuple[float, float, float, float]) -> None:
    """Write the caption of a cell below it; `box` is the cell's box as fractions of the sheet."""
    left, bottom, wide, _ = box
    inch, gid = 1 / figure.get_figheight(), f"cell-{number}-"
    special = "" if cell.member == "general" else f", {cell.member}"
    x = left
    parts: tuple[tuple[str, str, dict[str, Any]], ...] = (
        ("number", f"Fig. {number}.", {"size": 9.5, "color": GREY}),
        ("configuration", cell.configuration, {"size": 11, "weight": "bold", "color": INK}),
        ("family", FAMILIES.get(cell.family, cell.family) + special, {"size": 10, "style": "italic", "color": INK}),
    )
    for what, words, style in parts:
        text = figure.text(x, bottom - 0.17 * inch, words, gid=gid + what, family=SERIF, va="center", **style)
        _fit(text, (left + wide - x) * figure.get_figwidth())
        x = text.get_window_extent().x1 / figure.bbox.width + 0.07 / figure.get_figwidth()
    for line, (words, what) in enumerate(((_numbers(cell), "parameters"), (_contact_orders(cell), "orders"))):
        text = figure.text(
            left,
            bottom - (0.345 + 0.16 * line) * inch,
            words,
            gid=gid + what,
            family=SANS,
            size=6.8,
            math_fontfamily="dejavusans",
            va="center",
            color=GREY,
        )
        _fit(text, wide * figure.get_figwidth())


def _fit(text: Text, width: float) -> None:
    """Write a text, shrunk to a width in inches if it is longer."""
    length = text.get_window_extent().width / 100
    if length > width:
        text.set_fontsize(0.97 * float(text.get_fontsize()) * width / length)


def _numbers(cell: Cell) -> str:
    """Format the free parameters; the parameters of the cubics replace those of equal name."""
    at = cell.curvature
    if at.state[0] == PARALLEL:
        more = {"k": at.k[0], "k_star": at.k_star[0]}
    else:
        unit = at.rho0[0]
        more = {"kappa": at.kappa[0] * unit, "kappa_star": at.kappa_star[0] * unit, "s": at.s[0] * unit}
    told = [_number(name, value) for name, value in cell.parameters.items() if name not in more]
    told += [_number(name, float(value)) for name, value in more.items()]
    return "   ".join(told)


def _number(name: str, value: float) -> str:
    """Return a parameter in the letters of the theory; angles in degrees."""
    found = re.fullmatch(r"([a-z]+)(\d*)(_star)?", name)
    if found is None:
        return f"{name} = {value:.3g}"
    word, index, star = found.groups()
    letter = GREEK.get(word, word) + (f"_{{{index}}}" if index else "") + ("^*" if star else "")
    if word in ANGLES:
        return f"${letter}$ = {np.degrees(value):.0f}°".replace("-", "−")
    value = 0.0 if abs(value) < 5e-7 else value
    return f"${letter}$ = {value:.3g}".replace("-", "−")


def _contact_orders(cell: Cell) -> str:
    """Return the guided elements by their orders of contact."""
    of_order: dict[int, list[str]] = {}
    for g in cell.guided:
        of_order.setdefault(int(g.order), []).append(g.label)
    told = []
    for order, labels in sorted(of_order.items(), reverse=True):
        rays = [label.removeprefix("ray ") for label in labels if label.startswith("ray ")]
        others = [label for label in labels if not label.startswith("ray ")]
        words = [f"rays {', '.join(rays)}"] * bool(rays) + others
        told.append(f"{'exact' if order == EXACT else f'order {order}'}: {', '.join(words)}")
    return "   ".join(told) or "no real guided pair"


def frame(figure: Figure, width: float, height: float) -> None:
    """Draw the double rule about the sheet."""
    from matplotlib.patches import Rectangle

    for inset, weight, gid in ((0.3, 1.6, "rule-outer"), (0.37, 0.5, "rule-inner")):
        corner = (inset / width, inset / height)
        figure.add_artist(
            Rectangle(
                corner,
                1 - 2 * corner[0],
                1 - 2 * corner[1],
                fill=False,
                edgecolor=INK,
                linewidth=weight,
                joinstyle="miter",
                gid=gid,
                transform=figure.transFigure,
            )
        )


def legend(figure: Figure, shown: list[Cell], width: float, height: float) -> None:
    """Explain the kinds of lines in the drawing."""
    from matplotlib.lines import Line2D

    entries: list[tuple[str, dict[str, Any]]] = [
        ("circling-point curve", {"color": COUPLER, "linewidth": 1.0}),
        ("centring-point curve", {"color": FIXED, "linewidth": 2.0}),
        ("inflection circle", {"color": COUPLER, "linewidth": 0.8, "linestyle": DASHED}),
        ("return circle", {"color": FIXED, "linewidth": 0.8, "linestyle": DASHED}),
        ("guided pair and its path", {"color": PATH, "linewidth": 1.7}),
    ]
    if all(cell.curvature.state[0] == PARALLEL for cell in shown):
        entries = [entry for entry in entries if not entry[0].endswith("circle")]
    y = (MARGIN + 0.06) / height
    texts = [
        figure.text(0, y, words, gid=f"legend-{i + 1}", family=SERIF, style="italic", size=9, va="center", color=INK)
        for i, (words, _) in enumerate(entries)
    ]
    lengths = [text.get_window_extent().width / figure.bbox.width * width for text in texts]
    stroke, gap, between = 0.3, 0.07, 0.26
    x = 0.5 * (width - sum(lengths) - len(texts) * (stroke + gap) - (len(texts) - 1) * between)
    for text, length, (_, style) in zip(texts, lengths, entries, strict=True):
        figure.add_artist(Line2D([x / width, (x + stroke) / width], [y, y], transform=figure.transFigure, **style))
        text.set_x((x + stroke + gap) / width)
        x += stroke + gap + length + between
