"""Files that are made by a process of their own.

what libraries print | much of it, in C, and no text: no harm
stopped              | before and while it runs: an error, and nothing in the terminal
"""

from __future__ import annotations

import threading
import time

import pytest
import pyvista as pv

from facewrinkle.anatomy.face import Face
from facewrinkle.errors import FaceWrinkleError
from facewrinkle.live.saving import Order
from facewrinkle.live.saving_process import SavingProcess


class Run:
    """Runs code in the process that reads the order."""

    def __init__(self, code):
        self._code = code

    def __reduce__(self):
        return exec, (self._code,)


def order(code):
    return Order("rig", [], Face.without_anatomy(pv.Plane().triangulate(), 1.0), Run(code))


def test_what_libraries_print_does_no_harm(capfd):
    code = r"import os; os.write(1, b'hello\n'); print('hello'); os.write(2, b'\xff' * 300_000); 1 / 0"
    with pytest.raises(FaceWrinkleError, match="the rig could not be made; the terminal tells more"):
        SavingProcess().save(order(code), lambda *_: None)
    told = capfd.readouterr().err
    assert told.count("\ufffd") == 300_000
    assert "ZeroDivisionError" in told


def test_what_is_stopped_is_not_made(capfd):
    process, begin = SavingProcess(), time.monotonic()

    def stop():
        while process._process is None and time.monotonic() < begin + 30.0:
            time.sleep(0.01)
        process.stop()

    thread = threading.Thread(target=stop)
    thread.start()
    for _ in range(2):  # while it runs, and before
        with pytest.raises(FaceWrinkleError, match="the rig was not made: the studio was closed"):
            process.save(order("import time; time.sleep(60)"), lambda *_: None)
    thread.join()
    assert capfd.readouterr() == ("", "")
