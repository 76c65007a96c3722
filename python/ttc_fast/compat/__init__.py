"""Time-to-collision as other systems compute it, bit for bit, quirks included.

These functions are for comparisons with those systems. The right answers are in ``ttc_fast`` itself.
"""
