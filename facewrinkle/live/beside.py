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
from pathlib import Path

from ..errors import FaceWrinkleError
from .library import Tell
from .saving import Order, save_slowly

ORDER, FAULT = "order.pickle", "fault.txt"


class Beside:
    """Makes files in processes of their own, one at a time."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    def made(self, order: Order, tell: Tell) -> tuple[str, bytes]:
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
            paths = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__, name], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": paths.rstrip(os.pathsep)},
            )  # fmt: skip
            with self._process as process:
                assert process.stdout is not None
                assert process.stderr is not None
                for line in process.stdout:
                    tell(*json.loads(line))
                fault = process.stderr.read()
            self._process = None
            if process.returncode == 0:
                file = next(path for path in folder.iterdir() if path.name != ORDER)
                return file.name, file.read_bytes()
            if (folder / FAULT).is_file():
                raise FaceWrinkleError((folder / FAULT).read_text(encoding="utf-8"))
            print(fault, file=sys.stderr)
            raise FaceWrinkleError(f"the {order.what} could not be made; the terminal tells more.")

    def stop(self) -> None:
        """End what is being made."""
        if (process := self._process) is not None:
            process.terminate()


def main(folder: Path) -> int:
    """Make the file of the order in a folder; return 0, or 1 with a sentence in the folder."""
    order = pickle.loads((folder / ORDER).read_bytes())
    told = sys.stdout
    sys.stdout = sys.stderr  # what libraries print is no progress
    try:
        name, content = save_slowly(order, lambda what, share: print(json.dumps([what, share]), file=told, flush=True))
    except FaceWrinkleError as error:
        (folder / FAULT).write_text(str(error), encoding="utf-8")
        return 1
    (folder / name).write_bytes(content)
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
