"""Settings of the supervisor and its monitors (`ibvs_qp.safety`)."""

from __future__ import annotations

from dataclasses import dataclass

from ibvs_qp.config.settings import setting, validate


@dataclass(frozen=True, kw_only=True)
class SafetySettings:
    """Supervision of a flight (docs/safety.md)."""

    supervise: bool = setting(True, "the supervisor acts; without it faults are only handled by the checks of inputs")
    self_check: bool = setting(True, "find sensor data in other axes than FRD and NED before the first touch")

    def __post_init__(self) -> None:
        """Validate."""
        validate(self)
