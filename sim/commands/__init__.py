"""The commands of ``ibvs-qp``, one a file; heavy imports happen when a command runs, not when help is shown."""
