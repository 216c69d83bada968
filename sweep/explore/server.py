"""Server of the page, on this machine only: a token in every address, no answer to pages from elsewhere.

It stores nothing about its visitors: a request contains its designs, so any number of pages may be open at once.
"""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
import tempfile
import threading
import time
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweep.errors import InputError, LinksweepError, MissingInput, extra
from sweep.exchange.export import FORMATS, export
from sweep.explore.cells import cells, design_of
from sweep.explore.changes import dragged, improve, problem_in_hand
from sweep.explore.hand import Hand
from sweep.pages import rendered
from sweep.report.live import PLANE, SPATIAL

if TYPE_CHECKING:
    from starlette.requests import Request
    from starlette.responses import Response

HOST = "127.0.0.1"
TOKEN_BYTES = 24
MOST_BYTES = 100_000  # largest size of a request
PULSE = 0.2  # seconds between two progress messages of a search
WORDS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; img-src data:; style-src 'unsafe-inline'; "
    "script-src 'unsafe-inline'; connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
HEADERS = [(name.lower().encode(), words.encode()) for name, words in WORDS.items()]


class Server:
    """Server of a page at its own address: ``address`` contains port and token; ``run`` serves until Ctrl-C."""

    def __init__(self, hand: Hand, port: int = 0) -> None:
        _needed()
        self.hand, self.token = hand, secrets.token_urlsafe(TOKEN_BYTES)
        # The TCP protocol is named since asyncio otherwise keeps Nagle's delay: a body would wait 40 ms for its head's
        # ack.
        self.socket = socket.socket(proto=socket.IPPROTO_TCP)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self.socket.bind((HOST, port))
            self.socket.listen()  # early requests wait in the queue
        except OSError as error:
            self.socket.close()
            raise InputError("--port", port, f"a port that is free; {error.strerror}", "explore") from error
        self.origin = f"http://{HOST}:{self.socket.getsockname()[1]}"
        self.address = f"{self.origin}/{self.token}/"

    def run(self) -> None:
        """Serve until the process is interrupted."""
        import uvicorn

        settings = uvicorn.Config(self.app(), log_level="warning", timeout_graceful_shutdown=1)
        uvicorn.Server(settings).run(sockets=[self.socket])

    def app(self) -> Callable[..., Any]:
        """Return the application: the page, and its requests."""
        from starlette.applications import Starlette
        from starlette.requests import Request
        from starlette.responses import HTMLResponse, PlainTextResponse
        from starlette.routing import Route

        def page(_: Request) -> Response:
            return HTMLResponse(page_text(self.hand))

        async def checked(scope: Any, receive: Any, send: Any) -> None:
            async def sent(message: Any) -> None:
                if message["type"] == "http.response.start":
                    message["headers"] = [*message["headers"], *HEADERS]
                await send(message)

            ours = scope["type"] != "http" or self._is_ours(Request(scope))
            await (routed if ours else PlainTextResponse("not for you\n", 403))(scope, receive, sent)

        place = f"/{self.token}"
        endpoints = {
            "answer": self._answer, "cells": self._cells, "design": self._design, "drag": self._drag,
            "save": self._save,
        }  # fmt: skip
        routes = [Route(f"{place}/", page)]
        routes += [Route(f"{place}/{name}", _json(what), methods=["POST"]) for name, what in endpoints.items()]
        others = {"improve": self._improve, "export": self._export}
        routes += [Route(f"{place}/{name}", what, methods=["POST"]) for name, what in others.items()]
        wrong = dict.fromkeys((LinksweepError, KeyError, OverflowError, TypeError, ValueError), _refused)
        routed = Starlette(routes=routes, exception_handlers=wrong)
        return checked

    def _is_ours(self, request: Request) -> bool:
        """Tell whether a request has the token, names this server, and comes from its own page or from no page.

        A browser that was talked into another name for this machine says so in Host; a page in another tab in Origin.
        """
        token = request.url.path.split("/")[1].encode()
        known = secrets.compare_digest(token, self.token.encode())
        host, origin = request.headers.get("host", ""), request.headers.get("origin")
        return known and f"http://{host}" == self.origin and origin in (None, self.origin)

    def _answer(self, body: dict[str, Any]) -> dict[str, Any]:
        begun = time.perf_counter()
        answer = self.hand.answer(body["designs"], body["names"])
        return answer | {"milliseconds": 1e3 * (time.perf_counter() - begun)}

    def _cells(self, body: dict[str, Any]) -> dict[str, Any]:
        return cells(self.hand, body["pairs"], body.get("ranges", {}), int(body["bins"]))

    def _drag(self, body: dict[str, Any]) -> dict[str, Any]:
        design, place = self.hand.design(body["design"]), (str(body["part"]), str(body["joint"]))
        moved, phi = dragged(self.hand, design, float(body["phi"]), place, [float(x) for x in body["to"]])
        return {"design": moved, "phi": phi}

    def _design(self, body: dict[str, Any]) -> dict[str, Any]:
        return {"design": design_of(self.hand, int(body["number"]))}

    def _save(self, body: dict[str, Any]) -> dict[str, Any]:
        if body["as"] == "reference":
            return {"text": self.hand.reference(body["design"])}
        return {"text": self.hand.saved(body["design"], body["free"])}

    async def _improve(self, request: Request) -> Response:
        """Search while the page is connected; a page that disconnects stops its own search only."""
        from starlette.concurrency import run_in_threadpool
        from starlette.responses import StreamingResponse

        body = await _json_body(request)
        design = self.hand.design(body["design"])
        problem = problem_in_hand(self.hand, design, body["free"])
        stop, counted = threading.Event(), [0]

        def is_over() -> bool:
            counted[0] += 1
            return stop.is_set()

        async def words() -> AsyncIterator[str]:
            begun, work = time.monotonic(), asyncio.create_task(run_in_threadpool(improve, problem, design, is_over))
            try:
                while not work.done():
                    yield json.dumps({"looks": counted[0], "seconds": time.monotonic() - begun}) + "\n"
                    await asyncio.wait([work], timeout=PULSE)
                yield json.dumps(await work) + "\n"
            except LinksweepError as error:
                yield json.dumps({"error": str(error)}) + "\n"
            finally:
                stop.set()

        return StreamingResponse(words(), media_type="application/x-ndjson")

    async def _export(self, request: Request) -> Response:
        """Return a file of the design, in one of the formats of `sweep export`."""
        from starlette.concurrency import run_in_threadpool
        from starlette.responses import Response

        body = await _json_body(request)
        design, kind = self.hand.design(body["design"]), str(body["format"])
        content = await run_in_threadpool(self._file, design, kind)
        return Response(content, media_type="application/octet-stream")

    def _file(self, design: dict[str, float], kind: str) -> bytes:
        if kind not in FORMATS:
            raise InputError("format", kind, ", ".join(FORMATS), "explore")
        with tempfile.TemporaryDirectory() as folder:
            target = Path(folder, f"design{FORMATS[kind][0]}")
            export(self.hand.family, design, target, kind, speed=self.hand.study.speed, angles="rad")
            return target.read_bytes()


