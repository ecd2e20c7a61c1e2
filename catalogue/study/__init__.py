"""Studies: many requests as one monotone map, run on any engine, stored in a file and resumable.

`study` has `Study`; `reading` reads requests and grids; `run` performs the rounds, `task` is the
work of a worker; `results_file` is the file, `models` its tables.  `chart` draws the map with its
`contours`, `front` the Pareto front of a request, each as a `page`. Import `Study` from
`catalogue`.
"""

from __future__ import annotations
