"""Colours and pens of a moving drawing; widths are in points of its symbols."""

from __future__ import annotations

#: Colours on light and on dark paper, by property; distinct to colour-blind eyes (Okabe and Ito).
LIGHT = {
    "paper": "#fdfcf9",
    "ink": "#26323d",
    "grey": "#75808a",
    "faint": "#c9ced2",
    "coupler": "#0072b2",
    "coupler-face": "#d6e6ef",
    "crank": "#4d5a66",
    "crank-face": "#e0e2e3",
    "driver": "#00795a",
    "driver-face": "#d3e8e0",
    "path": "#d55e00",
    "theory": "#8a4f8f",
}
DARK = {
    "paper": "#171b1f",
    "ink": "#e4e8eb",
    "grey": "#929ca5",
    "faint": "#444c53",
    "coupler": "#56b4e9",
    "coupler-face": "#203947",
    "crank": "#a9b3bb",
    "crank-face": "#333a40",
    "driver": "#3cc79e",
    "driver-face": "#1d3c33",
    "path": "#ff8c42",
    "theory": "#d3a0d8",
}


def colour(name: str) -> str:
    """Return the colour of a property: from the page's style, or else that on light paper."""
    return f"var(--guide-{name},{LIGHT[name]})"


def properties(colours: dict[str, str]) -> str:
    """Return declarations that set the colours."""
    return "".join(f"--guide-{name}:{value};" for name, value in colours.items())


def _pen(selector: str, stroke: str, width: float, fill: str = "none", more: str = "") -> str:
    face = fill if fill == "none" else colour(fill)
    return f"{selector}{{stroke:{colour(stroke)};stroke-width:calc({width:g}*var(--guide-point));fill:{face};{more}}}"


def _style() -> str:
    one = ".guide-drawing "
    return "".join(
        [
            f"{one}.paper{{fill:{colour('paper')}}}",
            _pen(one + ".frame", "grey", 1, more="stroke-linecap:round"),
            _pen(one + ".bearing", "grey", 1.1, "paper", "stroke-linejoin:round"),
            _pen(one + ".path", "path", 2.4, more="stroke-linecap:round;stroke-linejoin:round"),
            _pen(one + ".link", "crank", 1.3, "crank-face"),
            _pen(one + ".link.driver", "driver", 1.3, "driver-face"),
            _pen(one + ".link.coupler", "coupler", 1.3, "coupler-face", "fill-opacity:.7"),
            f"{one}.link.plate{{fill-opacity:.7}}",
            _pen(one + ".slider," + one + ".slide", "crank", 1.3, "paper"),
            _pen(one + ".pin", "ink", 1.4, "paper"),
            _pen(one + ".point", "paper", 1, "path"),
            _pen(one + ".drive", "driver", 1.2, more="stroke-linecap:round;stroke-linejoin:round"),
            _pen(one + ".theory", "theory", 1),
            _pen(one + ".faint", "path", 0.9, more="stroke-opacity:.55"),
            _pen(one + ".second", "coupler", 1.2),
            _pen(one + ".velocity", "ink", 1.4, more="stroke-linecap:round;stroke-linejoin:round"),
            f"{one}.dashed{{stroke-dasharray:calc(4*var(--guide-point)) calc(3*var(--guide-point))}}",
            f"{one}.filled{{fill:{colour('theory')}}}",
            f"{one}text{{font-family:'DejaVu Sans',Verdana,sans-serif;font-size:calc(9*var(--guide-point));"
            f"fill:{colour('ink')};stroke:none}}",
            f"{one}.halo{{paint-order:stroke;stroke:{colour('paper')};stroke-width:calc(3*var(--guide-point));"
            "stroke-linejoin:round}",
            *(f".guide-drawing.hide-{name} .layer.{name}{{display:none}}" for name in LAYER_NAMES),
            f"@media(prefers-color-scheme:dark){{svg.guide-drawing:root{{{properties(DARK)}}}}}",
        ]
    )


LAYER_NAMES = ("turn", "circle", "cubics", "centrodes", "pole", "velocity", "names")
#: Style sheet of moving drawings: a page of many needs it once.
STYLE = _style()
