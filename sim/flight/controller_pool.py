"""Controllers that have flown and wait to fly again: creating one takes as long as ten seconds of its ticks' work.

A controller after `reset` is as new to the bit, so a sweep over seeds or scenes creates each configuration once.
"""

from __future__ import annotations

import threading

from ibvs_qp.analytic import PaperController
from ibvs_qp.config import ControllerConfig
from ibvs_qp.controller import HybridController

Controller = HybridController | PaperController

#: Controllers kept; the one that waited longest goes first.
KEPT = 8

_waiting: list[tuple[str, ControllerConfig, Controller]] = []
_lock = threading.Lock()


def take(law: str, config: ControllerConfig) -> Controller:
    """A controller of a law and a configuration, as new; it belongs to the caller alone until given back."""
    with _lock:
        for index in reversed(range(len(_waiting))):
            if _waiting[index][:2] == (law, config):
                controller = _waiting.pop(index)[2]
                controller.reset()
                return controller
    return HybridController(config) if law == "qp" else PaperController(config)


def give_back(law: str, config: ControllerConfig, controller: Controller) -> None:
    """Keep a controller for the next flight; the caller must not use it any more."""
    with _lock:
        _waiting.append((law, config, controller))
        del _waiting[:-KEPT]
