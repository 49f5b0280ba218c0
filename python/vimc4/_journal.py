"""What happened."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, overload

if TYPE_CHECKING:
    from . import _vimc4
    from ._types import Event, Move


class Journal(Sequence["Event"]):
    """Everything that happened, oldest first: commands with what they mean, answers, motions with their
    boxes, ports, signals, program lines, warnings, and what people did. Each entry is a dict with its
    ``number``, ``at`` in nanoseconds, the number of the ``command`` that it belongs to, under ``event``
    its kind, and what that kind has besides. The last 100,000 are kept.

    As a text it is the story: a line for each, as a conversation is logged, with the motions in
    between.
    """

    def __init__(self, journal: _vimc4.Journal) -> None:
        self._journal = journal
        self._entries: list[Event] | None = None

    @property
    def _all(self) -> list[Event]:
        if self._entries is None:
            self._entries = self._journal.entries()
        return self._entries

    def __len__(self) -> int:
        return len(self._all)

    @overload
    def __getitem__(self, place: int) -> Event: ...
    @overload
    def __getitem__(self, place: slice) -> list[Event]: ...
    def __getitem__(self, place: int | slice) -> Event | list[Event]:
        return self._all[place]

    def of(self, command: int | None) -> list[Event]:
        """A command, its answers, and everything that came of it, by the number of the command."""
        return [entry for entry in self._all if entry.get("command") == command]

    def moves(self) -> list[Move]:
        """The motions, each with its box. The last one may not have ended yet."""
        return self._journal.moves()

    def story(self) -> list[str]:
        """All of it in words, a line for each."""
        return self._journal.story()

    def json_lines(self) -> str:
        """All of it as lines of JSON. If entries were dropped the first line says how many."""
        return self._journal.json_lines()

    @property
    def dropped(self) -> int:
        """How many entries are not there any more because there was no room."""
        return self._journal.dropped

    def __str__(self) -> str:
        return "".join(f"{line}\n" for line in self.story())

    def __repr__(self) -> str:
        return f"<vimc4.Journal of {len(self)} entries>"
