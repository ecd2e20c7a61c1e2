"""A grid of requests as one map: equal on every engine and after kills, monotone, against plain finds.

    python tests/benchmarks/study_map.py DB [--count 100] [--engines serial processes:2 dask:2] [--kill] [--plain]

The grid is n x n x m requests of about `--count` in all: tolerance, box of the fixed pivots, transmission angle.  With
`--kill` one worker of each study is killed after a quarter of the results, the study itself after half of them, and
the command run again.  With `--plain` each request is asked alone as well: what the map costs and gains, and in how
many ordered pairs the looser request has the worse answer.
"""

from __future__ import annotations

import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from measuring import arguments, table, title

import catalogue
from catalogue import Catalogue, Request, Study
from catalogue.guides.codes import record, text_of
from catalogue.problem.order import Order
from catalogue.study import task

Array = np.ndarray[Any, Any]
BASE: dict[str, Any] = {"stroke": 150, "unit": "mm", "fixed_pivots_in": [-150, -100, 250, 100]}
TOLERANCES, BOXES, ANGLES = (0.05, 1.0), (0.5, 1.5), (20.0, 50.0)
LEVELS = 3  #: of the transmission angle
SAME = 1e-3  #: Costs that differ by less are the same: a tenth of a point of score


def grid(count: int) -> list[Request]:
    """Return about so many requests."""
    n = max(round((count / LEVELS) ** 0.5), 2)
    axes = {
        "deviation": np.geomspace(*TOLERANCES, n).round(4).tolist(),
        "fixed_pivots_in": {"scale": np.linspace(*BOXES, n).round(3).tolist()},
        "min_transmission": np.linspace(*ANGLES, LEVELS).round(1).tolist(),
    }
    with TemporaryDirectory() as folder:
        study = Study.grid({**BASE, "deviation": 1}, Path(folder) / "x.study", **axes)
        return [study[k].request for k in range(1, len(study) + 1)]


# -- a study in a process of its own ---------------------------------------------------------------------------------
def child(database: str, file: str, name: str, count: int) -> None:
    """Run the study, printing the number of results of its round."""
    with catalogue.open(database) as cat:
        Study(grid(count), file).run(cat, engine=name, report=lambda state: print(state.done, flush=True))


