"""The record that separates laws from gains: comparisons of the experiment ``fair``, and its page."""
