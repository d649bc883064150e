"""Explore the Parquet table of the noise sweep: what survives, what noise costs, and flights flown again."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Noise sweep")

with app.setup:
    import marimo as mo
    import numpy as np
    import polars as pl

    from sim.figures import draw_force, draw_path
    from sim.figures.style import law_name
    from sim.notebook.common import number, picture, table, unless_short
    from sim.notebook.noise import (
        FIGURES,
        FORCE,
        VS,
        averaged_samples,
        differences_table,
        effects,
        find_run,
        fly_again,
        row_name,
        success,
        success_table,
        sweep_or_sample,
    )
    from sim.sweep.design import configuration_hash
    from sim.sweep.figures.maps import draw_boxes, draw_figure_maps, draw_success_maps
    from sim.sweep.spec import LAWS


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # What noise costs

    The vehicle steers by lines in a picture and by a force sensor. Both are noisy, and the sweep adds noise that
    **no filter is configured for**:

    - $\sigma_{vs}$ on the distance $\rho$ and the angle $\theta$ of *every line in every picture*, after vision.
      Features are normalised, so at the camera's distance $d = 0.5$ m a line is displaced by $\sigma_{vs}\, d$: 1 cm,
      4 cm and 6 cm for 0.02, 0.08 and 0.12, thirty times a second. Its angle is off by 1.1°, 4.6° and 6.9°.
    - $\sigma_f$ on *every axis of every force sample*, a hundred times a second: 1, 2 and 3 N beside a push of 5 N.

    The job is a small C (two rows and the climb between them), flown by both laws with the same seeds. Every flight is
    a row of a Parquet table with its settings, its seed and its figures:

    ```sh
    ibvs-qp experiment noise-sweep --out runs/noise       # the record: 3 x 3 cells, ten flights, both laws, with vision
    ibvs-qp experiment notebooks/data/noise_sample.toml   # the sample shown here: lines from the sensor model, 0.3 m
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
    sweep, problem = sweep_or_sample(file.value)
    return problem, sweep


@app.cell(hide_code=True)
def _(problem, sweep):
    mo.md(
        (f"**{problem}**\n\n" if problem else "")
        + f"""
    The table has {sweep.height} flights. The first question: **which flights were completed?** The figures below
    include completed flights only. Where many flights fail, the completed ones are a biased selection, and a law that
    fails in heavy noise may look precise. Always read the figures together with this table.

    """
        + success_table(sweep)
    )
    return


@app.cell(hide_code=True)
def _():
    chosen = mo.ui.dropdown({figure.label: figure for figure in FIGURES}, value=FIGURES[0].label, label="figure")
    mo.vstack([chosen])
    return (chosen,)


@app.cell
def _(chosen, sweep):
    done = sweep.filter(pl.col("completed"))
    picture(draw_boxes, done, chosen.value, [VS, FORCE])
    return (done,)


@app.cell
def _(chosen, done, sweep):
    mo.vstack(
        [picture(draw_success_maps, sweep, [FORCE, VS]), picture(draw_figure_maps, done, chosen.value, [FORCE, VS])]
    )
    return


@app.cell(hide_code=True)
def _(chosen, sweep):
    mo.md(
        r"""
    **What to see.** Going up in a map is more line noise, going right more force noise. If the two loops were
    independent, the path would change upwards only and the push sideways only. They are almost independent: the
    force law reduces its bandwidth as its noise grows, and the lines control the body that carries the brush.

    ## Is one law better?

    Both laws fly the same seeds, so compare them **pair by pair**: the effect of a seed is in both flights and cancels
    in the difference. The interval of the median is exact for any distribution. With six pairs it spans all of them, so
    a sign is significant only if all six agree. Fewer pairs are never significant.

    """
        + differences_table(sweep, chosen.value)
        + r"""

    A program does not win by being a program. Estimation (line filter, contact estimator) reduces the noise, and both
    laws share it. Without an active limit the two laws compute nearly the same thrusts (notebook 03). They differ in
    the effect of noise on the rows: the analytic law rolls with a noisy angle, the program hardly does, and it measures
    a line's error at the tip. With few seeds per cell many intervals contain zero, and that is a result.

    """
    )
    return


@app.cell(hide_code=True)
def _(sweep):
    _effects, _averages = [], []
    for _law in LAWS:
        for _figure in FIGURES[:2]:
            _flights, _vs, _force, *_parts = effects(sweep, _law, _figure).values()
            _percent = (number(part, ".0%") for part in _parts)
            _effects.append((_figure.label, law_name(_law), _flights, number(_vs), number(_force), *_percent))
        _pictures, _samples = averaged_samples(sweep, _law)
        for (_vs, _seen), (_force, _felt) in zip(_pictures.items(), _samples.items(), strict=False):
            _averages.append((law_name(_law), f"{_vs:g}", number(_seen, ".0f"), f"{_force:g}", number(_felt, ".0f")))
    mo.md(
        r"""
    ## Which noise, how much, and how it grows

    Over the completed flights we fit, per law and figure,

    $$
    \log y = a + b \log \sigma_{vs} + c \log \sigma_f + \text{rest}.
    $$

    An exponent of 1 means *proportional to the noise*, as for a linear filter of fixed bandwidth. An exponent below 1
    means a floor that does not depend on the noise (0: no effect), or a filter that reduces its bandwidth with more
    noise. The next columns are the parts of the scatter of $\log y$ that each noise explains alone. The rest, which
    both together do not explain cell by cell, comes from the seeds.

    """
        + table(
            [
                *"figure|law|flights|exponent of sigma_vs|exponent of sigma_f".split("|"),
                "explained by sigma_vs",
                "by sigma_f",
                "rest (seeds)",
            ],
            _effects,
            left=2,
        )
        + r"""

    ## How many samples are averaged

    The mean of $N$ independent samples has noise $\sigma / \sqrt N$. Conversely, an error of rms $e$ under noise
    $\sigma$ means that at least $N = (\sigma / e)^2$ samples were averaged (at least, because $e$ has other causes
    too). The table uses the smallest value of the other noise. For a first-order filter of bandwidth $f_c$ on samples
    at rate $f_s$, $N \approx f_s / (\pi f_c)$.

    """
        + table(["law", "sigma_vs", "pictures", "sigma_f [N]", "force samples"], _averages)
        + r"""

    With $N = 1$ the line noise would appear in the path without reduction. Tens of pictures are a filter memory of a
    second or more. That is possible because accelerometer and gyro propagate the estimate from picture to picture. The
    push cannot be averaged as long: 40 force samples at 100 Hz are a bandwidth of 0.8 Hz, and a slower force loop would
    not follow the wall.
    """
    )
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## A row is a flight

    Every row holds the settings of its flight, so any of them can fly again here: the worst to see what went wrong, the
    best to see whether it was luck.
    """)
    return


