import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="A first flight")

with app.setup:
    import marimo as mo

    from sim.figures import draw_board, draw_force, draw_image_error, draw_path
    from sim.notebook.first_flight import (
        draw_camera_story,
        draw_moment,
        draw_one,
        fly_first,
        merit_table,
        moment_text,
        settings_form,
        story,
    )
    from sim.notebook.picture import picture


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # A first flight

    A hexarotor with tilted rotors carries a rigid arm with a brush. It shall press the brush against a board with 5 N
    and paint a C: one row along the board's lower edge, up by nine tenths of a brush width, and back along the upper
    edge of what it has just painted. It knows no position. All it has is an IMU, a force/torque sensor at the arm's
    base, and an RGB-D camera, whose pictures come 60 ms late.

    Pictures become lines, lines and forces become wishes, and one quadratic program per tick turns the wishes into
    six rotor thrusts:

    $$
    \text{picture} \;\to\; (\rho, \theta),\ \text{plane}
    \qquad\qquad
    \text{wishes } b_k \;\to\; \min_u \sum_k w_k \bigl\| A_k M^{-1}(B u + h) - b_k \bigr\|^2
    \;\text{ within limits} \;\to\; u .
    $$

    This page flies the job once, in closed loop with the simulated vehicle, and looks at it from all sides.
    """)
    return


@app.cell(hide_code=True)
def _():
    form = settings_form()
    form
    return (form,)


@app.cell
def _(form):
    flight = fly_first(**(form.value or {}))
    return (flight,)


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## What the camera sees

    The board's face is found in the depth picture as a plane $1/Z = a x + b y + c$ over normalised image coordinates;
    its edges are found in the colour picture where the plane ends or the paint begins. A line is $x\cos\theta +
    y\sin\theta = \rho$; it moves with the camera's twist by the interaction matrix $[\dot\rho,\,\dot\theta]^\top =
    L(\rho,\theta,\text{plane})\,[v,\,\omega]^\top$. The detections are drawn into the pictures below: tinted is what
    belongs to the plane, beside each line stand its track, what it borders on and its confidence. The dark bar is the
    arm, the orange disc the brush; what they hide must be known otherwise.
    """)
    return


@app.cell
def _(flight):
    picture(draw_camera_story, flight)
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## The push

    Along the wall's normal the vehicle blends a stand-off controller with the force law

    $$
    F_f = F_\text{ref} + K_{sp}\,e_s + K_{sd}\,\dot e_s +
    K_{fp}\,(F_\text{ref} - f) + K_{fi}\!\int (F_\text{ref} - f)\,dt ,
    $$

    weighted with $1-\lambda$ and $\lambda$. At the first touch both $\lambda$ and $F_\text{ref}$ ramp up within a
    second: the wall is a spring of 1.5 kN/m, and 5 N on it are 3 mm.
    """)
    return


@app.cell
def _(flight):
    picture(draw_one, draw_force, flight)
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## The error in the picture

    The guiding line shall pass a given distance beside the brush tip. Its error is taken where the picture shows the
    tip; at half a metre one pixel is 0.8 mm on the board. On the climb between the rows the vertical edge guides, in
    the second row the upper edge of the fresh paint.
    """)
    return


@app.cell
def _(flight):
    picture(draw_one, draw_image_error, flight)
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## The path

    Nobody told the vehicle a path. The dashed line is what a perfect vehicle would do on the board as it is: row 1
    along the lower edge, row 2 along the edge of row 1 *as painted*. The error is the distance of the true tip to it,
    never a lag in time.
    """)
    return


@app.cell
def _(flight):
    picture(draw_one, draw_path, flight)
    return


@app.cell
def _(flight):
    picture(draw_one, draw_board, flight)
    return


@app.cell(hide_code=True)
def _(flight):
    mo.md("## Figures of merit\n\n" + merit_table(flight) + "\n\n`docs/metrics.md` defines each of them.")
    return


@app.cell(hide_code=True)
def _(flight):
    mo.md("## What happened, and why\n\n" + story(flight))
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Any moment in detail

    The program of each tick is in the log, so it can be solved again and asked. A task *asks* for an acceleration or
    a force and *does* something; where no limit binds the two agree to the weights' accuracy, and where one does, the
    lighter task gives way.
    """)
    return


@app.cell(hide_code=True)
def _(flight):
    moment = mo.ui.slider(
        0.0, float(flight.t[-1]), 0.1, value=round(0.6 * float(flight.t[-1]), 1), label="time [s]", show_value=True,
        full_width=True,
    )  # fmt: skip
    moment
    return (moment,)


@app.cell
def _(flight, moment):
    picture(draw_moment, flight, moment.value)
    return


@app.cell(hide_code=True)
def _(flight, moment):
    mo.md(moment_text(flight, moment.value))
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Where to go on

    `ibvs-qp paint` does the same for both laws and writes a report with a video. Notebook 02 turns weights and
    limits, 03 compares the two laws tick by tick.
    """)
    return


@app.cell
def _(flight):
    def test_flight_is_completed_and_painted():
        assert flight.completed, flight.reason
        assert flight.coverage_mask.max() > 0.9 and len(flight.pictures) > 20

    def test_push_is_held_while_painting():
        painting = (flight.row > 0) & (flight.t > flight.t[flight.row > 0][0] + 0.5)
        error = (flight.push_true - flight.push_reference)[painting]
        assert abs(error).mean() < 0.5

    def test_any_tick_is_explained():
        assert "push" in moment_text(flight, 0.8 * flight.t[-1]) and "**t = " in moment_text(flight, 0.0)

    return


if __name__ == "__main__":
    app.run()
