"""The live report of a running run, served to this machine alone."""

from __future__ import annotations

import threading
import time as real_time
import webbrowser
from collections.abc import Callable
from html import escape
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, urlparse

from dusttaichi.analysis import open_run
from dusttaichi.analysis.foreign import explain_foreign_errors
from dusttaichi.errors import DustError
from dusttaichi.report.page import collect_report_data, format_json, render_page
from dusttaichi.results.files import list_segments

if TYPE_CHECKING:
    from threading import Event

    from dusttaichi.report.packing import Content

HOST = "127.0.0.1"
NAMES = (HOST, "localhost")
SHARE = 0.1  # of a core's time for the report: it is updated after ten times its run time
LAST = 6.0  # s during which a page may fetch the end before the server ends


def find_result_file(path: str | Path) -> Path:
    """Find the result file of a run, which need not exist yet: of its directory, or itself."""
    path = Path(path)
    return path / "result.nc" if path.is_dir() or not path.suffix else path


class Source:
    """Data of the report of a run, updated when the result grows and SHARE allows it."""

    def __init__(self, path: str | Path) -> None:
        self.path = find_result_file(path)
        self._data: Content | None = None
        self._next, self._seen = 0.0, [("", 0, 0)]
        self._lock = threading.Lock()

    def data(self) -> Content:
        """Current `collect_report_data`, with `live` and a `stamp` that grows with every update.

        Raises DustError where there is no result yet.
        """
        with self._lock:
            start = real_time.monotonic()
            change_stamp = self._read_change_stamp()
            if self._data is None or (change_stamp != self._seen and start >= self._next):
                with explain_foreign_errors([self.path]), open_run(self.path) as run:
                    new_data = collect_report_data([run])
                    new_data["live"] = run.status == "running"
                new_data["stamp"] = self._data["stamp"] + 1 if self._data else 1
                self._data, self._seen = new_data, change_stamp
                elapsed = real_time.monotonic() - start
                self._next = real_time.monotonic() + elapsed / SHARE
            return self._data

    def _read_change_stamp(self) -> list[tuple[str, int, int]]:
        """Read a value that changes when the result grows: of its file and its segments."""
        stamp = []
        for path in [self.path, *list_segments(self.path)]:
            try:
                file_status = path.stat()
            except OSError:  # not there yet, or just joined with the others
                continue
            stamp.append((path.name, file_status.st_mtime_ns, file_status.st_size))
        if not stamp:
            raise DustError(f"There is no result at {self.path} yet.")
        return stamp


class Handler(BaseHTTPRequestHandler):
    """The report, and its data after a stamp: 204 without an update."""

    server: Server

    def do_GET(self) -> None:
        if not self._is_from_this_machine():
            return self._answer(403, "text/plain", f"only {self.server.url} is served")
        url = urlparse(self.path)
        if url.path not in ("/", "/data.json"):
            return self._answer(404, "text/plain", "there is only /")
        try:
            data = self.server.source.data()
        except DustError as error:  # not there yet, or just being written
            head = '<!DOCTYPE html><meta http-equiv="refresh" content="2"><title>waiting</title>'
            text = f"{head}<p>{escape(str(error), quote=False)}"
            return self._answer(503, "text/html; charset=utf-8", text)
        if url.path == "/":
            return self._answer(200, "text/html; charset=utf-8", render_page(data))
        if str(data["stamp"]) in parse_qs(url.query).get("after", []):
            return self._answer(204, "application/json", "")
        return self._answer(200, "application/json", format_json(data))

    def _is_from_this_machine(self) -> bool:
        """False for a request with another host name, as by DNS rebinding of a foreign page."""
        host, _, port = self.headers.get("Host", "").rpartition(":")
        return host in NAMES and port == str(self.server.server_address[1])

    def _answer(self, code: int, content_type: str, text: str) -> None:
        body = text.encode()
        self.send_response(code)
        self.send_header("Content-Type", content_type)
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        try:
            self.wfile.write(body)
        except (BrokenPipeError, ConnectionResetError):
            pass  # the browser was closed

    def log_message(self, *_: object) -> None:
        """The terminal belongs to the run."""


class Server(ThreadingHTTPServer):
    """Serves the page of one run on this machine alone; port 0: any free one."""

    daemon_threads = True

    def __init__(self, path: str | Path, port: int = 0) -> None:
        self.source = Source(path)
        try:
            super().__init__((HOST, port), Handler)
        except OSError as error:
            raise DustError(f"--port {port}: {error.strerror or error}; 0 takes any.") from error

    @property
    def url(self) -> str:
        return f"http://{HOST}:{self.server_address[1]}/"


def serve(
    path: str | Path,
    port: int = 0,
    *,
    browse: bool = True,
    announce: Callable[[str], None] = print,
    stop: Event | None = None,
) -> None:
    """Serve the report of a run until Ctrl-C, or until a moment after `stop` (an Event) is set.

    announce: called with the address. browse: open it in the user's browser.
    """
    with Server(path, port) as server:
        announce(server.url)
        if browse:
            threading.Thread(target=webbrowser.open, args=(server.url,), daemon=True).start()
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            while stop is None or not stop.wait(0.5):
                if stop is None:
                    real_time.sleep(0.5)
            real_time.sleep(LAST)
        except KeyboardInterrupt:
            pass
        finally:
            server.shutdown()
