"""From the parameter node to a study, and from a result folder back."""
