"""A browser that a test drives: Debian's own Chromium, headless."""

import shutil
import time
from contextlib import contextmanager

import pytest

CHROMIUM = shutil.which("chromium")
needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine")


@contextmanager
def open_page(address, size=(1500, 900)):
    """The page, and a list that receives every script error, console message and request to another place."""
    sync_api = pytest.importorskip("playwright.sync_api")
    troubles = []
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        page = browser.new_page(viewport={"width": size[0], "height": size[1]})
        page.on("pageerror", lambda error: troubles.append(str(error)))
        page.on("console", lambda said: troubles.append(said.text))
        own = address.split("/?")[0]
        page.on("request", lambda r: troubles.append(r.url) if not r.url.startswith((own, "blob:", "data:")) else None)
        page.goto(address)
        wait(page, "() => !!(window.vidtrack && window.vidtrack.state.image)")
        yield page, troubles
        browser.close()


def wait(page, what, seconds=60):
    """Wait until a function of the page answers true."""
    for _ in range(20 * seconds):
        if page.evaluate(what):
            return
        time.sleep(0.05)
    raise TimeoutError(f"{what}; status: {page.inner_text('#status')}; problems: {page.inner_text('#problems')}")


def choose(page, name):
    """Show a recording, named as in the list: `clip front/cam1`."""
    page.evaluate("() => { window.vidtrack.state.image = null; }")
    page.click(f'[data-view="{name}"]')
    wait(page, "() => !!window.vidtrack.state.image")


def screen(page, x, y):
    """Where a place of the frame buffer is on the screen."""
    return page.evaluate(
        "([x, y]) => { const b = vidtrack.picture.getBoundingClientRect(), p = vidtrack.toScreen(x, y);"
        " return [b.left + p[0], b.top + p[1]]; }",
        [x, y],
    )


def pick(page, tag, x, y):
    """Tag the ball at a place, as a person does: choose the tag, click on the ball."""
    page.select_option("#tag", tag)
    page.mouse.click(*screen(page, x, y))
    wait(page, f"() => document.querySelector('#status').textContent.startsWith('tag {tag} at')")


def drag(page, start, end):
    """Drag from one place of the frame buffer to another."""
    page.mouse.move(*screen(page, *start))
    page.mouse.down()
    page.mouse.move(*screen(page, (start[0] + end[0]) / 2, (start[1] + end[1]) / 2))
    page.mouse.move(*screen(page, *end))
    page.mouse.up()
