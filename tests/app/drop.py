"""Drops files onto a window as a file manager does: the source's side of XDND version 5.

    python drop.py WINDOW PATH ...        on the display DISPLAY

The protocol: https://www.freedesktop.org/wiki/Specifications/XDND
"""

from __future__ import annotations

import os
import sys
from urllib.parse import quote_from_bytes

from Xlib import X, Xatom
from Xlib.display import Display
from Xlib.protocol import event

_VERSION = 5


def drop(display: Display, target_id: int, paths: list[str]) -> None:
    """Returns when the window has taken them. Ends the program where it refuses."""
    target = display.create_resource_object("window", target_id)
    source = display.screen().root.create_window(0, 0, 1, 1, 0, X.CopyFromParent)
    uris = display.intern_atom("text/uri-list")
    selection = display.intern_atom("XdndSelection")

    def tell(name: str, *data: int) -> None:
        values = [source.id, *data, *[0] * (4 - len(data))]
        message = event.ClientMessage(window=target, client_type=display.intern_atom(name), data=(32, values))
        target.send_event(message)
        display.flush()

    source.set_selection_owner(selection, X.CurrentTime)
    tell("XdndEnter", _VERSION << 24, uris)
    tell("XdndPosition", 0, 300 << 16 | 300, X.CurrentTime, display.intern_atom("XdndActionCopy"))
    while True:
        received = display.next_event()
        if received.type == X.SelectionRequest:
            _give(received, uris, b"".join(_uri(path) + b"\r\n" for path in paths))
            display.flush()
        elif received.type == X.ClientMessage:
            name = display.get_atom_name(received.client_type)
            if name == "XdndStatus":
                if not received.data[1][1] & 1:
                    sys.exit("the window does not take it")
                tell("XdndDrop", 0, X.CurrentTime)
            elif name == "XdndFinished":
                return


def _uri(path: str) -> bytes:
    return b"file://" + quote_from_bytes(os.fsencode(path)).encode()


def _give(request: event.SelectionRequest, kind: int, data: bytes) -> None:
    """Answer a request for the selection."""
    request.requestor.change_property(request.property, kind, 8, data)
    request.requestor.send_event(
        event.SelectionNotify(
            time=request.time, requestor=request.requestor, selection=request.selection,
            target=request.target, property=request.property or Xatom.NONE,
        )
    )  # fmt: skip


if __name__ == "__main__":
    drop(Display(), int(sys.argv[1]), sys.argv[2:])
