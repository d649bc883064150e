import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="Constraint tuning")

with app.setup:
    from pathlib import Path

    import marimo as mo

    from sim.notebook.picture import picture
    from sim.notebook.tuning import (
        Setting,
        TuningBench,
        changed_text,
        command_line,
        compare_pair,
        comparison_table,
        control_panel,
        draw_dashboard,
        fly_snippet,
        knob_values,
        load_setting,
        make_controls,
        save_setting,
        saved_text,
    )


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # Tuning by constraints

    Every tick, 250 times a second, the controller solves one small quadratic program for the six rotor thrusts $u \in
    \mathbb{R}^6$ and the slacks $s \ge 0$ of its soft limits:

    $$
    \min_{u,\,s}\;\; \sum_k w_k \,\bigl\| A_k\,\dot\nu(u) - b_k \bigr\|^2 \;+\; \sum_j p_j\, s_j^2
    \qquad \text{with} \qquad
    \dot\nu(u) = M^{-1}\,(B\,u + h),
    $$

    $$
    \max(u_\text{min},\; u^- - \dot u_\text{max}\,\Delta t) \;\le\; u \;\le\;
    \min(u_\text{max},\; u^- + \dot u_\text{max}\,\Delta t),
    \qquad
    c_j^\top \dot\nu(u) \;\le\; d_j + s_j .
    $$

    $\dot\nu$ are the vehicle's linear and angular accelerations, $B$ is the control effectiveness of the tilted
    rotors, $h$ gathers gravity, contact and what else acts, $u^-$ are the thrusts of the tick before. The tasks $k$
    are image lines, push, level attitude, yaw, free velocity and height. So there are three kinds of screws:

    * a **weight** $w_k$ says how dear a residual is: the inverse square of an error that one would accept. Where
      everything can be had at once, weights mean nothing; they decide who gives way when it cannot;
    * a **hard limit** (thrust, thrust rate) is never left. Its **price** $|\partial J^\star / \partial
      u_\text{max}|$, the multiplier of its row, says what a newton more would have saved;
    * a **soft limit** may be left at $p_j$ per squared unit of slack: large $p_j$ is nearly a wall, small $p_j$ a
      slope.

    The settings stand at the side of the page. Each time one is let go, the closed loop is flown again: the vehicle
    starts 15 cm in front of the board, closes in, presses for 1.6 s and slides to the left along the board's lower
    edge. Plant, contact, sensors with their noise and delays, estimators and strategy are those of `ibvs-qp paint`;
    only the camera's pictures are replaced by a sensor model of lines (`--features geometric`).
    """)
    return


@app.cell(hide_code=True)
def _():
    bench = TuningBench()
    controls = make_controls(bench.base)
    share_gains = mo.ui.switch(value=False, label="the analytic law flies the gains set here")
    return bench, controls, share_gains


@app.cell(hide_code=True)
def _(controls, share_gains):
    control_panel(controls, share_gains)
    return


@app.cell
def _(bench, controls, share_gains):
    comparison = bench.compare(controls.value, own_gains=not share_gains.value)
    return (comparison,)


@app.cell
def _(comparison):
    picture(draw_dashboard, comparison)
    return


@app.cell(hide_code=True)
def _(comparison):
    mo.md(changed_text(comparison))
    return


@app.cell(hide_code=True)
def _(comparison):
    mo.md(comparison_table(comparison))
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## How to read the picture

    **Left: response.** The push on the board, with its reference: zero in free flight, then a ramp of one second from
    the first touch, cut to what the rotors can hold. The error of the guiding edge, where the picture shows the brush
    tip; one pixel is 0.8 mm on the board. The tilt of the vehicle, which should be none: it is fully actuated, it
    need not lean to push.

    **Right: limits.** Each row of the first panel is a limit that was active at some time, the dearest above, with
    the share of ticks in which it bound; the colour is the price on a scale of logarithms. Under it the distance of
    the nearest rotor to one of its limits: zero means that the wrench lies on the boundary of the *attainable wrench
    set*

    $$ \mathcal{W} = \{\, B u \;:\; u_\text{min} \le u \le u_\text{max} \,\} \subset \mathbb{R}^6 . $$

    With six rotors $B$ is square, each wrench has one allocation, and the room of the nearest rotor *is* the margin
    of the wrench, counted in thrust. The last panel cuts $\mathcal{W}$ at full lift and without moment: the
    horizontal forces in level flight. Its corner to the front is the greatest push; sliding adds friction, which
    pulls the dots to the side, where the set is narrower.

    The *analytic law* flies the same scene with the gains of its own preset, found by the same search; it allocates
    by the pseudo-inverse and clips, so it has limits but no prices.
    """)
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Three changes worth making

    **Ask for more than there is: push 34 N, without the reach check.** With the check (the flight before) the push
    never gets there: it follows the ray of pushes $w(f)=f\,[d;\,p{\times}d]-h$ to the first facet of $\mathcal{W}$
    and cuts the reference to 97 % of what it finds. Standing still that would be 29.7 N. But a slide is to follow, on
    a wall whose friction nobody has felt yet, so $d$ leans sideways by the most friction that a brush has, 0.8, and
    8.5 N are left until the slide has shown less. Switched off, rotor limits bind from the end of the ramp on, and
    the program chooses what to give up: the push, which has the lightest weight. It ends 4 N short standing and ever
    more as friction takes its share, while tilt stays below one degree and the tip within a millimetre of its row.
    The analytic law, which clips, holds the push and loses the attitude: it leans by 35 degrees.
    """)
    return


@app.cell
def _():
    at_the_limit = compare_pair({"scene.paint.push_n": 34.0}, {"pilot.controller.reach_check": False})
    picture(draw_dashboard, at_the_limit)
    return (at_the_limit,)


@app.cell(hide_code=True)
def _(at_the_limit):
    mo.md(comparison_table(at_the_limit))
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    **Turn the priorities round: the weight of the push from 0.5 to 5000, at the same 34 N, still without the check.**
    The flight before is the same at the shipped weight. Nothing but one weight says who gives way: now the vehicle
    leans into the wall by up to 19 degrees, because leaning turns lift into push, and gets its 34 N. The prices tell
    it as well, they rise from some ten to some ten thousand: a newton of thrust is worth more when what it buys is
    weighted more. The analytic law has no such choice; clipped thrusts lose whatever the geometry makes them lose.
    """)
    return


