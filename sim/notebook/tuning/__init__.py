"""Notebook 02: every change of a weight, a limit or the scene is flown again and compared."""

from sim.notebook.tuning.bench import TuningBench, compare_pair
from sim.notebook.tuning.comparison import changed_text, comparison_table
from sim.notebook.tuning.controls import control_panel, make_controls
from sim.notebook.tuning.dashboard import draw_dashboard
from sim.notebook.tuning.knobs import GROUPS, KNOBS, knob_values
from sim.notebook.tuning.preset import command_line, load_setting, save_setting, saved_text
from sim.notebook.tuning.snippet import Setting, fly_snippet

__all__ = [
    "GROUPS",
    "KNOBS",
    "Setting",
    "TuningBench",
    "changed_text",
    "command_line",
    "compare_pair",
    "comparison_table",
    "control_panel",
    "draw_dashboard",
    "fly_snippet",
    "knob_values",
    "load_setting",
    "make_controls",
    "save_setting",
    "saved_text",
]
