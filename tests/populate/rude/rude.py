# Series that misbehave, each in its own way, while blocks are made.
import os
import signal
import sys

import numpy as np

from catalogue.plugin import Guided, Member, Parameter, Series, circle_pair, hookimpl, linkage_of, normal_pair

KAPPA = Parameter("kappa", ((0.1, 0.13),), "rho0/R")
PHI = Parameter("phi1", ((0.3, 1.3),), "direction of crank 1 [rad]")


def member(before=lambda: None, name="general"):
    def pivots(p):
        before()
        return linkage_of(circle_pair(p["kappa"], p["phi1"]), circle_pair(p["kappa"], np.pi - p["phi1"]))

    return Member(name, "four-bar", [KAPPA, PHI], pivots)


def prints():
    print("what a plugin prints")
    os.write(1, b"past the buffer")
    assert sys.stdin.read() == ""


def raises():
    raise ZeroDivisionError("first line\nsecond line")


def once(file):
    """Kill the process, the first time that it is called with the file."""
    try:
        os.close(os.open(file, os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return
    os.kill(os.getpid(), signal.SIGKILL)


def endless():
    while True:
        pass


def allocates():
    raise MemoryError


def few(p):
    return linkage_of(circle_pair(p["kappa"], p["phi1"]), circle_pair(p["kappa"], np.pi - p["phi1"]))[:7]


def series(code, *members, order=4, pairs=normal_pair):
    def guided(p):
        return [Guided("undulation", pairs(np.zeros_like(p["kappa"])), order)]

    def classify(instant):
        return np.ones(len(instant.linkage)), np.ones(len(instant.linkage))

    return Series(code, "misbehaves", code, "for the tests", members, classify, guided)


@hookimpl
def catalogue_series():
    return [
        series("R.prints", member(prints)),
        series("R.raises", member(raises)),
        series("R.half", member(), member(raises, "raises")),
        series("R.exits", member(lambda: sys.exit("enough"))),
        series("R.ends", member(lambda: os._exit(7))),
        series("R.killed", member(lambda: os.kill(os.getpid(), signal.SIGKILL))),
        series("R.aborts", member(os.abort)),
        series("R.once", member(lambda: once(os.environ["TEST_ONCE"]))),
        series("R.endless", member(endless)),
        series("R.greedy", member(allocates)),
        series("R.few", Member("general", "four-bar", [KAPPA, PHI], few)),
        series("R.refused", member(), order=0),
        series("R.empty", member(), pairs=lambda v: normal_pair(v) * np.nan),
    ]
