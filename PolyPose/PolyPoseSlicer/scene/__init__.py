"""MRML: nodes, frames, views and layouts."""
