"""What can go wrong. Numerical outcomes (no orbit, a fold, a grazing) are no errors: they are values."""

from __future__ import annotations


class SignoriniError(Exception):
    """Any error of this package: a full disk, an output that cannot be written."""


class SceneError(SignoriniError, ValueError):
    """Bad input.

    Attributes:
        message: what is wrong.
        help: what would be accepted ("" where the message says it).
        file, line, column: where in the scene (None if it is no matter of the scene's text).
        key: the key, as ``body.young`` or ``load[0].mode`` (None likewise).
    """

    def __init__(
        self,
        message: str,
        help: str = "",
        place: tuple[str | None, int | None, int | None, str | None] = (None, None, None, None),
    ):
        self.message = message
        self.help = help
        self.file, self.line, self.column, self.key = place
        text = message if self.line is None else f"{self.file}:{self.line}:{self.column}: {self.key}: {message}"
        super().__init__(f"{text}\n  {help}" if help else text)


class FileError(SignoriniError, ValueError):
    """A file that is none of this program's, or damaged."""


class NumericsError(SignoriniError, ArithmeticError):
    """The numerics failed before there was a result that could say so itself."""
