"""Twenty requests of practice, in round millimetres: what a designer writes down, not what a linkage has.

    python tests/benchmarks/recall_practical.py > more_requests.json

None has a linkage of origin; what is known of each is what an independent search found (`independent_search.py`).
"""

from __future__ import annotations

import json
from typing import Any

from measuring import arguments

GROUP = "practical"
PINS: dict[str, Any] = {"pins_only": True}
#: Job, stroke, radius (0: a line, None: any arc), deviation, what is ranked by, constraints.
JOBS: list[tuple[str, float, float | None, float, str, dict[str, Any]]] = [
    ("level-luffing crane", 12000, 0, 60, "size",
     PINS | {"min_transmission": 25, "fixed_pivots_in": [-20000, -25000, 0, -4000], "max_link": 16000}),
    ("harbour crane over a hold", 10000, 0, 40, "transmission",
     PINS | {"fixed_pivots_in": [-9000, -16000, -2000, -6000], "max_size": 22000}),
    ("press", 80, 0, 0.2, "score", {"full_rotation": True, "max_link": 250, "min_drive_angle": 100}),
    ("walking leg", 200, 0, 2, "balance",
     PINS | {"min_transmission_turn": 30, "max_size": 600, "min_uniformity": 0.6}),
    ("lift table", 400, 0, 1.5, "balance", {"swept_in": [-150, -400, 550, 60], "min_transmission": 30}),
    ("recorder pen", 60, 0, 0.1, "balance", PINS | {"min_allowance": 0.01}),
    ("axle guide", 120, 0, 0.3, "score", PINS | {"max_size": 300, "min_transmission": 45}),
    ("suspension arc", 160, 600, 0.5, "transmission",
     PINS | {"fixed_pivots_in": [-50, -350, 210, -100], "max_link": 350}),
    ("hinged door", 300, 500, 0.2, "size", PINS | {"min_transmission": 40, "max_ground": 250}),
    ("window stay", 250, 0, 1, "size",
     PINS | {"pivots_in": [-50, -250, 300, 20], "max_rotation": 90, "min_transmission": 25}),
    ("dwell drive", 100, 80, 0.1, "transmission", PINS | {"full_rotation": True, "max_size": 300}),
    ("packaging pusher", 50, 0, 0.3, "balance",
     PINS | {"full_rotation": True, "min_uniformity": 0.8, "max_drive_angle": 200}),
    ("parallel gripper", 40, 0, 0.05, "size", PINS | {"max_rotation": 20, "min_transmission": 35}),
    ("guillotine knife", 150, 0, 0.5, "size", {"keep_out": [[20, 10, 130, 200]], "min_transmission": 35}),
    ("camera boom", 300, 0, 0.5, "score",
     {"families": ["inverted-slider-crank"], "max_travel": 150, "min_transmission": 40}),
    ("engine indicator", 70, 0, 0.1, "transmission", PINS | {"max_ground": 90, "max_arm": 50, "max_link": 120}),
    ("seat rail", 200, 0, 1, "transmission", PINS | {"swept_in": [-80, -260, 280, 20]}),
    ("valve lifter", 12, 0, 0.01, "balance", PINS | {"min_advantage": 0.8, "max_size": 40}),
    ("reclining backrest", 350, None, 1, "size",
     PINS | {"max_rotation": 40, "fixed_pivots_in": [0, -400, 350, -50], "min_transmission": 30}),
    ("knee of an orthosis", 90, 60, 0.4, "balance",
     PINS | {"pivots_in": [-20, -60, 110, 40], "min_link": 15, "min_ground": 15}),
]  # fmt: skip


def requests() -> list[Any]:
    """Return the requests, with nothing known."""
    return [
        {
            "name": f"p{number:02d}",
            "group": GROUP,
            "job": job,
            "kind": "straight-line" if radius == 0 else "circular-arc",
            "stroke": stroke,
            "radius": radius or None,
            "deviation": deviation,
            "constraints": constraints,
            "rank_by": rank,
            "known": None,
        }
        for number, (job, stroke, radius, deviation, rank, constraints) in enumerate(JOBS, 1)
    ]


if __name__ == "__main__":
    arguments().parse_args()
    print("[\n" + ",\n".join(json.dumps(request) for request in requests()) + "\n]")
