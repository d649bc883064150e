"""What a run leaves for people: run folder, HTML report, comparison of runs."""
