"""Where the QP is worse than the best analytic law or the predictive rival, over nine experiments."""
