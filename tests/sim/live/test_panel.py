"""Inputs of the page: those of a watcher and those that are refused are put back; of events none is lost."""

from __future__ import annotations

import asyncio
import inspect
import math
from types import SimpleNamespace

import pytest

pytest.importorskip("viser", reason="the extra live is not installed")

import ibvs_qp
from ibvs_qp.model.inputs import setting_values
from sim.live.explaining import WhatIf
from sim.live.panel import Panel
from sim.live.site import open_server, stop

WRITER, WATCHER = 0, 1


@pytest.fixture
def page(free_port):
    """The commands that a panel sends, what it shows, and its inputs by label."""
    config, sent, shown = ibvs_qp.preset("qp").controller, [], {}
    server = open_server("127.0.0.1", free_port)
    try:
        settings = dict(setting_values(config)) | {
            "push_n": 5.0,
            "speed_m_s": 0.1,
            "thrust_max_n": 52.56,
            "solver.name": "osqp",
        }
        Panel(server, lambda *values: sent.append(values), settings, WhatIf(config), lambda: None, shown.__setitem__)
        server.get_clients = lambda: dict.fromkeys((WATCHER, WRITER))  # type: ignore[method-assign, return-value]
        handles = server.gui._gui_input_handle_from_uuid.values()
        yield sent, shown, lambda label: next(each for each in handles if label in (each.label or ""))
    finally:
        stop(server)


def enter(handle, value, client: int) -> None:
    """An input of a browser, in the server's event loop: its echoes of values that are put back run there, too."""
    event = SimpleNamespace(
        client=SimpleNamespace(client_id=client, add_notification=lambda *_, **__: None), client_id=client
    )

    async def message() -> None:
        handle._impl.value = value
        for callback in handle._impl.update_cb:
            assert inspect.iscoroutinefunction(callback)  # viser runs others in a pool of threads, after other messages
            await callback(event)

    asyncio.run_coroutine_threadsafe(message(), handle._impl.gui_api._event_loop).result()


@pytest.mark.parametrize(
    ("label", "value", "hostile"),
    [
        ("speed x", 0.5, math.nan),
        ("back", 3.0, math.inf),
        ("rotor", "2", "tail"),
        ("instead", "weights.line", "weights.pull"),
        ("factor", 0.5, 400.0),
        ("analytic law", False, None),
        ("push =", 0.0, 1e6),
        ("solver", "daqp", "abacus"),
        ("thrust max", 20.0, 5.0),
    ],
)
def test_inputs_of_watchers_and_refused_ones_are_put_back(page, capsys, label, value, hostile):
    sent, shown, find = page
    handle = find(label)
    if label == "rotor":
        value = handle.options[1]
    enter(handle, value, WRITER)
    assert handle.value == value
    count, views = len(sent), dict(shown)
    other = hostile if hostile is not None else not value
    enter(handle, other, WATCHER)
    assert handle.value == value
    assert not capsys.readouterr().err
    if hostile is not None:
        enter(handle, hostile, WRITER)
        assert handle.value == value
        assert len(capsys.readouterr().err.splitlines()) == 1
    assert len(sent) == count and shown == views
