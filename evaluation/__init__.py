"""How good the answers are: accuracy on simulated and recorded input, and whole drives with the brake in the loop."""
