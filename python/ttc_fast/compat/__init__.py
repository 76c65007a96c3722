"""What other systems answer, bit for bit, quirks included.

For comparing with them and for moving away from them. The right answers are in ``ttc_fast`` itself.
"""
