"""What a user writes: finger, jaw, target, path, friction. SI units, radians, no numerics."""

from fastncm.scene.description import (
    Finger,
    Friction,
    Jaw,
    Model,
    Path,
    Pose,
    Scene,
    Solver,
    Target,
)
from fastncm.scene.files import TomlFile, read_toml
from fastncm.scene.names import check_name, scene_names, unit_of
from fastncm.scene.shipped import load_scene, shipped_scenes
from fastncm.scene.table import CaseGroup, tabulate

__all__ = [
    "CaseGroup",
    "Finger",
    "Friction",
    "Jaw",
    "Model",
    "Path",
    "Pose",
    "Scene",
    "Solver",
    "Target",
    "TomlFile",
    "check_name",
    "load_scene",
    "read_toml",
    "scene_names",
    "shipped_scenes",
    "tabulate",
    "unit_of",
]
