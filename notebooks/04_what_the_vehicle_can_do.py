"""What the rotors can do: attainable wrenches, pushes, weak rotors, and the choice of a vehicle."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="What the vehicle can do")

with app.setup:
    import marimo as mo
    import numpy as np

    from allocation import TAROT_T960
    from sim.notebook.ability.abilities import abilities, push_around, push_thrusts
    from sim.notebook.ability.case import vehicle_case
    from sim.notebook.ability.choice import Duties, design_map
    from sim.notebook.ability.draw_design import draw_derate, draw_design_map, draw_sliding, draw_tip
    from sim.notebook.ability.draw_vehicle import draw_cuts, draw_thrusts
    from sim.notebook.ability.words import abilities_table, choice_text, loss_table
    from sim.notebook.picture import picture


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
    in turn left and right, so that $B$ has full rank: force and moment can be chosen independently, and the vehicle can
    push a wall **while it stays level**. How hard is a question about $\mathcal W$, which this notebook asks in many
    ways. Everything is exact: flat cuts and rays through a polytope, no simulation.

    Play with the controls; dashed outlines always show the Tarot T960 as shipped (6 kg, 30°, all rotors well).
    """)
    return


@app.cell(hide_code=True)
def _():
    mass = mo.ui.slider(3.0, 10.0, 0.25, value=6.0, label="mass [kg]", show_value=True)
    tilt = mo.ui.slider(10.0, 50.0, 1.0, value=30.0, label="rotor tilt [deg]", show_value=True)
    tip_ahead = mo.ui.slider(0.5, 1.0, 0.05, value=0.7, label="tip ahead of the centre of mass [m]", show_value=True)
    tip_below = mo.ui.slider(-0.3, 0.3, 0.02, value=0.0, label="tip below it [m]", show_value=True)
    friction = mo.ui.slider(0.0, 1.0, 0.05, value=0.3, label="friction of tip and wall", show_value=True)
    push = mo.ui.slider(0.0, 40.0, 1.0, value=20.0, label="push asked [N]", show_value=True)
    rotor = mo.ui.dropdown(["none", *TAROT_T960.names], value="none", label="weak rotor")
    share = mo.ui.slider(0.0, 1.0, 0.05, value=0.4, label="share of full thrust it still gives", show_value=True)
    mo.hstack(
        [mo.vstack([mass, tilt, tip_ahead, tip_below]), mo.vstack([push, friction, rotor, share])],
        justify="start",
        gap=3,
    )
    return friction, mass, push, rotor, share, tilt, tip_ahead, tip_below


@app.cell(hide_code=True)
def _(mass, rotor, share, tilt, tip_ahead, tip_below):
    nominal = vehicle_case()
    case = vehicle_case(
        mass_kg=mass.value,
        tilt_deg=tilt.value,
        tip_m=(tip_ahead.value, 0.0, tip_below.value),
        weak_rotor="" if rotor.value == "none" else rotor.value,
        share=share.value,
    )
    picture(draw_cuts, case, nominal)
    return case, nominal


