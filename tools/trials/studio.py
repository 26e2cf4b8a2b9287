"""What a studio costs, as a page without a browser sees it: processor time, bytes and age of frames, and memory."""

from __future__ import annotations

import asyncio
import json
import math
import threading
import time
from collections.abc import AsyncGenerator, Callable
from contextlib import aclosing
from typing import Any

import aiohttp
import numpy as np
import psutil
from cyclopts import App

import facewrinkle as fw
from facewrinkle.live import Studio

app = App(name="studio", help="Measure what a studio costs.")

PULLED = ("AU26", "AU12", "paper_surprise", "happiness")
PACE = 0.1
"""Seconds that the slow page takes to draw."""


async def frames_of(studio: Studio) -> AsyncGenerator[tuple[aiohttp.ClientWebSocketResponse, bytes], None]:
    """Yield the connection, and each frame that a studio sends to a page."""
    address, _, key = studio.url.partition("/#")
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(f"{address}/socket", headers={"Origin": address}, max_msg_size=0) as socket,
    ):
        await socket.send_json({"do": "hello", "key": key})
        async for message in socket:
            if message.type is aiohttp.WSMsgType.BINARY and message.data[:4] != b"PHOT":
                yield socket, message.data


def clock_of(thread: threading.Thread) -> Callable[[], float]:
    """Return a function with the processor time, s, of a thread."""
    number = time.pthread_getcpuclockid(thread.ident or 0)
    return lambda: time.clock_gettime(number)


async def pulled(studio: Studio, name: str, frames: int, pace: float = 0.0) -> dict[str, list[float]]:
    """Return what each frame cost while a slider goes to and fro."""
    stage = studio.stage
    clocks = {"stage": clock_of(stage), "server": clock_of(studio._server._thread)}
    made: dict[int, float] = {}
    costs: dict[str, list[float]] = {"stage": [], "server": [], "kB": [], "age": []}
    stage.listeners.append(lambda: made.__setitem__(stage.shown.step if stage.shown else 0, time.monotonic()))
    spent, begin, step = {thread: clock() for thread, clock in clocks.items()}, time.monotonic(), 0
    async with aclosing(frames_of(studio)) as sent:
        async for socket, data in sent:
            head = json.loads(data[4 : 4 + int.from_bytes(data[:4], "little")])
            await asyncio.sleep(pace)
            now = time.monotonic()
            steps = max(head["step"] - step, 1)
            for thread, clock in clocks.items():
                costs[thread].append(1e3 * (clock() - spent[thread]) / steps)
            costs["kB"].append(len(data) / 1024)
            costs["age"].append((now - made.get(head["step"], now)) / max(now - begin, 1e-9))
            spent, begin, step = {thread: clock() for thread, clock in clocks.items()}, now, head["step"]
            count = len(costs["kB"])
            weight = round(0.5 - 0.5 * math.cos(2.0 * math.pi * count / 60.0), 3)
            await socket.send_json({"do": "change", "patches": [[["mixture"], {name: weight}]], "gesture": "pull"})
            await socket.send_json({"do": "shown"})
            if count >= frames:
                break
    return {what: values[frames // 4 :] for what, values in costs.items()}


MIXTURES = ("happiness", "anger", "surprise", "kiss")
EVERY = 500
"""Frames between two readings."""


async def watched(studio: Studio, frames: int) -> list[tuple[int, float]]:
    """Return the memory, MB, that the process holds after numbers of frames."""
    process, readings, seen = psutil.Process(), [], 0
    async with aclosing(frames_of(studio)) as sent:
        async for socket, _ in sent:
            seen += 1
            await socket.send_json({"do": "shown"})
            for patch in _changes(seen):
                await socket.send_str(json.dumps({"do": "change", "patches": [patch], "gesture": f"{seen // 50}"}))
            if seen % EVERY == 0:
                readings.append((seen, process.memory_info().rss / 2**20))
                print(f"{seen:6d} frames  {readings[-1][1]:7.1f} MB", flush=True)
            if seen >= frames:
                break
    return readings


async def watched_by_two(studio: Studio, frames: int) -> list[tuple[int, float]]:
    """Return what the first of two pages reads that change the same face at once."""
    first, _ = await asyncio.gather(watched(studio, frames), watched(studio, frames))
    return first


def _changes(seen: int) -> list[Any]:
    weight = round(0.5 - 0.5 * math.cos(seen / 12.0), 3)
    patches: list[Any] = [[["mixture"], {MIXTURES[seen // 200 % len(MIXTURES)]: weight}]]
    if seen % 100 == 50:
        patches.append([["folds", "seed"], seen // 100 % 7])
    if seen % 300 == 120:
        dimple = {"kind": "dimple", "center": [38.8, -30.8, 95.0], "size": 12.0, "depth": 2.0}
        patches += [[["patterns", "d"], dimple], [["tears", "t"], {"start": [30.0, 20.0, 100.0]}]]
    if seen % 300 == 240:
        patches += [[["patterns", "d"], None], [["tears", "t"], None]]
    return patches


@app.command
def speed(*, frames: int = 160) -> None:
    """Print medians of what a frame costs while a slider is pulled: ms of the studio's threads, and kB.

    Processor times do not count what waits. The age is that of the frame that a page which takes 100 ms to draw shows
    when it has drawn it, in these.

    Parameters
    ----------
    frames
        Of each slider; the first quarter does not count.
    """
    print(f"{'pulled':>10}  stage  server  |   kB  (p90)")
    with Studio(fw.default_face(), browser=False) as studio:
        for name in PULLED:
            costs = asyncio.run(pulled(studio, name, frames))
            stage, server, size = (np.median(costs[what]) for what in ("stage", "server", "kB"))
            print(f"{name:>10}  {stage:5.1f}  {server:6.1f}  | {size:4.0f}  ({np.percentile(costs['kB'], 90):.0f})")
        ages = asyncio.run(pulled(studio, "AU12", 40, PACE))["age"]
        print(
            f"age of what a slow page shows: {np.median(ages):.2f} of its frames, {np.percentile(ages, 90):.2f} (p90)"
        )


@app.command
def memory(*, frames: int = 2000) -> None:
    """Print the memory as two pages change sliders, folds, a pattern and a tear, and how much it grows in the second
    half.

    Parameters
    ----------
    frames
        20,000 take half an hour.
    """
    begin = time.perf_counter()
    with Studio(fw.default_face(), browser=False) as studio:
        readings = np.array(asyncio.run(watched_by_two(studio, frames)))
    later = readings[len(readings) // 2 :]
    growth = np.polyfit(later[:, 0], later[:, 1], 1)[0] if len(later) > 1 else 0.0
    print(f"{1000.0 * growth:+.2f} MB in 1000 frames of the second half; {time.perf_counter() - begin:.0f} s")
