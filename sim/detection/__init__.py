"""Pictures from files, through a detector, to tables, JSON and overlays."""
