"""Cases on which systems are compared, and what a system answers."""
