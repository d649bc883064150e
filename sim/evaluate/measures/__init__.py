"""Figures of one flight as a flat row, from its trace: paint jobs, presses, slides, lost rotors, faults."""

from sim.evaluate.measures.fault import fault_figures
from sim.evaluate.measures.loss import loss_figures
from sim.evaluate.measures.paint import paint_figures, paint_timed_figures
from sim.evaluate.measures.press import press_figures, press_row
from sim.evaluate.measures.slide import slide_figures

__all__ = [
    "fault_figures",
    "loss_figures",
    "paint_figures",
    "paint_timed_figures",
    "press_figures",
    "press_row",
    "slide_figures",
]
