"""What is measured on one flight, as a flat row of figures; truth only, from the trace alone."""

from sim.measures.loss import loss_figures
from sim.measures.paint import paint_figures
from sim.measures.press import press_figures
from sim.measures.slide import slide_figures

__all__ = ["loss_figures", "paint_figures", "press_figures", "slide_figures"]
