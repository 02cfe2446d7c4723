"""Run the tutorials and write what they print and draw beside them, as Markdown: ``python python/tutorials/render.py``, from the project's folder.

With ``--check`` nothing is written: the output must be what stands there.
"""

from __future__ import annotations

import ast
import contextlib
import io
import re
import sys
import tempfile
import traceback
from pathlib import Path

HERE = Path(__file__).parent


def cells(text: str) -> list[tuple[bool, str]]:
    """Parts of a script, each either words or code."""
    parts: list[tuple[bool, list[str]]] = []
    for line in text.splitlines():
        if line.startswith("# %%"):
            parts.append(("[markdown]" in line, []))
        else:
            parts[-1][1].append(line)
    words = lambda lines: "\n".join(line.removeprefix("#").removeprefix(" ") for line in lines)  # noqa: E731
    return [(is_words, (words(lines) if is_words else "\n".join(lines)).strip()) for is_words, lines in parts]


def execute(code: str, names: dict) -> str:
    """What a cell prints."""
    heard = io.StringIO()
    with contextlib.redirect_stdout(heard):
        exec(compile(ast.parse(code), "<cell>", "exec"), names)
    return heard.getvalue()


def render(script: Path, image: Path) -> str:
    """The script as Markdown; figures called ``figure`` go to ``image``."""
    out, names = [], {}
    for is_words, text in cells(script.read_text(encoding="utf-8")):
        if is_words:
            out.append(text)
            continue
        names.pop("figure", None)
        printed = execute(text, names)
        out.append(f"```python\n{text}\n```")
        if printed:
            out.append(f"```text\n{printed.rstrip()}\n```")
        if "figure" in names:
            names["figure"].savefig(image, dpi=80)
            out.append(f"![{script.stem}]({image.name})")
    return "\n\n".join(out) + "\n"


NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")


def same(a: str, b: str) -> bool:
    """The same words, and the same numbers but for rounding errors."""
    close = lambda x, y: abs(x - y) <= max(1e-9, 1e-3 * abs(y))  # noqa: E731
    words = [" ".join(NUMBER.sub("#", text).split()) for text in (a, b)]
    numbers = [[float(x) for x in NUMBER.findall(text)] for text in (a, b)]
    return words[0] == words[1] and all(close(x, y) for x, y in zip(*numbers))


def main() -> int:
    check = "--check" in sys.argv
    differ = []
    for script in sorted(HERE.glob("*.py")):
        if script.name == "render.py":
            continue
        target = script.with_suffix(".md")
        with tempfile.TemporaryDirectory() as folder:
            image = Path(folder if check else HERE) / f"{script.stem}.png"
            try:
                text = render(script, image)
            except Exception:
                traceback.print_exc()
                differ.append(f"{script.name} failed")
                continue
        if not check:
            target.write_text(text, encoding="utf-8")
        elif not target.exists() or not same(target.read_text(encoding="utf-8"), text):
            differ.append(f"{target.name} is not what {script.name} prints")
            sys.stdout.write(text)
    for line in differ:
        print(line, file=sys.stderr)
    for made in ["plate.h5", "bar-from-matrices.toml", *(f"bar-from-matrices-{m}.mtx" for m in ("M", "K", "N_C", "N_O"))]:
        Path(made).unlink(missing_ok=True)
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
