"""Commands of the package as processes: progress, canceling, and what went wrong as one sentence."""

import os
import re
import shutil
import subprocess
import tempfile
import threading
from pathlib import Path

from .exchange import Refusal

ADVICE = "Set the Python that has facewrinkle in the preferences of the add-on."


def found(python):
    """Return the beginning of a command: the Python that is set, or else the `facewrinkle` that the system finds."""
    if python:
        return [os.path.expanduser(python), "-m", "facewrinkle"]
    command = shutil.which("facewrinkle")
    if command is None:
        raise Refusal(f"facewrinkle was not found on this computer. {ADVICE}")
    return [command]


class Run:
    """A command of the package that runs in a temporary folder, beside Blender.

    Attributes
    ----------
    folder : Path
        Removed by :meth:`close`.
    step : str
        What is being done, such as "Shapes".
    share : float
        Of this step, from 0 to 1.
    notes : list of str
        What the package had to say.
    """

    def __init__(self, python):
        self.command, self.folder = found(python), Path(tempfile.mkdtemp(prefix="facewrinkle_"))
        self.step, self.share, self.notes = "Starting", 0.0, []
        self._process = self._reader = None
        self._last = ""

    def start(self, *arguments):
        # Blender's own libraries must not be found by the other Python.
        environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONHOME", "PYTHONPATH")}
        environment |= {"FACEWRINKLE_PROGRESS": "lines", "PYTHONIOENCODING": "utf-8"}
        try:
            self._process = subprocess.Popen(
                [*self.command, *map(str, arguments)],
                cwd=self.folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                encoding="utf-8",
                errors="replace",
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        except OSError as problem:
            raise Refusal(f"{self.command[0]} cannot be run ({problem.strerror}). {ADVICE}") from None
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self._process.stderr:
            line = line.strip()
            if step := re.match(r"(.+) (\d+)/(\d+)$", line):
                self.step, self.share = step[1], int(step[2]) / max(int(step[3]), 1)
            elif line.startswith("facewrinkle: note: "):
                self.notes.append(line.removeprefix("facewrinkle: note: "))
            elif line:
                self._last = line

    @property
    def running(self):
        return self._process is not None and self._process.poll() is None

    def result(self):
        """Wait for the end; raise a Refusal if it was none that is wanted."""
        code = self._process.wait()
        self._reader.join()
        if code and "No module named facewrinkle" in self._last:
            raise Refusal(f"{self.command[0]} has no facewrinkle: install it there. {ADVICE}")
        if code == 2:  # it does not know what it is asked
            raise Refusal(f"{self.command[0]} has another facewrinkle than this extension is for: update it. {ADVICE}")
        if "no face was found" in self._last:
            raise Refusal("No face was found. Press Place Landmarks, drag each to its place, and try again.")
        if code:
            raise Refusal(self._last.removeprefix("facewrinkle: ") or f"facewrinkle ended early (code {code}).")

    def close(self):
        """End the process if it still runs, and remove its files."""
        if self.running:
            self._process.terminate()
            try:
                self._process.wait(5)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        if self._reader is not None:
            self._reader.join()
            self._process.stderr.close()
        shutil.rmtree(self.folder, ignore_errors=True)