@app.cell(hide_code=True)
def _(sweep):
    rows = {row_name(row): row for row in sweep.to_dicts()}
    _worst = sweep.filter(pl.col("completed") & (pl.col("law") == "qp")).sort("path_rms_m", descending=True).to_dicts()
    flight = mo.ui.dropdown(rows, value=row_name(_worst[0]) if _worst else next(iter(rows)), label="fly again")
    mo.vstack([flight])
    return flight, rows


@app.cell
def _(flight):
    again, figures, same = unless_short(fly_again, lambda row: (None, {}, False))(flight.value)
    picture(draw_path, {again.law: again}) if again else None
    return again, figures, same


@app.cell
def _(again):
    picture(draw_force, {again.law: again}) if again else None
    return


@app.cell(hide_code=True)
def _(again, figures, flight, same):
    _rows = [
        (each.label, *(number(value and each.scale * value, ".3f") for value in (flight.value[each.name], flown)))
        for each in FIGURES[:4]
        for flown in [figures.get(each.name)]
    ]
    _note = "Same code and settings: the figures are equal to the bit."
    _changed = "Code or settings have changed since the table was made, so the figures may differ."
    mo.md(
        f"**{row_name(flight.value)}: {again.reason}**\n\n"
        + table(["figure", "in the table", "flown again"], _rows)
        + f"\n\n{_note if same else _changed}"
        if again
        else ""
    )
    return


@app.cell(hide_code=True)
def _(sweep):
    mo.accordion({"Every row of the table": mo.ui.table(sweep, selection=None)})
    return


@app.cell(hide_code=True)
def _(rows, sweep):
    def test_every_cell_is_there_under_both_laws_and_with_the_same_seeds():
        counts = success(sweep)
        assert counts.height == 2 * sweep[VS].n_unique() * sweep[FORCE].n_unique()
        assert counts["flights"].n_unique() == 1
        assert (sweep.filter(pl.col("law") == "qp")["seed"] == sweep.filter(pl.col("law") == "paper")["seed"]).all()

    def test_the_fit_finds_exponents_that_were_put_in():
        vs, force = sweep[VS].to_numpy(), sweep[FORCE].to_numpy()
        rng = np.random.default_rng(0)
        made = 0.01 * vs**0.8 * force**0.1 * np.exp(rng.normal(0.0, 0.01, len(vs)))
        known = sweep.with_columns(pl.Series(FIGURES[0].name, made), pl.lit(True).alias("completed"))
        found = effects(known, "qp", FIGURES[0])
        assert abs(found["vs"] - 0.8) < 0.02 and abs(found["force"] - 0.1) < 0.02
        assert found["vs_part"] > 0.9 and found["rest"] < 0.02

    def test_a_row_leads_back_to_its_design():
        for row in list(rows.values())[:: max(len(rows) // 5, 1)]:
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
