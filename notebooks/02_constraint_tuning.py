import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="Constraint tuning")

with app.setup:
    import tempfile

    import marimo as mo

    from ibvs_qp.config.errors import ConfigError
    from sim.notebook.common import picture
    from sim.notebook.dashboard import draw_dashboard
    from sim.notebook.tuning import (
        GROUPS,
        KNOBS,
        Start,
        TuningBench,
        compare_pair,
        knob_values,
        load_setting,
        load_start,
        save_setting,
        save_text,
    )
    from sim.notebook.wall_flights import Setting, flights_table, fly_setting
    from sim.notebook.what_if import LiveFlight, RecordedTicks

    FIGURES = (
        "first touch [s]",
        "greatest push [N]",
        "push error while holding, rms [N]",
        "push error while sliding, rms [N]",
        "path along the edge, rms [mm]",
        "greatest tilt [deg]",
        "change of a thrust per tick in contact, rms [N]",
        "least reach margin in contact [N]",
        "ticks with an active limit [%]",
    )


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # Tuning by constraints

    **One tick again.** A weight or a bound in a recorded tick is scaled and its program solved again; the vehicle does
    not move. `thrust_ceiling` is the upper limit of all rotors: at a quarter of it, −0.6 decades, some rotors are at
    their limit in the press, and the limits have prices. At 0 decades the tick is as it was flown.
    """)
    return


@app.cell(hide_code=True)
def _():
    # Each control reports to this state by itself: steps that arrive during a flight become one flight of the last
    # values. Elements of one mo.ui.dictionary would lose all but one of the controls moved meanwhile.
    start, set_start = mo.state(Start())
    refusal, set_refusal = mo.state("")  # apart from the start: a preset that is refused resets no control
    return refusal, set_refusal, set_start, start


@app.cell(hide_code=True)
def _(start):
    turns, set_turns = mo.state({})

    def _widget(knob, value):
        def _turn(to):
            set_turns(lambda earlier: earlier | {knob.path: to})

        if knob.low is None:
            return mo.ui.switch(value=value, label=knob.label, on_change=_turn)
        _look = {"label": knob.label, "show_value": True, "full_width": True, "debounce": True}  # reports on release
        return mo.ui.slider(steps=knob.stops(value), value=value, on_change=_turn, **_look)

    bench = TuningBench(start().setting)
    controls = {name: _widget(KNOBS[name], value) for name, value in knob_values(bench.base).items()}
    share_gains = mo.ui.switch(value=False, label="the analytic law uses the gains set here")
    return bench, controls, share_gains, turns


@app.cell(hide_code=True)
def _(set_refusal, set_start):
    def _reset(_):
        set_refusal("")
        set_start(lambda now: now.again())

    wanted = mo.ui.text(value="tarot_t960_qp", label="preset (name or file)", full_width=True)
    load = mo.ui.button(label="load", on_change=lambda _: load_start(wanted.value, set_start, set_refusal))
    reset = mo.ui.button(label="reset all", on_change=_reset)
    return load, reset, wanted


@app.cell(hide_code=True)
def _(controls, load, refusal, reset, share_gains, start, wanted):
    _groups = {
        title: mo.vstack([controls[knob.path] for knob in knobs], gap=0.3).style({"padding-right": "1.2rem"})
        for title, knobs in GROUPS.items()
    }
    _folded = mo.accordion({title: panel for title, panel in _groups.items() if title != "Task"}, multiple=True)
    _note = f"**Not loaded:** {refusal()}" if refusal() else f"begun with {start().name}"
    _task = mo.md(f"{load} {reset} {_note}\n\n### Task")
    mo.sidebar([wanted, _task, _groups["Task"], _folded, share_gains], width="22rem")
    return


@app.cell(hide_code=True)
def _(bench):
    ticks = RecordedTicks(fly_setting(bench.base))
    instead = mo.ui.dropdown(ticks.names, value="thrust_ceiling", label="instead")
    decades = mo.ui.slider(-2.0, 2.0, 0.02, value=-0.6, label="factor, in decades", show_value=True)
    moment = mo.ui.slider(
        0.0, round(ticks.end_s, 2), 0.02, value=round(ticks.hold_s, 2), label="t [s]", show_value=True
    )
    live = mo.ui.run_button(label="fly the sidebar's setting live")
    mo.hstack([instead, decades, moment, live], justify="start", gap=2, wrap=True)
    return decades, instead, live, moment, ticks


@app.cell(hide_code=True)
def _(bench, live, live_flight):
    mo.stop(not live.value)
    with mo.status.spinner("Starting ibvs-qp live: 10 s ..."):
        try:
            _text = live_flight.start(bench.setting)
        except ConfigError as _error:
            _text = f"**Not flown:** {_error}"
    mo.md(_text)
    return


@app.cell(hide_code=True)
def _(decades, instead, moment, ticks):
    _drawn, explained = ticks.show(moment.value, instead.value, 10.0**decades.value)
    mo.Html(_drawn)
    return (explained,)


@app.cell(hide_code=True)
def _():
    live_flight = LiveFlight()
    shown = []  # the last figure, which stays until its successor is drawn
    return live_flight, shown


@app.cell
def _(bench, share_gains, shown, turns):
    def _note(text):
        mo.output.replace(mo.vstack([mo.md(text), *shown]))

    comparison = bench.compare(turns(), own_gains=not share_gains.value, note=_note)
    shown[:] = [picture(draw_dashboard, comparison)]
    shown[0]
    return (comparison,)


@app.cell(hide_code=True)
def _(comparison):
    mo.md(comparison.changes_text())
    return


@app.cell(hide_code=True)
def _(comparison):
    mo.md(flights_table(comparison.flights, FIGURES))
    return


@app.cell(hide_code=True)
def _(explained):
    mo.md(f"**The tick above in numbers.** {explained}")
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## The program

    Every tick, 250 times a second, the controller solves one small quadratic program for the six rotor thrusts $u \in
    \mathbb{R}^6$ and the slacks $s \ge 0$ of its soft limits:

    $$
    \min_{u,\,s}\;\; \tfrac12 \sum_k w_k \,\bigl\| A_k\,\dot\nu(u) - b_k \bigr\|^2 \;+\; \tfrac12 \sum_j p_j\, s_j^2
    \qquad \text{with} \qquad
    \dot\nu(u) = M^{-1}\,(B\,u + h),
    $$

    $$
    \max(u_\text{min},\; u^- - \dot u_\text{max}\,\Delta t) \;\le\; u \;\le\;
    \min(u_\text{max},\; u^- + \dot u_\text{max}\,\Delta t),
    \qquad
    c_j^\top \dot\nu(u) \;\le\; d_j + s_j .
    $$

    $\dot\nu$ is the linear and angular acceleration of the vehicle, $B$ the control effectiveness of the tilted
    rotors, $h$ the wrench of gravity, contact and other known effects, and $u^-$ the thrusts of the tick before. The
    tasks $k$ are image lines, push, level attitude, yaw, free velocity and height. OSQP solves the program at every
    tick. There are three kinds of parameters:

    * a **weight** $w_k$ is the inverse square of an acceptable error. Weights have no effect while all tasks can be
      met together. Otherwise they decide which task deviates;
    * a **hard limit** (thrust, thrust rate) always holds. Its **multiplier** $|\partial J^\star / \partial
      u_\text{max}|$ is the derivative of the least cost by the bound, and no more: it falls linearly as the bound
      yields, to zero where the limit is released. If nothing else changes on the way, the cost falls by half of
      multiplier times way. `ibvs-qp explain` prints the range and the true fall;
    * a **soft limit** has a slack $s_j$ with the **slack weight** $p_j$: a large $p_j$ is nearly a hard limit, a small
      $p_j$ allows violations.

    The controls of the flight are in the sidebar. On release of a control the closed loop flies again, once with the
    last values if several controls were moved meanwhile; *reset all* goes back to the preset, *load* begins with
    another one. The vehicle starts 15 cm in front of the board, approaches, presses for 1.6 s and slides to the left
    along the board's lower edge. Plant, contact, sensors with noise and delays, estimators and strategy are those of
    `ibvs-qp paint`; a sensor model of lines replaces the camera (`--features geometric`).
    """)
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## How to read the picture

    **Left: response.** The push on the board, with its reference: zero in free flight, then a ramp of one second from
    the first touch, limited to the push that the rotors can hold. The error of the guide line at the image position of
    the brush tip; one pixel is 0.8 mm on the board. The tilt of the vehicle. It should be zero: the vehicle is fully
    actuated and pushes without leaning.

    **Right: limits.** The first panel has one row per limit that was active, the largest multipliers on top, with the
    fraction of ticks in which it was active. The colour is the multiplier on a logarithmic scale. Below it, the
    distance of the nearest rotor to one of its limits: zero means that the wrench lies on the boundary of the
    *attainable wrench set*

    $$ \mathcal{W} = \{\, B u \;:\; u_\text{min} \le u \le u_\text{max} \,\} \subset \mathbb{R}^6 . $$

    With six rotors $B$ is square and each wrench has unique thrusts, so the room of the nearest rotor *is* the margin
    of the wrench, measured in thrust. The last panel is the cut of $\mathcal{W}$ at full lift and without moment: the
    horizontal forces in level flight. Its front corner is the greatest push. Sliding adds friction, which moves the
    dots sideways, where the set is narrower.

    The *analytic law* flies the same scene with the gains of its own preset. It allocates with the pseudo-inverse and
    clips, so it has limits but no multipliers.
    """)
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Three instructive changes

    **A push beyond reach: 34 N without the reach check.** The flight before has the check on, and its push stays far
    below 34 N: the check follows the ray of pushes $w(f)=f\,[d;\,p{\times}d]-h$ to the first facet of $\mathcal{W}$ and
    limits the reference to 97 % of that push. At rest that would be about 29 N. But a slide follows, on a wall whose
    friction has not been measured yet, so $d$ includes the largest sideways friction of a brush, 0.8, and 8.4 N remain
    until the slide has shown less. Without the check, rotor limits are active from the end of the ramp on. The program
    then gives up the task with the smallest weight, the push. It ends 4 N short at rest, and 19 N (rms) while sliding,
    because friction needs thrust too. Tilt stays at 0.2 degrees and the tip within 0.9 mm (rms) of its row. The
    analytic law clips its thrusts. It tilts by 0.8 degrees, and pushes 12 N harder.
    """)
    return


