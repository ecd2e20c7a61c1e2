"""Collection: mechanisms as specimens of the catalogue.

`definition.COLLECTION` is what the hook returns: `draw` draws specimens, choosing the point that
runs straightest (`straightest_point`), `measures` has the metrics and measures what is asked for,
`classification` says which mechanism it is, `picture` plots it, `plain_data` is how it is stored.
Import from the modules; they import `kinematics` and `geometry`.
"""
