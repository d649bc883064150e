"""Push force in contact: the paper's impedance force law as one row along the wall normal."""

from __future__ import annotations

import casadi as ca

from ibvs_qp.model.feedforward import moment_lag
from ibvs_qp.model.inputs import LEAST_GAIN
from ibvs_qp.model.model import Model
from ibvs_qp.model.rows import TaskRow
from ibvs_qp.symbolic.logic import clamp
from ibvs_qp.tasks.task import Task

#: Bound of the force integral as a force [N].
FORCE_INTEGRAL_BOUND = 8.0
#: The filter adds the part of the last target that limits removed, at most [N]: noise of a push at its reach. More
#: would put the full weight of an unreachable push on the other rows.
PUSH_DEFICIT_BOUND = 0.4
#: And at most this ratio to the unallocated wrench [N per N or N m]: the effect of a limit begins at zero.
PUSH_DEFICIT_RATIO = 4.0


class PushTask(Task):
    r"""Net force along n equals the force law in contact [N], weight lambda.

    .. math::
        F = F_{ref} + \Big(\frac{K_{sp}}{k} + K_{fp}\Big) (F_{ref} - f) - K_{sd} (v + T \dot v)
            + K_{fi} \int (F_{ref} - f)

    F_ref is the push reference within reach times the ramp after touch, T the lead against the motors' lag; push f and
    rate v of the penetration are those of `ibvs_qp.estimation.push_disturbance`, whose forces h contains.
    `Model.filtered` follows; it starts at the last command and, within bounds, the part of the last target that limits
    removed. (Paper, equation 14, with the sign of the force feedback corrected; its e_s is the distance of the tip,
    here from the penetration of the reference.)
    """

    weight_settings = ("weights.push",)

    def rows(self, model: Model) -> list[TaskRow]:
        """One row in newtons, so that the blend with the stand-off row is linear in lambda."""
        return [
            TaskRow(
                name="push",
                unit="N",
                expression=model.force_along_normal,
                target=model.output("push_command", self.force(model)),
                weight=model.weights.push * model.contact_weight,
            )
        ]

    def force(self, model: Model) -> ca.SX:
        """The force law behind its filter [N]; it writes the states of integral and filter, so call it once."""
        gains, contact = model.gains, model.contact
        reference = model.push_reference * contact.ramp
        felt, stiffness = model.push_disturbance, contact.stiffness
        error = reference - felt.push
        # On stiff walls the loop gain rises with the stiffness; the proportional gain falls with it.
        softness = ca.fmin(1.0, model.config.contact.full_gain_stiffness_n_m / stiffness)
        target = reference + softness * gains.force_kfp * error + gains.force_kfi * self._integral(model, reference)
        if model.config.impedance:
            damped = felt.rate + gains.push_lead_s * felt.acceleration
            target += gains.force_ksp * error / stiffness - gains.force_ksd * damped
        return self._filtered(model, target)

    def _filtered(self, model: Model, target: ca.SX) -> ca.SX:
        """Target behind the filter [N]: a limit that noise reaches for a tick does not lower the push of the next.

        The part removed is last target minus last command, with the present disturbance; the unallocated wrench is zero
        within the limits.
        """
        row, signals, filter_s = model.force_along_normal, model.signals, model.gains.push_filter_s
        missing = signals.state("push_target") - model.at(row, model.acceleration_commanded)
        bound = ca.fmin(PUSH_DEFICIT_RATIO * signals.input("unallocated"), PUSH_DEFICIT_BOUND)
        deficit = clamp(missing, -bound, bound)
        filtered = model.filtered(target, row, filter_s) + model.filter_share(filter_s) * deficit
        return signals.remember("push_target", filtered)

    def _integral(self, model: Model, reference: ca.SX) -> ca.SX:
        """Integral of the force error [N s]: zero out of contact; while thrusts are limited it only falls.

        The error is that of the push to expect, lambda times the reference behind motors and force filter: the lag of
        a ramp to 25 N in a second would fill the integral, and the push overshoot by 5 N. An integral that could not
        fall while it alone keeps the thrusts limited would stay for good.
        """
        contact, signals = model.contact, model.signals
        pressing = ca.logic_and(contact.touching, model.target.press)
        expected, old = signals.state("push_expected"), signals.state("force_integral")
        late = 1.0 - ca.exp(-model.body.dt / moment_lag(model.config))
        coming = model.contact_weight * reference
        expected = ca.if_else(pressing, expected + late * (coming - expected), 0.0)
        error = signals.remember("push_expected", expected) - contact.push
        used = model.gains.force_kfi > LEAST_GAIN
        bound = used * FORCE_INTEGRAL_BOUND / ca.fmax(model.gains.force_kfi, LEAST_GAIN)
        moving = ca.logic_or(model.integrate, error * old < 0.0)
        step = ca.if_else(moving, model.body.dt, 0.0) * model.contact_weight
        moved = clamp(old + step * error, -bound, bound)
        return signals.remember("force_integral", ca.if_else(pressing, moved, 0.0))
