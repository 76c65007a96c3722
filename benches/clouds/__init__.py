"""``robust_min_x``: the clouds, the questions, and who answers them."""
