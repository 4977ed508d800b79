"""All pages of a report as one file, to be handed on: one below the other, with links between them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import partial
from urllib.parse import unquote

from vidtrack.report.addresses import FOLDER

_MAIN = re.compile(r"<main>(.*)</main>", re.DOTALL)
_ID = re.compile(r'(<[^>]*\bid=")([^"]+)(")')
_LINK = re.compile(r'(<a [^>]*href=")([^"]*)(")')


def one_file(pages: Mapping[str, str]) -> str:
    """The pages as one.

    pages   by their address from the first of them, which is `report.html`: report/run_pluck.html, ...; as
            `page_file.write_page` wrote them
    Script and style stand once; what has an address in a page keeps it behind the page's own. Films stay outside.
    """
    head = next(iter(pages.values()))
    parts = []
    for address, text in pages.items():
        main = _MAIN.search(text)
        if main is None:
            raise ValueError(f"{address} is no page of a report")
        own = _name(address)
        body = _ID.sub(partial(_renamed, own), main[1])
        body = _LINK.sub(partial(_led, address, pages), body)
        parts.append(f'<article id="{own}" class="page">{body}</article>')
    whole = _MAIN.search(head)
    assert whole is not None
    return f"{head[: whole.start()]}<main>{''.join(parts)}</main>{head[whole.end() :]}"


def _renamed(own: str, found: re.Match[str]) -> str:
    return f"{found[1]}{own}.{found[2]}{found[3]}"


def _led(address: str, pages: Mapping[str, str], found: re.Match[str]) -> str:
    return f"{found[1]}{_moved(found[2], address, pages)}{found[3]}"


def _name(address: str) -> str:
    return unquote(address).removeprefix(f"{FOLDER}/").removesuffix(".html")


def _moved(link: str, address: str, pages: Mapping[str, str]) -> str:
    """A link of the page at `address`, as it is within the one file."""
    path, _, part = link.partition("#")
    if not path:
        return f"#{_name(address)}.{part}"
    if ":" in path.split("/", 1)[0]:
        return link
    below = address.startswith(f"{FOLDER}/")
    full = path.removeprefix("../") if below and path.startswith("../") else f"{FOLDER}/{path}" if below else path
    known = {unquote(page): page for page in pages}
    if (page := known.get(unquote(full))) is not None:
        return f"#{_name(page)}" + (f".{part}" if part else "")
    return full + (f"#{part}" if part else "")
