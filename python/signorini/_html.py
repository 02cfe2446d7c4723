"""What a notebook shows of results and scenes: facts, and the picture where matplotlib is there."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable
from typing import Any

Facts = Iterable[tuple[str, Any]]


def _word(x: Any) -> str:
    if isinstance(x, bool) or x is None:
        return {True: "yes", False: "no", None: "not known"}[x]
    return f"{x:.9g}" if isinstance(x, float) else str(x)


def table(title: str, facts: Facts) -> str:
    """A title, and names beside values."""
    rows = "".join(
        f'<tr><th style="text-align:left;font-weight:normal;opacity:.7">{html.escape(name)}</th><td style="text-align:left">{html.escape(_word(x))}</td></tr>'
        for name, x in facts
    )
    return f"<p><b>{html.escape(title)}</b></p>" + (f"<table>{rows}</table>" if rows else "")


def picture(result: Any) -> str:
    """The figure of a result; nothing where none can be drawn."""
    try:
        image: bytes | None = result.plot()._repr_png_()
    except (ImportError, TypeError, ValueError, KeyError):
        return ""
    if image is None:
        return ""
    text = base64.b64encode(image).decode()
    alt = html.escape(repr(result), quote=True)
    return f'<img alt="{alt}" style="max-width:100%" src="data:image/png;base64,{text}">'


def folded(summary: str, text: str) -> str:
    """A text that is seen when it is asked for."""
    return f"<details><summary>{html.escape(summary)}</summary><pre>{html.escape(text)}</pre></details>"
