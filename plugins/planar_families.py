"""The six families of linkages with two guiding dyads (Allievi 1895, Introduction, sec. 3)."""

from collections.abc import Iterator

from catalogue.plugin import Family, hookimpl


@hookimpl
def catalogue_families() -> Iterator[Family]:
    """Yield every combination of two dyads out of crank (RR), slider (PR) and slide (RP)."""
    yield Family("four-bar", "two cranks", "four-bar", "RR.RR")
    yield Family("slider-crank", "crank and slider", "inverted-slider-crank", "RR.PR")
    yield Family("inverted-slider-crank", "crank and slide", "slider-crank", "RR.RP")
    yield Family("swinging-block", "slider and slide (conchoidal)", "swinging-block", "PR.RP")
    yield Family("elliptic-trammel", "two sliders", "oldham", "PR.PR")
    yield Family("oldham", "two slides", "elliptic-trammel", "RP.RP")
