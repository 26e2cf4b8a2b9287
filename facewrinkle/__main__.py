"""``python -m facewrinkle``, and the command ``facewrinkle``."""

from typing import NoReturn

from .commands.interrupts import end_at_signals


def program() -> NoReturn:
    """Run the command line and end the process with its code."""
    end_at_signals()  # before anything else is imported, which takes a moment
    import sys

    from .cli import main

    sys.exit(main())


if __name__ == "__main__":
    program()
