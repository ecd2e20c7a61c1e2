"""The contract of a series, as tests that every plugin inherits."""

from __future__ import annotations

from functools import cache

from ..plugin.registry import Registry
from ..series.series import Series
from .guides import GuidesContract
from .membership import MembershipContract


def load(code: str, *folders: object) -> Series:
    """Load a series by its code, from the built-in plugins and from `folders`."""
    return _registry(tuple(map(str, folders))).get(code)


@cache
def _registry(folders: tuple[str, ...]) -> Registry:
    """Load the plugins of some folders, only once for any number of series."""
    return Registry(folders)


class SeriesContract(MembershipContract, GuidesContract):
    """Tests that every series must pass.

    To test yours: 1. subclass this with a name that begins with ``Test``; 2. set `series`, for
    instance to ``load("my.x0", folder)``; 3. if it has special parameter points, at which orders
    rise or pairs vanish, add them to `special`; 4. if a member lacks a guided element everywhere,
    say so in `absent`.

    Attributes
    ----------
    series : Series
    folders : sequence, optional
        Plugin folders to load besides the built-in one; the inverse series and the families may be
        in these folders.
    special : mapping, optional
        Parameter points, by the key of the member, that are tested besides the even sample.
    absent : collection of (key of member, label), optional
        Guided elements that are NaN throughout a member on purpose.
    """

    def test_data_are_complete(self) -> None:
        known = self.registry().families
        for text in (self.series.code, self.series.title, self.series.source, self.series.inverse):
            assert text.strip() == text != "", f"{self.series.code}: code, title, source and inverse must not be blank"
        for member in self.series.members:
            assert member.family in known, f"{member.key}: no plugin provides the family {member.family}"
            assert member.weight > 0, f"{member.key}: its weight must be positive"
            names = [p.name for p in member.parameters]
            assert len(set(names)) == len(names), f"{member.key}: two parameters have one name: {names}"
            for p in member.parameters:
                assert p.name.isidentifier(), f"{member.key}: {p.name!r} is no name for a column"
                assert p.meaning.strip(), f"{member.key}: say what {p.name} means"
        keys = {m.key for m in self.series.members}
        assert {*self.special, *(key for key, _ in self.absent)} <= keys, f"special, absent: members are {keys}"
