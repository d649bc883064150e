"""Planning of a flight: inputs of the strategy, its command, and the resulting reference."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from ibvs_qp.command import SafetyState
from ibvs_qp.estimation.contact_state import ContactState
from ibvs_qp.frames import to_camera
from ibvs_qp.measurement import Reference
from ibvs_qp.pilot.config import PilotConfig
from ibvs_qp.pilot.estimation import ASSUMED_DISTANCE, Estimation
from ibvs_qp.pilot.painting.command import PainterInput, PaintingCommand, image_reference
from ibvs_qp.pilot.painting.painter import Painter
from ibvs_qp.pilot.painting.strategy import Strategy, require_strategy
from ibvs_qp.supervision.supervision import Limits, Supervision

#: States in which the strategy has control.
FLYING = (SafetyState.NOMINAL, SafetyState.DEGRADED)


#: Least and largest velocity of the centre of mass over that of the tip along a curved wall [-].
FASTER = 0.25, 3.0


class Planning:
    """Runs the strategy; the supervisor ends its job.

    Attributes:
        painter: The strategy.
        time_s: Time of the tick since the first one [s].

    Args:
        config: Configuration of the flight.
        painter: Strategy to follow; None paints the job of the configuration.
    """

    def __init__(self, config: PilotConfig, painter: Strategy | None) -> None:
        vehicle = config.controller.vehicle
        tip, camera = np.array(vehicle.tip_position_m), np.array(vehicle.camera_position_m)
        self._tip_forward = float(tip[0])
        self._tip_right, self._tip_below, self._tip_ahead = to_camera(tip, camera).tolist()
        self.painter: Strategy = require_strategy(Painter(config.painting) if painter is None else painter)
        self.reset()

    def reset(self) -> None:
        """As before the flight."""
        self.painter.reset()
        self.time_s = 0.0

    def note(self, name: str, text: str) -> None:
        """Add an event to the strategy's log, unless its text is empty."""
        if text:
            self.painter.log.append((self.time_s, name, text))

    def plan(
        self,
        estimation: Estimation,
        supervision: Supervision,
        limits: Limits | None,
        push_reference: float,
        dt: float,
        rejected: list[str],
    ) -> PaintingCommand:
        """Command of the strategy, tilted after the loss of a rotor; the supervisor may end its job.

        ``push_reference`` is that of the tick before: the controller runs after the strategy.
        """
        motion, contact, rotors = estimation.motion, estimation.contact.state, supervision.rotor_loss
        inputs = self._inputs(estimation, push_reference)
        if rotors.update(limits):
            self.painter.abandon(inputs, "no level hover is left")
        elif supervision.state not in FLYING and not self.painter.descending:
            self.painter.stop(inputs, "; ".join(supervision.supervisor.reasons))
        command = self.painter.fly(inputs)
        if self.painter.fault:
            rejected.append(self.painter.fault)
        attitude = rotors.target(contact, estimation.estimator.attitude, motion.state[0], dt)
        return dataclasses.replace(command, **attitude) if attitude else command

    def waits_for(self, estimation: Estimation, push_reference: float) -> str:
        """Condition for which the strategy's phase waits; empty at its end, in a descent, or where it names none."""
        if self.painter.finished or self.painter.descending:
            return ""
        try:
            return str(self.painter.waits_for(self._inputs(estimation, push_reference)))
        except Exception as error:  # of a strategy of the user's
            return f"an unknown condition ({type(error).__name__}: {error})"

    def _inputs(self, estimation: Estimation, push_reference: float) -> PainterInput:
        motion, contact = estimation.motion, estimation.contact.state
        return PainterInput(
            time_s=self.time_s,
            lines=MappingProxyType(motion.lines),  # a strategy of the user's must not lose lines of the filter
            odometer=motion.state[4:6],
            velocity=motion.state[:2],
            distance=contact.distance,
            wall_known=contact.known,
            in_contact=contact.in_contact,
            time_since_touch=contact.time_since_touch,
            push=contact.push,
            push_reference=push_reference,
            tared=estimation.estimator.tared,
        )

    def reference(self, command: PaintingCommand, contact: ContactState, curvature: Sequence[float]) -> Reference:
        r"""Reference of a command at the measured distance.

        The strategy moves along the wall. Before a wall of curvature K the centre of mass, at a distance D, moves at
        :math:`(I + D K)` times that velocity, since the vehicle turns to face the wall.
        """
        distance = contact.distance if contact.known else ASSUMED_DISTANCE
        reference = image_reference(command, self._tip_ahead + distance, self._tip_below, self._tip_right)
        if self.painter.descending or not any(curvature):
            return reference
        right, both, down = curvature
        curvatures, directions = np.linalg.eigh(np.array(((right, both), (both, down))))
        scales = np.clip(1.0 + (self._tip_forward + distance) * curvatures, *FASTER)
        moves = (directions * scales) @ directions.T
        return dataclasses.replace(reference, velocity=moves @ reference.velocity, travel=moves @ reference.travel)
