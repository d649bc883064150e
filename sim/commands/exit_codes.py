"""Exit codes of ``ibvs-qp``."""

#: Internal error, refused input, Ctrl-C with the partial run written.
EXIT_INTERNAL, EXIT_USER, EXIT_INTERRUPTED = 1, 2, 130
