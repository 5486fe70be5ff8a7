"""How certain a result is: intervals, local minima, checks."""
