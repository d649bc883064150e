"""Recorded ticks through OSQP's settings, DAQP and the back ends of qpsolvers: accuracy against time."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Solvers")

with app.setup:
    import marimo as mo
    import numpy as np

    from sim.notebook.picture import picture
    from sim.notebook.short import unless_short
    from sim.notebook.solvers.contenders import field, kept_osqp
    from sim.notebook.solvers.draw import draw_race, draw_settings, draw_ticks
    from sim.notebook.solvers.programs import hard_press
    from sim.notebook.solvers.race import exact_solutions, race, race_all
    from sim.notebook.solvers.settings_grid import NEVER, settings_grid
    from sim.notebook.solvers.words import race_table
    from sim.notebook.solvers.yours import your_settings


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # Which solver, with which settings?

    Every 4 ms the controller solves one quadratic program in the rotor thrusts $u$ and the slacks $s$ of soft limits,

    $$
    \min_{x = (u, s)} \; \tfrac12 x^T P x + q^T x \qquad \text{with} \quad l \le A x \le h .
    $$

    The accelerations are eliminated, so the program is small and dense, and its pattern of non-zeros never changes: an
    absent line is a zero weight, not another problem. Two families of solvers compete for such programs.

    - **OSQP** (ADMM) repeats one cheap step: solve a linear system with a fixed matrix, clip to the bounds, move the
      multipliers by the step size $\rho$. It is warm started with the last tick's solution, and it stops when primal
      and dual residuals are below a tolerance. It approaches the solution; how close is a *setting*.
    - **Active-set** methods (DAQP, quadprog) guess which rows bind, solve the equality problem exactly, and mend the
      guess. They end *at* the solution, after a number of steps that depends on how many rows change.
    - **Interior-point** and augmented-Lagrangian methods (Clarabel, PIQP, ProxQP) stand beside them for comparison.

    The ticks come from a flight: the vehicle is asked to press with 35 N where its rotors reach 30.4 N, and nobody
    reduces the request, so that rotors meet their idle floor and the program has to decide what to give up.
    """)
    return


@app.cell
def _():
    flight = hard_press(ticks=unless_short(1900, 1320))
    stretch = flight.busy(unless_short(500, 100))
    exact = exact_solutions(stretch)
    return exact, flight, stretch


@app.cell(hide_code=True)
def _(exact, flight, stretch):
    mo.md(rf"""
    The flight has {len(flight.t)} ticks; at {flight.limited.mean():.0%} of them a limit binds. The others need **no
    solver at all**: without limits the program is linear least squares, whose optimum $-P^{{-1}} q$ is part of the
    compiled tick. If it breaks no row it *is* the solution, and the shipped controller flies it. In an ordinary paint
    job that is 99 % of all ticks. For the race we take {len(stretch.t)} consecutive ticks around the moment when the
    rotors meet their floor; {stretch.limited.mean():.0%} of them are limited.

    The yardstick is a solution that satisfies the optimality conditions

    $$
    P x + q + A^T y = 0, \qquad l \le A x \le h, \qquad y_+^T (h - A x) = 0, \quad y_-^T (A x - l) = 0
    $$

    to a relative {exact.residual.max():.0e} at the worst tick: it is exact to rounding, whoever found it.
    """)
    return


@app.cell
def _(exact, stretch):
    results = race_all(field(), stretch, exact, repeats=unless_short(3, 1))
    picture(draw_race, results)
    return (results,)


@app.cell(hide_code=True)
def _(results):
    mo.md(
        r"""
    **How to read it.** Each dot is one way to solve the same ticks in Python: time per tick to the right (dot: median,
    line: to the 99th percentile), distance of the thrusts to the exact ones upwards. Times are those of the computer
    that made this copy; trust their ratios.

    """
        + race_table(results)
        + r"""

    - *A kept workspace beats everything else by an order of magnitude.* OSQP through `qpsolvers` builds and scales a
      new problem at every tick; the same OSQP with its values updated in place does not. Which solver it is matters
      less than that.
    - *A tolerance is no accuracy.* OSQP's test is relative to the largest entries of $P x$ and $q$. The rows of this
      program differ in weight by orders of magnitude (roll and pitch 400, push 0.5), so an iterate may pass the test
      and still be off by newtons along the push. Tested every 5 iterations at 1e-3 it stops too early; the defaults do
      better at the same tolerance only because they test every 25 iterations.
    - *Iterations buy digits*, a few for every decade of tolerance, and never all of them.
    - *The shipped controller solves every tick with OSQP*, at an absolute tolerance of 1e-6 and no relative one:
      thrusts within 1e-3 N of the exact solution. Where the cap of 500 iterations ends the solve and the residual,
      converted to thrust, exceeds 1e-3 N, DAQP solves the same tick.
    - *Where OSQP does not win:* at this size (six thrusts, a handful of slacks) DAQP with a kept workspace is faster
      than OSQP **and** exact. Called through CasADi or `qpsolvers` the same DAQP loses that lead to conversions. In the
      controller it is the exact fallback. What speaks for OSQP here is not the median: every iteration costs the
      same, so a cap on iterations is a deadline. Which rows contradict each other where there is no solution does not
      come from the solver: an iterate that was cut short holds no certificate, so a smallest set of rows in conflict is
      sought by itself (Farkas' lemma by non-negative least squares, `ibvs_qp/qp/infeasible.py`).
    """
    )
    return


