"""Logs of laser scans through ``ttc_fast.ScanTTC.nearest``."""
