"""Connections that hang up on who neither finishes a request nor takes its answer."""

from __future__ import annotations

import asyncio
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

#: Seconds in which the head of a request must be there, and in which part of an answer must be taken.
PATIENCE = 10.0


class ImpatientProtocol(H11Protocol):
    """HTTP of uvicorn, which itself waits for the rest of a request, and for a reader, as long as they please."""

    _waiting: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Wait for the first request."""
        super().connection_made(transport)
        self._wait()

    def data_received(self, data: bytes) -> None:
        """Wait on while a request is not complete."""
        super().data_received(data)
        if self.conn.their_state not in (h11.IDLE, h11.SEND_BODY):
            self._settle()
        elif self._waiting is None:
            self._wait()

    def pause_writing(self) -> None:
        """Wait for the reader to take what has been written."""
        super().pause_writing()
        self._settle()
        self._wait()

    def resume_writing(self) -> None:
        """Wait no more."""
        super().resume_writing()
        self._settle()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no more."""
        self._settle()
        super().connection_lost(exc)

    def _wait(self) -> None:
        self._waiting = self.loop.call_later(PATIENCE, self._hang_up)

    def _settle(self) -> None:
        if self._waiting is not None:
            self._waiting.cancel()
            self._waiting = None

    def _hang_up(self) -> None:
        if self.transport is not None and not self.transport.is_closing():
            self.transport.abort()
