"""A cohort: its studies, how they are registered, and what became of each."""
