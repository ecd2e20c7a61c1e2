"""What a command imports: nothing that its scene does not need."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

MINE = '{"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}'
PLANAR = [
    "find straight-line --stroke 150 --deviation 0.5 --limit 3",
    "find circular-arc --stroke 100 --deviation 0.5 --radius 120 --limit 2 --plot arc.svg",
    "find circular-arc --stroke 100 --deviation 0.5 --radius 120 --limit 2 --format json",
    "find dwell --angle 60 --residual 1 --swing 20 --limit 2",
    "show watt --plot watt.png",
    "show 100 --plot one.svg --moving",
    "measure mine.json --stroke 120 --plot measured.svg",
    "sheet watt --out sheet.html",
    "plate I.GG --out plate.svg",
]
#: What a process runs: each command, and then whether it ended well and an optimiser is imported.
CODE = """
import sys
from catalogue.cli import main
for words in sys.argv[1:]:
    sys.argv = ["catalogue", *words.split()]
    try:
        main()
    except SystemExit as end:
        print(words, end.code or 0, "scipy.optimize" in sys.modules, file=sys.stderr)
"""


def test_no_planar_command_imports_an_optimiser(environment: dict[str, str], small_db: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.json").write_text(MINE)
    done = subprocess.run(
        [sys.executable, "-c", CODE, *PLANAR], cwd=tmp_path, capture_output=True, text=True, timeout=300,
        env={**environment, "CATALOGUE_DB": str(small_db), "CATALOGUE_ANSWERS": str(tmp_path / "answers.db")},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = [line for line in done.stderr.splitlines() if line.startswith(tuple(PLANAR))]
    assert told == [f"{words} 0 False" for words in PLANAR], done.stderr


def test_no_card_imports_an_optimiser(environment: dict[str, str], small_db: Path, tmp_path: Path) -> None:
    code = (
        "import sys, catalogue; cat = catalogue.open(); "
        "found = cat.find(catalogue.CircularArc(100, 0.5, 120), limit=2); html = found._repr_html_(); "
        "found[0].off_nominal(found[0].path() @ [1, 1j]); "
        "print(html.count('<svg'), 'scipy.optimize' in sys.modules)"
    )
    env = {**environment, "CATALOGUE_DB": str(small_db), "CATALOGUE_ANSWERS": str(tmp_path / "answers.db")}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, timeout=300)
    assert done.stdout == "2 False\n", done.stderr
