"""A surface of a user's own, in a file of its own: what `catalogue.spatial.Kind` asks of it and no more."""

import numpy as np

from catalogue.spatial import Kind


class Ellipsoid(Kind):
    """Half axes a, b, c along X, Y, Z; u around Z, w up from the equator."""

    name = "ellipsoid"
    parameters = lengths = ("a", "b", "c")
    spans = (np.pi, np.pi)

    def point(self, u, w, p):
        return p[0] * np.cos(u) * np.cos(w), p[1] * np.sin(u) * np.cos(w), p[2] * np.sin(w)

    def implicit(self, x, p):
        return ((x[0] / p[0]) ** 2 + (x[1] / p[1]) ** 2 + (x[2] / p[2]) ** 2 - 1,)

    def locate(self, x, p):
        return np.arctan2(x[1] / p[1], x[0] / p[0]), np.arctan2(x[2] / p[2], np.hypot(x[0] / p[0], x[1] / p[1]))
