"""Show the progress of long operations on standard error: bars on a terminal, lines elsewhere."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass

#: Delay of the first sign of progress [s]: shorter operations feel immediate and stay silent.
PATIENCE = 1.0
#: Time between two lines of progress where there is no terminal [s]: few lines in a log.
AGAIN = 10.0


@dataclass(frozen=True)
class Progress:
    """State of a build, as it is reported after each block."""

    guides: int  # number of guides of the chosen series in the file
    wanted: int  # requested number of guides
    rows: int = 0  # number of rows written by this run
    seconds: float = 0.0  # elapsed time of this run [s]
    series: str = ""  # code of the current series; empty when done
    failed: tuple[str, ...] = ()  # plugins that raised, with the reason; their series are left out

    @property
    def rate(self) -> float:
        """Rows written per second."""
        return self.rows / self.seconds if self.seconds else 0.0


@contextmanager
def busy(label: str) -> Iterator[None]:
    """Show a pulsing bar and the elapsed time after `PATIENCE`; without a terminal, one line."""
    done = threading.Event()

    def pulse() -> None:
        if done.wait(PATIENCE):
            return
        if not sys.stderr.isatty():
            _say(f"{label} ...")
            return
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as Bar

        columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
        with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
            bar.add_task(label, total=None)
            done.wait()

    thread = threading.Thread(target=pulse, daemon=True)
    with suppress(RuntimeError):  # without threads no progress is shown
        thread.start()
    try:
        yield
    finally:
        done.set()
        if thread.ident is not None:
            thread.join()


@contextmanager
def shown(*, quiet: bool, label: str) -> Iterator[Callable[[Progress], None]]:
    """Yield a function that shows the progress of a build.

    Without a terminal: one line after `PATIENCE`, one every `AGAIN` seconds, one at the end.
    """
    if quiet:
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    last: list[Progress] = []
    console = Console(stderr=True)
    text, series = TextColumn("{task.description}"), TextColumn("guides {task.fields[series]}")
    columns = text, BarColumn(), MofNCompleteColumn(), series, TimeElapsedColumn()
    told = time.monotonic()
    first = threading.Timer(PATIENCE, _say, [f"{label} ..."])
    first.daemon = True
    with ExitStack() as stack, Bar(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task(label, total=None, series="")
        if not console.is_terminal:
            stack.callback(first.cancel)
            with suppress(RuntimeError):
                first.start()

        def report(progress: Progress) -> None:
            nonlocal told
            last[:] = [progress]
            if not console.is_terminal and time.monotonic() - told > AGAIN:
                told = time.monotonic()
                of = f" of {progress.wanted}" * (progress.guides <= progress.wanted)
                _say(f"{label}: {progress.guides}{of} guides ...")
            bar.update(task, total=progress.wanted, completed=progress.guides, series=progress.series)

        yield report
    if last and last[0].rows:
        p = last[0]
        print(f"{label}: {p.guides} guides, {p.rows} rows in {p.seconds:.1f} s ({p.rate:.0f} rows/s)", file=sys.stderr)


def _say(text: str) -> None:
    """Print a line on standard error if it is open."""
    with suppress(OSError, ValueError):
        print(text, file=sys.stderr, flush=True)
