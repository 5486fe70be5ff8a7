"""Genuine Slicer views drawn off screen by slicer-core's displayable managers, and saved as PNG."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import slicer
import vtk

_SLICE_MANAGERS = (
    "vtkMRMLModelSliceDisplayableManager",
    "vtkMRMLSegmentationsDisplayableManager2D",
    "vtkMRMLMarkupsDisplayableManager",
    "vtkMRMLTransformsDisplayableManager2D",
)
_THREE_D_MANAGERS = (
    "vtkMRMLCameraDisplayableManager",
    "vtkMRMLViewDisplayableManager",
    "vtkMRMLModelDisplayableManager",
    "vtkMRMLSegmentationsDisplayableManager3D",
    "vtkMRMLVolumeRenderingDisplayableManager",
    "vtkMRMLMarkupsDisplayableManager",
    "vtkMRMLTransformsDisplayableManager3D",
)


class _View:
    """One window with one renderer and Slicer's displayable managers."""

    def __init__(self, factory: Any, managers: tuple[str, ...], size: tuple[int, int], style: Any) -> None:
        self.renderer, self.window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetSize(*size)
        self.window.AddRenderer(self.renderer)
        self.interactor = vtk.vtkRenderWindowInteractor()
        self.interactor.SetRenderWindow(self.window)
        self.interactor.SetInteractorStyle(vtk.vtkInteractorStyleUser())
        self.interactor.Initialize()
        factory = factory.GetInstance()
        factory.SetMRMLApplicationLogic(slicer.app.applicationLogic())
        for manager in managers:
            if not factory.IsDisplayableManagerRegistered(manager):
                factory.RegisterDisplayableManager(manager)
        self.group = slicer.vtkMRMLDisplayableManagerGroup()
        self.group.SetRenderer(self.renderer)
        self.group.Initialize(factory, self.renderer)
        # What hands the mouse to the displayable managers, in Slicer's view widgets too.
        self.mouse = style
        self.mouse.SetDisplayableManagers(self.group)
        self.mouse.SetInteractor(self.interactor)

    def move(self, column: float, row: float) -> None:
        """Move the mouse to a place in pixels from the lower left corner."""
        self.window.Render()
        self.interactor.SetEventInformation(round(column), round(row), 0, 0)
        self.interactor.InvokeEvent("MouseMoveEvent")

    def click(self, column: float, row: float) -> None:
        """Move the mouse there and click its left button."""
        self.interactor.InvokeEvent("EnterEvent")
        self.move(column, row)
        self.interactor.InvokeEvent("LeftButtonPressEvent")
        self.interactor.InvokeEvent("LeftButtonReleaseEvent")

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Press the left button at one place and release it at another."""
        self.interactor.InvokeEvent("EnterEvent")
        self.move(*start)
        self.interactor.InvokeEvent("LeftButtonPressEvent")
        self.move(*end)
        self.interactor.InvokeEvent("LeftButtonReleaseEvent")

    def image(self) -> vtk.vtkImageData:
        """Draw, and return the picture."""
        self.window.Render()
        grabber = vtk.vtkWindowToImageFilter()
        grabber.SetInput(self.window)
        grabber.ReadFrontBufferOff()
        grabber.Update()
        return grabber.GetOutput()

    def save(self, path: str | Path) -> Path:
        """Draw, and write a PNG file."""
        writer = vtk.vtkPNGWriter()
        writer.SetFileName(str(path))
        writer.SetInputData(self.image())
        writer.Write()
        return Path(path)


class SliceView(_View):
    """A slice view; `node`, `composite` and `logic` are the real MRML objects."""

    def __init__(
        self, name: str = "Red", orientation: str = "Axial", size: tuple[int, int] = (400, 400)
    ) -> None:
        style = slicer.vtkMRMLSliceViewInteractorStyle()
        super().__init__(slicer.vtkMRMLSliceViewDisplayableManagerFactory, _SLICE_MANAGERS, size, style)
        self.renderer.GetActiveCamera().ParallelProjectionOn()
        application = slicer.app.applicationLogic()
        self.logic = slicer.vtkMRMLSliceLogic()
        self.logic.SetMRMLApplicationLogic(application)
        self.logic.SetMRMLScene(slicer.mrmlScene)
        self.node = slicer.mrmlScene.GetSingletonNode(name, "vtkMRMLSliceNode")
        if self.node is None:
            self.node = self.logic.AddSliceNode(name)
        else:  # a layout has made the node already
            self.logic.SetSliceNode(self.node)
        self.node.SetOrientation(orientation)
        self.composite = self.logic.GetSliceCompositeNode()
        if application.GetSliceLogics() is None:
            application.SetSliceLogics(vtk.vtkCollection())
        application.GetSliceLogics().AddItem(self.logic)
        self.mouse.SetSliceLogic(self.logic)
        self.group.SetMRMLDisplayableNode(self.node)
        self._mapper = vtk.vtkImageMapper()
        self._mapper.SetColorWindow(255)
        self._mapper.SetColorLevel(127.5)
        self._actor = vtk.vtkActor2D()
        self._actor.SetMapper(self._mapper)
        self._actor.GetProperty().SetDisplayLocationToBackground()
        self.logic.ResizeSliceNode(*size)

    def fit(self) -> None:
        """Show the whole background volume."""
        self.logic.FitSliceToBackground()

    def image(self) -> vtk.vtkImageData:
        """Draw, and return the picture."""
        connection = self.logic.GetImageDataConnection()
        self._mapper.SetInputConnection(connection)
        if connection and not self.renderer.HasViewProp(self._actor):
            self.renderer.AddViewProp(self._actor)
        return super().image()

    def close(self) -> None:
        """Take the view out of the application."""
        self.mouse.SetInteractor(None)
        slicer.app.applicationLogic().GetSliceLogics().RemoveItem(self.logic)


class ThreeDView(_View):
    """A 3D view; `node` is the real view node."""

    def __init__(self, name: str = "1", size: tuple[int, int] = (500, 400)) -> None:
        style = slicer.vtkMRMLThreeDViewInteractorStyle()
        super().__init__(slicer.vtkMRMLThreeDViewDisplayableManagerFactory, _THREE_D_MANAGERS, size, style)
        self.logic = slicer.vtkMRMLViewLogic()
        self.logic.SetMRMLApplicationLogic(slicer.app.applicationLogic())
        self.logic.SetMRMLScene(slicer.mrmlScene)
        # A layout may have made the node already.
        self.node = slicer.mrmlScene.GetSingletonNode(name, "vtkMRMLViewNode") or self.logic.AddViewNode(name)
        self.group.SetMRMLDisplayableNode(self.node)

    def look_from(self, direction: tuple[float, float, float] = (0.5, 0.9, 0.2)) -> None:
        """Look at everything from a direction in RAS, superior up."""
        self.window.Render()
        self.renderer.ResetCamera()
        camera = self.renderer.GetActiveCamera()
        focus, distance = camera.GetFocalPoint(), camera.GetDistance()
        camera.SetPosition(*(f + distance * d for f, d in zip(focus, direction, strict=True)))
        camera.SetViewUp(0, 0, 1)
        self.renderer.ResetCamera()
        self.renderer.ResetCameraClippingRange()
