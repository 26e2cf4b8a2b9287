"""``facewrinkle completion``: what a shell needs to complete commands and options."""

from __future__ import annotations

import sys
from typing import Literal


def completion(shell: Literal["bash", "zsh", "fish"], /) -> None:
    """Print what completes commands and options in a shell.

    Parameters
    ----------
    shell
        For bash: facewrinkle completion bash > ~/.local/share/bash-completion/completions/facewrinkle
    """
    from ..cli import app

    sys.stdout.write(app.generate_completion(shell=shell))
