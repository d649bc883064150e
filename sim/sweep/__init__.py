"""Many flights as one design: run in processes, one Parquet part per block, resumable, same numbers for any workers."""

from sim.sweep.design import FlightPlan, Run
from sim.sweep.engine import SweepResult, run_sweep
from sim.sweep.planned import Planned
from sim.sweep.spec import SweepSpec, load_spec

__all__ = ["FlightPlan", "Planned", "Run", "SweepResult", "SweepSpec", "load_spec", "run_sweep"]
