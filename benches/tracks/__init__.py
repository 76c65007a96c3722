"""Trackers: an approach is a list of distances and their stamps."""
