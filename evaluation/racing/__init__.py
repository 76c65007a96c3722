"""Laps of race lines on occupancy maps, and drives with steering at random, with the brake in the loop.

``python -m evaluation.racing`` runs them and prints the tables.
"""
