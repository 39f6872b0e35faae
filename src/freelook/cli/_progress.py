"""What a running command says on the terminal: lines, and one line that changes."""

from __future__ import annotations

import shutil
import sys
from types import TracebackType

CLEAR = "\r\x1b[2K"


def say(text: str) -> None:
    print(text, flush=True)


class StatusLine:
    """One line that is rewritten on a terminal; elsewhere a new line whenever it changes."""

    def __init__(self) -> None:
        self._live = sys.stdout.isatty()
        self._shown = ""

    def __enter__(self) -> StatusLine:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._live and self._shown:
            print(flush=True)

    def show(self, text: str) -> None:
        if text == self._shown:
            return
        self._shown = text
        if self._live:
            columns = shutil.get_terminal_size().columns
            print(f"{CLEAR}{text[: columns - 1]}", end="", flush=True)
        else:
            say(text)
