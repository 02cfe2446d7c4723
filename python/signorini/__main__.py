"""The command line: ``signorini`` or ``python -m signorini``."""

import signal
import sys

from ._signorini import main as _main


def main() -> None:
    """Run the command line with this process's arguments, and exit with its code."""
    # Ctrl-C is the command's: it ends the program, or the work where that saves something first
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_main(["signorini", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
