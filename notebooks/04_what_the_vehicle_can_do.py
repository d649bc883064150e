"""What the rotors can do: attainable wrenches, pushes, weak rotors, and the choice of a vehicle."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="What the vehicle can do")

with app.setup:
    import marimo as mo
    import numpy as np

    from allocation import TAROT_T960
    from sim.notebook.common import number, picture, table
    from sim.notebook.vehicle import (
        Duties,
        abilities,
        after_loss,
        cheapest,
        design_map,
        draw_cuts,
        draw_design_map,
        draw_sliding,
        draw_thrusts,
        draw_tip,
        draw_weak_rotor,
        vehicle_case,
    )

    def abilities_table(case, friction):
        """Abilities of a vehicle beside those of the shipped one."""
        _ours, _shipped = abilities(case, friction), abilities(vehicle_case(), friction)
        return table(
            ["", "this vehicle", "as shipped"],
            [
                (name, *(number(value, ".1f", missing="impossible") for value in (_ours[name], _shipped[name])))
                for name in _ours
            ],
        )


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # What the vehicle can do

    Before any control law is chosen, the rotors decide what is possible. A rotor at hub $p_i$ with thrust axis $t_i$,
    spin $s_i$ and drag-torque ratio $K_M$ adds a wrench that is proportional to its thrust $u_i$, so the wrench of all
    rotors is linear, and thrusts between an idle floor $l$ and a ceiling $h$ make a convex set of wrenches:

    $$
    w = B\,u, \qquad B_i = \begin{bmatrix} t_i \\ p_i \times t_i - s_i K_M\, t_i \end{bmatrix},
    \qquad \mathcal W = \{\, B u : l \le u \le h \,\}.
    $$

    A vehicle whose rotors all point up can only push by leaning. Here every rotor is tilted sideways about its own arm,
    alternately left and right, so that $B$ has full rank: force and moment can be chosen independently, and the vehicle
    can push a wall **while it stays level**. How hard it can push is a property of $\mathcal W$. This notebook computes
    it exactly, with plane cuts and rays through a polytope. There is no simulation.

    Move the controls. Dashed outlines show the Tarot T960 as shipped (6 kg, 30°, all rotors intact).
    """)
    return


@app.cell(hide_code=True)
def _():
    mass = mo.ui.slider(3.0, 10.0, 0.25, value=6.0, label="mass [kg]", show_value=True)
    tilt = mo.ui.slider(10.0, 50.0, 1.0, value=30.0, label="rotor tilt [deg]", show_value=True)
    tip_ahead = mo.ui.slider(0.5, 1.0, 0.05, value=0.7, label="tip ahead of the centre of mass [m]", show_value=True)
    tip_below = mo.ui.slider(-0.3, 0.3, 0.02, value=0.0, label="tip below it [m]", show_value=True)
    friction = mo.ui.slider(0.0, 1.0, 0.05, value=0.3, label="friction of tip and wall", show_value=True)
    push = mo.ui.slider(0.0, 40.0, 1.0, value=20.0, label="push [N]", show_value=True)
    rotor = mo.ui.dropdown(["none", *TAROT_T960.names], value="none", label="weak rotor")
    fraction = mo.ui.slider(0.0, 1.0, 0.05, value=0.4, label="fraction of full thrust that remains", show_value=True)
    mo.hstack(
        [mo.vstack([mass, tilt, tip_ahead, tip_below]), mo.vstack([push, friction, rotor, fraction])],
        justify="start",
        gap=3,
    )
    return fraction, friction, mass, push, rotor, tilt, tip_ahead, tip_below


@app.cell(hide_code=True)
def _(fraction, mass, rotor, tilt, tip_ahead, tip_below):
    nominal = vehicle_case()
    case = vehicle_case(
        mass_kg=mass.value,
        tilt_deg=tilt.value,
        tip_position_m=(tip_ahead.value, 0.0, tip_below.value),
        weak_rotor="" if rotor.value == "none" else rotor.value,
        fraction=fraction.value,
    )
    picture(draw_cuts, case, nominal)
    return case, nominal


