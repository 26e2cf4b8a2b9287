"""Costs of a frame of the studio: processor time of stage and server, bytes, and its age.

Run it with ``python -m analysis.studio_speed``. A page without a browser looks on while a slider is pulled to and fro;
processor times, in ms, are those of the studio's threads, and do not count what waits. The age is that of the frame
that a page which takes 100 ms to draw shows when it has drawn it, in these.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import threading
import time
from collections.abc import Callable

import aiohttp
import numpy as np

import facewrinkle as fw
from facewrinkle.live import Studio

PULLED = ("AU26", "AU12", "surprise", "happiness")
PACE = 0.1
"""Seconds that the slow page takes to draw."""


def clock_of(thread: threading.Thread) -> Callable[[], float]:
    """Return a function with the processor time, s, of a thread."""
    number = time.pthread_getcpuclockid(thread.ident or 0)
    return lambda: time.clock_gettime(number)


async def pulled(studio: Studio, name: str, frames: int, pace: float = 0.0) -> dict[str, list[float]]:
    """Return what each frame cost while a slider goes to and fro."""
    address, _, key = studio.url.partition("/#")
    stage = studio.stage
    clocks = {"stage": clock_of(stage), "server": clock_of(studio._server._thread)}
    made: dict[int, float] = {}
    costs: dict[str, list[float]] = {"stage": [], "server": [], "kB": [], "age": []}
    stage.listeners.append(lambda: made.__setitem__(stage.shown.step if stage.shown else 0, time.monotonic()))
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(f"{address}/socket", headers={"Origin": address}, max_msg_size=0) as socket,
    ):
        await socket.send_json({"do": "hello", "key": key})
        spent, begin, step = {name: clock() for name, clock in clocks.items()}, time.monotonic(), 0
        async for message in socket:
            if message.type is not aiohttp.WSMsgType.BINARY or message.data[:4] == b"PHOT":
                continue
            head = json.loads(message.data[4 : 4 + int.from_bytes(message.data[:4], "little")])
            await asyncio.sleep(pace)
            now = time.monotonic()
            steps = max(head["step"] - step, 1)
            for name, clock in clocks.items():
                costs[name].append(1e3 * (clock() - spent[name]) / steps)
            costs["kB"].append(len(message.data) / 1024)
            costs["age"].append((now - made.get(head["step"], now)) / max(now - begin, 1e-9))
            spent, begin, step = {name: clock() for name, clock in clocks.items()}, now, head["step"]
            count = len(costs["kB"])
            weight = round(0.5 - 0.5 * math.cos(2.0 * math.pi * count / 60.0), 3)
            await socket.send_json({"do": "change", "patches": [[["mixture"], {name: weight}]], "gesture": "pull"})
            await socket.send_json({"do": "shown"})
            if count >= frames:
                break
    return {what: values[frames // 4 :] for what, values in costs.items()}


def main() -> None:
    """Print a table of medians, with the 90th percentile of the bytes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=160)
    frames = parser.parse_args().frames
    print(f"{'pulled':>10}  stage  server  |   kB  (p90)")
    with Studio(fw.default_face(), browser=False) as studio:
        for name in PULLED:
            costs = asyncio.run(pulled(studio, name, frames))
            cpu = "  ".join(f"{np.median(costs[what]):{width}.1f}" for what, width in COLUMNS)
            print(f"{name:>10}  {cpu}  | {np.median(costs['kB']):4.0f}  ({np.percentile(costs['kB'], 90):.0f})")
        ages = asyncio.run(pulled(studio, "AU12", 40, PACE))["age"]
        print(
            f"age of what a slow page shows: {np.median(ages):.2f} of its frames, {np.percentile(ages, 90):.2f} (p90)"
        )


COLUMNS = (("stage", 5), ("server", 6))

if __name__ == "__main__":
    main()