def run(database: str, file: Path, name: str, count: int, *, kill: bool) -> tuple[float, float, int]:
    """Return the seconds of the wall and of the processors that a study takes, and the number of kills."""
    command = [sys.executable, __file__, database, "--count", str(count), "--child", str(file), name]
    wall, cpu, kills = time.perf_counter(), sum(os.times()[2:4]), 0
    left = {count // 2: False, count // 4: True} if kill else {}
    while True:
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            for line in process.stdout:
                if left and int(line) >= min(left):
                    worker = left.pop(min(left))
                    victims = children(process.pid) if worker else [process.pid]
                    if victims:
                        os.kill(random.choice(victims), signal.SIGKILL)
                        kills += 1
        if process.returncode == 0:
            break
        assert process.returncode == -signal.SIGKILL, process.returncode
    return time.perf_counter() - wall, sum(os.times()[2:4]) - cpu, kills


def children(pid: int) -> list[int]:
    """Return the worker processes of a process, by what the system tells of them."""
    found = subprocess.run(["ps", "-o", "pid=,args=", "--ppid", str(pid)], capture_output=True, text=True, check=False)
    lines = [line.split(maxsplit=1) for line in found.stdout.splitlines()]
    return [int(one) for one, words in lines if "catalogue.engines.worker" in words or "spawn_main" in words]


def digest(study: Study) -> str:
    """Return a digest of both tables of a study."""
    text = study.to_pandas().to_csv() + study.answers().to_csv()
    return hashlib.sha256(text.encode()).hexdigest()[:12]


# -- against plain finds ---------------------------------------------------------------------------------------------
def alone(cat: Catalogue, requests: list[Request]) -> tuple[list[str | None], float]:
    """Return the best answer to each request asked alone, and the processor time of all."""
    clock, best = time.process_time(), []
    for request in requests:
        found = cat.find(request)
        best.append(text_of(record(found[0])) if len(found) else None)
    return best, time.process_time() - clock


def costs(requests: list[Request], best: list[str | None]) -> Array:
    """Return what each answer costs by each request's ranking, shape (requests, answers); infinite without one."""
    rows: dict[Any, Array] = {}
    held = [k for k, one in enumerate(best) if one is not None]
    for request in requests:
        if request.path not in rows:
            row = rows[request.path] = np.full(len(best), np.inf)
            row[held] = task.costs(request.to_json(), [one for one in best if one is not None])
    return np.array([rows[request.path] for request in requests])


def worse_pairs(requests: list[Request], cost: Array) -> tuple[int, int, float]:
    """Return the ordered pairs, those of them with the worse answer to the looser request, and by how much at most."""
    count, worse, most = 0, 0, 0.0
    for looser, tighter, _ in Order.of(requests).tighter():
        over = cost[looser, looser] - cost[looser, tighter]
        over = over[np.isfinite(cost[looser, tighter])]
        count += len(over)
        worse += int((over > SAME).sum())
        most = max(most, float(np.max(over, initial=0.0)))
    return count, worse, most


def compare(cat: Catalogue, requests: list[Request], study: Study) -> None:
    """Print how the map compares with plain finds."""
    best, seconds = alone(cat, requests)
    mapped = [next(iter(study[k].records), None) for k in range(1, len(requests) + 1)]
    plain, map_ = costs(requests, best), costs(requests, mapped)
    rows = []
    spent = float(study.to_pandas(seconds=True)["seconds"].sum())
    for name, cost, time_ in (("plain finds", plain, seconds), ("one map", map_, spent)):
        own = np.diag(cost)
        pairs, worse, most = worse_pairs(requests, cost)
        score = 100 * (1 - float(np.mean(own[np.isfinite(own)])))
        rows.append([name, f"{time_ / len(requests):.2f}", f"{score:.2f}", int(np.isinf(own).sum()), pairs, worse,
                     f"{100 * most:.1f}"])  # fmt: skip
    head = ["", "s a request", "mean score", "without", "ordered pairs", "looser is worse", "at most by"]
    table(head, rows)
    both = np.isfinite(np.diag(plain)) & np.isfinite(np.diag(map_))
    gain = 100 * (np.diag(plain) - np.diag(map_))[both]
    limits = {
        "below -1": gain < -1,
        "-1 to -0.1": (gain >= -1) & (gain < -0.1),
        "equal to 0.1": np.abs(gain) <= 0.1,
        "0.1 to 1": (gain > 0.1) & (gain <= 1),
        "above 1": gain > 1,
    }
    table(["gain of the map in score", *limits], [["cells", *(int(mask.sum()) for mask in limits.values())]])


def main() -> None:
    """Run the study on each engine; compare."""
    parser = arguments()
    parser.add_argument("database")
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--engines", nargs="+", default=["serial", "processes:2", "dask:2"])
    parser.add_argument("--kill", action="store_true")
    parser.add_argument("--plain", action="store_true")
    parser.add_argument("--child", nargs=2, help="used by the benchmark itself")
    given = parser.parse_args()
    if given.child:
        file, name = given.child
        return child(given.database, file, name, given.count)
    title("A grid of requests as one map")
    requests = grid(given.count)
    with TemporaryDirectory() as folder, catalogue.open(given.database) as cat:
        rows, study = [], Study(requests)
        for number, name in enumerate(given.engines):
            file = Path(folder) / f"{number}.study"
            wall, cpu, kills = run(given.database, file, name, len(requests), kill=given.kill)
            study = Study.open(file)
            inside = float(study.to_pandas(seconds=True)["seconds"].sum())
            size = file.stat().st_size / len(requests) / 1e3
            rows.append([name, len(requests), f"{wall:.0f}", f"{cpu / len(requests):.2f}",
                         f"{inside / len(requests):.2f}", kills, f"{size:.0f}", digest(study)])  # fmt: skip
        head = ["engine", "requests", "s", "s of a core a request", "in the search", "kills", "kB a request", "tables"]
        table(head, rows)
        equal = len({row[-1] for row in rows}) == 1
        print(json.dumps({"equal": equal}), flush=True)
        if given.plain:
            compare(cat, requests, study)
    return None


if __name__ == "__main__":
    main()
