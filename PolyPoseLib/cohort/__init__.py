"""Cohorts: thousands of studies registered on this machine's cores or on a cluster, by Dask.

A study is a task of a worker, and its registration a process of its own that the worker starts. Out of memory, a crash
in native code, or a study without an end then take that study down and nothing else; its memory goes back to the system
whole, its peak is measured by the system, and what it prints is its log. The price, the start of Python and its
libraries, is a few seconds a study.
"""
