"""What is measured on one flight, as a flat row of figures; truth only, from the trace alone."""

from sim.evaluate.measures.loss import loss_figures
from sim.evaluate.measures.paint import paint_figures
from sim.evaluate.measures.press import press_figures
from sim.evaluate.measures.slide import slide_figures

__all__ = ["loss_figures", "paint_figures", "press_figures", "slide_figures"]
