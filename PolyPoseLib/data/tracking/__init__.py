"""Values of a registration over time: the sequence that goes in, and the poses that come out."""
