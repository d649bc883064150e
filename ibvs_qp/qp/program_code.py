"""Sizes, tables and tolerances of a program as C: ``ibvs_program_layout.h`` and ``ibvs_program_tables.c``."""

from __future__ import annotations

import shutil
from pathlib import Path

from ibvs_qp.config import SolverSettings
from ibvs_qp.qp.osqp_code import write_osqp
from ibvs_qp.qp.problem import QpProblem
from ibvs_qp.qp.solution import ACTIVE_MULTIPLIER, BOUND_SLIP, REFINED_SLIP
from ibvs_qp.symbolic.literals import real, table

#: OSQP at every tick and its acceptance test, the same for every program.
SHELL = Path(__file__).parent / "c"
#: Its part that only Python needs.
FOR_PYTHON = "python_solve.c"
#: Changes of OSQP's active set at most.
PASSES = 20


def write_program(folder: Path, problem: QpProblem, settings: SolverSettings, single: bool = False) -> None:
    """Write the solver of a program: OSQP, its acceptance test, and what they must know of the program.

    Args:
        folder: Receives the sources.
        problem: Sparsity and rows of the program.
        settings: OSQP's settings.
        single: Numbers are floats.
    """
    sizes = {
        "ROTORS": problem.model.rotors,
        "VARIABLES": len(problem.variable_names),
        "ROWS": len(problem.row_names),
        "P_NONZEROS": problem.p_pattern.nnz,
        "A_NONZEROS": problem.a_pattern.nnz,
        "MAX_ITERATIONS": settings.max_iterations,
        "PASSES": PASSES,
    }
    tolerances = {
        "ACTIVE_MULTIPLIER": ACTIVE_MULTIPLIER,
        "BOUND_SLIP": BOUND_SLIP,
        "REFINED_SLIP": REFINED_SLIP,
        "ACCEPT_RESIDUAL": settings.accept_residual,
    }
    layout = [
        "/* Precision, sizes and tolerances of the program; generated. */",
        "#ifndef IBVS_PROGRAM_LAYOUT_H",
        "#define IBVS_PROGRAM_LAYOUT_H",
        "",
        f"#define IBVS_FLOAT {int(single)}",
        f"typedef {'float' if single else 'double'} ibvs_real;",
        "",
        *(f"#define IBVS_{name} {value}" for name, value in sizes.items()),
        *(f"#define IBVS_{name} {real(value, single)}" for name, value in tolerances.items()),
        "",
        "#endif",
        "",
    ]
    (folder / "ibvs_program_layout.h").write_text("\n".join(layout))
    p, a = problem.p_pattern, problem.a_pattern
    tables = [
        "/* Sparsity of the program, and its soft rows; generated. */",
        '#include "ibvs_program.h"',
        "",
        table("uint8_t", "ibvs_p_columns", p.indptr, single),
        table("uint8_t", "ibvs_p_rows", p.indices, single),
        table("uint8_t", "ibvs_a_columns", a.indptr, single),
        table("uint8_t", "ibvs_a_rows", a.indices, single),
        table("bool", "ibvs_soft_rows", problem.row_slack >= 0, single),
        "",
    ]
    (folder / "ibvs_program_tables.c").write_text("\n".join(tables))
    write_osqp(folder, problem, settings, single)
    for source in sorted(SHELL.iterdir()):
        if source.name != FOR_PYTHON:
            shutil.copyfile(source, folder / source.name)
