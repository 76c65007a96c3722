"""How accurate the methods are: on simulated approaches with exact truth, and on recorded frames."""
