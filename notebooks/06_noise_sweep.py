"""Explore the Parquet table of the noise sweep: what survives, what noise costs, and flights flown again."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Noise sweep")

with app.setup:
    import marimo as mo
    import numpy as np
    import polars as pl

    from sim.notebook.noise.again import find_run, fly_again, row_name, row_named
    from sim.notebook.noise.draw import draw_boxes, draw_flight, draw_maps, draw_path_and_push
    from sim.notebook.noise.effects import effects
    from sim.notebook.noise.table import FIGURES, FORCE, VS, figure_named, success, sweep_or_sample
    from sim.notebook.noise.words import (
        again_table,
        averages_table,
        differences_table,
        effects_table,
        success_table,
    )
    from sim.notebook.picture import picture
    from sim.notebook.short import unless_short
    from sim.sweep.fingerprint import configuration_hash


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # What noise costs

    The vehicle steers by lines in a picture and by a force sensor. Both are noisy, and the sweep adds noise that **no
    filter is told of**:

    - $\sigma_{vs}$ on the distance $\rho$ and the angle $\theta$ of *every line in every picture*, after vision.
      Features are normalised, so at the camera's distance $d = 0.5$ m a line is misplaced by $\sigma_{vs}\, d$: 1 cm,
      4 cm and 6 cm for 0.02, 0.08 and 0.12, thirty times a second. Its angle is off by 1.1°, 4.6° and 6.9°.
    - $\sigma_f$ on *every axis of every force sample*, a hundred times a second: 1, 2 and 3 N beside a push of 5 N.

    The job is a small C (two rows and the climb between them), flown by both laws with the same seeds. Every flight is
    a row of a Parquet table with its settings, its seed and its figures:

    ```sh
    ibvs-qp experiment noise-sweep --out runs/noise       # the record: 3 x 3 cells, ten flights, both laws, with vision
    python -m sim.notebook.noise.sample                   # the sample shown here: lines from the sensor model, 0.3 m
    ```
    """)
    return


@app.cell(hide_code=True)
def _():
    file = mo.ui.text(
        value="",
        label="Parquet file",
        placeholder="runs/noise/noise-sweep.parquet (empty: the sample)",
        full_width=True,
    )
    mo.vstack([file])
    return (file,)


@app.cell
def _(file):
    table, problem = sweep_or_sample(file.value)
    return problem, table


@app.cell(hide_code=True)
def _(problem, table):
    mo.md(
        (f"**{problem}**\n\n" if problem else "")
        + f"""
    The table has {table.height} flights. First of all: **which flights came to their end?** Figures of merit are taken
    over completed flights only, and where many fail, those that remain are the lucky ones. A law that gives up in heavy
    noise may look precise; always read the figures below together with this table.

    """
        + success_table(table)
    )
    return


@app.cell(hide_code=True)
def _():
    chosen = mo.ui.dropdown([figure.words for figure in FIGURES], value=FIGURES[0].words, label="figure")
    mo.vstack([chosen])
    return (chosen,)


@app.cell
def _(chosen, table):
    picture(draw_boxes, table, figure_named(chosen.value))
    return


@app.cell
def _(chosen, table):
    picture(draw_maps, table, figure_named(chosen.value))
    return


@app.cell(hide_code=True)
def _(chosen, table):
    mo.md(
        r"""
    **What to see.** Going up in a map is more line noise, going right more force noise. If the two loops were
    independent, the path would change upwards only and the push sideways only. They are not quite: the force law gives
    up bandwidth as its noise grows, and the lines fix the body that carries the brush.

    ## Is one law better?

    Both laws fly the same seeds, so compare them **pair by pair**: what a seed brings is in both flights and cancels in
    the difference. The interval is the exact one of the median, whatever the distribution: of six pairs it reaches from
    the least to the greatest, so a sign is sure only if all six have it. Fewer pairs make nothing sure.

    """
        + differences_table(table, figure_named(chosen.value))
        + r"""

    Do not expect a program to win by being one. Noise is fought by estimation (line filter, contact estimator), which
    both laws share word for word, and without a limit in the way the two laws want nearly the same thrusts (notebook
    03). What differs is what noise does to the rows: the analytic law rolls after a noisy angle, the program hardly
    does, and it judges a line at the tip. With few seeds per cell many intervals contain zero, and that is an answer.

    """
    )
    return


@app.cell
def _(table):
    picture(draw_path_and_push, table)
    return


