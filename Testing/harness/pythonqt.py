"""A `qt` module with PythonQt's conventions on PySide6, stricter where PythonQt only prints.

Qt properties are attributes, signals are connected by their C++ signature, a plain Qt object takes no new
attributes, and an unknown signal, property or value raises.
"""

from __future__ import annotations

import contextlib
import ctypes
import inspect
import os
import sys
import types
from collections.abc import Callable, Iterator
from typing import Any

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import shiboken6
from PySide6 import QtCore, QtGui, QtWidgets

from . import errors

_QObject = QtCore.QObject
_native_connect = _QObject.connect
_native_disconnect = _QObject.disconnect
_native_getattribute = _QObject.__getattribute__
_connections: dict[int, list[_Connection]] = {}
_lenient = False

_VIRTUAL = ("sizeHint", "minimumSizeHint")
"""Properties that Qt itself asks a Python class for; reading them as properties there would never end."""


class _Connection:
    """One connected slot, so that it can be found again by signal and receiver."""

    def __init__(self, signal: str, receiver: Callable, slot: Callable, python_signal: str | None) -> None:
        self.signal, self.receiver, self.slot, self.python_signal = signal, receiver, slot, python_signal


class _Property:
    """A Qt property as an attribute of the instances; the class keeps what it had under that name."""

    def __init__(self, meta: QtCore.QMetaProperty, original: object) -> None:
        self.name, self.writable, self.kind = meta.name(), meta.isWritable(), meta.typeName()
        self.original = original

    def __get__(self, instance: Any, owner: type) -> Any:
        if instance is None:
            if hasattr(self.original, "__get__"):
                return self.original.__get__(None, owner)
            return self.original
        if self.name in _VIRTUAL and not type(instance).__module__.startswith("PySide6"):
            return self.original.__get__(instance, owner)()
        return _QObject.property(instance, self.name)

    def __set__(self, instance: Any, value: Any) -> None:
        if not self.writable:
            raise AttributeError(f"Property '{self.name}' of {type(instance).__name__} is read only")
        meta = instance.metaObject()
        if not meta.property(meta.indexOfProperty(self.name)).write(instance, value):
            raise AttributeError(
                f"'{self.name}' of {type(instance).__name__} is a {self.kind} and does not take {value!r}"
            )


def _strict_setattr(self: Any, name: str, value: Any) -> None:
    """Refuse what PythonQt refuses on plain Qt objects: new attributes, values for signals and methods."""
    cls = type(self)
    attribute = None
    for base in cls.__mro__:  # inspect.getattr_static takes ten times as long, and a panel sets thousands
        if name in base.__dict__:
            attribute = base.__dict__[name]
            break
    if isinstance(attribute, QtCore.Signal) and isinstance(value, QtCore.SignalInstance):
        self.__dict__[name] = value  # PySide keeps a bound signal in its object
    elif isinstance(attribute, QtCore.Property):
        value = list(value) if isinstance(value, tuple) else value
        if not _QObject.setProperty(self, name, value):
            raise AttributeError(f"Property '{name}' of {cls.__name__} does not take {value!r}")
    elif attribute is not None and hasattr(type(attribute), "__set__"):
        type(attribute).__set__(attribute, self, value)
    elif cls.__module__.startswith("PySide6") or getattr(cls, "standsForQtClass", False):
        if name.encode() in [bytes(each) for each in self.dynamicPropertyNames()]:
            self.setProperty(name, value)
        elif _lenient:
            return
        elif attribute is not None:
            raise AttributeError(f"'{name}' of {cls.__name__} is a signal or a method and takes no value")
        else:
            raise AttributeError(f"{cls.__name__} has no attribute '{name}' and takes no new ones")
    else:
        self.__dict__[name] = value


@contextlib.contextmanager
def lenient() -> Iterator[None]:
    """Let PySide's own .ui loader, which sets an attribute for each child, do as it likes."""
    global _lenient
    _lenient = True
    try:
        yield
    finally:
        _lenient = False


def set_private(instance: Any, **values: Any) -> None:
    """Set attributes of a stand-in widget behind the strict rule; only for the harness itself."""
    instance.__dict__.update(values)


def _accepted_arguments(function: Callable) -> int | None:
    """How many positional arguments a Python callable takes; None: any number."""
    target, bound = (function.__func__, 1) if inspect.ismethod(function) else (function, 0)
    if not inspect.isfunction(target):
        return None
    code = target.__code__
    return None if code.co_flags & inspect.CO_VARARGS else code.co_argcount - bound


