"""Equations of a test that patches them: controllers of one configuration share theirs in a process."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from ibvs_qp import analytic, controller


@pytest.fixture
def fresh_equations() -> Iterator[None]:
    """The test builds its own equations, and no later test gets them; request it before `monkeypatch` patches."""
    caches = controller._shipped_problem, analytic._analytic_model
    for cache in caches:
        cache.cache_clear()
    yield
    for cache in caches:
        cache.cache_clear()