@app.cell(hide_code=True)
def _(case, friction, nominal):
    mo.md(
        r"""
    **What to see.** *Top right* is the triangle of horizontal forces that are possible in level flight at full lift
    and without any moment; each corner points where a pair of opposite rotors pushes. Its long corner points
    to the **front**, and that is where the arm must be: the same vehicle with the arm at the back pushes half as hard.
    *Bottom left* shows why: at the height of the weight the set is cut near its lower corner, where rotors idle.
    Vehicles of this class hover at a fifth of their full thrust; **the idle floor ends the push, not the ceiling**.
    *Bottom right*: whatever is spent on a yaw moment (a gust, friction at the tip) is not there for the push.

    """
        + abilities_table(abilities(case, friction.value), abilities(nominal, friction.value))
    )
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Which rotor ends the push

    Six rotors, six components of the wrench, $B$ invertible: **the thrusts of a wanted wrench are unique**. For a push
    $F$ of the nominal vehicle with the tip at the height of the centre of mass they are, in closed form,

    $$
    u_\text{mid} = \frac{m g}{6\cos\alpha} + \frac{F}{3 \sin\alpha}, \qquad
    u_\text{others} = \frac{m g}{6\cos\alpha} - \frac{F}{6 \sin\alpha},
    $$

    with the tilt $\alpha$. The two mid rotors push, the other four are unloaded. They meet their idle floor
    $u_\text{min}$ at $F = m g \tan\alpha - 6\,u_\text{min} \sin\alpha$. No allocation method can do better, because
    there is nothing to choose; methods differ only in what they *give up* beyond this point (notebook 03).
    Raise the push until a bar turns red; then raise the mass: a heavier vehicle pushes harder.
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
    itself and the yaw moment at the long lever of the arm. Sliding **up** is cheap (lift is what this vehicle has most
    of); sliding **down** presses the tip down and unloads rotors that are near idle already.
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
    way below the centre of mass the pitch moment of the push helps against that of downward friction.
    The arm cannot be arbitrarily short either: the propellers must stay clear of the wall
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

    A **mid** rotor pushes, so its ceiling ends the push directly, and below about a fifth of full thrust it cannot even
    carry its share of the weight: level hover is lost. An **outer** rotor is *unloaded* by the push: as it weakens it
    costs no push at all, but below that same fifth the vehicle is level **only while it pushes**: the lower curve is
    the least push that makes it possible. A controller that treats the push as untouchable cannot find that; one that
    may trade it can.
    """)
    return


@app.cell
def _(case):
    picture(draw_derate, case)
    return


@app.cell(hide_code=True)
def _(mass, tilt):
    _table = loss_table(mass.value, tilt.value)
    mo.md(
        r"""
    After a **complete loss** there are five rotors for six components. Level hover without any horizontal force and
    without any moment is out of reach, whichever rotor is lost: zero moment forces the opposite rotor to exactly zero.
    Something must be let go. The table says how much, if only *that* is let go:

    """
        + _table
        + r"""

    With rotors that cannot go below idle, letting go of one thing is not enough. Roll, pitch and height can be kept
    when sideways force **and** yaw are let go together: retreat, and come down turning. That is what the vehicle does
    on a reported loss (`ibvs-qp experiment rotor-derate`). It does not go on painting, and no controller could make it.
    """
    )
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Choose a design

    More tilt buys horizontal force and pays with hover power: each rotor must make $1/\cos\alpha$ of its share of the
    weight, and the ideal power of a propeller (momentum theory) is $P = T^{3/2} / \sqrt{2 \rho A}$ with disc area $A$:

    $$
    P_\text{hover} = \frac{6}{\sqrt{2 \rho A}} \left( \frac{m g}{6 \cos\alpha} \right)^{3/2}.
    $$

    More **mass** buys force as well ($F_\text{max} \approx m g \tan\alpha$): ballast is a design variable, but power
    grows with $m^{3/2}$. Say what the vehicle shall do; the star is the cheapest design that does all of it.
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
def _(designs, duties, nominal):
    mo.md(choice_text(designs.cheapest(duties), nominal, duties))
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    **What this does not say.** The set is static: it knows no motor lag and no thrust rate, which decide how fast the
    border is reached, and no sensor noise, which decides how near to it one dares to fly. The controller therefore cuts
    an asked push to 97 % of the reach with the limits in force (`ibvs_qp/model/reach.py`) and reports the rest as
    `Command.reach_margin`. Power is the ideal induced one; a real propeller needs about half as much again.
    """)
    return


@app.cell(hide_code=True)
def _(nominal):
    def test_the_reach_of_the_shipped_vehicle():
        figures, vehicle = abilities(nominal, 0.3), nominal.vehicle
        tilt = np.radians(vehicle.geometry.tilt_deg)
        closed_form = nominal.weight_n * np.tan(tilt) - 6.0 * vehicle.thrust_min[0] * np.sin(tilt)
        assert abs(figures.push_still_n - closed_form) < 1e-6
        assert abs(figures.push_still_n - 30.4) < 0.05 and abs(figures.lateral_worst_n - 15.2) < 0.05

    def test_a_rotor_touches_its_limit_exactly_at_the_reach():
        case = vehicle_case(mass_kg=7.0, tilt_deg=25.0, tip_m=(0.7, 0.0, 0.1))
        thrusts = push_thrusts(case, abilities(case, 0.0).push_still_n)
        assert abs(np.minimum(thrusts - case.lower, case.upper - thrusts).min()) < 1e-6

    def test_friction_makes_the_push_smaller_in_every_direction():
        around = [push_around(nominal, friction, np.linspace(0.0, 6.0, 13)) for friction in (0.0, 0.3, 0.8)]
        assert (around[0] > around[1]).all() and (around[1] > around[2]).all() and (around[2] > 0.0).all()

    return (
        test_a_rotor_touches_its_limit_exactly_at_the_reach,
        test_friction_makes_the_push_smaller_in_every_direction,
        test_the_reach_of_the_shipped_vehicle,
    )


if __name__ == "__main__":
    app.run()
