"""Recording and replay of flights in MCAP files (docs/logs.md); needs the extra ``log``."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from ibvs_qp.config.errors import ConfigError

if TYPE_CHECKING:
    from ibvs_qp.recording.comparison import Difference, Replay, replay
    from ibvs_qp.recording.other_preset import PresetComparison, compare_preset
    from ibvs_qp.recording.reader import RecordedFlight, read_log
    from ibvs_qp.recording.recorder import Recorder
    from ibvs_qp.recording.repair_file import repair

_HOMES = {
    "ibvs_qp.recording.reader": ("RecordedFlight", "read_log"),
    "ibvs_qp.recording.other_preset": ("PresetComparison", "compare_preset"),
    "ibvs_qp.recording.recorder": ("Recorder",),
    "ibvs_qp.recording.repair_file": ("repair",),
    "ibvs_qp.recording.comparison": ("Difference", "Replay", "replay"),
}
__all__ = [
    "Difference",
    "PresetComparison",
    "RecordedFlight",
    "Recorder",
    "Replay",
    "compare_preset",
    "read_log",
    "repair",
    "replay",
    "require_extra",
]
#: Top-level packages of the extra.
_EXTRA = ("mcap", "mcap_protobuf", "google", "foxglove_schemas_protobuf")


def require_extra() -> None:
    """Raise ConfigError where the extra is not installed."""
    __getattr__("Recorder")


def __getattr__(name: str) -> Any:
    """Import a public name where it lives, in one line of explanation where the extra is missing."""
    home = next((home for home, names in _HOMES.items() if name in names), None)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        return getattr(importlib.import_module(home), name)
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] not in _EXTRA:
            raise
        raise ConfigError("MCAP logs need the extra log: pip install -c constraints.txt -e '.[log]'") from None
