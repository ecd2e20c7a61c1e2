"""Kinds of guides by element (point, slot, returning point) and nominal (line, circle)."""

from __future__ import annotations

#: A coupler point runs along a line or circle.
POINTS = {"line": "line", "circle": "circle"}
#: The coupler carries a straight or circular slot over a fixed point.
SLOTS = {"line": "slot", "circle": "arc"}
#: A coupler point runs along a line or circle to the pole and back.
RETURNS = {"line": "return-line", "circle": "return-circle"}
#: Kinds whose nominal is a line.
STRAIGHT = tuple(kinds["line"] for kinds in (POINTS, SLOTS, RETURNS))
