"""The command ``catalogue``: one module per command, with its options.

`app` puts the commands together, `options` and `find_options` are what several of them share, `tables` prints,
`reading` reads linkages from files.  Only `main` is for others; the modules import `api` and what lies below, late, so
that ``--help`` is quick.
"""

from __future__ import annotations

import os
import sys

#: Exit code after Ctrl-C.
INTERRUPTED = 130


def main() -> None:
    """Run the command line; every expected error is one line on standard error and a documented exit code."""
    from ..errors import CatalogueError

    _only_one_catalogue()
    # The matrices are small: more threads of linear algebra cost more than they bring.  NumPy reads this when imported.
    for name in ("OMP", "OPENBLAS", "MKL"):
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    try:
        from .app import app, run

        code = run(app)
        if code == INTERRUPTED:  # made of Ctrl-C by typer, without a word
            raise KeyboardInterrupt
    except CatalogueError as error:
        print(f"catalogue: {error}", file=sys.stderr)
        code = error.exit_code
    except KeyboardInterrupt:
        print("catalogue: interrupted; what was finished is kept", file=sys.stderr)
        code = INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone
        sys.stderr.close()
        code = 141
    sys.exit(code)


def _only_one_catalogue() -> None:
    """Another distribution installs a package of the same name; together they overwrite each other's files."""
    from importlib.metadata import PackageNotFoundError, distribution

    try:
        distribution("catalogue")
    except PackageNotFoundError:
        return
    print(
        "catalogue: the distribution `catalogue` is installed beside `mechanism-catalogue` and both own the package "
        "`catalogue`; uninstall both, then install the one you need, or use a virtual environment for each",
        file=sys.stderr,
    )
    sys.exit(5)
