"""Geometry: what a guide is; nothing here moves.

`kinds` says what a surface or a curve states of itself (`surfaces`, `curves` have six and three),
`guides.Guides` lays those of a batch in space; a new kind is a subclass of a few lines.  `rotation`
has quaternions, `power_series` the numbers of which derivatives are made.
"""