def _collecting(function: Callable) -> Callable:
    """A slot that drops surplus arguments, as PythonQt does, and reports what the function raises."""
    accepted = _accepted_arguments(function)

    def slot(*arguments: Any) -> None:
        try:
            function(*(arguments if accepted is None else arguments[:accepted]))
        except Exception as error:
            errors.report(error)
            sys.__excepthook__(type(error), error, error.__traceback__)

    return slot


def connect(self: Any, signal: str, receiver: Any, slot: str | None = None) -> bool:
    """Connect `signal`, given by its C++ signature, to a callable or to a named slot of an object."""
    function = receiver if slot is None else getattr(receiver, slot.split("(")[0])
    signal = signal.replace(" ", "")
    python_signal = getattr(type(self), "signatures", {}).get(signal)
    wrapped = _collecting(function)
    if python_signal:
        getattr(self, python_signal).connect(wrapped)
    elif self.metaObject().indexOfSignal(signal) >= 0:
        _native_connect(self, QtCore.SIGNAL(signal), wrapped)
    else:
        raise RuntimeError(f"{self.metaObject().className()} has no signal '{signal}'")
    _connections_of(self).append(_Connection(signal, function, wrapped, python_signal))
    return True


def disconnect(self: Any, signal: str, receiver: Callable | None = None) -> bool:
    """Undo `connect`; without a receiver every connection of the signal."""
    signal = signal.replace(" ", "")
    mine = _connections_of(self)
    found = [c for c in mine if c.signal == signal and (receiver is None or c.receiver == receiver)]
    for connection in found:
        mine.remove(connection)
        if connection.python_signal:
            getattr(self, connection.python_signal).disconnect(connection.slot)
        else:
            _native_disconnect(self, QtCore.SIGNAL(signal), connection.slot)
    return bool(found)


def _connections_of(instance: Any) -> list[_Connection]:
    address = shiboken6.getCppPointer(instance)[0]
    if address not in _connections:
        _connections[address] = []
        # The address may be used again: forget the connections with the object.
        _native_connect(instance, QtCore.SIGNAL("destroyed()"), lambda: _connections.pop(address, None))
    return _connections[address]


def _getattribute(self: Any, name: str) -> Any:
    # PySide serves these two ahead of the class's dictionary.
    if name == "connect":
        return types.MethodType(connect, self)
    if name == "disconnect":
        return types.MethodType(disconnect, self)
    return _native_getattribute(self, name)


def _first_of(function: Callable) -> Callable:
    """PythonQt returns the file name alone, PySide a pair."""
    return lambda *arguments, **keywords: function(*arguments, **keywords)[0]


def _apply_conventions(module: types.ModuleType) -> None:
    classes = {each for each in vars(module).values() if inspect.isclass(each) and issubclass(each, _QObject)}
    for cls in classes:
        meta = cls.staticMetaObject
        for index in range(meta.propertyOffset(), meta.propertyCount()):
            prop = meta.property(index)
            original = inspect.getattr_static(cls, prop.name(), None)
            if not isinstance(original, QtCore.Signal | _Property):
                setattr(cls, prop.name(), _Property(prop, original))
        cls.__setattr__ = _strict_setattr
    _QObject.__getattribute__ = _getattribute
    _QObject.name = property(
        lambda self: self.objectName, lambda self, value: setattr(self, "objectName", value)
    )
    _QObject.className = lambda self: self.metaObject().className()
    for dialog in (QtWidgets.QDialog, QtWidgets.QMenu):
        dialog.exec_ = dialog.exec
    for name in ("getOpenFileName", "getSaveFileName", "getOpenFileNames"):
        setattr(QtWidgets.QFileDialog, name, staticmethod(_first_of(getattr(QtWidgets.QFileDialog, name))))


def _outlive_lost_references() -> None:
    """PySide loses references to True, False and None with each signal and property; 3.12 made them immortal."""
    if sys.version_info < (3, 12):
        for value in (True, False, None):
            ctypes.c_ssize_t.from_address(id(value)).value += 1 << 40


def install() -> types.ModuleType:
    """Make `import qt` work in this process and return the module."""
    _outlive_lost_references()
    module = types.ModuleType("qt", __doc__)
    for source in (QtCore, QtGui, QtWidgets):
        for name in dir(source):
            if name.startswith("Q"):
                setattr(module, name, getattr(source, name))
    for name in ("Signal", "Slot", "Property", "SIGNAL", "SLOT"):
        setattr(module, name, getattr(QtCore, name))
    application = QtWidgets.QApplication.instance() or QtWidgets.QApplication(["Slicer"])
    application.setQuitOnLastWindowClosed(False)
    _apply_conventions(module)
    sys.modules["qt"] = module
    return module