@app.cell
def _():
    push_first = compare_pair(
        {"scene.paint.push_n": 34.0, "pilot.controller.reach_check": False},
        {"pilot.controller.weights.push": 5000.0},
    )
    picture(draw_dashboard, push_first)
    return (push_first,)


@app.cell(hide_code=True)
def _(push_first):
    mo.md(comparison_table(push_first))
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    **A bad force law: six times the force gain, no damping, no ramp.** The contact is a spring $k$ and a damper under
    the mass $m$, and this force law alone would drive it into ringing. The *force ceiling* bounds the push by the
    contact's own poles,

    $$
    F_n \;\le\; f_\text{max} + 2\sqrt{k m}\;\dot e_s ,
    $$

    with $\dot e_s < 0$ while the tip closes in, so that it is braked before the spring is compressed. The flight
    before is the same without the ceiling: 17 N instead of 7 N at the peak, and a tip that leaves the wall again and
    again. Switch off the approach barrier as well, and the tip strikes with 33 N. Note how busy the ceiling is: in
    every sixth tick it mends what the force law spoils, and the push still swings. The shipped gains never ask for
    it.
    """)
    return


@app.cell
def _():
    bad_force_law = {
        "pilot.controller.gains.force_kfp": 2.1,
        "pilot.controller.gains.force_ksd": 0.0,
        "pilot.controller.touch_ramp": False,
    }
    hard_touch = compare_pair(
        bad_force_law | {"pilot.controller.limits.push_barrier": False},
        {"pilot.controller.limits.push_barrier": True},
    )
    picture(draw_dashboard, hard_touch)
    return (hard_touch,)


@app.cell(hide_code=True)
def _(hard_touch):
    mo.md(comparison_table(hard_touch))
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Save as preset

    A setting that is better than the shipped one can be kept: the preset holds the controller (vehicle model, gains,
    weights, limits), the scene beside it what is asked and what the world is like. `ibvs-qp paint` flies both through
    the whole job, with rendered pictures and the report.
    """)
    return


@app.cell(hide_code=True)
def _():
    preset_file = mo.ui.text(value="my_preset.toml", label="file", full_width=True)
    save = mo.ui.run_button(label="save as preset")
    mo.hstack([preset_file, save], widths=[3, 1], align="end")
    return preset_file, save


@app.cell(hide_code=True)
def _(comparison, preset_file, save):
    mo.stop(not save.value)
    mo.md(saved_text(comparison.setting, preset_file.value))
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Tests

    What this page rests on. `pytest notebooks/02_constraint_tuning.py` runs them.
    """)
    return


@app.cell
def _(at_the_limit, bench, comparison, controls):
    def test_sliders_begin_at_the_shipped_preset():
        assert controls.value == knob_values(Setting())
        assert comparison.changes == () and not comparison.refusal

    def test_a_preset_comes_back_and_flies_the_same():
        file, _ = save_setting(at_the_limit.setting, Path("kept.toml"))
        again = load_setting(file)
        assert again == at_the_limit.setting
        assert (fly_snippet(again).thrusts == at_the_limit.now.thrusts).all()
        assert command_line(again, file).startswith("ibvs-qp paint --preset kept.toml --scene kept.scene.toml")

    def test_limits_have_a_price_where_they_bind():
        flown = at_the_limit.now
        assert flown.active.any() and (flown.limit_price[flown.active] > 0.0).all()

    def test_refused_settings_are_told_and_the_last_flight_stays():
        refused = bench.compare({"pilot.controller.limits.tilt_deg": 1e9})
        assert "tilt_deg" in refused.refusal and refused.now is comparison.now

    return


if __name__ == "__main__":
    app.run()
