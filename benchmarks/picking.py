"""How fast the picking page answers: 1000 frames of 1080p H.264, clicks on balls and jumps in time, in a browser.

    PYTHONPATH=. python benchmarks/picking.py [FOLDER]

Prints the median and the worst of 12 clicks (from the button to the point on the page), of 12 jumps to a random frame
and of 12 steps to the next one, ms.
"""

from __future__ import annotations

import os
import sys
import tempfile
import threading
import time

import av
import numpy as np

from tests.picking.browser import open_page, screen
from vidtrack.picking.desk import Desk
from vidtrack.picking.server import Server

FRAMES, SIZE, TRIES = 1000, (1920, 1080), 12


def film(path: str) -> np.ndarray:
    """A recording of balls at rest and one that moves; where they are (n, 2), px."""
    rng = np.random.default_rng(1)
    at = np.stack([x.ravel() for x in np.meshgrid(np.linspace(150, 1770, 8), np.linspace(150, 930, 5))], -1)
    still = np.full(SIZE[::-1], 30, np.uint8)
    y, x = np.mgrid[-12:13, -12:13]
    for cx, cy in at.astype(int):
        still[cy - 12 : cy + 13, cx - 12 : cx + 13][np.hypot(x, y) < 7] = 210
    noise = rng.integers(0, 5, (8, *still.shape), np.uint8)
    with av.open(path, "w") as container:
        stream = container.add_stream("libx264", rate=60, options={"preset": "ultrafast", "crf": "20"})
        stream.width, stream.height, stream.pix_fmt, stream.gop_size = *SIZE, "yuv420p", 250
        for i in range(FRAMES):
            grey = still + noise[i % 8]
            grey[500:514, i : i + 14] = 220
            picture = av.VideoFrame.from_ndarray(np.concatenate([grey, np.full((540, 1920), 128, np.uint8)]), "yuv420p")
            container.mux(stream.encode(picture))
        container.mux(stream.encode())
    return at


def main(folder: str) -> None:
    """Make the experiment, serve it, drive the page."""
    os.makedirs(f"{folder}/calibration/c", exist_ok=True)
    at = film(f"{folder}/calibration/c/cam1.mp4")
    with open(f"{folder}/config.yaml", "w", encoding="utf-8") as file:
        file.write("units: m\ncameras: {cam1: }\n")
    with open(f"{folder}/calibration/points.csv", "w", encoding="utf-8") as file:
        file.write("tag,x,y,z\n" + "".join(f"{i},{x},{y},0\n" for i, (x, y) in enumerate(at)))
    os.chdir(folder)
    server = Server(Desk())
    threading.Thread(target=server.serve_forever, daemon=True).start()
    rng = np.random.default_rng(2)
    shown = "() => vidtrack.state.image !== null"
    with open_page(server.address) as (page, troubles):
        clicks, jumps, steps = [], [], []
        for number in rng.integers(0, FRAMES - 1, TRIES).tolist():
            for what, times in ((number, jumps), (number + 1, steps)):
                page.evaluate("() => { vidtrack.state.image = null; }")
                began = time.perf_counter()
                page.evaluate(
                    f"() => {{ const s = document.querySelector('#slider'); s.value = {what}; s.oninput(); }}"
                )
                while not page.evaluate(shown):
                    time.sleep(0.002)
                times.append(time.perf_counter() - began)
                time.sleep(0.3)
        page.evaluate("() => { const s = document.querySelector('#slider'); s.value = 10; s.oninput(); }")
        time.sleep(1)
        for k, (x, y) in enumerate(at.tolist()[:TRIES]):
            page.evaluate("() => { vidtrack.state.answered = null; }")
            page.mouse.click(*screen(page, x, y))
            while page.evaluate("() => vidtrack.state.answered === null"):
                time.sleep(0.005)
            clicks.append(page.evaluate("() => vidtrack.state.answered") / 1000)
            if k == 2:  # three picks: labels, which run beside, begin with the fourth
                page.keyboard.press("Control+z")
                page.keyboard.press("Control+z")
                page.keyboard.press("Control+z")
        print(f"script errors and outside requests: {len(troubles)}")
    for name, times in (("click", clicks), ("jump", jumps), ("next frame", steps)):
        print(f"{name}: median {1000 * np.median(times):.0f} ms, worst {1000 * max(times):.0f} ms")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(sys.argv[1])
    else:
        with tempfile.TemporaryDirectory() as scratch:
            main(scratch)
