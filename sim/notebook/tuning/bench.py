"""What stands behind the sliders: flies what changed, and remembers what was shown before."""

from __future__ import annotations

import functools
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any

from joblib.externals.loky import get_reusable_executor

from ibvs_qp.config.errors import ConfigError
from sim.flight.trace import Trace
from sim.notebook.short import short_form
from sim.notebook.tuning.knobs import KNOBS, knob_values, turned
from sim.notebook.tuning.snippet import KEPT_FLIGHTS, Setting, analytic_setting, fly_snippet

#: How long the helper, which flies beside this process when both laws have to, waits for the next change [s].
IDLE_S = 1800
#: What keeps linear algebra in the helper from taking this process's core.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One setting as flown, beside the setting before it and the analytic law.

    Attributes:
        setting: What was set.
        now: Its flight under the quadratic program.
        last: The flight shown before.
        last_setting: What was set then.
        analytic: The flight of the analytic law in the same scene.
        refusal: Why the setting was refused; then everything else is what was shown before.
    """

    setting: Setting
    now: Trace
    last: Trace
    last_setting: Setting
    analytic: Trace
    refusal: str = ""

    @property
    def changes(self) -> tuple[str, ...]:
        """Every knob that was turned since the last setting, as "label: before -> after"."""
        before, after = knob_values(self.last_setting), knob_values(self.setting)
        return tuple(
            f"{KNOBS[name].label}: {_spoken(before[name])} → {_spoken(value)}"
            for name, value in after.items()
            if value != before[name]
        )


def _spoken(value: Any) -> str:
    return ("off", "on")[value] if isinstance(value, bool) else f"{value:g}"


class TuningBench:
    """Flies settings and keeps the last two.

    Args:
        base: Where the knobs stand at first; it also is the first setting to compare with.
    """

    def __init__(self, base: Setting | None = None) -> None:
        self.base = base or Setting()
        self._shown: list[Comparison] = []
        self._analytic: dict[Setting, Trace] = {}

    def compare(self, values: dict[str, Any] | None = None, own_gains: bool = True) -> Comparison:
        """Fly the base setting with some knobs turned and compare it with what was shown before.

        Args:
            values: Values of knobs by name.
            own_gains: Whether the analytic law flies the gains of its own preset, or those that are set.

        Returns:
            The comparison; with its refusal, and what was shown before, where the configuration is refused.
        """
        before = self._shown[-1] if self._shown else None
        try:
            setting = turned(self.base, values or {})
            now, analytic = self._fly(setting, analytic_setting(setting, own_gains))
        except ConfigError as error:
            return self._refused(str(error), own_gains)
        if before is None:
            last_setting, last = self.base, now if setting == self.base else fly_snippet(self.base)
        elif before.setting == setting:
            last_setting, last = before.last_setting, before.last
        else:
            last_setting, last = before.setting, before.now
        shown = Comparison(setting=setting, now=now, last=last, last_setting=last_setting, analytic=analytic)
        self._shown = [shown]
        return shown

    def _refused(self, reason: str, own_gains: bool) -> Comparison:
        shown = self._shown[-1] if self._shown else self.compare({}, own_gains)
        fields = {name: value for name, value in vars(shown).items() if name != "refusal"}
        return Comparison(**fields, refusal=reason)

    def _fly(self, setting: Setting, analytic: Setting) -> tuple[Trace, Trace]:
        """Both laws beside each other where both must fly; the analytic law is flown only when its setting changed."""
        known = self._analytic.get(analytic)
        if known is not None or short_form():
            now = fly_snippet(setting)
            known = known if known is not None else fly_snippet(analytic, "paper")
        else:
            now, known = _side_by_side(setting, analytic)
        if len(self._analytic) >= KEPT_FLIGHTS:
            self._analytic.clear()
        self._analytic[analytic] = known
        return now, known


def compare_pair(before: dict[str, Any], change: dict[str, Any]) -> Comparison:
    """One change of the shipped setting beside a further one.

    Args:
        before: Values of knobs in the flight to compare with.
        change: Further values, of the flight shown.
    """
    bench = TuningBench()
    bench.base = turned(bench.base, before)
    return bench.compare(change)


@functools.lru_cache(maxsize=KEPT_FLIGHTS)
def _side_by_side(setting: Setting, analytic: Setting) -> tuple[Trace, Trace]:
    """The analytic law flies in the helper while this process flies the program; here too until the helper is ready."""
    if not _helper_ready().done():
        return fly_snippet(setting), fly_snippet(analytic, "paper")
    beside = _helper().submit(fly_snippet, analytic, "paper")
    now = fly_snippet(setting)
    try:
        return now, beside.result()
    except BrokenProcessPool:
        return now, fly_snippet(analytic, "paper")


def _helper() -> Executor:
    """One process beside this one, started where there is none."""
    return get_reusable_executor(max_workers=1, timeout=IDLE_S, env=dict.fromkeys(THREADS, "1"))


@functools.cache
def _helper_ready() -> Future[Trace]:
    """Done when the helper has loaded everything, and created its controller, by a first flight."""
    return _helper().submit(fly_snippet, analytic_setting(Setting()), "paper")
