"""Notebook 01: one flight from the camera's picture to the painted board, and any moment of it in detail."""

from sim.notebook.first_flight.figures import draw_camera_story, draw_one, merit_table
from sim.notebook.first_flight.flying import fly_first, story
from sim.notebook.first_flight.form import settings_form
from sim.notebook.first_flight.moment import draw_moment, moment_text

__all__ = [
    "draw_camera_story",
    "draw_moment",
    "draw_one",
    "fly_first",
    "merit_table",
    "moment_text",
    "settings_form",
    "story",
]
