"""Files of a benchmark: its data sets, its rows, and the tables and figures made of them."""
