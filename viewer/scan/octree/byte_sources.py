"""Where the bytes of octrees come from: a file, a server that answers range requests, or a stream."""

from __future__ import annotations

import http.client
import re
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Protocol

from ...errors import InputError
from ..admission import opened

_AT_LEAST = 1 << 14  # bytes that one request brings, since coarse levels are short
_SECONDS = 30.0  # that a server may take to answer
_CHUNK = 1 << 16  # bytes of a stream read at a time


class ByteSource(Protocol):
    """Bytes that can be read anywhere. Any thread may read, one at a time."""

    @property
    def is_stream(self) -> bool:
        """Whether the bytes come one after the other, and nobody knows their end."""

    def read(self, start: int, size: int) -> bytes:
        """So many bytes from a place on, fewer where the bytes end there. Raises InputError, OSError."""


class FileBytes:
    """The bytes of a file."""

    is_stream = False

    def __init__(self, path: Path) -> None:
        self._path = path

    def read(self, start: int, size: int) -> bytes:
        """See `ByteSource`."""
        with opened(self._path) as file:
            file.seek(start)
            return file.read(size)


class StreamBytes:
    """The bytes of a stream, such as standard input, as far as they have come; reading waits for more."""

    is_stream = True

    def __init__(self, stream: BinaryIO | http.client.HTTPResponse) -> None:
        self._stream = stream
        self._come = bytearray()

    def close(self) -> None:
        """Read no more."""
        self._stream.close()

    def read(self, start: int, size: int) -> bytes:
        """See `ByteSource`."""
        while len(self._come) < start + size:
            missing = start + size - len(self._come)
            try:
                part = self._stream.read(min(missing, _CHUNK))
            except (OSError, ValueError, http.client.HTTPException):  # it broke or closed: the bytes end here
                part = b""
            if not part:
                break
            self._come += part
        return bytes(self._come[start : start + size])


class HttpBytes:
    """The bytes of a file on a server, by range requests; of a server that answers with the whole file, its
    answer as it comes."""

    def __init__(self, url: str) -> None:
        self._url = url
        self._held = 0, b""  # the last answer, and where it begins
        self._whole: StreamBytes | None = None
        self._size: int | None = None  # of the file, once the server has stated it

    @property
    def is_stream(self) -> bool:
        """Whether the server does not answer range requests; known once something was read."""
        return self._whole is not None

    def read(self, start: int, size: int) -> bytes:
        """See `ByteSource`."""
        if not size:
            return b""
        if self._whole is not None:
            return self._whole.read(start, size)
        first, held = self._held
        is_end = self._size is not None and first + len(held) >= self._size
        if not (first <= start and (start + size <= first + len(held) or (is_end and held))):
            answer = self._ask(start, max(size, _AT_LEAST))
            if self._whole is not None:
                return self._whole.read(start, size)
            first, held = self._held = start, answer
        return held[start - first : start - first + size]

    def close(self) -> None:
        """Read no more from the server, on the thread that reads."""
        if self._whole is not None:
            self._whole.close()

    def _ask(self, start: int, size: int) -> bytes:
        request = urllib.request.Request(self._url, headers={"Range": f"bytes={start}-{start + size - 1}"})
        with self._reported():
            try:
                response = urllib.request.urlopen(request, timeout=_SECONDS)
            except urllib.error.HTTPError as error:
                error.close()
                if error.code == http.client.REQUESTED_RANGE_NOT_SATISFIABLE:
                    return b""  # the file ends before
                raise
            if response.status == http.client.PARTIAL_CONTENT:
                with response:
                    self._check_range(response.headers.get("Content-Range", ""), start)
                    return _start_of(response, size)
        if self._size is not None:
            raise InputError("changed while Scan4D read it, or the server no longer answers range requests")
        self._whole = StreamBytes(response)
        return b""

    @contextmanager
    def _reported(self) -> Iterator[None]:
        try:
            yield
        except urllib.error.HTTPError as error:
            raise InputError(f"the server answers {error.code} {error.reason}", self._url) from error
        except (OSError, http.client.HTTPException, ValueError) as error:
            reason = getattr(error, "reason", None) or error
            raise InputError(f"cannot be read from the server ({reason})", self._url) from error

    def _check_range(self, text: str, start: int) -> None:
        """Take the file's size from an answer, which has to begin at the place that was asked for."""
        found = re.fullmatch(r"bytes (\d{1,18})-\d{1,18}/(\d{1,18}|\*)", text.strip())
        if found is None or int(found[1]) != start:
            raise InputError("the server answers with other bytes than Scan4D asked for", self._url)
        size = None if found[2] == "*" else int(found[2])
        if self._size is not None and size != self._size:
            raise InputError("changed on the server while Scan4D read it", self._url, "Open it again")
        self._size = size


def _start_of(response: http.client.HTTPResponse, size: int) -> bytes:
    """At most so many bytes of an answer, fewer where the connection broke."""
    try:
        return response.read(size)
    except http.client.IncompleteRead as error:
        return error.partial
