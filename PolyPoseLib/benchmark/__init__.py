"""Benchmarks: every system on every case, a process each, scored against truths that no system sees."""