def _needed() -> None:
    try:
        import starlette  # noqa: F401
        import uvicorn  # noqa: F401
    except ImportError as error:
        raise MissingInput(str(error.name), f"this package, for the page: {extra('explore')}", "explore") from error


async def _json_body(request: Request) -> dict[str, Any]:
    body = await request.body()
    try:
        content = json.loads(body) if len(body) <= MOST_BYTES else None
    except RecursionError:  # deeply nested brackets
        content = None
    if not isinstance(content, dict):
        raise ValueError(f"a JSON object of at most {MOST_BYTES} bytes")
    return content


def _json(answer: Callable[[dict[str, Any]], dict[str, Any]]) -> Callable[[Request], Any]:
    """Return an endpoint that answers JSON with JSON, in a thread."""
    from starlette.concurrency import run_in_threadpool
    from starlette.responses import JSONResponse

    async def endpoint(request: Request) -> Response:
        return JSONResponse(await run_in_threadpool(answer, await _json_body(request)))

    return endpoint


def _refused(_: Request, error: Exception) -> Response:
    """Return the fault of a request."""
    from starlette.responses import JSONResponse

    words = f"{error} is missing" if isinstance(error, KeyError) else str(error)
    return JSONResponse({"error": words}, 422)


def page_text(hand: Hand) -> str:
    """Return the page with its first answer, style and scripts; it needs no other source."""
    scripts = [*SPATIAL, *PLANE, "live/explore.js"]
    return rendered(
        "explore.html", page=hand.page(), formats=list(FORMATS), live_designs=[], axis="angle", scripts=scripts
    )