@app.cell(hide_code=True)
def _(table):
    mo.md(
        r"""
    ## Which noise, how much, and how it grows

    Over the completed flights we fit, per law and figure,

    $$
    \log y = a + b \log \sigma_{vs} + c \log \sigma_f + \text{rest}.
    $$

    An exponent of 1 means *proportional to the noise*: a linear filter of fixed bandwidth behaves so. Below 1, a floor
    that the noise does not touch (0: it does not matter at all), or a filter that closes as it hears more noise. Beside
    it stands how much of the scatter of $\log y$ each noise explains alone; what both together cannot explain, cell by
    cell, is left to the seeds.

    """
        + effects_table(table)
        + r"""

    ## How much has been averaged

    The mean of $N$ independent samples has noise $\sigma / \sqrt N$. Turned round, an error of rms $e$ under noise
    $\sigma$ means that at least $N = (\sigma / e)^2$ samples were averaged (at least, because $e$ holds everything else
    too), each noise looked at where the other one is least. For a first-order filter of bandwidth $f_c$ on samples at
    rate $f_s$, $N \approx f_s / (\pi f_c)$.

    """
        + averages_table(table)
        + r"""

    Below one picture's worth of averaging a line noise would go straight into the path. Tens of pictures are a second
    or more of memory, which only works because the accelerometer and the gyro carry the estimate from picture to
    picture. The push cannot be averaged as long: 40 force samples at 100 Hz are a bandwidth of 0.8 Hz, and a slower
    force loop would no longer follow its wall.
    """
    )
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## A row is a flight

    Every row holds what decides its flight, so any of them can be flown again, here and now: the worst to see what went
    wrong, the best to see whether it was luck.
    """)
    return


@app.cell(hide_code=True)
def _(table):
    rows = table.to_dicts()
    worst = table.filter(pl.col("completed") & (pl.col("law") == "qp")).sort("path_rms_m", descending=True).to_dicts()
    flight = mo.ui.dropdown([row_name(row) for row in rows], value=row_name((worst or rows)[0]), label="fly again")
    mo.vstack([flight])
    return flight, rows


@app.cell
def _(flight, rows):
    row = row_named(rows, flight.value)
    again = unless_short(fly_again, lambda _: None)(row)
    picture(draw_flight, again.trace) if again else None
    return again, row


@app.cell(hide_code=True)
def _(again, row):
    mo.md(f"**{row_name(row)}: {again.trace.reason}**\n\n" + again_table(row, again) if again else "")
    return


@app.cell(hide_code=True)
def _(table):
    mo.accordion({"Every row of the table": mo.ui.table(table, selection=None)})
    return


@app.cell(hide_code=True)
def _(rows, table):
    def test_every_cell_is_there_under_both_laws_and_with_the_same_seeds():
        counts = success(table)
        assert counts.height == 2 * table[VS].n_unique() * table[FORCE].n_unique()
        assert counts["flights"].n_unique() == 1
        assert (table.filter(pl.col("law") == "qp")["seed"] == table.filter(pl.col("law") == "paper")["seed"]).all()

    def test_the_fit_finds_exponents_that_were_put_in():
        vs, force = table[VS].to_numpy(), table[FORCE].to_numpy()
        rng = np.random.default_rng(0)
        made = 0.01 * vs**0.8 * force**0.1 * np.exp(rng.normal(0.0, 0.01, len(vs)))
        figure = FIGURES[0]
        known = table.with_columns(pl.Series(figure.column, made), pl.lit(True).alias("completed"))
        found = effects(known, "qp", figure)
        assert abs(found.vs_exponent - 0.8) < 0.02 and abs(found.force_exponent - 0.1) < 0.02
        assert found.vs_share > 0.9 and found.rest_share < 0.02

    def test_a_row_leads_back_to_its_design():
        for row in rows[:: max(len(rows) // 5, 1)]:
            run = find_run(row)
            assert (run.law, run.seed) == (row["law"], row["seed"]) and len(configuration_hash(run)) == 16
            assert (run.plan.scene.features.sigma_vs, run.plan.scene.force_torque.sigma_n) == (row[VS], row[FORCE])

    return (
        test_a_row_leads_back_to_its_design,
        test_every_cell_is_there_under_both_laws_and_with_the_same_seeds,
        test_the_fit_finds_exponents_that_were_put_in,
    )


if __name__ == "__main__":
    app.run()