@app.cell
def _(results, stretch):
    _shown = ("OSQP 1e-3", "OSQP 1e-5", "shipped")
    picture(draw_ticks, stretch, [one for one in results if one.contender.name in _shown])
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    **Tick by tick.** OSQP alone needs few iterations where no limit binds, but at a loose tolerance it drifts: the
    push row is so light that a wrong push hardly shows in the residuals. Where limits bind (tinted) iterations rise,
    most at ticks at which the set of active rows *changes*: the warm start is then wrong about a multiplier, and
    multipliers move by one step size per iteration. Those ticks make the tail of the times.

    ## OSQP's settings

    Two settings decide: the tolerance, and how often the step size $\rho$ is adapted. Adapting costs a new
    factorisation; not adapting leaves a step size that suits the rows of one phase and starves those of another. Errors
    and iterations do not depend on the computer.
    """)
    return


@app.cell
def _(exact, stretch):
    CAP = 200
    grid = settings_grid(
        stretch,
        exact,
        tolerances=unless_short((1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8), (1e-3, 1e-6)),
        intervals=unless_short((5, 25, 100, NEVER), (25,)),
        cap=CAP,
    )
    picture(draw_settings, grid, CAP)
    return (grid,)


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    With the step size adapted, the error follows the tolerance down until the cap of 200 iterations ends it. Without
    adaptation it does not move at all: the step size that OSQP begins with does not suit this program. The shipped
    settings: absolute tolerance 1e-6, a test every 5 iterations, adaptation every 20, a cap of 500 and two passes of
    scaling.

    ## Your setting

    Move the sliders: the purple star is OSQP with your settings on the same ticks.
    """)
    return


@app.cell(hide_code=True)
def _():
    power = mo.ui.slider(1, 9, 1, value=4, label="tolerance 10^-", show_value=True)
    most = mo.ui.slider(5, 400, 5, value=200, label="iterations at most", show_value=True)
    check = mo.ui.slider(1, 50, 1, value=5, label="test every ... iterations", show_value=True)
    adapt = mo.ui.slider(5, 200, 5, value=25, label="adapt rho every ... iterations", show_value=True)
    scaling = mo.ui.slider(0, 10, 1, value=2, label="scaling passes", show_value=True)
    mo.hstack([mo.vstack([power, most, check]), mo.vstack([adapt, scaling])], justify="start", gap=3)
    return adapt, check, most, power, scaling


@app.cell
def _(adapt, check, exact, most, power, results, scaling, stretch):
    yours = race(
        kept_osqp(
            "yours",
            your_settings(power.value, most.value, check.value, adapt.value, scaling.value),
            family="yours",
        ),
        stretch,
        exact,
        repeats=unless_short(3, 1),
    )
    picture(draw_race, [*(one for one in results if one.contender.family != "qpsolvers"), yours])
    return (yours,)


@app.cell(hide_code=True)
def _(yours):
    mo.md(race_table([yours], reference="yours"))
    return


@app.cell(hide_code=True)
def _(exact, grid, results, stretch, yours):
    def test_the_yardstick_is_exact():
        assert exact.residual.max() < 1e-9

    def test_the_shipped_solver_and_active_set_solvers_are_accurate_and_loose_osqp_is_not():
        errors = {one.contender.name: float(np.nanmax(one.errors_n)) for one in results}
        assert errors["shipped"] < 2e-2 and errors["DAQP in CasADi"] < 1e-6
        assert errors["OSQP 1e-8"] < 1e-3 < errors["OSQP 1e-3"]
        assert not any(one.unanswered for one in results)

    def test_a_tighter_tolerance_costs_iterations_and_buys_accuracy():
        loose, tight = grid[0], grid[-1] if len(grid) == 2 else grid[5]
        assert loose.iterations_p99 < tight.iterations_p99 and loose.error_n > tight.error_n

    def test_limits_bind_in_about_half_of_the_ticks():
        assert 0.3 < stretch.limited.mean() < 0.7 and len(yours.errors_n) == len(stretch.t)

    return (
        test_a_tighter_tolerance_costs_iterations_and_buys_accuracy,
        test_the_shipped_solver_and_active_set_solvers_are_accurate_and_loose_osqp_is_not,
        test_limits_bind_in_about_half_of_the_ticks,
        test_the_yardstick_is_exact,
    )


if __name__ == "__main__":
    app.run()