@app.cell
def _():
    at_the_limit = compare_pair({"scene.paint.push_n": 34.0}, {"pilot.controller.reach_check": False})
    picture(draw_dashboard, at_the_limit)
    return (at_the_limit,)


@app.cell(hide_code=True)
def _(at_the_limit):
    mo.md(flights_table(at_the_limit.flights, FIGURES))
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    **Reversed priorities: the weight of the push from 0.5 to 5000, at the same 34 N without the check.** The flight
    before has the shipped weight. This one weight decides which task deviates. Now the push reaches 34 N, and height,
    lines and level flight are given up for it: the tip leaves its row by 15 cm (rms) and then the wall, and the vehicle
    tilts by 6 degrees until the supervisor ends the flight. The multipliers rise from about ten to above ten thousand:
    the cost depends more on a bound when the weight of its effect is larger. The analytic law has no such parameter;
    the geometry decides what the clipped thrusts lose.
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
    mo.md(flights_table(push_first.flights, FIGURES))
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    **A bad force law: a force gain of 4 instead of 0.02, no damping, no ramp.** The contact is a spring $k$ with a
    damper under the mass $m$, and this force law makes it ring. The *force ceiling* bounds the push by the poles of the
    contact,

    $$
    F_n \;\le\; f_\text{max} + 2\sqrt{k m}\;\dot e_s ,
    $$

    with $\dot e_s < 0$ while the tip approaches, so that it brakes the tip before the spring is compressed. The flight
    before has no ceiling: the tip loses contact again and again, with 18 N at the peak. With the ceiling the push rings
    by 1 N and stays below 6.5 N; the ceiling is active in a third of the ticks in contact. With the shipped gains it is
    never active.
    """)
    return


@app.cell
def _():
    bad_force_law = {
        "pilot.controller.gains.force_kfp": 4.0,
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
    mo.md(flights_table(hard_touch.flights, FIGURES))
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Save as preset

    The preset holds the controller (vehicle model, gains, weights, limits), the scene file beside it the task and the
    world. `ibvs-qp paint` flies both through the whole job, with rendered pictures and the report.
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
    mo.md(save_text(comparison.setting, preset_file.value))
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Tests

    Tests of this page. `pytest notebooks/02_constraint_tuning.py` runs them.
    """)
    return


