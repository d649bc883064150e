"""What stands behind the sliders: flies what changed, and remembers what was shown before."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, cast

import joblib

from ibvs_qp.errors import ConfigError
from sim.notebook.short import short_form
from sim.notebook.tuning.knobs import KNOBS, knob_values, turned
from sim.notebook.tuning.snippet import KEPT_FLIGHTS, Setting, analytic_setting, fly_snippet
from sim.trace import Trace

#: Processes that fly beside each other while both laws have to, and how long they wait for the next change [s].
WORKERS, IDLE_S = 2, 1800


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
    jobs = [joblib.delayed(fly_snippet)(setting), joblib.delayed(fly_snippet)(analytic, "paper")]
    with joblib.parallel_config("loky", n_jobs=WORKERS, inner_max_num_threads=1, idle_worker_timeout=IDLE_S):
        now, paper = joblib.Parallel()(jobs)
    return cast(Trace, now), cast(Trace, paper)
