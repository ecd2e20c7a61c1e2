"""Studies: many requests as one monotone map, run on any engine, stored in a file and resumable.

`study` has `Study`, `reading` files of requests and grids, `order` what is looser and tighter,
`run` the rounds, `task` the work of a worker, `results_file` the file and `models` its tables;
`chart` the map with its `contours` and `front` the Pareto front of a request, each a `page`.
Import `Study` from `catalogue`.
"""

from __future__ import annotations
