"""The pictures of the tutorial, made of the real programs while a test runs it: where VIDTRACK_SHOTS names a folder."""

import html
import io
import os
from contextlib import contextmanager

import cv2
import numpy as np

from tests.picking.browser import CHROMIUM
from vidtrack.video.reader import open_video

SHOTS = os.environ.get("VIDTRACK_SHOTS")

STYLE = (
    "margin:0;padding:14px;background:#1c1f24;color:#dfe3e8;font:13px/1.45 'DejaVu Sans Mono',monospace;white-space:pre"
)


def small(name, png):
    """Keep a picture with few colours: a quarter of the bytes."""
    from PIL import Image

    picture = Image.open(io.BytesIO(png)).convert("RGB").quantize(112, dither=Image.Dither.NONE)
    picture.save(os.path.join(SHOTS, f"{name}.png"), optimize=True)


def shot(page, name):
    """What a page of the browser shows."""
    if SHOTS:
        small(name, page.screenshot())


@contextmanager
def blank(width, height):
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        yield browser.new_page(viewport={"width": width, "height": height})
        browser.close()


def terminal(name, command, said, most=24, width=118):
    """A command and what it says, as on a terminal; of long answers the first and the last lines."""
    lines = [line if len(line) <= width else line[: width - 1] + "…" for line in said.rstrip().splitlines()]
    if len(lines) > most:
        lines = [*lines[: most - 9], "...", *lines[-8:]]
    text = "\n".join([f"$ {command}", *lines])
    with blank(1000, 60) as page:
        page.set_content(f'<body style="{STYLE}">{html.escape(text)}</body>')
        small(name, page.screenshot(full_page=True))


def page_of(name, path, caption=None):
    """The top of a page of the report, or the part with a caption."""
    with blank(1150, 620) as page:
        page.goto(path.as_uri())
        page.wait_for_timeout(1500)
        if caption:
            page.locator("figure", has_text=caption).first.scroll_into_view_if_needed()
            page.wait_for_timeout(500)
        small(name, page.screenshot())


def films(paths):
    """The first picture of each film, side by side."""
    pictures = []
    for path in paths:
        with open_video(str(path)) as video:
            pictures.append(cv2.resize(np.array(next(video.frames()).luma), None, fx=0.6, fy=0.6))
    whole = np.concatenate([np.pad(p, 3, constant_values=255) for p in pictures], axis=1)
    small("films", cv2.imencode(".png", whole)[1].tobytes())
