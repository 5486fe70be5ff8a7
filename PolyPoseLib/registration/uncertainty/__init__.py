"""How sure a result is: intervals, local minima, checks."""
