"""Output of a run: run folder, HTML report, comparison of runs."""
