"""Logs of point clouds through ``ttc_fast.ttc_from_clouds``."""
