"""The page of a run that goes on: served from this machine to this machine, and growing."""

import threading
import time as real_time
import webbrowser
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import parse_qs, urlparse

from dusttaichi.analysis import open_run
from dusttaichi.analysis.foreign import understood
from dusttaichi.errors import DustError
from dusttaichi.files import parts_folder
from dusttaichi.report.page import as_json, html, report_data

HOST = "127.0.0.1"
NAMES = (HOST, "localhost")
SHARE = 0.1  # of one core that the page may take: it is made again after ten times what it took
LAST = 6.0  # s for which a page may fetch the end, after which a server that is to end does


def result_of(path):
    """The result file of a run, which need not be there yet: of its directory, or itself."""
    path = Path(path)
    return path / "result.nc" if path.is_dir() or not path.suffix else path


class Source:
    """The data of the page of a run, made again when the result has grown and time allows it."""

    def __init__(self, path):
        self.path = result_of(path)
        self._data, self._next, self._seen = None, 0.0, None
        self._lock = threading.Lock()

    def data(self):
        """Current `report_data`, with `live` and a `stamp` that rises when it is new.

        Raises DustError where there is no result yet.
        """
        with self._lock:
            began = real_time.monotonic()
            seen = self._changed()
            if self._data is None or (seen != self._seen and began >= self._next):
                with understood([self.path]), open_run(self.path) as run:
                    fresh = report_data([run])
                    fresh["live"] = run.status == "running"
                stamp = self._data["stamp"] + 1 if self._data else 1
                self._data, self._seen = fresh | {"stamp": stamp}, seen
                took = real_time.monotonic() - began
                self._next = real_time.monotonic() + took / SHARE
            return self._data

    def _changed(self):
        """Stamp that changes when the result grows: its file, and the parts that continue it."""
        found = []
        for path in [self.path, *sorted(parts_folder(self.path).glob("*.nc"))]:
            try:
                about = path.stat()
            except OSError:  # not there yet, or just joined with the others
                continue
            found.append((path.name, about.st_mtime_ns, about.st_size))
        if not found:
            raise DustError(f"There is no result at {self.path} yet.")
        return found


class Handler(BaseHTTPRequestHandler):
    """The page, and its data after a stamp: 204 where there is nothing new."""

    def do_GET(self):
        if not self._of_this_machine():
            return self._answer(403, "text/plain", f"only {self.server.url} is served")
        url = urlparse(self.path)
        if url.path not in ("/", "/data.json"):
            return self._answer(404, "text/plain", "there is only /")
        try:
            data = self.server.source.data()
        except DustError as error:  # not there yet, or just being written
            return self._answer(503, "text/html; charset=utf-8", _waiting(error))
        if url.path == "/":
            return self._answer(200, "text/html; charset=utf-8", html(data))
        if str(data["stamp"]) in parse_qs(url.query).get("after", []):
            return self._answer(204, "application/json", "")
        return self._answer(200, "application/json", as_json(data))

    def _of_this_machine(self):
        """False where another name than this machine's was asked for: a page from elsewhere whose
        name leads here (DNS rebinding) would read the run."""
        host, _, port = self.headers.get("Host", "").rpartition(":")
        return host in NAMES and port == str(self.server.server_address[1])

    def _answer(self, code, kind, text):
        body = text.encode()
        self.send_response(code)
        self.send_header("Content-Type", kind)
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        try:
            self.wfile.write(body)
        except (BrokenPipeError, ConnectionResetError):
            pass  # the browser has gone

    def log_message(self, *_):
        """The terminal belongs to the run."""


def _waiting(error):
    text = str(error).replace("&", "&amp;").replace("<", "&lt;")
    return f'<!DOCTYPE html><meta http-equiv="refresh" content="2"><title>waiting</title><p>{text}'


class Server(ThreadingHTTPServer):
    """Serves the page of one run on this machine alone; port 0: any free one."""

    daemon_threads = True

    def __init__(self, path, port=0):
        self.source = Source(path)
        try:
            super().__init__((HOST, port), Handler)
        except OSError as error:
            raise DustError(f"--port {port}: {error.strerror or error}; 0 takes any.") from error

    @property
    def url(self):
        return f"http://{HOST}:{self.server_address[1]}/"


def serve(path, port=0, *, browse=True, told=print, stop=None):
    """Serve the page of a run until Ctrl-C, or until a moment after `stop` (an Event) is set.

    told: called with the address. browse: open it in the user's browser.
    """
    with Server(path, port) as server:
        told(server.url)
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
