"""How fast the picking page answers: 1000 frames of 1080p H.264, clicks on balls and jumps in time, in a browser.

    PYTHONPATH=. python benchmarks/picking.py [FOLDER]

Prints the median and the worst of 12 jumps to a random frame, of the first click on each (from the button to the point
on the page, the moment that the picture is there), of a second one, and of steps to the next frame, ms. Of clicks also
what the server needs for the answer: processor time of the thread that answers, which does not depend on what else the
machine does, and the time from request to answer, which does.
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
from vidtrack.picking import server as serving
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
    answers = answers_timed()
    server = Server(Desk())
    threading.Thread(target=server.serve_forever, daemon=True).start()
    rng = np.random.default_rng(2)
    shown = "() => vidtrack.state.image !== null"
    with open_page(server.address) as (page, troubles):
        first, again, jumps, steps = [], [], [], []
        for k, number in enumerate(rng.integers(0, FRAMES - 1, TRIES).tolist()):
            jumps.append(seconds(page, f"() => {{ vidtrack.state.image = null; {GO.format(number)} }}", shown))
            # at once, on a picture of which nothing but the pixels is known yet
            first.append(click(page, at[k]))
            again.append(click(page, at[k + TRIES]))
            time.sleep(0.3)
            steps.append(seconds(page, f"() => {{ vidtrack.state.image = null; {GO.format(number + 1)} }}", shown))
            if k % 2:  # labels, which are computed beside, begin with the fourth pick: with and without them
                for _ in range(4):
                    page.keyboard.press("Control+z")
        print(f"script errors and outside requests: {len(troubles)}")
    server.shutdown()
    server.server_close()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    for name, times in (
        ("answer to a click, processor time of the server", [a[0] for a in answers]),
        ("answer to a click, time at the server", [a[1] for a in answers]),
        ("first click on a new frame", first),
        ("further click", again),
        ("jump to a random frame", jumps),
        ("next frame", steps),
    ):
        print(f"{name}: median {1000 * np.median(times):.0f} ms, worst {1000 * max(times):.0f} ms")


def answers_timed() -> list[tuple[float, float]]:
    """A list that receives, of each answer to a click from now on, the processor time and the time that it took, s."""
    answers: list[tuple[float, float]] = []
    measure = serving._POST["/measure"]

    def timed(desk, given):
        began, used = time.perf_counter(), time.thread_time()
        try:
            return measure(desk, given)
        finally:
            if given.get("click"):
                answers.append((time.thread_time() - used, time.perf_counter() - began))

    serving._POST["/measure"] = timed
    return answers


GO = "const s = document.querySelector('#slider'); s.value = {}; s.oninput();"


def seconds(page, act: str, done: str) -> float:
    """How long it takes from an act until `done` is true."""
    began = time.perf_counter()
    page.evaluate(act)
    while not page.evaluate(done):
        time.sleep(0.002)
    return time.perf_counter() - began


def click(page, place: np.ndarray) -> float:
    """How long it takes from the button to the point on the page."""
    page.evaluate("() => { vidtrack.state.answered = null; }")
    page.mouse.click(*screen(page, *place.tolist()))
    while page.evaluate("() => vidtrack.state.answered === null"):
        time.sleep(0.005)
    return page.evaluate("() => vidtrack.state.answered") / 1000


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(sys.argv[1])
    else:
        with tempfile.TemporaryDirectory() as scratch:
            main(scratch)
