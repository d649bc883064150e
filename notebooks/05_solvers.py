"""Recorded ticks through OSQP's settings, DAQP and the back ends of qpsolvers: accuracy against time."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="Solvers")

with app.setup:
    import marimo as mo
    import numpy as np

    from ibvs_qp.config import SolverSettings
    from sim.figures.style import legend_below, new_figure
    from sim.notebook.common import picture, unless_short
    from sim.notebook.solvers import (
        NEVER,
        contenders,
        draw_race,
        draw_ticks,
        exact_solutions,
        race,
        race_table,
        transition,
        workspace,
    )
    from sim.notebook.wall_flights import WallTask, record_flight


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # Which solver, with which settings?

    Every 4 ms the controller solves one quadratic program in the rotor thrusts $u$ and the slacks $s$ of soft limits,

    $$
    \min_{x = (u, s)} \; \tfrac12 x^T P x + q^T x \qquad \text{with} \quad l \le A x \le h .
    $$

    The accelerations are eliminated, so the program is small and dense. Its pattern of non-zeros never changes: a line
    that is not visible has weight zero. Three families of solvers apply.

    - **OSQP** (ADMM) repeats one cheap step: solve a linear system with a fixed matrix, clip to the bounds, move the
      multipliers by the step size $\rho$. It starts from the last tick's solution and stops when primal and dual
      residuals are below a tolerance. Its accuracy is a *setting*. The controller solves every tick with OSQP.
    - **Active-set** methods (DAQP, quadprog) guess the active rows, solve the equality problem exactly, and correct the
      guess. They end *at* the solution, after a number of steps that depends on how many rows change.
    - **Interior-point** and augmented-Lagrangian methods (Clarabel, PIQP, ProxQP) are included for comparison.

    The ticks come from a flight in which the vehicle presses with 35 N where its rotors reach 30.4 N, without the reach
    check. Rotors meet their idle floor, and the program decides which task deviates.
    """)
    return


@app.cell
def _():
    flight = record_flight(WallTask(push_n=35.0, hold_s=unless_short(3.5, 1.2)))
    _programs = [record.program for record in flight.records]
    stretch = transition(_programs, unless_short(500, 100))
    ticks = _programs[stretch]
    exact, residuals = exact_solutions(ticks)
    return exact, flight, residuals, stretch, ticks


@app.cell(hide_code=True)
def _(flight, residuals, stretch, ticks):
    mo.md(rf"""
    The flight has {len(flight.t)} ticks; at {flight.limited.mean():.0%} of them a limit is active. In an ordinary paint
    job it is one per cent. The race uses {len(ticks)} consecutive ticks around the moment at which the rotors meet
    their floor; {flight.limited[stretch].mean():.0%} of them are limited.

    The reference solution satisfies the optimality conditions

    $$
    P x + q + A^T y = 0, \qquad l \le A x \le h, \qquad y_+^T (h - A x) = 0, \quad y_-^T (A x - l) = 0
    $$

    to a relative {residuals.max():.0e} at the worst tick (primal and dual residual, duality gap): it is exact to
    rounding.
    """)
    return


@app.cell
def _(exact, ticks):
    results = [race(contender, ticks, exact, repeats=unless_short(3, 1)) for contender in contenders()]
    picture(draw_race, results)
    return (results,)


@app.cell(hide_code=True)
def _(results):
    mo.md(
        r"""
    **How to read it.** Each row is one way to solve the same ticks in Python. Left: time per tick (dot: median, line:
    to the 99th percentile). Right: distance of the thrusts to the exact ones; dotted: a tick, and an error below the
    noise of the thrusts. Times belong to the computer that made this copy; only their ratios are general. *Shipped* is
    the whole engine of the controller: OSQP, the acceptance test (status, finiteness, bounds, residuals), and DAQP in
    the same tick when the test fails. Blue rows are the solvers of `solver.name` on a warm workspace, without it.

    """
        + race_table(results)
        + r"""

    - *A persistent workspace is an order of magnitude faster than anything else.* OSQP through `qpsolvers` builds and
      scales a new problem at every tick; the same OSQP with values updated in place does not. The choice of the solver
      matters less.
    - *A tolerance is not an accuracy.* OSQP's test is relative to the largest entries of $P x$ and $q$. The rows of
      this program differ in weight by orders of magnitude (roll and pitch 400, push 0.5), so an iterate can pass the
      test with an error of newtons along the push. Tested every 5 iterations at 1e-3 it stops too early. The defaults
      are more accurate at the same tolerance only because they test every 25 iterations.
    - *Each decade of tolerance* costs some iterations and gains about one digit.
    - *DAQP with a persistent workspace* (`solver.name = "daqp"`) is faster than OSQP at this size (six thrusts, a few
      slacks) **and** exact. Through CasADi or `qpsolvers` conversions cost this lead. In the controller DAQP is the
      exact fallback. The argument for OSQP is not the median: every iteration costs the same, so a cap on iterations is
      a deadline.
    - *An infeasible program* yields no certificate from a capped solve. The controller then computes a smallest set of
      conflicting rows itself (Farkas' lemma by non-negative least squares, `ibvs_qp/qp/infeasible.py`).
    """
    )
    return


