"""Thousands of simulated drives with the brake controller in the loop: does it crash, and does it stop for nothing?

``python -m evaluation.closed_loop`` runs them and prints the tables.
"""
