"""Python values as TOML."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from os import PathLike, fspath
from typing import Any

import numpy as np


def value(x: Any) -> str:
    """One value: a number, a text, a list, an inline table."""
    if isinstance(x, (bool, np.bool_)):
        return "true" if x else "false"
    if isinstance(x, (int, np.integer)):
        return str(int(x))
    if isinstance(x, (float, np.floating)):
        x = float(x)
        if math.isnan(x):
            return "nan"
        if math.isinf(x):
            return "inf" if x > 0 else "-inf"
        return repr(x)
    if isinstance(x, str):
        # an escaped text of JSON is one of TOML, but for the character that JSON leaves as it is
        return json.dumps(x, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(x, PathLike):
        return value(fspath(x))
    if isinstance(x, np.ndarray):
        return value(x.tolist())
    if isinstance(x, (list, tuple)):
        return "[" + ", ".join(value(v) for v in x) + "]"
    if isinstance(x, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {value(v)}" for k, v in x.items() if v is not None) + " }"
    raise TypeError(f"{type(x).__name__} is no value of a scene: give numbers, texts, lists or dicts")


def _key(name: Any) -> str:
    name = str(name)
    bare = name and all(c.isascii() and (c.isalnum() or c in "_-") for c in name)
    return name if bare else value(name)


def _is_tables(x: Any) -> bool:
    return isinstance(x, (list, tuple)) and len(x) > 0 and all(isinstance(t, Mapping) for t in x)


def document(tables: Mapping[str, Any]) -> str:
    """A whole scene; keys whose value is None are left out."""
    plain, rest = [], []
    for name, x in tables.items():
        if x is None:
            continue
        if isinstance(x, Mapping):
            rest.append((f"[{_key(name)}]", x))
        elif _is_tables(x):
            rest += [(f"[[{_key(name)}]]", table) for table in x]
        else:
            plain.append(f"{_key(name)} = {value(x)}")
    for head, table in rest:
        plain += ["", head] + [f"{_key(k)} = {value(v)}" for k, v in table.items() if v is not None]
    return "\n".join(plain).strip() + "\n"
