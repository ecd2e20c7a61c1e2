"""Published mechanisms of many bars, from their lengths."""

from __future__ import annotations

from typing import Any

#: T. Jansen, The Great Pretender, 2007: the eleven numbers of the leg of a beach animal.
JANSEN: dict[str, Any] = {
    "joints": {
        "O": [0, 0],
        "D": [-38, -7.8],
        "B": {"O": 15, "angle": 0},
        "C": {"B": 50, "D": 41.5, "side": "right"},
        "E": {"C": 55.8, "D": 40.1, "side": "right"},
        "F": {"B": 61.9, "D": 39.3, "side": "left"},
        "G": {"E": 39.4, "F": 36.7, "side": "left"},
        "foot": {"G": 65.7, "F": 49, "side": "left"},
    },
    "bars": {
        "frame": ["O", "D"],
        "crank": ["O", "B"],
        "j": ["B", "C"],
        "upper": ["C", "D", "E"],
        "k": ["B", "F"],
        "c": ["F", "D"],
        "f": ["E", "G"],
        "lower": ["G", "F", "foot"],
    },
    "drive": "crank",
    "point": "foot",
    "name": "Jansen",
}

#: A Klann leg (US patent 6 260 862) in the lengths of boim.com/Walkin8r/Klann.html.
KLANN: dict[str, Any] = {
    "joints": {
        "A": [0, 0],
        "B": [-38.8, -12.5],
        "D": [-14.6, 41.9],
        "C": {"A": 17.5, "angle": 90},
        "H": {"C": 38.8, "B": 23.7, "side": "right"},
        "F": {"C": 73.4, "H": 35.2, "side": "left"},
        "E": {"F": 57.7, "D": 34.1, "side": "left"},
        "foot": {"E": 111.7, "F": 59, "side": "left"},
    },
    "bars": {
        "frame": ["A", "B", "D"],
        "crank": ["A", "C"],
        "rod": ["C", "H", "F"],
        "lower-rocker": ["B", "H"],
        "upper-rocker": ["D", "E"],
        "leg": ["E", "F", "foot"],
    },
    "drive": "crank",
    "point": "foot",
    "name": "Klann",
}

#: P. L. Chebyshev's lambda linkage of his walking machine, its foot kept parallel to the frame.
CHEBYSHEV: dict[str, Any] = {
    "joints": {
        "A": [0, 0],
        "D": [2, 0],
        "B": {"A": 1, "angle": 100},
        "C": {"B": 2.5, "D": 2.5, "side": "left"},
        "P": {"from": "B", "to": "C", "along": 5, "across": 0},
        "toe": [4, 3],
    },
    "bars": {
        "frame": ["A", "D"],
        "crank": ["A", "B"],
        "coupler": ["B", "C", "P"],
        "rocker": ["C", "D"],
        "foot": ["P", "toe"],
    },
    "parallel": [["frame", "foot"]],
    "drive": "crank",
    "point": "toe",
    "name": "Chebyshev",
}

#: A rear suspension with a Horst link: axle on the seat stay, shock between rocker and frame [mm].
BICYCLE: dict[str, Any] = {
    "joints": {
        "main": [0, 0],
        "upper": [-30, 215],
        "mount": [60, 120],
        "horst": {"main": 395, "angle": 181},
        "link": {"horst": 388, "upper": 105, "side": "right"},
        "axle": {"horst": 42, "link": 400, "side": "left"},
        "eye": {"upper": 55, "link": 140, "side": "right"},
    },
    "bars": {
        "frame": ["main", "upper", "mount"],
        "chainstay": ["main", "horst"],
        "seatstay": ["horst", "link", "axle"],
        "rocker": ["upper", "link", "eye"],
        "body": ["mount"],
        "shaft": ["eye"],
    },
    "slides": [{"bar": "body", "slider": "shaft", "along": ["mount", "eye"]}],
    "drive": "chainstay",
    "point": "axle",
    "unit": "mm",
    "name": "Horst link",
}

#: C.-N. Peaucellier 1864: two long arms 5, rhombus 2, crank as long as the frame.
PEAUCELLIER: dict[str, Any] = {
    "joints": {
        "O": [0, 0],
        "Q": [1.6, 0],
        "C": {"Q": 1.6, "angle": 20},
        "B": {"O": 5, "C": 2, "side": "left"},
        "D": {"O": 5, "C": 2, "side": "right"},
        "P": {"B": 2, "D": 2, "side": "left"},
    },
    "bars": {
        "frame": ["O", "Q"],
        "crank": ["Q", "C"],
        "OB": ["O", "B"],
        "OD": ["O", "D"],
        "BC": ["B", "C"],
        "CD": ["C", "D"],
        "BP": ["B", "P"],
        "DP": ["D", "P"],
    },
    "drive": "crank",
    "point": "P",
}


def hypocycloid(ring: int, planet: int) -> dict[str, Any]:
    """Return a planet with so many teeth that rolls in a ring fixed to the frame, its radius in units of teeth."""
    return {
        "joints": {"O": [0, 0], "A": [ring - planet, 0], "P": [ring, 0]},
        "bars": {"frame": ["O"], "arm": ["O", "A"], "planet": ["A", "P"]},
        "gears": [{"wheels": ["frame", "planet"], "carrier": "arm", "ratio": ring / planet}],
        "drive": "arm",
        "point": "P",
    }
