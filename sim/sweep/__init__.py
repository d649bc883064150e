"""Many flights as one design: run in processes, one Parquet part per block, resumable, same numbers for any workers."""

from sim.sweep.design import FlightPlan, Run
from sim.sweep.engine import SweepResult, run_sweep

__all__ = ["FlightPlan", "Run", "SweepResult", "run_sweep"]
