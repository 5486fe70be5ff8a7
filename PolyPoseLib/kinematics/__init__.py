"""The motion of bones relative to each other, in joint coordinate systems."""
