"""``facewrinkle studio``: a face in the browser, with a slider for everything."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..errors import check_whole
from .options import FaceOptions, Report, Whole

before_the_end: list[Callable[[], None]] = []
"""What must be done, quickly, when a signal ends the command line: to save what was made, to end other processes."""


def studio(
    mesh: Path | None = None,
    /,
    *,
    source: FaceOptions = FaceOptions(),
    host: str = "127.0.0.1",
    port: Whole = 0,
    save_to: Path | None = None,
    browser: Annotated[bool, Parameter(negative="--no-browser")] = True,
    listen: Whole | None = None,
) -> None:
    """Open a face in the browser, with a slider for everything. Press Ctrl-C to quit.

    Parameters
    ----------
    mesh
        The face; same as --face.
    host
        Address to listen on. With others than 127.0.0.1, everyone in the network who knows the printed address
        can use the studio.
    port
        Port to listen on. Default: any free one.
    save_to
        The only folder that the page may write to; the session is saved there automatically. Default: files are
        downloaded.
    browser
        Open the browser.
    listen
        UDP port at which Live Link Face on a phone (11111), or a tracker that sends VMC, drives the face; a phone needs
        --host too. Default: none.
    """
    from ..live import Studio  # which needs a package of the extra "studio"

    source, report = source.of(mesh), Report(quiet=False)
    check_whole("port", port, 0, 65535)
    start = source.session()
    mesh, atlas = (Path(file) if file else None for file in (start.face, start.atlas))
    face = replace(source, face=mesh, atlas=atlas, identity=None).load(report)  # the session has its identity
    with report.waiting("Getting ready"):
        window = Studio(face, host=host, port=port, save_to=save_to, browser=browser, start=start, listen=listen)
    with window:
        report.say(f"The studio is open at {window.url}")
        local = host in ("127.0.0.1", "localhost", "::1")
        if not local:
            report.say(f"It listens on {host}: everyone in the network who knows this address can use it.")
        if listen is not None:
            senders = "this computer alone; a phone needs --host 0.0.0.0 too" if local else "everyone in the network"
            report.say(f"Face capture can drive the face by UDP port {listen}, from {senders}.")
        report.say("Press Ctrl-C to quit.")
        before_the_end.append(window.end)
        window.wait()
