# Adds nothing.  Each process that loads it holds a lock of its own until it has ended, however it ends.
import fcntl
import os
from pathlib import Path

LOCK = Path(os.environ["TEST_LOCKS"], str(os.getpid())).open("w")  # noqa: SIM115  (it is held to the end)
fcntl.flock(LOCK, fcntl.LOCK_EX)
