"""Made-up batches, and a script that writes them without end, to be killed: ``python filler.py FILE``."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from catalogue.store import Database, drop_indexes, make_indexes, prepare, write_batch

Table = dict[str, Any]
GUIDES, LEVELS = 2, 3  # per mechanism, per guide


def sample(number: int, count: int = 4) -> tuple[Table, Table, Table, Table]:
    """Return batch, mechanisms, guides (a line and a circle each) and reaches, all different."""
    random = np.random.default_rng(number)
    batch = {
        "series": "I.GG",
        "member": "plain",
        "plugin": "dwell",
        "plugin_version": "1.0",
        "plan": "7f",
        "seed": 3,
        "number": number,
        "drawn": 2 * count,
        "kept": count,
        "guides": GUIDES * count,
        "wanted": GUIDES * count,
    }
    kappa = random.normal(size=count)
    pivots = random.normal(size=(count, 2, 2, 3))
    pivots[..., 2] = 1
    mechanisms = {
        "family": "four-bar",
        "configuration": np.array(["+-", "++"])[random.integers(2, size=count)],
        "series": "I.GG",
        "member": "plain",
        "name": None,
        "parameters": [f'{{"a": {value!r}}}' for value in random.random(count).tolist()],
        "pivots": pivots,
        "rho0": np.ones(count),
        "kappa": kappa,
        "kappa_star": kappa + 1,
        "s": random.normal(size=count),
    }
    total = GUIDES * count
    angle = random.uniform(0, 2 * np.pi, total)
    guides = {
        "mechanism": np.repeat(np.arange(count), GUIDES),
        "kind": np.tile(["line", "circle"], count),
        "label": "[2]",
        "x": random.normal(size=total),
        "y": random.normal(size=total),
        "tangent_x": np.cos(angle),
        "tangent_y": np.sin(angle),
        "curvature": np.tile([0.0, -0.5], count),
        "contact_order": np.full(total, 3),
        "inflections": np.int64(2),
        "cover": np.arange(total) // GUIDES,
    }
    length = random.uniform(0.5, 4, size=(8, total * LEVELS))
    fixed = np.where(np.arange(total * LEVELS) % LEVELS == 0, np.nan, length[5])
    arc = np.repeat(np.tile([False, True], count), LEVELS)
    reaches = {
        "guide": np.repeat(np.arange(total), LEVELS),
        "level": np.tile(np.arange(-LEVELS, 0), total),
        "stroke": length[0],
        "half": 0.5 * length[0],
        "centre": 0.0,
        "deviation": length[1] * 1e-3,
        "sweep": np.where(arc, 0.2, 0.0),
        "size": length[2],
        "max_link": length[3],
        "min_link": np.nan,
        "max_ground": None,
        "max_arm": length[4],
        "min_transmission": 20 * length[6],
        "rotates": np.arange(total * LEVELS) % 4,
        "drive_angle": np.nan,
        "rotation": 10 * length[6],
        **{f"fixed_{side}": fixed for side in ("x0", "y0", "x1", "y1")},
        **{f"all_{side}": length[7] for side in ("x0", "y0", "x1", "y1")},
    }
    return batch, mechanisms, guides, reaches


def fill(path: str) -> None:
    """Write batches, then index them, over and over."""
    with Database.open(path) as database:
        prepare(database)
        with database.engine.connect() as connection:
            done = connection.exec_driver_sql("SELECT count(*) FROM batch").scalar_one()
            connection.rollback()
            while True:
                drop_indexes(connection)
                for number in range(done, done + 3):
                    write_batch(connection, *sample(number, 300))
                    print("batch", flush=True)
                make_indexes(connection)
                done += 3


if __name__ == "__main__":
    fill(sys.argv[1])
