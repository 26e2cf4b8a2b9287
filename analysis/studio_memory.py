"""Does the memory of a studio stay flat? A page looks on while sliders, folds, a pattern and a tear change.

Run it with ``python -m analysis.studio_memory``; ``--frames 20000`` takes half an hour.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import time
from typing import Any

import aiohttp
import numpy as np
import psutil

import facewrinkle as fw
from facewrinkle.live import Studio

MIXTURES = ("happiness", "anger", "emotion_surprise", "kiss")
EVERY = 500
"""Frames between two readings."""


async def watched(studio: Studio, frames: int) -> list[tuple[int, float]]:
    """Return the memory, MB, that the process holds after numbers of frames."""
    address, _, key = studio.url.partition("/#")
    process, readings, seen = psutil.Process(), [], 0
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(f"{address}/socket", headers={"Origin": address}, max_msg_size=0) as socket,
    ):
        await socket.send_json({"do": "hello", "key": key})
        async for message in socket:
            if message.type is not aiohttp.WSMsgType.BINARY or message.data[:4] == b"PHOT":
                continue
            seen += 1
            await socket.send_json({"do": "shown"})
            for patch in _changes(seen):
                await socket.send_str(json.dumps({"do": "change", "patches": [patch], "gesture": f"{seen // 50}"}))
            if seen % EVERY == 0:
                readings.append((seen, process.memory_info().rss / 2**20))
                print(f"{seen:6d} frames  {readings[-1][1]:7.1f} MB", flush=True)
            if seen >= frames:
                return readings
    return readings


def _changes(seen: int) -> list[Any]:
    weight = round(0.5 - 0.5 * math.cos(seen / 12.0), 3)
    patches: list[Any] = [[["mixture"], {MIXTURES[seen // 200 % len(MIXTURES)]: weight}]]
    if seen % 100 == 50:
        patches.append([["folds", "seed"], seen // 100 % 7])
    if seen % 300 == 120:
        dimple = {"kind": "dimple", "centre": [38.8, -30.8, 95.0], "size": 12.0, "depth": 2.0}
        patches += [[["patterns", "d"], dimple], [["tears", "t"], {"start": [30.0, 20.0, 100.0]}]]
    if seen % 300 == 240:
        patches += [[["patterns", "d"], None], [["tears", "t"], None]]
    return patches


def main() -> None:
    """Print the memory, and how much it grows in the second half."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=2000)
    frames = parser.parse_args().frames
    begin = time.perf_counter()
    with Studio(fw.default_face(), browser=False) as studio:
        readings = np.array(asyncio.run(watched(studio, frames)))
    later = readings[len(readings) // 2 :]
    growth = np.polyfit(later[:, 0], later[:, 1], 1)[0] if len(later) > 1 else 0.0
    print(f"{1000.0 * growth:+.2f} MB in 1000 frames of the second half; {time.perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main()
