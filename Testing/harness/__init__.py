"""Runs a scripted module's tests without the Slicer application: slicer-core's real MRML, strict stand-ins.

`install()` is all that a test needs. With the folder of Slicer's own Python code (`Base/Python`) the module
runs on Slicer's ScriptedLoadableModule, parameterNodeWrapper, i18n and packaging instead of on the stand-ins.
"""

from __future__ import annotations

from pathlib import Path

_installed = False


def install(slicer_python: str | Path | None = None) -> None:
    """Make `slicer.app`, `slicer.mrmlScene`, `qt`, `ctk` and the rest importable in this process, once."""
    global _installed
    if _installed:
        return
    _installed = True
    import slicer

    from . import application, errors, parameter_node, pythonqt, scripted, ui_loader, widgets

    errors.install()
    qt = pythonqt.install()
    qt.QUiLoader = ui_loader.QUiLoader
    application.install()
    ui_loader.register(widgets.install())
    scripted.install_sample_data()
    if slicer_python:
        folder = Path(slicer_python) / "slicer"
        if not (folder / "ScriptedLoadableModule.py").is_file():
            raise FileNotFoundError(f"{slicer_python} is not Slicer's folder Base/Python")
        slicer.__path__.append(str(folder))
    else:
        scripted.install()
        parameter_node.install()
