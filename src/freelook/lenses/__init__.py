"""Lens profiles that come with the package, as JSON files of our own format."""
