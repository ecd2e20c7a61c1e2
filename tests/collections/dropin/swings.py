"""A small collection: pendulums, and points of rolling discs."""

from __future__ import annotations

import numpy as np

from catalogue.plugin import hookimpl

__version__ = "1.0"


def path(p):
    """Points (201,) of the path, complex, and its stroke, before it is laid."""
    t = np.linspace(-p["swing"], p["swing"], 201)
    if p["kind"] == "pendulum":
        return 1j * p["length"] * np.exp(-1j * t), 2 * p["length"] * np.sin(p["swing"])
    z = p["length"] * (t + p["eccentricity"] * (np.sin(t) + 1j * np.cos(t)))
    return z, (z[-1] - z[0]).real


def numbers(p, stroke):
    return {"size": p["length"], "swing": 2 * np.degrees(p["swing"]), "sweep": sweep(p, stroke)}


def sweep(p, stroke):
    return stroke / p["length"] if p["kind"] == "pendulum" else 0.0


def draw(family, rng, count):
    from catalogue.plugin import Specimen

    out = []
    for _ in range(count):
        p = {"kind": family, "length": 1.0, "swing": float(rng.uniform(0.02, 0.5))}
        if family == "roller":
            p["eccentricity"] = float(rng.uniform(0.2, 0.9))
        p["length"] = float(1 / path(p)[1])
        series = "simple" if family == "pendulum" else "curtate"
        deviation = float(np.ptp(path(p)[0].imag) / 2)
        out.append(
            Specimen(family, series, "bar" if family == "pendulum" else "disc", "line", deviation, p, numbers(p, 1))
        )
        if family == "pendulum":
            out.append(Specimen(family, series, "bar", "circle", 0.0, p, numbers(p, 1)))
    return out


def measure(parameters, request):
    from catalogue.plugin import Measured

    out = []
    for given in parameters:
        p = {**given, "length": float(given["length"] * request.stroke / path(given)[1])}
        z, stroke = path(p)
        if request.kind == "line":
            out.append(Measured(float(np.ptp(z.imag) / 2), None, numbers(p, stroke), p))
        elif p["kind"] != "pendulum":
            out.append(Measured.no("a disc that rolls leads no point round"))
        else:
            radius = request.radius or p["length"]
            off = abs(z) if radius == p["length"] else np.abs(z - 1j * (p["length"] - radius))
            out.append(Measured(float(np.ptp(off) / 2), float(radius), numbers(p, stroke), p))
    return out


def classify(p):
    from catalogue.plugin import Tags

    if p["kind"] == "roller":
        return Tags("roller", "curtate", "disc")
    small = p["swing"] < np.radians(5)
    return Tags("pendulum", "simple", "bar", ("seconds",) if small else ())


def plot(piece, file):
    from catalogue.plugin import blank, kind_of, write

    figure = blank(4, 3)
    z, _ = path(piece.parameters)
    figure.add_subplot().plot(z.real, z.imag)
    if file is not None:
        write(figure, file, kind_of(file))
    return figure


@hookimpl
def catalogue_collections():
    from catalogue.plugin import LENGTH, Collection, Metric

    metrics = {
        "size": Metric("length of the bar, radius of the disc", LENGTH),
        "swing": Metric("angle of the motion", "deg", more=True),
        "sweep": Metric("stroke over radius", "1"),
    }
    families = {"pendulum": ("simple",), "roller": ("curtate",)}
    return [
        Collection("swings", "Things that swing", "any school", "1", families, metrics, draw, measure, classify, plot)
    ]
