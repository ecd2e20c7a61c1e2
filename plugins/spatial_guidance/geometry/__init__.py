"""Geometry: what a guide is, and what a path is nearest to; nothing here moves.

`kinds` says what a surface or a curve states of itself (`surfaces`, `curves` have six and three), `guides.Guides` lays
those of a batch in space; a new kind is a subclass of a few lines and a place in `guides.KINDS`.  `minimum_zone` has
the narrowest cylinder and torus about a path, `rotation` quaternions, `power_series` the numbers of which derivatives
are made.  Import from the modules; they import `catalogue.plugin` alone.
"""