@app.cell(hide_code=True)
def _(case, friction):
    _binding = ", ".join(f"{case.geometry.names[index]} {side}" for index, side in case.reach().binding)
    mo.md(
        r"""
    **What to see.** *Top right*: the triangle of horizontal forces that are possible in level flight at full lift and
    without moment. Each corner is the direction in which a pair of opposite rotors pushes. The longest corner points to
    the **front**, so the arm must be there: the same vehicle with the arm at the back pushes half as hard. *Bottom
    left* shows the reason: at the height of the weight, the set is cut near its lower corner, where rotors idle.
    Vehicles of this class hover at a fifth of their full thrust; **the idle floor ends the push, not the ceiling**.
    *Bottom right*: a yaw moment (a gust, friction at the tip) reduces the push.

    """
        + abilities_table(case, friction.value)
        + f"\n\nRotor limits that end the push at rest: {_binding.replace('_', ' ') or '–'}."
    )
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Which rotor ends the push

    Six rotors, six components of the wrench, $B$ invertible: **the thrusts of a wrench are unique**. For a push
    $F$ of the nominal vehicle with the tip at the height of the centre of mass they are, in closed form,

    $$
    u_\text{mid} = \frac{m g}{6\cos\alpha} + \frac{F}{3 \sin\alpha}, \qquad
    u_\text{others} = \frac{m g}{6\cos\alpha} - \frac{F}{6 \sin\alpha},
    $$

    with the tilt $\alpha$. The two mid rotors push, the other four are unloaded. They meet their idle floor
    $u_\text{min}$ at $F = m g \tan\alpha - 6\,u_\text{min} \sin\alpha$. No allocation method can do better, because
    the thrusts are unique. Methods differ only in what they *give up* beyond this point (notebook 03).
    Raise the push until a bar turns orange; then raise the mass: a heavier vehicle pushes harder.
    """)
    return


@app.cell
def _(case, push):
    picture(draw_thrusts, case, push.value)
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Sliding costs more than standing

    A tip that slides along $\hat t$ under a push $f$ feels friction $\mu f$ against its travel. The rotors must add

    $$
    w(f) = f \begin{bmatrix} d \\ p_\text{tip} \times d \end{bmatrix}, \qquad d = n + \mu\, \hat t,
    $$

    and the greatest $f$ is where this ray leaves $\mathcal W$. Sliding **sideways** costs twice: the lateral force
    itself and its yaw moment on the long arm. Sliding **up** is cheap, because lift is available in plenty. Sliding
    **down**, friction carries a part of the weight and unloads rotors that are near idle already.
    """)
    return


@app.cell
def _(case, friction):
    picture(draw_sliding, case, (0.1, 0.3, 0.8), friction.value)
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Where to put the tip

    Standing still, only the **height** of the tip counts: a push off the plane of the centre of mass is a pitch moment
    $f \cdot z_\text{tip}$ which rotors near idle must make. The length of the arm does not matter. Sliding, it does:
    friction has the arm's length as its lever for yaw. And what was best standing still is not best sliding: some
    way below the centre of mass the pitch moment of the push balances a part of that of downward friction.
    The arm cannot be arbitrarily short: the propellers must stay clear of the wall
    ($0.48\ \text{m} \cdot \cos 30° + 0.19\ \text{m} = 0.61$ m ahead of the centre of mass).
    """)
    return


@app.cell
def _(case, friction):
    picture(draw_tip, case, friction.value)
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## A rotor that weakens, a rotor that is lost

    A **mid** rotor pushes, so its ceiling ends the push directly. Below about a fifth of full thrust it cannot carry
    its part of the weight, and level hover is impossible. An **outer** rotor is *unloaded* by the push: as it weakens,
    the greatest push stays the same. But below the same fifth the vehicle is level **only while it pushes**; the lower
    curve is the least push that makes level flight possible. A controller with a fixed push cannot use that; one with a
    weighted push can.
    """)
    return


@app.cell
def _(case):
    picture(draw_weak_rotor, case)
    return


