"""The page's server: its address, its end, and one line for an ignored message."""

from __future__ import annotations

import contextlib
import io
import logging
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable, Coroutine
from typing import Any

import viser

from ibvs_qp.config.errors import ConfigError

#: Longest line about a message that is ignored [characters].
_LINE = 200


class _OneLine(logging.Handler):
    """Errors of the websocket server as one line on standard error: hostile messages end their own connection."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print the line."""
        error = record.exc_info[1] if record.exc_info else None
        text = f"{record.getMessage()} ({type(error).__name__}: {error})" if error is not None else record.getMessage()
        ignored(text)


def ignored(text: str) -> None:
    """Print one line about an input that is ignored."""
    print(f"ibvs-qp live: ignored: {' '.join(text.split())[:_LINE]}", file=sys.stderr)


def guarded(
    act: Callable[..., None], undo: Callable[[], None] | None = None
) -> Callable[..., Coroutine[None, None, None]]:
    """A callback of the page: an error is one line, and is undone.

    It runs in viser's event loop, directly after the message has changed the value: in a pool of threads another
    callback would see a watcher's value before it is put back.
    """

    async def call(*values: Any) -> None:
        try:
            act(*values)
        except Exception as error:
            ignored(str(error) if isinstance(error, ConfigError) else f"{type(error).__name__}: {error}")
            if undo is not None:
                undo()

    return call


def quiet_server() -> None:
    """Send errors of websockets and asyncio to one line each."""
    for name in ("websockets.server", "websockets", "asyncio"):
        logger = logging.getLogger(name)
        logger.handlers, logger.propagate = [_OneLine(logging.ERROR)], False
        logger.setLevel(logging.ERROR)


def open_server(host: str, port: int) -> viser.ViserServer:
    """A server at an address.

    Raises:
        ConfigError: When the port is taken.
    """
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or error
            raise ConfigError(f"cannot listen on {host} port {port}: {reason}; give another with --port") from None
    quiet_server()
    with contextlib.redirect_stdout(io.StringIO()):  # a table of addresses
        server = viser.ViserServer(host=host, port=port, verbose=False, label="ibvs-qp live")
    server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
    server.gui.main_panel.dock_right()
    return server


def open_browser(server: viser.ViserServer) -> None:
    """Open the page; a browser in the terminal would block the caller."""
    threading.Thread(target=webbrowser.open, args=(address(server),), daemon=True).start()


def address(server: viser.ViserServer) -> str:
    """Address of the page."""
    host = server.get_host()
    shown = {"0.0.0.0": "127.0.0.1", "::": "[::1]"}.get(host, f"[{host}]" if ":" in host else host)  # nosec B104
    return f"http://{shown}:{server.get_port()}"


def stop(server: viser.ViserServer) -> None:
    """End it; it would print a line."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()
