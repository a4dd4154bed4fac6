"""Input of drivers/plan.py that needs no volume: the text of an operation."""
