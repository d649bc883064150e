"""The record that separates laws from gains: the page of the experiment ``fair``."""
