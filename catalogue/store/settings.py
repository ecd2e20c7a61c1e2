"""The few facts about the database as a whole, kept as text under a key."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.dialects.sqlite import insert

from .database import Database
from .errors import database_errors
from .models import Setting


def get_setting(database: Database, key: str, default: str | None = None) -> str | None:
    """Return the text kept under `key`, `default` if there is none."""
    with database_errors(database.path), database.engine.connect() as connection:
        value = connection.scalar(select(Setting.value).where(Setting.key == key))
    return default if value is None else value


def set_setting(database: Database, key: str, value: str) -> None:
    """Keep the text `value` under `key`, in place of what was there."""
    statement = insert(Setting).values(key=key, value=value)
    with database.begin() as connection:
        connection.execute(statement.on_conflict_do_update(index_elements=[Setting.key], set_={"value": value}))
