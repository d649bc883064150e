"""Where the QP is worse than the analytic law at its best or the predictive rival, over nine experiments."""
