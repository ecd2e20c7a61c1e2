"""Checks of plugins: names that can be printed, typed and stored, data of declared types."""

from __future__ import annotations

import math
from typing import Any

from ..collections.spec import Collection
from ..errors import PluginError
from ..foreign_code import checked_name, checked_text
from ..kinematics.families import Family
from ..series.series import Member, Parameter, Series


def checked(item: Any) -> str:
    """Check a family, series or collection, and return its name, or raise `PluginError`."""
    if isinstance(item, Series):
        return _series(item)
    if isinstance(item, Collection):
        Collection.__post_init__(item)  # a subclass may have skipped this check
        return checked_name("a collection", item.name)
    Family.__post_init__(item)
    checked_name(f"inverse of the family {item.name}", item.inverse)
    checked_text(f"title of the family {item.name}", item.title)
    return checked_name("a family", item.name)


def _series(series: Series) -> str:
    code = checked_name("code of a series", series.code)
    Series.__post_init__(series)
    checked_name(f"inverse of the series {code}", series.inverse)
    checked_text(f"title of the series {code}", series.title)
    checked_text(f"source of the series {code}", series.source)
    for member in series.members:
        if not isinstance(member, Member):
            raise PluginError(f"series {code}: a member is of the class {type(member).__name__}, not Member")
        what = f"series {code}, member {checked_text('name of a member', member.name, 60)}"
        if not all(isinstance(p, Parameter) for p in member.parameters):
            raise PluginError(f"{what}: its parameters must be of the class Parameter")
        names = [checked_name(f"{what}, a parameter", p.name) for p in member.parameters]
        if len(set(names)) < len(names):
            raise PluginError(f"{what}: two parameters have one name")
        if not 0 < member.weight < math.inf:
            raise PluginError(f"{what}: the weight must be positive and finite, not {member.weight}")
    return code
