"""The scene files that come with the package."""
