"""Count the modules of the core that one command passes, and the calls that climb from a floor to a higher one.

    python tests/walk.py find straight-line --stroke 150 --deviation 0.05 --db FILE

A module counts when one of its functions runs; modules that are only loaded do not.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from types import FrameType
from typing import Any

from catalogue.cli import main

sys.path.insert(0, str(Path(__file__).parent))
from test_floors import FLOOR, ROOT, room


def walk(arguments: list[str]) -> tuple[dict[str, int], Counter[tuple[str, str]]]:
    """Run a command and return its modules with the calls into each, in the order of the first, and the climbs.

    A climb is a call into a room on a higher floor than the caller's.
    """
    calls: dict[str, int] = {}
    climbs: Counter[tuple[str, str]] = Counter()

    loading = 0  # modules, one within another

    def called(frame: FrameType, event: str, _: Any) -> None:
        nonlocal loading
        path = Path(frame.f_code.co_filename)
        if event not in ("call", "return") or not path.is_relative_to(ROOT):
            return
        if frame.f_code.co_name == "<module>":
            loading += 1 if event == "call" else -1
        if loading or event == "return":
            return
        name = path.relative_to(ROOT).as_posix()
        calls[name] = calls.get(name, 0) + 1
        caller = frame.f_back
        while caller is not None and not Path(caller.f_code.co_filename).is_relative_to(ROOT):
            caller = caller.f_back
        if caller is not None and FLOOR.get(room(path), 0) > FLOOR.get(room(Path(caller.f_code.co_filename)), 99):
            climbs[Path(caller.f_code.co_filename).relative_to(ROOT).as_posix(), name] += 1

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
