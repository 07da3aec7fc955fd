"""The deck of a model: CalculiX's input as text."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .model import SLICE, Model

STICK = 10.0
"""Slope of the shear traction over sticking slip, in parts of the penalty."""
TOLERANCE = 1e-4
"""Largest residual of a converged increment, in parts of the mean force (CalculiX: 5e-3)."""
SMALLEST = 1e-6
"""Increment at which CalculiX gives up, in parts of the first one."""


@dataclass(frozen=True)
class Increments:
    """Of the model's time. CalculiX goes from the first to the largest, and back where it must."""

    first: float
    largest: float


def deck(model: Model, mu: float, increments: Increments) -> str:
    """CalculiX's input for the model's path."""
    lines = *_mesh(model), *_contact(model, mu), *_path(model, increments)
    return "\n".join(lines) + "\n"


def _mesh(model: Model) -> Iterator[str]:
    yield "*NODE, NSET=NALL"
    yield from (f"{i}, {x:.12g}, {y:.12g}, 0." for i, (x, y) in enumerate(model.nodes, 1))
    for (name, elements), begin in zip(model.parts.items(), _begins(model), strict=False):
        yield f"*ELEMENT, TYPE=CPS8R, ELSET={name}"
        for number, element in enumerate(elements, begin):
            yield f"{number}, " + ", ".join(str(node + 1) for node in element)
        yield f"*SOLID SECTION, ELSET={name}, MATERIAL={model.materials[name][0]}"
        yield f"{SLICE}"
    for name, cards in dict(model.materials.values()).items():
        yield f"*MATERIAL, NAME={name}"
        yield cards
    yield "*NSET, NSET=CLAMP"
    yield from (f"{node + 1}," for node in model.clamp)


def _contact(model: Model, mu: float) -> Iterator[str]:
    begins = dict(zip(model.parts, _begins(model), strict=False))
    for name, faces in model.surfaces.items():
        yield f"*SURFACE, NAME={name}, TYPE=ELEMENT"
        yield from (f"{begins[part] + element}, S{face}" for part, element, face in faces)
    yield "*SURFACE INTERACTION, NAME=TOUCH"
    yield "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR"
    yield f"{model.stiffness:g}"
    if mu > 0.0:
        yield "*FRICTION"
        yield f"{mu:g}, {STICK * model.stiffness:g}"
    for slave, master in model.pairs:
        yield "*CONTACT PAIR, INTERACTION=TOUCH, TYPE=NODE TO SURFACE"
        yield f"{slave}, {master}"


def _path(model: Model, increments: Increments) -> Iterator[str]:
    """One step for the whole path, since CalculiX extrapolates within a step only."""
    for number, table in enumerate(model.motions):
        yield f"*AMPLITUDE, NAME=MOTION{number}"
        yield from (f"{time:.12g}, {value:.12g}" for time, value in table)
    yield "*TIME POINTS, NAME=POSITIONS"
    yield from (f"{time:.12g}," for time in model.times)
    first, largest = increments.first, increments.largest
    yield "*STEP, NLGEOM, INC=100000"
    yield "*STATIC"
    yield f"{first:g}, {model.times[-1]:.12g}, {SMALLEST * first:g}, {largest:g}"
    yield "*CONTROLS, PARAMETERS=FIELD"
    yield f"{TOLERANCE:g}, {TOLERANCE:g}"
    for node, direction, number in model.driven:
        yield f"*BOUNDARY, AMPLITUDE=MOTION{number}"
        yield f"{node + 1}, {direction}, {direction}, 1."
    yield "*NODE PRINT, NSET=CLAMP, TOTALS=ONLY, TIME POINTS=POSITIONS"
    yield "RF"
    yield "*END STEP"


def _begins(model: Model) -> np.ndarray:
    """Number of the first element of each part, and one more than the last one's."""
    return np.cumsum([1, *(len(elements) for elements in model.parts.values())])
