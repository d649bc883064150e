"""The commands of ``ibvs-qp``, one per file; heavy modules load when a command runs, so that help is fast."""
