"""Slicer's own classes have no type stubs: whatever is taken from them is Any."""

from typing import Any

def __getattr__(name: str) -> Any: ...
