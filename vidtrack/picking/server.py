"""The page's server: on 127.0.0.1 only, for those who have the token; every answer comes from this computer."""

from __future__ import annotations

import json
import secrets
import socket
import sys
import threading
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any
from urllib.parse import parse_qs, urlsplit

from vidtrack.errors import VidtrackError
from vidtrack.picking import looking
from vidtrack.picking.desk import Desk
from vidtrack.picking.store import Outdated

LARGEST = 4_000_000
"""Bytes of a request."""


class Server(ThreadingHTTPServer):
    """A server with a desk and a token; `address` is what the browser opens."""

    daemon_threads = True

    def __init__(self, desk: Desk, port: int = 0) -> None:
        self.desk = desk
        # a click is answered while labels are computed: that thread lets go of the interpreter ten times as often
        sys.setswitchinterval(0.0005)
        self.token = secrets.token_urlsafe(24)
        self._open: dict[Any, threading.Thread] = {}
        super().__init__(("127.0.0.1", port), _Handler)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """As in ThreadingMixIn; which connections are open is known."""
        self._open[request] = threading.current_thread()
        try:
            super().process_request_thread(request, client_address)
        finally:
            del self._open[request]

    def server_close(self) -> None:
        """Close all connections and let the desk go: a thread in a decoder when Python ends would abort it."""
        super().server_close()
        for request in list(self._open):
            with suppress(OSError):
                request.shutdown(socket.SHUT_RDWR)
        self.desk.close()
        for thread in list(self._open.values()):
            thread.join(30)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Nothing for a window that was closed; anything else is a fault to be seen."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self.server_address[1])

    @property
    def address(self) -> str:
        """The page, with the token."""
        return f"http://127.0.0.1:{self.port}/?token={self.token}"


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True  # else the body of an answer waits up to 40 ms for the receipt of its head
    server: Server

    def log_message(self, *_: Any) -> None:
        """Nothing: the terminal is the user's."""

    def do_GET(self) -> None:
        """A page, a picture or a record."""
        url = urlsplit(self.path)
        asked = {key: values[-1] for key, values in parse_qs(url.query).items()}
        if self._refused(asked.get("token", self.headers.get("X-Token", ""))):
            return
        if url.path == "/":
            self._page()
            return
        self._answer(_GET.get(url.path), asked)

    def do_POST(self) -> None:
        """A record in, a record out."""
        url = urlsplit(self.path)
        try:
            length = int(self.headers.get("Content-Length", ""))
        except ValueError:
            length = -1
        body = self.rfile.read(length) if 0 <= length <= LARGEST else b""
        if self._refused(self.headers.get("X-Token", "")):
            return
        if self.headers.get_content_type() != "application/json" or not body:
            self._send(HTTPStatus.BAD_REQUEST, _json({"problem": "a request is JSON"}))
            return
        try:
            given = json.loads(body)
        except (ValueError, RecursionError):
            self._send(HTTPStatus.BAD_REQUEST, _json({"problem": "a request is JSON"}))
            return
        self._answer(_POST.get(url.path), given)

    def _refused(self, token: str) -> bool:
        """Whether a request comes from elsewhere: another page, another name of this computer, or without the token."""
        hosts = (f"127.0.0.1:{self.server.port}", f"localhost:{self.server.port}")
        origin, site = self.headers.get("Origin"), self.headers.get("Sec-Fetch-Site", "none")
        own = self.headers.get("Host") in hosts
        own = own and (origin is None or origin in [f"http://{host}" for host in hosts])
        own = own and site in ("none", "same-origin")
        if own and secrets.compare_digest(token.encode(), self.server.token.encode()):
            return False
        self.close_connection = True
        self._send(HTTPStatus.FORBIDDEN, _json({"problem": "open the address that vidtrack pick has printed"}))
        return True

    def _page(self) -> None:
        nonce = secrets.token_urlsafe(12)
        here = files("vidtrack.picking") / "page"
        parts = {name: (here / name).read_text(encoding="utf-8") for name in ("page.html", "page.css", "page.js")}
        text = parts["page.html"].replace("/*STYLE*/", parts["page.css"]).replace("/*SCRIPT*/", parts["page.js"])
        policy = f"default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; connect-src 'self'; "
        policy += "img-src blob: data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        self._send(HTTPStatus.OK, text.replace("NONCE", nonce).encode(), "text/html; charset=utf-8", policy)

    def _answer(self, what: Any, given: dict[str, Any]) -> None:
        if what is None:
            self._send(HTTPStatus.NOT_FOUND, _json({"problem": "no such thing here"}))
            return
        try:
            answer = what(self.server.desk, given)
        except Outdated as error:
            self._send(HTTPStatus.CONFLICT, _json({"problem": str(error)}))
        except VidtrackError as error:
            self._send(HTTPStatus.UNPROCESSABLE_ENTITY, _json({"problem": str(error)}))
        except OSError as error:
            self._send(HTTPStatus.UNPROCESSABLE_ENTITY, _json({"problem": f"{error.filename}: {error.strerror}."}))
        except (KeyError, IndexError, TypeError, AttributeError, ValueError) as error:
            self._send(HTTPStatus.BAD_REQUEST, _json({"problem": f"{type(error).__name__}: {error}"}))
        else:
            if isinstance(answer, bytes):
                self._send(HTTPStatus.OK, answer, "image/png" if answer[:4] == b"\x89PNG" else "image/jpeg")
            else:
                self._send(HTTPStatus.OK, _json(answer))

    def _send(self, status: HTTPStatus, body: bytes, kind: str = "application/json", policy: str = "") -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("X-Content-Type-Options", "nosniff")
        if policy:
            self.send_header("Content-Security-Policy", policy)
        self.end_headers()
        self.wfile.write(body)


def _json(value: Any) -> bytes:
    return json.dumps(value, allow_nan=False, default=str).encode()


def _which(given: dict[str, Any]) -> tuple[str, str, str]:
    return str(given["kind"]), str(given["name"]), str(given["camera"])


def _frame(desk: Desk, given: dict[str, Any]) -> bytes:
    return desk.jpeg(*_which(given), int(given["n"]), float(given.get("low", 0)), float(given.get("high", 255)))


def _mask(desk: Desk, given: dict[str, Any]) -> bytes:
    return desk.mask(*_which(given), int(given["n"]), json.loads(given.get("detect", "{}")))


def _measure(desk: Desk, given: dict[str, Any]) -> dict[str, Any]:
    look = desk.look(*_which(given), int(given["n"]), given.get("detect", {}))
    if "box" in given:
        return {"blobs": looking.inside(look, *(float(v) for v in given["box"])), "all": len(look.blobs.Xf)}
    blob = looking.nearest(look, float(given["x"]), float(given["y"]), float(given.get("reach", 8)))
    return {"blobs": [blob] if blob else [], "all": len(look.blobs.Xf)}


_GET = {
    "/state": lambda desk, _: desk.read_again(),
    "/info": lambda desk, given: desk.info(*_which(given)),
    "/frame": _frame,
    "/mask": _mask,
    "/counted": lambda desk, _: {"pictures": desk.counted},
    "/plan": lambda desk, _: {"lines": desk.plan()},
}
_POST = {
    "/measure": _measure,
    "/label": lambda desk, given: desk.label(str(given["camera"]), given["picks"], given.get("clips")),
    "/epipolar": lambda desk, given: desk.epipolar(str(given["camera"]), float(given["x"]), float(given["y"])),
    "/save": lambda desk, given: desk.save(given),
}
