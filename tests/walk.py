"""Count the modules of the core that one command passes, and the calls that climb from a floor to a higher one.

    python tests/walk.py find straight-line --stroke 150 --deviation 0.05 --db FILE

A module counts when one of its functions runs; modules that are only loaded do not.
"""

from __future__ import annotations

import sys
from collections import Counter
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any

from catalogue.cli import main

sys.path.insert(0, str(Path(__file__).parent))
from test_floors import FLOOR, ROOT, room


@cache
def module(file: str) -> str | None:
    """Return the path of a module of the core below its root, None of another file."""
    path = Path(file)
    return path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else None


@cache
def floor(name: str) -> int:
    known: int = FLOOR.get(room(ROOT / name), 99)
    return known


def walk(arguments: list[str]) -> tuple[dict[str, int], Counter[tuple[str, str]]]:
    """Run a command and return its modules with the calls into each, in the order of the first, and the climbs.

    A climb is a call into a room on a higher floor than the caller's.
    """
    calls: dict[str, int] = {}
    climbs: Counter[tuple[str, str]] = Counter()

    loading = 0  # modules, one within another

    def called(frame: FrameType, event: str, _: Any) -> None:
        nonlocal loading
        name = module(frame.f_code.co_filename)
        if event not in ("call", "return") or name is None:
            return
        if frame.f_code.co_name == "<module>":
            loading += 1 if event == "call" else -1
        if loading or event == "return":
            return
        calls[name] = calls.get(name, 0) + 1
        back, caller = frame.f_back, None
        while back is not None and caller is None:
            caller, back = module(back.f_code.co_filename), back.f_back
        if caller is not None and floor(name) > floor(caller):
            climbs[caller, name] += 1

    sys.argv = ["catalogue", *arguments]
    sys.setprofile(called)
    try:
        main()
    except SystemExit:
        pass
    finally:
        sys.setprofile(None)
    return calls, climbs


if __name__ == "__main__":
    modules, climbs = walk(sys.argv[1:])
    for name, count in modules.items():
        print(f"{count:8d}  {name}")
    for (below, above), count in climbs.items():
        print(f"{count:8d}  {below} climbs to {above}")
    print(f"{len(modules)} modules, {len(climbs)} climbs")
