"""Notebook 02 starts the flight in the browser, and ends it."""

from __future__ import annotations

import re
import urllib.request

import pytest

from ibvs_qp.config.errors import ConfigError
from sim.notebook.wall_flights import Setting
from sim.notebook.what_if import LiveFlight, bars

pytest.importorskip("viser", reason="the extra live is not installed")


@pytest.mark.slow
def test_a_live_flight_starts_with_the_setting_and_ends():
    live = LiveFlight()
    try:
        text = live.start(Setting(seed=3))
        found = re.search(r"http://127\.0\.0\.1:\d+", text)
        assert found and urllib.request.urlopen(found[0]).status == 200
        process = live._process
        assert process is not None and "3" in process.args  # type: ignore[operator]
    finally:
        live.end()
    assert process.poll() is not None


@pytest.mark.slow
def test_a_setting_that_does_not_fly_is_refused():
    with pytest.raises(ConfigError, match="seed"):
        LiveFlight().start(Setting(seed=-1))


def test_bars_are_as_long_as_their_values_and_red_at_the_limit():
    drawn = bars("thrust", [("a<b", 2.0, 1.0), ("c", 1.0, 4.0)], limit=4.0, full=4.0)
    widths = [float(each) for each in re.findall(r'<rect[^>]*width="([\d.]+)"', drawn)]
    assert widths[1] == pytest.approx(widths[0] / 2) and widths[3] == pytest.approx(2 * widths[0])
    assert "a&lt;b" in drawn and drawn.count("<line") == 1 and "1 (-1)" in drawn
