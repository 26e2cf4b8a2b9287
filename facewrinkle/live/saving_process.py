"""Files that take long, made by a process of their own: drawing a movie would let the face stand still meanwhile.

The process is handed an order in a folder that was made for it, tells on its output how far it is, and leaves the file,
or a sentence about what was wrong, in the same folder.
"""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import IO

from ..errors import FaceWrinkleError
from ..processes import environment
from .library import Tell
from .saving import Order, save_slowly

ORDER, FAULT, LOG = "order.pickle", "fault.txt", "log.txt"


class SavingProcess:
    """Makes files in processes of their own, one at a time."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._stopped, self._lock = False, threading.Lock()

    def save(self, order: Order, tell: Tell) -> tuple[str, bytes]:
        """Return the name and the content of a file.

        Parameters
        ----------
        order : Order
        tell : callable
            Told what is done, and the share of it.

        Raises
        ------
        FaceWrinkleError
            If it cannot be made, or :meth:`stop` was called.
        """
        with tempfile.TemporaryDirectory(prefix="facewrinkle-") as name:
            folder = Path(name)
            (folder / ORDER).write_bytes(pickle.dumps(order))
            with (folder / LOG).open("wb") as log:  # a pipe that nobody reads would fill, and hold the process up
                code = self._run(folder, log, tell)
            if self._stopped:
                raise FaceWrinkleError(f"the {order.what} was not made: the studio was closed.")
            if code == 0:
                file = next(path for path in folder.iterdir() if path.name not in (ORDER, LOG))
                return file.name, file.read_bytes()
            if (folder / FAULT).is_file():
                raise FaceWrinkleError((folder / FAULT).read_text(encoding="utf-8"))
            print((folder / LOG).read_text(encoding="utf-8", errors="replace"), file=sys.stderr)
            raise FaceWrinkleError(f"the {order.what} could not be made; the terminal tells more.")

    def _run(self, folder: Path, log: IO[bytes], tell: Tell) -> int | None:
        """Run the process for the order in a folder, and return how it ended; None if it was not to begin."""
        with self._lock:
            if self._stopped:
                return None
            process = self._process = subprocess.Popen(
                [sys.executable, "-m", __name__, str(folder)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                stderr=log, text=True, env=environment(),
                start_new_session=True,  # Ctrl-C is for the studio, which ends the process by itself
            )  # fmt: skip
        with process:
            assert process.stdout is not None
            for line in process.stdout:
                tell(*json.loads(line))
        self._process = None
        return process.returncode

    def stop(self) -> None:
        """End what is being made, and make nothing more."""
        with self._lock:
            self._stopped = True
            if self._process is not None:
                self._process.terminate()


def main(folder: Path) -> int:
    """Make the file of the order in a folder; return 0, or 1 with a sentence in the folder."""
    told = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what libraries print, in C too, is no progress
    order = pickle.loads((folder / ORDER).read_bytes())
    try:
        name, content = save_slowly(order, lambda what, share: print(json.dumps([what, share]), file=told, flush=True))
    except FaceWrinkleError as error:
        (folder / FAULT).write_text(str(error), encoding="utf-8")
        return 1
    (folder / name).write_bytes(content)
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
