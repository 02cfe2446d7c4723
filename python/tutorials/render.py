"""Run the tutorials and write what they print and draw beside them, as Markdown: ``python python/tutorials/render.py``, from the project's folder.

With ``--check`` nothing is written: the output must be what stands there. ``--notebooks FOLDER`` writes the tutorials as notebooks, which are executed where they are opened.
"""

from __future__ import annotations

import ast
import contextlib
import io
import json
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


def notebook(script: Path) -> str:
    """The script as a notebook of Jupyter (format 4.5), without output."""
    made = []
    for k, (is_words, text) in enumerate(cells(script.read_text(encoding="utf-8"))):
        # a figure is shown by being the last thing of its cell
        text = text if is_words or not re.search(r"^figure = ", text, re.M) else f"{text}\nfigure"
        cell = {"id": f"cell-{k}", "metadata": {}, "source": text.splitlines(keepends=True)}
        made.append({"cell_type": "markdown", **cell} if is_words else {"cell_type": "code", "execution_count": None, "outputs": [], **cell})
    about = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return json.dumps({"cells": made, "metadata": about, "nbformat": 4, "nbformat_minor": 5}, indent=1, ensure_ascii=False) + "\n"


def scripts() -> list[Path]:
    return [script for script in sorted(HERE.glob("*.py")) if script.name != "render.py"]


NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")


def same(a: str, b: str) -> bool:
    """The same words, and the same numbers but for rounding errors."""
    close = lambda x, y: abs(x - y) <= max(1e-9, 1e-3 * abs(y))  # noqa: E731
    words = [" ".join(NUMBER.sub("#", text).split()) for text in (a, b)]
    numbers = [[float(x) for x in NUMBER.findall(text)] for text in (a, b)]
    return words[0] == words[1] and all(close(x, y) for x, y in zip(*numbers))


def main() -> int:
    check = "--check" in sys.argv
    if "--notebooks" in sys.argv:
        folder = Path(sys.argv[sys.argv.index("--notebooks") + 1])
        folder.mkdir(parents=True, exist_ok=True)
        for script in scripts():
            (folder / f"{script.stem}.ipynb").write_text(notebook(script), encoding="utf-8")
        return 0
    differ = []
    for script in scripts():
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
