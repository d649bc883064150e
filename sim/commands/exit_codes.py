"""Exit codes of ``ibvs-qp``."""

#: Internal error, refused input or file, Ctrl-C and SIGTERM with the partial run written.
EXIT_INTERNAL, EXIT_USER, EXIT_INTERRUPTED, EXIT_TERMINATED = 1, 2, 130, 143
