"""The quadratic program: symbolic rows, one fixed sparsity, evaluation, solvers and the acceptance test."""
