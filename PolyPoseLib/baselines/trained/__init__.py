"""What the trained systems of the comparison share: their grid, inputs, training set, training and weights."""
