"""Rotor derating and loss in flight, while pressing."""

from __future__ import annotations

from sim.evaluate.measures import press_figures
from sim.evaluate.measures.loss import loss_figures
from sim.experiments.base import Choice, Column, Criterion, Experiment, runs
from sim.experiments.figures.derate import draw_derate
from sim.experiments.scenes import near_wall
from sim.flight.faults import Derate
from sim.flight.jobs import PressJob
from sim.sweep.design import Run

NAME = "rotor-derate"
#: Share of full thrust left to one rotor; the push asked [N]; when it happens after the touch, and the hold [s].
SHARES, QUICK_SHARES = (0.5, 0.4, 0.3), (0.4,)
ROTORS = ("mid_right", "front_left")
PUSH_N, AFTER_S, HOLD_S = 25.0, 4.0, 12.0
#: Rotors that are lost, the push then [N], the hold before, and the flight after the loss [s].
LOST, LOSS_PUSH_N, LOSS_AFTER_S, DESCEND_S = ("mid_right", "front_left", "rear_right"), 5.0, 3.0, 5.0
LOSS_HOLD_S = 8.0


def design(choice: Choice) -> list[Run]:
    """Derating of one rotor, told to the pilot or not, then total losses."""
    flights = []
    for told in (True,) if choice.quick else (True, False):
        for rotor in ROTORS[: 1 if choice.quick else 2]:
            for share in QUICK_SHARES if choice.quick else SHARES:
                flights += runs(
                    NAME,
                    choice,
                    scene=near_wall(paint={"push_n": PUSH_N}),
                    job=PressJob(hold_s=HOLD_S),
                    measure=press_figures,
                    params={"kind": "derate", "rotor": rotor, "share": share, "told": told},
                    seeds=1 if choice.quick else 2,
                    faults=(Derate(delay_s=AFTER_S, rotor=rotor, share=share, reported=told),),
                )
    for rotor in LOST[1:2] if choice.quick else LOST:
        flights += runs(
            NAME,
            choice,
            scene=near_wall(paint={"push_n": LOSS_PUSH_N}),
            job=PressJob(hold_s=LOSS_HOLD_S, descend_s=DESCEND_S),
            measure=loss_figures,
            params={"kind": "loss", "rotor": rotor, "share": 0.0, "told": True},
            seeds=1 if choice.quick else 3,
            faults=(Derate(delay_s=LOSS_AFTER_S, rotor=rotor, share=0.0),),
        )
    return flights


_DERATE, _LOSS = {"kind": "derate", "told": True}, {"kind": "loss"}
EXPERIMENT = Experiment(
    name=NAME,
    title="Derated and lost rotors",
    about="While it presses 25 N, one rotor is limited to a share of its full thrust, told to the pilot or not; the "
    "reach that is left is a linear program. Then a rotor stops while pressing 5 N: the vehicle shall detach, retreat "
    "and descend. A loss leaves this vehicle no level hover without lateral force; yaw or place must be given up.",
    paper="Not reported.",
    design=design,
    params={"kind": "event", "rotor": "rotor", "share": "thrust left", "told": "told to the pilot"},
    columns=(
        Column(metric="push_mean_n", label="delivered", unit="N", better=1),
        Column(metric="reach_n", label="reach left", unit="N", better=0),
        Column(metric="height_error_peak_m", label="height error, peak", unit="mm", scale=1e3, digits=1),
        Column(metric="tilt_peak_deg", label="tilt, peak", unit="deg", of_all=True),
        Column(metric="yaw_peak_deg", label="yaw, peak", unit="deg", where={"kind": "derate"}),
        Column(metric="survived_s", label="flew on for", unit="s", digits=1, better=1, of_all=True),
        Column(metric="descent_peak_m_s", label="descent, fastest", unit="m/s"),
        Column(metric="yaw_turned_deg", label="turned since the loss", unit="deg", digits=0),
        Column(metric="yaw_rate_peak_deg_s", label="yaw rate, peak", unit="deg/s", digits=0),
        Column(metric="push_spike_n", label="push after the loss, peak", unit="N"),
    ),
    criteria=(
        Criterion(
            text="derated: delivered over reach",
            metric="reach_share",
            bound=0.95,
            least=True,
            params=_DERATE,
            scale=100.0,
            unit="%",
        ),
        Criterion(
            text="derated: tilt, peak", metric="tilt_peak_deg", bound=2.0, params=_DERATE, unit="deg", every=True
        ),
        Criterion(
            text="loss: flies on",
            metric="survived_s",
            bound=DESCEND_S,
            least=True,
            params=_LOSS,
            failed_too=True,
            unit="s",
            every=True,
        ),
        Criterion(
            text="loss: tilt, peak",
            metric="tilt_peak_deg",
            bound=25.0,
            params=_LOSS,
            failed_too=True,
            unit="deg",
            every=True,
        ),
        Criterion(
            text="loss: detached", metric="detached", bound=1.0, least=True, params=_LOSS, failed_too=True, every=True
        ),
        Criterion(
            text="loss: descent",
            metric="descent_peak_m_s",
            bound=1.5,
            params=_LOSS,
            failed_too=True,
            unit="m/s",
            every=True,
        ),
    ),
    draw=draw_derate,
)
