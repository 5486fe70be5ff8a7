"""A plan on the CT drawn onto the X-rays of a result."""
