"""A small own stand-in for `slicer.parameterNodeWrapper`: the types and widgets that the module uses."""

from __future__ import annotations

import dataclasses
import enum
import json
import sys
import types
import typing
from collections.abc import Callable
from typing import Any

import slicer
import vtk


@dataclasses.dataclass(frozen=True)
class WithinRange:
    """A number's bounds."""

    minimum: float
    maximum: float

    def check(self, value: Any) -> None:
        """Raise ValueError outside of the bounds."""
        if not self.minimum <= value <= self.maximum:
            raise ValueError(f"Value must be within [{self.minimum}, {self.maximum}], is {value}")


@dataclasses.dataclass(frozen=True)
class Default:
    """A parameter's default value."""

    value: Any


class _Serializer:
    """Reads and writes one parameter of a `vtkMRMLScriptedModuleNode`."""

    def __init__(self, name: str, hint: Any, default: Any) -> None:
        self.name, self.hint = name, hint
        self.kind = typing.get_args(hint)[0] if typing.get_origin(hint) is typing.Annotated else hint
        notes = typing.get_args(hint)[1:] if typing.get_origin(hint) is typing.Annotated else ()
        self.checks = [note for note in notes if isinstance(note, WithinRange)]
        given = [note.value for note in notes if isinstance(note, Default)]
        self.default = default if default is not None else (given[0] if given else self._empty())

    @property
    def is_node(self) -> bool:
        return isinstance(self.kind, type) and issubclass(self.kind, slicer.vtkMRMLNode)

    @property
    def is_enum(self) -> bool:
        return isinstance(self.kind, type) and issubclass(self.kind, enum.Enum)

    @property
    def element(self) -> Any:
        return typing.get_args(self.kind)[0] if typing.get_origin(self.kind) is list else None

    def _empty(self) -> Any:
        if self.is_node:
            return None
        if self.is_enum:
            return next(iter(self.kind))
        if self.element is not None:
            return []
        if self.kind not in (str, bool, int, float):
            raise TypeError(f"The harness has no parameter of type {self.hint}")
        return self.kind()

    def write_default(self, node: Any) -> None:
        if not node.HasParameter(self.name):
            self.write(node, self.default)

    def write(self, node: Any, value: Any) -> None:
        self._check(value)
        with slicer.util.NodeModify(node):
            if self.is_node:
                node.SetParameter(self.name, "")
                node.SetNodeReferenceID(self.name, value.GetID() if value else None)
            elif self.element is not None:
                self._write_list(node, value)
            elif self.is_enum:
                node.SetParameter(self.name, value.name)
            else:
                node.SetParameter(self.name, json.dumps(value) if self.kind is not str else value)

    def _write_list(self, node: Any, values: list) -> None:
        for index, value in enumerate(values):
            _Serializer(f"{self.name}.{index}", self.element, None).write(node, value)
        surplus = len(values)
        while node.HasParameter(f"{self.name}.{surplus}"):
            node.UnsetParameter(f"{self.name}.{surplus}")
            node.RemoveNodeReferenceIDs(f"{self.name}.{surplus}")
            surplus += 1
        node.SetParameter(self.name, str(len(values)))

    def read(self, node: Any) -> Any:
        if self.is_node:
            return node.GetNodeReference(self.name)
        text = node.GetParameter(self.name)
        if self.element is not None:
            # A copy: unlike Slicer's, changing it in place changes nothing, so the module must assign lists.
            elements = [_Serializer(f"{self.name}.{i}", self.element, None) for i in range(int(text))]
            return tuple(each.read(node) for each in elements)
        if self.is_enum:
            return self.kind[text]
        return text if self.kind is str else self.kind(json.loads(text))

    def _check(self, value: Any) -> None:
        if self.element is not None:
            if not isinstance(value, list | tuple):
                raise TypeError(f"{self.name} is a list, not {value!r}")
        elif self.is_node:
            if value is not None and not isinstance(value, self.kind):
                raise TypeError(f"{self.name} takes a {self.kind.__name__}, not {value!r}")
        elif not isinstance(value, self.kind) and not (self.kind is float and isinstance(value, int)):
            raise TypeError(f"{self.name} takes a {self.kind.__name__}, not {value!r}")
        for check in self.checks:
            check.check(value)


@dataclasses.dataclass
class _Connector:
    """Joins one widget and one parameter."""

    signal: str
    widget: Any
    read: Callable[[], Any]
    write: Callable[[Any], None]


