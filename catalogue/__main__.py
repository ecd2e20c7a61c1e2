"""``python -m catalogue`` is the command ``catalogue``."""

from .cli import main

main()
