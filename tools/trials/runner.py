"""Long runs that may be stopped: each outcome is a line of a file, and a later run plays only what is not there yet.

Cases are played in processes beside this one. One that dies, or takes too long, is an outcome as well.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import signal
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

from facewrinkle.progress import bar

OUTPUT = Path("output/trials")

DIED = "the process died of it, or it took too long"
"""The outcome of a case that its process did not come back from."""

Case = tuple[Any, ...]
"""What a case is told by: strings, numbers and truth values."""


def code() -> str:
    """Return a digest of the source of the package, the analyses and the trials: other code is another measurement."""
    digest, root = hashlib.sha256(), Path(__file__).parents[2]
    files = [path for folder in ("facewrinkle", "analysis", "tools/trials") for path in (root / folder).rglob("*")]
    for path in sorted(files):
        if path.suffix in (".py", ".toml", ".json"):
            digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:16]


class Worker:
    """A process beside this one that plays cases; when it dies, another one takes over.

    Parameters
    ----------
    seconds : int
        Time of the processor that a case may take, and a third of the time of the clock. 0 is any.
    """

    def __init__(self, seconds: int = 0) -> None:
        self._seconds = seconds
        self._start()

    def _start(self) -> None:
        self._pool = ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn"))

    def __call__(self, play: Callable[..., Any], *case: Any) -> Any:
        """Return what a function makes of a case, or `DIED`.

        What was played before may be the cause of a death: a fresh process tries again.
        """
        for _ in range(2):
            try:
                return self._pool.submit(_timed, self._seconds, play, case).result()
            except BrokenProcessPool:
                self._start()
        return DIED

    def close(self) -> None:
        """End the process."""
        self._pool.shutdown()


def _timed(seconds: int, play: Callable[..., Any], case: Case) -> Any:
    """Play a case; nothing catches the alarms, so that they end the process."""
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.alarm(3 * seconds)  # a busy machine is slower
    outcome = play(*case)
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    signal.alarm(0)
    return outcome


def known(path: Path) -> dict[Case, Any]:
    """Return the outcomes in a file that this code has made, by their cases; a line that is torn is left out."""
    found, digest = {}, code()
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        try:
            record = json.loads(line)
        except json.JSONDecodeError:
            continue
        if record["code"] == digest:
            found[tuple(record["case"])] = record["outcome"]
    return found


def run(
    path: Path,
    play: Callable[..., Any],
    cases: Sequence[Case],
    *,
    workers: int = 1,
    minutes: float = float("inf"),
    seconds: int = 0,
) -> dict[Case, Any]:
    """Play the cases that are not in a file yet, add their outcomes to it, and return those of all cases.

    Parameters
    ----------
    path : Path
        Of the file, in JSON lines.
    play : callable
        Called with what tells a case; its outcome has to fit into JSON.
    cases : sequence of tuple
    workers : int
        Processes.
    minutes : float
        No case is begun later.
    seconds : int
        Time of the processor that a case may take. 0 is any.

    Returns
    -------
    dict
        By case, in the order of the cases; without those for which there was no time.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    digest, found, end, own = code(), known(path), time.monotonic() + 60.0 * minutes, threading.local()
    left = [case for case in cases if case not in found]

    def played(case: Case) -> Any:
        if time.monotonic() > end:
            return None
        if not hasattr(own, "worker"):
            own.worker = Worker(seconds)
        return own.worker(play, *case)

    with path.open("a+", encoding="utf-8") as file, ThreadPoolExecutor(workers) as threads:
        file.seek(0)
        text = file.read()
        file.write("\n" if text and not text.endswith("\n") else "")
        for case, outcome in zip(left, bar(threads.map(played, left), path.stem, len(left)), strict=True):
            if outcome is None:
                continue
            line = json.dumps({"code": digest, "case": case, "outcome": outcome})
            file.write(line + "\n")
            file.flush()
            found[case] = json.loads(line)["outcome"]
    return {case: found[case] for case in cases if case in found}
