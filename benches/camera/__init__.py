"""Camera: the cases, what a user would write for them, and how near the truth each estimator comes."""
