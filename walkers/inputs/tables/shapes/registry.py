"""The shapes that a case file can name.

A new shape is a module in this folder and an entry here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

from walkers.inputs.tables.shapes.box import BoxShape
from walkers.inputs.tables.shapes.channel import ChannelShape
from walkers.inputs.tables.shapes.cylinder import CylinderShape
from walkers.inputs.tables.shapes.groove import GrooveShape
from walkers.inputs.tables.shapes.octagon import OctagonShape
from walkers.inputs.tables.shapes.plane import PlaneShape
from walkers.inputs.tables.shapes.shape import Shape
from walkers.inputs.tables.shapes.vessel import VesselShape

_CLASSES: tuple[type[Shape], ...] = (
    PlaneShape,
    ChannelShape,
    GrooveShape,
    BoxShape,
    CylinderShape,
    OctagonShape,
    VesselShape,
)
SHAPES: Mapping[str, type[Shape]] = {shape.name: shape for shape in _CLASSES}
"""The classes of shapes by their names."""

if TYPE_CHECKING:
    ShapeName = str
else:
    ShapeName = Literal[tuple(SHAPES)]
    """A name of a shape."""
