"""Tests run in the project's folder, where the scenes are."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def _in_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)


@pytest.fixture
def command() -> str:
    """The command line that the wheel installed, beside the interpreter."""
    import sys

    return os.path.join(os.path.dirname(sys.executable), "signorini")
