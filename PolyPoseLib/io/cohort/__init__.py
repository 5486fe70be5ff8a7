"""Files of a cohort: the list or folder of studies, what became of each, and the tables and the page of them all."""
