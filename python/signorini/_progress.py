"""Progress of long work: a line in a terminal, a bar in a notebook, nothing elsewhere."""

from __future__ import annotations

import html
import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, Union

Tell = Callable[[float, str], None]
#: None: where somebody sees it; or whether at all; or a function of the share that is done (0 to 1) and what is being done.
Progress = Union[bool, Tell, None]

#: Work shorter than this shows nothing, in seconds.
QUIET = 1.0


def _in_notebook() -> bool:
    shell = sys.modules.get("IPython")
    shell = shell and shell.get_ipython()
    return type(shell).__name__ == "ZMQInteractiveShell"


class Shown:
    """Shows progress while it is open, and leaves nothing behind."""

    def __init__(self, progress: Progress, title: str):
        self._title, self._start, self._handle, self._width = title, time.monotonic(), None, 0
        self.tell: Tell | None
        if callable(progress):
            self.tell = progress
        elif progress is False:
            self.tell = None
        elif _in_notebook():
            self.tell = self._notebook
        elif progress or sys.stderr.isatty():
            self.tell = self._terminal
        else:
            self.tell = None

    def _text(self, share: float, what: str) -> str | None:
        elapsed = time.monotonic() - self._start
        if elapsed < QUIET:
            return None
        left = f", {elapsed * (1 / share - 1):.0f} s left" if 0.01 < share <= 1 else ""
        return f"{self._title}: {100 * share:.0f} %  {elapsed:.0f} s{left}  {what}"

    def _terminal(self, share: float, what: str) -> None:
        text = self._text(share, what)
        if text is not None:
            sys.stderr.write("\r" + text[:160].ljust(self._width))
            sys.stderr.flush()
            self._width = len(text[:160])

    def _notebook(self, share: float, what: str) -> None:
        text = self._text(share, what)
        if text is None:
            return
        from IPython.display import HTML, display

        shown: Any = HTML(f'<progress value="{share:.4f}" max="1"></progress> {html.escape(text)}')
        if self._handle is None:
            self._handle = display(shown, display_id=True)
        else:
            self._handle.update(shown)

    def __enter__(self) -> Shown:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._width:
            sys.stderr.write("\r" + " " * self._width + "\r")
            sys.stderr.flush()
        if self._handle is not None:
            from IPython.display import HTML

            self._handle.update(HTML(""))