@app.cell(hide_code=True)
def _(mass, tilt):
    _rows = []
    for _floor, _idle in (("as it is", {}), ("none", {"thrust_min_n": 0.0})):
        for _rotor in TAROT_T960.names:
            _lost = vehicle_case(mass_kg=mass.value, tilt_deg=tilt.value, weak_rotor=_rotor, fraction=0.0, **_idle)
            _values = [number(value, ".1f", missing="impossible") for value in after_loss(_lost)]
            _rows.append((_rotor.replace("_", " "), _floor, *_values))
    mo.md(
        r"""
    After a **complete loss** five rotors remain for six components. Level hover without horizontal force and without
    moment is impossible, whichever rotor is lost: zero moment requires zero thrust of the opposite rotor. Something
    must be given up. The table says how much, if only *that* is given up:

    """
        + table(
            ["lost rotor", "idle floor", "sideways force [N]", "as a lean [deg]", "or yaw moment [N m]"], _rows, left=2
        )
        + r"""

    With an idle floor one component is not enough. Roll, pitch and height can be controlled when sideways force **and**
    yaw are given up together: the vehicle retreats and descends while it turns. This is its reaction to a reported loss
    (`ibvs-qp experiment rotor-derate`). It does not continue to paint, and no controller could make it.
    """
    )
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Choose a design

    More tilt buys horizontal force and pays with hover power: each rotor makes $1/\cos\alpha$ times its part of the
    weight, and the ideal power of a propeller (momentum theory) is $P = T^{3/2} / \sqrt{2 \rho A}$ with disc area $A$:

    $$
    P_\text{hover} = \frac{6}{\sqrt{2 \rho A}} \left( \frac{m g}{6 \cos\alpha} \right)^{3/2}.
    $$

    More **mass** buys force as well ($F_\text{max} \approx m g \tan\alpha$): ballast is a design variable, but power
    grows with $m^{3/2}$. Set the duties of the vehicle; the star is the cheapest design that meets all of them.
    """)
    return


@app.cell(hide_code=True)
def _():
    duty_push = mo.ui.slider(0.0, 40.0, 1.0, value=10.0, label="push, standing still [N]", show_value=True)
    duty_sliding = mo.ui.slider(0.0, 25.0, 0.5, value=8.0, label="push, any travel [N]", show_value=True)
    duty_friction = mo.ui.slider(0.0, 1.0, 0.05, value=0.6, label="friction", show_value=True)
    duty_gust = mo.ui.slider(0.0, 25.0, 0.5, value=10.0, label="gust from any side [N]", show_value=True)
    duty_mass = mo.ui.slider(3.0, 9.0, 0.25, value=5.5, label="least mass [kg]", show_value=True)
    mo.hstack(
        [mo.vstack([duty_push, duty_sliding, duty_friction]), mo.vstack([duty_gust, duty_mass])],
        justify="start",
        gap=3,
    )
    return duty_friction, duty_gust, duty_mass, duty_push, duty_sliding


@app.cell(hide_code=True)
def _(duty_friction, duty_gust, duty_mass, duty_push, duty_sliding, nominal):
    duties = Duties(
        push_n=duty_push.value,
        sliding_push_n=duty_sliding.value,
        friction=duty_friction.value,
        gust_n=duty_gust.value,
        least_mass_kg=duty_mass.value,
    )
    designs = design_map(duties, np.arange(10.0, 50.5, 1.0), np.arange(3.0, 9.05, 0.25))
    picture(draw_design_map, designs, duties, nominal)
    return designs, duties


@app.cell(hide_code=True)
def _(designs, duties):
    _best = cheapest(designs)
    mo.md(
        f"**Cheapest: {_best.geometry.tilt_deg:g}° at {_best.vehicle.mass_kg:g} kg.**\n\n"
        + abilities_table(_best, duties.friction)
        if _best
        else "**No design on this map meets every duty.**"
    )
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    **Limits of this analysis.** The set is static. Motor lag and thrust rate decide how fast its border is reached, and
    sensor noise decides how near to it a vehicle can fly. The controller therefore limits the push reference to 97 % of
    the reach with the limits in force (`ibvs_qp/model/reach.py`) and reports the margin as `Command.reach_margin`.
    Power is the ideal induced power; a real propeller needs about 50 % more.
    """)
    return


@app.cell(hide_code=True)
def _(nominal):
    def test_the_reach_of_the_shipped_vehicle():
        vehicle, tilt = nominal.vehicle, np.radians(nominal.geometry.tilt_deg)
        closed_form = nominal.weight_n * np.tan(tilt) - 6.0 * vehicle.thrust_min[0] * np.sin(tilt)
        assert abs(nominal.reach().push - closed_form) < 1e-6
        assert abs(nominal.reach().push - 30.4) < 0.05 and abs(nominal.level_force_n - 15.2) < 0.05

    def test_a_rotor_touches_its_limit_exactly_at_the_reach():
        case = vehicle_case(mass_kg=7.0, tilt_deg=25.0, tip_position_m=(0.7, 0.0, 0.1))
        thrusts = case.push_thrusts(case.reach().push)
        assert abs(np.minimum(thrusts - case.lower, case.upper - thrusts).min()) < 1e-6

    def test_friction_makes_the_push_smaller_in_every_direction():
        for angle in np.linspace(0.0, 6.0, 13):
            travel = (0.0, np.cos(angle), np.sin(angle))
            pushes = [nominal.reach(friction, travel).push for friction in (0.0, 0.3, 0.8)]
            assert pushes[0] > pushes[1] > pushes[2] > 0.0

    return (
        test_a_rotor_touches_its_limit_exactly_at_the_reach,
        test_friction_makes_the_push_smaller_in_every_direction,
        test_the_reach_of_the_shipped_vehicle,
    )


if __name__ == "__main__":
    app.run()
