"""Child processes: registration, camera search, live rendering."""
