"""Geometry of guides: surfaces and curves, rotations, power series.

`kinds` has the base class of surfaces and curves (`surfaces`, `curves` have six and three);
`guides.Guides` places those of a batch in space; a new kind is a subclass of a few lines.
`rotation` has quaternions, `power_series` the series for derivatives.
"""
