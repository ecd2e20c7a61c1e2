"""The first ten minutes of a new user: every command of the README, as they come, and what they print.

python tests/cli/first_minutes.py            # prints it; takes some minutes
python tests/cli/first_minutes.py --write    # renews data/reports/first_minutes.md

A wheel is built of this clone and installed into a new environment; home is an empty folder, the terminal 80 columns
wide, and what is printed goes into a pipe.  CODE in a command stands for the first answer of the `find` before it.
What takes minutes on purpose is left out, with the reason.
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "data" / "reports" / "first_minutes.md"
WIDTH, SHOWN = 80, 24
#: Commands that take minutes on purpose, or do not end.
LEFT_OUT = {
    "catalogue build --count": "a denser catalogue is minutes of work",
    "catalogue serve": "it serves until it is ended",
}
#: What a new user tries besides what the README says, mistakes among them.
BESIDES = (
    "catalogue",
    "catalogue find --stroke 150",
    "catalogue find straight-line --legend",
    "catalogue find straight-line --stroke '6in' --deviation '1/500in' --limit 3",
    "catalogue find straight-line --stroke 6inches --deviation 2thou",
    "catalogue find straight-line --stroke 150 --deviation 0.05 --max-size 10",
    "catalogue show wat",
    "catalogue show CODE --plot guide.unknown",
    "catalogue trace CODE | head -3",
)
HEAD = """\
# The first minutes

What a new user sees: a new environment, an empty home, a terminal of 80 columns, output into a pipe. Every command of
the README as it comes, then some that people try, mistakes among them. Of long output the first {shown} lines are
shown; `[err]` stands before what goes to standard error; of pip nothing is shown. Made by
`python tests/cli/first_minutes.py --write`.
"""


def commands() -> Iterator[str]:
    """Yield the commands of the README in their order, then those that are tried besides."""
    for block in re.findall(r"```sh\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL):
        for line in block.splitlines():
            line = line.split("  #")[0].strip().replace(".venv/bin/", "")
            if "pip install" in line:
                line = line.rpartition("&& ")[2]
            if line.startswith(("catalogue", "echo")):
                yield line
    yield from BESIDES


def transcript() -> str:
    """Return the page."""
    parts = [HEAD.format(shown=SHOWN)]
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder) / "home"
        home.mkdir()
        bin_ = Path(folder) / "venv" / "bin"
        subprocess.run([sys.executable, "-m", "venv", bin_.parent], check=True)
        subprocess.run(
            [bin_ / "pip", "install", "-q", f"{ROOT}[plot,parquet,cad]"], check=True, stderr=subprocess.DEVNULL
        )
        (Path(folder) / "clone").mkdir()
        (Path(folder) / "clone" / "data").symlink_to(ROOT / "data")
        env = {"HOME": str(home), "PATH": f"{bin_}:{os.defpath}", "COLUMNS": str(WIDTH), "LANG": "C.UTF-8"}
        code = ""
        for line in commands():
            if reason := next((why for start, why in LEFT_OUT.items() if line.startswith(start)), ""):
                parts.append(f"`{line}`: left out, {reason}.\n")
                continue
            asked = line.replace("CODE", code or "CODE")
            begin = time.monotonic()
            done = subprocess.run(
                ["sh", "-c", f"{{ {asked}\n}} 2>err | cat; exit 0"], env=env, cwd=Path(folder) / "clone", text=True,
                capture_output=True, check=False, timeout=900,
            )  # fmt: skip
            seconds = time.monotonic() - begin
            told = (Path(folder) / "clone" / "err").read_text("utf-8")
            if " find " in asked and (found := re.search(r"^─+\n(\w{7}) ", done.stdout, re.MULTILINE)):
                code = found[1]
            out = done.stdout.splitlines() + [f"[err] {one}".rstrip() for one in told.splitlines()]
            out = [one.replace(folder, "/new").replace(platform.platform(), platform.system()) for one in out]
            assert "Traceback" not in told, told
            wide = [one for one in done.stdout.splitlines() if len(one) > WIDTH]
            more = [f"... {len(out) - SHOWN} more lines"] * (len(out) > SHOWN)
            note = [f"({len(wide)} lines are wider than {WIDTH}.)\n"] * bool(wide)
            parts.append("\n".join([f"## `{asked}`\n", *note, "```text", *out[:SHOWN], *more, "```\n"]))
            print(f"{seconds:.0f} s: {asked}", file=sys.stderr)
    return "\n".join(parts)


if __name__ == "__main__":
    page = transcript()
    if "--write" in sys.argv:
        PAGE.write_text(page, "utf-8")
    else:
        print(page, end="")
