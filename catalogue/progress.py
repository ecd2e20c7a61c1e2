"""Progress bars on standard error for what takes more than a second."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .populate import Progress

#: After how long a pulsing bar appears [s].
PATIENCE = 1.0


@contextmanager
def busy(label: str) -> Iterator[None]:
    """Show a pulsing bar and the time once what is done meanwhile takes longer than `PATIENCE`, on a terminal only."""
    if not sys.stderr.isatty():
        yield
        return
    done = threading.Event()

    def pulse() -> None:
        if done.wait(PATIENCE):
            return
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as Bar

        columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
        with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
            bar.add_task(label, total=None)
            done.wait()

    thread = threading.Thread(target=pulse, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


@contextmanager
def shown(*, quiet: bool, label: str) -> Iterator[Callable[[Progress], None]]:
    """Yield a function that shows the state of a build; where standard error is no terminal, one line at the end."""
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
    with Bar(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task(label, total=None, series="")

        def report(progress: Progress) -> None:
            last[:] = [progress]
            bar.update(task, total=progress.wanted, completed=progress.guides, series=progress.series)

        yield report
    if last and last[0].rows:
        p = last[0]
        print(f"{label}: {p.guides} guides, {p.rows} rows in {p.seconds:.1f} s ({p.rate:.0f} rows/s)", file=sys.stderr)