def _connector(widget: Any, parameter: _Serializer) -> _Connector:
    kind, name = parameter.kind, widget.className()
    if kind is bool and name in ("QCheckBox", "QPushButton"):
        signal, attribute = "toggled(bool)", "checked"
    elif kind is int and name in ("QSpinBox", "QSlider"):
        signal, attribute = "valueChanged(int)", "value"
    elif kind in (int, float) and name in ("QDoubleSpinBox", "ctkSliderWidget", "ctkDoubleSpinBox"):
        signal, attribute = "valueChanged(double)", "value"
        for check in parameter.checks:
            widget.minimum, widget.maximum = check.minimum, check.maximum
    elif kind is str and name == "QLineEdit":
        signal, attribute = "textChanged(QString)", "text"
    elif kind is str and name == "ctkPathLineEdit":
        signal, attribute = "currentPathChanged(QString)", "currentPath"
    elif parameter.is_node and name == "qMRMLNodeComboBox":
        return _Connector(
            "currentNodeChanged(vtkMRMLNode*)", widget, widget.currentNode, widget.setCurrentNode
        )
    elif parameter.is_enum and name == "QComboBox":
        return _enum_connector(widget, list(kind))
    else:
        raise RuntimeError(f"No connector joins a {name} and the parameter {parameter.name}: {kind}")
    return _Connector(
        signal,
        widget,
        lambda: kind(getattr(widget, attribute)),
        lambda value: setattr(widget, attribute, value),
    )


def _enum_connector(widget: Any, members: list[enum.Enum]) -> _Connector:
    widget.clear()
    for member in members:
        widget.addItem(member.label() if hasattr(member, "label") else member.name)
    return _Connector(
        "currentIndexChanged(int)",
        widget,
        lambda: members[widget.currentIndex],
        lambda value: setattr(widget, "currentIndex", members.index(value)),
    )


class _Wrapper:
    """What a wrapped class gains."""

    allParameters: dict[str, _Serializer]

    def __init__(self, parameterNode: Any) -> None:
        self.parameterNode = parameterNode
        self._gui: dict[int, tuple[int, list[tuple[_Connector, Callable]]]] = {}
        self._updating = False
        for parameter in self.allParameters.values():
            parameter.write_default(parameterNode)

    def getValue(self, name: str) -> Any:
        """A parameter's value."""
        return self.allParameters[name].read(self.parameterNode)

    def setValue(self, name: str, value: Any) -> None:
        """Set a parameter."""
        self.allParameters[name].write(self.parameterNode, value)

    def StartModify(self) -> int:
        """Hold back ModifiedEvent."""
        return self.parameterNode.StartModify()

    def EndModify(self, was: int) -> None:
        """Send the held ModifiedEvent."""
        self.parameterNode.EndModify(was)

    def AddObserver(self, event: Any, callback: Callable, priority: float = 0.0) -> int:
        """Observe the node."""
        return self.parameterNode.AddObserver(event, callback, priority)

    def RemoveObserver(self, tag: int) -> None:
        """Stop observing."""
        self.parameterNode.RemoveObserver(tag)

    def Modified(self) -> None:
        """Tell that the node changed."""
        self.parameterNode.Modified()

    def connectGui(self, gui: Any) -> int:
        """Join the widgets that have the property SlicerParameterName with their parameters."""
        joined = []
        for widget in vars(gui).values():
            name = widget.property("SlicerParameterName")
            if name:
                joined.append(self._join(name, widget))
        tag = self.AddObserver(vtk.vtkCommand.ModifiedEvent, lambda *_: self._show(joined))
        key = max(self._gui, default=-1) + 1
        self._gui[key] = (tag, joined)
        return key

    def _join(self, name: str, widget: Any) -> tuple[_Connector, Callable, str]:
        connector = _connector(widget, self.allParameters[name])
        connector.write(self.getValue(name))

        def changed() -> None:
            if not self._updating:
                self.setValue(name, connector.read())

        widget.connect(connector.signal, changed)
        return connector, changed, name

    def _show(self, joined: list) -> None:
        if self._updating:
            return
        self._updating = True
        try:
            for connector, _changed, name in joined:
                connector.write(self.getValue(name))
        finally:
            self._updating = False

    def disconnectGui(self, key: int | None) -> None:
        """Undo `connectGui`."""
        if key not in self._gui:
            return
        tag, joined = self._gui.pop(key)
        self.RemoveObserver(tag)
        for connector, changed, _name in joined:
            connector.widget.disconnect(connector.signal, changed)


def parameterNodeWrapper(cls: type) -> type:
    """Make a class of typed parameters from a class of annotations."""
    hints = typing.get_type_hints(cls, include_extras=True)
    parameters = {name: _Serializer(name, hint, getattr(cls, name, None)) for name, hint in hints.items()}
    members: dict[str, Any] = {
        name: property(
            lambda self, name=name: self.getValue(name),
            lambda self, value, name=name: self.setValue(name, value),
        )
        for name in parameters
    }
    members |= {"allParameters": parameters, "__doc__": cls.__doc__, "__module__": cls.__module__}
    methods = {
        name: value
        for name, value in vars(cls).items()
        if name not in parameters and not name.startswith("__")
    }
    return type(cls.__name__, (_Wrapper,), {**methods, **members})


def install() -> None:
    """Make `slicer.parameterNodeWrapper` importable."""
    module = types.ModuleType("slicer.parameterNodeWrapper", __doc__)
    for each in (parameterNodeWrapper, WithinRange, Default):
        setattr(module, each.__name__, each)
    sys.modules[module.__name__] = slicer.parameterNodeWrapper = module
