"""The panel's sections and widgets."""
