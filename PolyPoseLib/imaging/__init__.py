"""CT volumes, bone structures and X-ray images, read from files and validated."""
