import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="A first flight")

with app.setup:
    import marimo as mo

    from sim.evaluate.metrics import compute_metrics
    from sim.figures import draw_board, draw_force, draw_image_error, draw_path
    from sim.notebook.common import number, picture, table
    from sim.notebook.first_flight import draw_camera, draw_moment, fly_first, moment_text


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # A first flight

    A hexarotor with tilted rotors carries a rigid arm with a brush. It presses the brush against a board with 5 N and
    paints a C: one row along the board's lower edge, up by nine tenths of a brush width, and back along the upper edge
    of the first row. No position is measured. The sensors are an IMU, a force/torque sensor at the base of the arm, and
    an RGB-D camera with a delay of 60 ms.

    Vision extracts lines from pictures. Lines and forces give the targets of the tasks. One quadratic program per tick,
    solved by OSQP, converts the targets into six rotor thrusts:

    $$
    \text{picture} \;\to\; (\rho, \theta),\ \text{plane}
    \qquad\qquad
    \text{targets } b_k \;\to\; \min_u \sum_k w_k \bigl\| A_k M^{-1}(B u + h) - b_k \bigr\|^2
    \;\text{ within limits} \;\to\; u .
    $$

    This page flies the job once, in closed loop with the simulated vehicle, and shows the flight in detail.
    """)
    return


@app.cell(hide_code=True)
def _():
    form = (
        mo.md("{seed} {push_n} {slope_deg}")
        .batch(
            seed=mo.ui.slider(0, 9, 1, value=0, label="seed", show_value=True),
            push_n=mo.ui.slider(2.0, 12.0, 0.5, value=5.0, label="push [N]", show_value=True),
            slope_deg=mo.ui.slider(-4.0, 4.0, 0.5, value=0.0, label="slope of the board [°]", show_value=True),
        )
        .form(submit_button_label="fly", bordered=True)  # a flight takes too long to follow a slider
    )
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

    Vision fits the board's face in the depth picture as a plane $1/Z = a x + b y + c$ over normalised image
    coordinates. It detects edges in the colour picture, where the plane ends or the paint begins. A line is
    $x\cos\theta + y\sin\theta = \rho$; it moves with the camera's twist by the interaction matrix
    $[\dot\rho,\,\dot\theta]^\top = L(\rho,\theta,\text{plane})\,[v,\,\omega]^\top$. The pictures below show the
    detections: the plane is tinted; each line has a label with its track, its kind and its confidence. The dark bar is
    the arm, the orange disc the brush. They hide a part of the board.
    """)
    return


@app.cell
def _(flight):
    picture(draw_camera, flight)
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

    weighted with $1-\lambda$ and $\lambda$. After the first touch both $\lambda$ and $F_\text{ref}$ ramp up within one
    second. The wall is a spring of 1.5 kN/m; 5 N compress it by 3 mm.
    """)
    return


@app.cell
def _(flight):
    picture(draw_force, {flight.law: flight})
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## The error in the picture

    The guide line must pass the brush tip at a given distance. Its error is measured at the image position of the tip;
    at half a metre one pixel is 0.8 mm on the board. In the first row the guide is the lower edge of the board, on the
    climb between the rows the vertical edge, and in the second row the upper edge of the fresh paint.
    """)
    return


@app.cell
def _(flight):
    picture(draw_image_error, {flight.law: flight})
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## The path

    The controller has no reference path. The dashed line is the path of a perfect vehicle on this board: row 1 along
    the lower edge, row 2 along the edge of row 1 *as painted*. The error is the distance of the true tip to this line;
    a delay along the path does not count.
    """)
    return


@app.cell
def _(flight):
    picture(draw_path, {flight.law: flight})
    return


@app.cell
def _(flight):
    picture(draw_board, {flight.law: flight})
    return


@app.cell(hide_code=True)
def _(flight):
    _metrics = compute_metrics(flight)
    _rows = (
        ("flight", 1.0, "s", "duration_s"),
        ("push minus reference, rms, straights", 1.0, "N", "force_rms_straight_n"),
        ("greatest push", 1.0, "N", "force_peak_n"),
        ("path error, rms, straights", 1e3, "mm", "path_rms_straight_m"),
        ("path error, rms, within 10 cm of a corner", 1e3, "mm", "path_rms_corner_m"),
        ("tilt, rms", 1.0, "°", "tilt_rms_deg"),
        ("tilt, greatest", 1.0, "°", "tilt_peak_deg"),
        ("intended band covered", 100.0, "%", "coverage"),
        ("least clearance of a propeller to the wall", 1e3, "mm", "propeller_clearance_min_m"),
    )
    _cells = [(_name, number(_scale * _metrics[_key], ".3g"), _unit) for _name, _scale, _unit, _key in _rows]
    mo.md(
        "## Figures of merit\n\n"
        + table(["figure", "", ""], [("end", flight.reason, ""), *_cells])
        + "\n\n`docs/metrics.md` defines each of them."
    )
    return


@app.cell(hide_code=True)
def _(flight):
    _events = [(f"{event.t:.2f} s", event.kind, event.text) for event in flight.events]
    mo.md("## Events\n\n" + table(["time", "event", "detail"], _events, left=3))
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Any tick in detail

    The log holds the program of each tick, so any tick can be solved again. Each task has a *target*, an acceleration
    or a force, and an *achieved* value. Without an active limit the two agree to the accuracy of the weights. With one,
    the task with the smaller weight deviates.
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

    `ibvs-qp paint` flies the same job under both laws and writes a report with a video. Notebook 02 varies weights and
    limits, notebook 03 compares the two laws tick by tick.
    """)
    return


@app.cell
def _(flight):
    def test_flight_is_completed_and_painted():
        assert flight.claimed, flight.reason
        assert flight.coverage_mask.max() > 0.9 and len(flight.pictures) > 20

    def test_push_follows_its_reference_while_painting():
        painting = (flight.row > 0) & (flight.t > flight.t[flight.row > 0][0] + 0.5)
        error = (flight.push_true - flight.push_reference)[painting]
        assert abs(error).mean() < 0.5

    def test_any_tick_is_explained():
        assert "push" in moment_text(flight, 0.8 * flight.t[-1]) and "**t = " in moment_text(flight, 0.0)

    return


if __name__ == "__main__":
    app.run()
