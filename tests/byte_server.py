"""A server of one file on this machine, with range requests and without."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


@dataclass
class Served:
    """What a server does. url: of the file. ranges: (start, size) of the answers so far. held_back: places of
    bytes that it does not send before `released`."""

    url: str = ""
    ranges: list[tuple[int, int]] = field(default_factory=list)
    held_back: range = range(0)
    released: threading.Event = field(default_factory=threading.Event)


@contextmanager
def serving(
    data: bytes, *, ranges: bool = True, held_back: range = range(0), name: str = "a.svo"
) -> Iterator[Served]:
    """Serve bytes. ranges: whether it answers range requests. held_back: see `Served`."""
    served = Served(held_back=held_back)

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if self.path != "/a.svo":
                self.send_error(404)
                return
            start, end = 0, len(data)
            asked = re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers.get("Range", ""))
            if ranges and asked:
                start, end = int(asked[1]), min(int(asked[2]) + 1, len(data))
                if start >= len(data):
                    self.send_error(416)
                    return
            self.send_response(206 if ranges and asked else 200)
            if ranges and asked:
                self.send_header("Content-Range", f"bytes {start}-{end - 1}/{len(data)}")
            self.send_header("Content-Length", str(end - start))
            self.end_headers()
            served.ranges.append((start, end - start))
            held = served.held_back
            free = max(start, held.start) if start < held.stop and end > held.start else end
            self.wfile.write(data[start:free])
            if free < end:
                self.wfile.flush()
                served.released.wait()
                self.wfile.write(data[free:end])

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        served.url = f"http://127.0.0.1:{server.server_port}/a.svo"
        yield served
    finally:
        served.released.set()
        server.shutdown()
        thread.join()
        server.server_close()
