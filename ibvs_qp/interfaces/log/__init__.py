"""Recording and replay of flights in MCAP files (docs/logs.md); needs the extra ``log``."""

from pathlib import Path

from ibvs_qp.config.errors import ConfigError

try:
    from ibvs_qp.interfaces.log.comparison import Difference, PresetComparison, Replay, compare_preset, replay, replayed
    from ibvs_qp.interfaces.log.reader import RecordedFlight, read_log, repair
    from ibvs_qp.interfaces.log.recorder import Recorder
except ModuleNotFoundError as error:
    if (error.name or "").split(".")[0] not in ("mcap", "mcap_protobuf", "google", "foxglove_schemas_protobuf"):
        raise
    raise ConfigError("MCAP logs need the extra log: pip install -c constraints.txt -e '.[log]'") from None

#: Layout of Foxglove, to import there.
FOXGLOVE_LAYOUT = Path(__file__).with_name("foxglove.json")

__all__ = [
    "FOXGLOVE_LAYOUT",
    "Difference",
    "PresetComparison",
    "RecordedFlight",
    "Recorder",
    "Replay",
    "compare_preset",
    "read_log",
    "repair",
    "replay",
    "replayed",
]