@app.cell
def _(at_the_limit, bench, comparison, controls, ticks):
    def test_sliders_begin_at_the_shipped_preset():
        assert {name: control.value for name, control in controls.items()} == knob_values(Setting())
        assert comparison.changes == () and not comparison.refusal

    def test_a_preset_comes_back_and_flies_the_same():
        with tempfile.TemporaryDirectory() as folder:
            file = f"{folder}/saved.toml"
            save_setting(at_the_limit.setting, file)
            again = load_setting(file)
            assert again == at_the_limit.setting
            assert (fly_setting(again).thrusts == at_the_limit.now.thrusts).all()
            assert f"ibvs-qp paint --preset {file} --scene {folder}/saved.scene.toml --seed 0" in save_text(again, file)

    def test_a_lower_thrust_limit_has_a_price_and_both_are_drawn():
        drawn, text = ticks.show(ticks.hold_s, "thrust_ceiling", 0.25)
        assert "holds for changes of" in text and drawn.count("<svg") == 2
        assert "No limit is active" in ticks.show(ticks.hold_s, "thrust_ceiling", 1.0)[1]
        assert "Unallocated" in ticks.show(ticks.hold_s, "thrust_ceiling", 0.01)[1]

    def test_active_limits_have_a_multiplier():
        flown = at_the_limit.now
        assert flown.active.any() and (flown.limit_price[flown.active] > 0.0).all()

    def test_a_refused_setting_is_reported_and_the_last_flight_stays():
        refused = bench.compare({"pilot.controller.limits.tilt_deg": 1e9})
        assert "tilt_deg" in refused.refusal and refused.now is comparison.now

    return


if __name__ == "__main__":
    app.run()
