"""Collection: spatial guidance mechanisms as specimens of the catalogue.

The hook returns `definition.COLLECTION`.  `draw` samples specimens and selects the point with the
straightest path (`straightest_point`), `measures` has the metrics and evaluates them,
`classification` finds class and special cases, `picture` plots a mechanism, `plain_data` is its
stored form.  Import from the modules; they import `kinematics` and `geometry`.
"""