@app.cell
def _(flight, results, stretch):
    _shown = [one for name in ("OSQP 1e-5", "OSQP 1e-3", "shipped") for one in results if one.contender.name == name]
    picture(draw_ticks, flight.t[stretch], flight.limited[stretch], _shown)
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    **Tick by tick.** OSQP needs few iterations where no limit is active. At a loose tolerance it drifts: the push row
    has a small weight, so a wrong push hardly shows in the residuals. Where limits are active (tinted) iterations rise,
    most at ticks at which the active set *changes*: the warm start then has a wrong multiplier, and multipliers move by
    one step size per iteration. These ticks make the tail of the times.

    ## OSQP's settings

    Two settings are decisive: the tolerance, and how often the step size $\rho$ is adapted. An adaptation costs a new
    factorisation. Without it, a step size that suits the rows of one phase is too small for those of another. Errors
    and iterations do not depend on the computer.
    """)
    return


@app.cell
def _(exact, ticks):
    grid, _figure = {}, new_figure(2.9)
    _errors, _iterations = _figure.subplots(1, 2)
    for _interval in unless_short((5, 25, 100, NEVER), (25,)):
        _tolerances = unless_short((1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8), (1e-3, 1e-6))
        _found = []
        for _tolerance in _tolerances:
            _settings = SolverSettings(
                tolerance=_tolerance,
                relative_tolerance=_tolerance,
                max_iterations=200,
                adaptive_rho_interval=_interval,
                adaptive_rho_tolerance=5.0,
            )
            _one = race(workspace("grid", _settings), ticks, exact)
            grid[_interval, _tolerance] = np.percentile((_one.errors_n, _one.iterations), 99.0, axis=1)
            _found.append(grid[_interval, _tolerance])
        _label = "never" if _interval == NEVER else f"every {_interval} iterations"
        for _axes, _values in zip((_errors, _iterations), zip(*_found, strict=True), strict=True):
            _axes.plot(_tolerances, _values, "o-", markersize=3, label=_label)
    for _axes in (_errors, _iterations):
        _axes.set(xscale="log", xlabel="tolerance (absolute and relative)")
        _axes.invert_xaxis()
    _errors.set(yscale="log", ylabel="thrust error [N]", title="Accuracy, 99 % of the ticks")
    _iterations.set(ylabel="iterations", title="Cost, 99 % of the ticks")
    legend_below(_figure, title="update of the step size rho")
    picture(lambda: _figure)
    return (grid,)


@app.cell(hide_code=True)
def _():
    _shipped = SolverSettings()
    mo.md(rf"""
    With adaptation, the error follows the tolerance down to the cap of 200 iterations. Without adaptation the error is
    nearly constant: OSQP's initial step size does not suit this program. The shipped settings are a tolerance of
    {_shipped.tolerance:.0e} (relative {_shipped.relative_tolerance:.0e}), a test every {_shipped.check_interval}
    iterations, adaptation every {_shipped.adaptive_rho_interval}, a cap of {_shipped.max_iterations}, and
    {_shipped.scaling} passes of scaling.

    ## Your settings

    Here a persistent OSQP workspace runs with your settings on the same ticks.
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
def _(adapt, check, exact, most, power, results, scaling, ticks):
    _settings = SolverSettings(
        tolerance=10.0**-power.value,
        relative_tolerance=10.0**-power.value,
        max_iterations=most.value,
        check_interval=check.value,
        adaptive_rho_interval=adapt.value,
        scaling=scaling.value,
    )
    yours = race(workspace("yours", _settings, family="yours"), ticks, exact, repeats=unless_short(3, 1))
    picture(draw_race, [*(one for one in results if one.contender.family != "qpsolvers"), yours])
    return (yours,)


@app.cell(hide_code=True)
def _(yours):
    mo.md(race_table([yours], reference="yours"))
    return


@app.cell(hide_code=True)
def _(exact, flight, grid, residuals, results, stretch, yours):
    def test_the_reference_is_exact():
        assert residuals.max() < 1e-9

    def test_accuracy_of_the_shipped_engine_and_of_tolerances():
        errors = {one.contender.name: float(one.errors_n.max()) for one in results}
        assert errors["shipped"] < 2e-2 and errors["DAQP in CasADi"] < 1e-6
        assert errors["OSQP 1e-8"] < 1e-3 < errors["OSQP 1e-3"]  # NaN, no answer, fails these as well

    def test_a_tighter_tolerance_costs_iterations_and_gains_accuracy():
        loose, tight = grid[25, 1e-3], grid[25, 1e-6]
        assert loose[0] > tight[0] and loose[1] < tight[1]

    def test_limits_are_active_in_about_half_of_the_ticks():
        assert 0.3 < flight.limited[stretch].mean() < 0.7 and len(yours.errors_n) == len(exact)

    return (
        test_a_tighter_tolerance_costs_iterations_and_gains_accuracy,
        test_accuracy_of_the_shipped_engine_and_of_tolerances,
        test_limits_are_active_in_about_half_of_the_ticks,
        test_the_reference_is_exact,
    )


if __name__ == "__main__":
    app.run()
