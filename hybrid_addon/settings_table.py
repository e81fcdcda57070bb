# SPDX-License-Identifier: GPL-3.0-or-later
"""Every setting of a scene, once. Properties, flags, the Python interface and the report are made from these rows.

A new setting is a row here, the code that reads it, and its translation (docs/developer/extending.md).
"""

from __future__ import annotations

import operator
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Literal

Kind = Literal["BOOL", "INT", "FLOAT", "ENUM", "FLAGS"]
Group = Literal["SURFACE", "SWITCH", "MODE", "QUALITY", "LIGHT", "MACHINE", "PASSES", "VIEWPORT", "EDITOR"]

RENDER_GROUPS = {"MODE", "QUALITY", "LIGHT", "MACHINE"}
"""Groups whose settings are flags of `hybrid render`, keywords of `render(...)` and keys of the report's settings."""

LARGEST = 3.4028234663852886e38
"""Of single precision, in which Blender holds numbers: the end of a range that has no other."""

LARGEST_FLAG = 1e6
"""What a flag takes at most, where the property has no end."""


@dataclass(frozen=True)
class Choice:
    """One item of an enumeration. number: what files hold; None: its place in the row, from 0."""

    key: str
    label: str
    description: str
    number: int | None = None


@dataclass(frozen=True)
class Setting:
    """One setting: what a person sees of it, what it may be, and who hears of a change.

    name        : of the property, of the keyword, and with dashes of the flag; it is saved in files, so it stays.
    kind        : ENUM is one of `choices`, FLAGS a set of them.
    default     : as Blender's property takes it: a bool, int, float, key or set of keys.
    label, description : in the interface, to be translated (blender/ui/translations); the manual quotes them.
    group       : what it is about; see RENDER_GROUPS.
    low, high   : the range, None for no end; soft_low, soft_high: what a slider reaches.
    step, precision, unit, subtype : as in `bpy.props.FloatProperty`.
    on          : of a number whose 0 means off: what it becomes when it is switched on, unless its default is not 0.
    tick        : of an ENUM that was a BOOL once: the keys that False and True still stand for.
    flag        : what `--help` says of the flag, of groups that have one.
    changes     : what is brought up to date when it changes (blender/ui/properties.py), "" for nothing.
    animatable  : whether it may differ from frame to frame.
    """

    name: str
    kind: Kind
    default: bool | int | float | str | frozenset[str]
    label: str
    description: str
    group: Group
    low: float | None = None
    high: float | None = None
    soft_low: float | None = None
    soft_high: float | None = None
    step: int | None = None
    precision: int | None = None
    unit: str | None = None
    subtype: str | None = None
    choices: tuple[Choice, ...] = ()
    on: float | None = None
    tick: tuple[str, str] | None = None
    flag: str = ""
    changes: Literal["", "SURFACE", "SWITCH", "SCENE", "PASSES", "PREVIEW", "EDITOR"] = ""
    animatable: bool = True

    @property
    def keys(self) -> tuple[str, ...]:
        """Of its choices."""
        return tuple(choice.key for choice in self.choices)

    @property
    def bounds(self) -> tuple[float, float]:
        """The range of a number."""
        return (-LARGEST if self.low is None else self.low, LARGEST if self.high is None else self.high)

    def checked(self, value: Any) -> Any:
        """The value as the property takes it; ValueError, one line for people, if it cannot be."""
        if self.kind in {"INT", "FLOAT"}:
            low, high = self.bounds
            try:
                number = operator.index(value) if self.kind == "INT" else float(value)
            except (TypeError, ValueError):
                whole = "whole " if self.kind == "INT" else ""
                raise ValueError(f"{self.name} is {value!r}: it must be a {whole}number") from None
            if not low <= number <= high:  # also refuses NaN
                raise ValueError(f"{self.name} is {value}: it must lie between {low:g} and {high:g}")
            return number
        if self.kind == "BOOL":
            if isinstance(value, str) or value not in (False, True):
                raise ValueError(f"{self.name} is {value!r}: it must be True or False")
            return bool(value)
        if self.kind == "FLAGS":
            keys = {str(key).upper() for key in value}
            if not keys <= set(self.keys):
                raise ValueError(f"{self.name} is {value!r}: it must be some of {', '.join(self.keys).lower()}")
            return keys
        if self.tick and isinstance(value, bool):
            return self.tick[value]
        key = str(value).upper()
        if key not in self.keys:
            raise ValueError(f"{self.name} is {key!r}: it must be one of {', '.join(self.keys).lower()}")
        return key


SURFACE = (
    Setting(
        "reflectivity", "FLOAT", 0.0, "Reflectivity", "Share of the light that is mirrored: 0 none, 1 a perfect mirror",
        group="SURFACE", low=0.0, high=1.0, subtype="FACTOR", flag="of the ray traced objects, 0..1",
        changes="SURFACE",
    ),
    Setting(
        "opacity", "FLOAT", 1.0, "Opacity", "1 is solid; below 1 the rest of the light passes through, bent by the IOR",
        group="SURFACE", low=0.0, high=1.0, subtype="FACTOR", flag="of the ray traced objects, 0..1",
        changes="SURFACE",
    ),
    Setting(
        "ior", "FLOAT", 1.5, "IOR",
        "Index of refraction: water 1.33, glass 1.5, diamond 2.42. Type a value below 1 for a bubble",
        group="SURFACE", low=1e-6, high=1e6, soft_low=1.0, soft_high=3.0, precision=3,
        flag="of the ray traced objects", changes="SURFACE",
    ),
    Setting(
        "dispersion", "FLOAT", 0.0, "Dispersion",
        "How much glass splits white light into colors: 20 / Abbe number, as in glTF. Crown glass 0.34, flint glass "
        "0.55, diamond 0.36; 0 splits none",
        group="SURFACE", low=0.0, high=100.0, soft_high=2.0, precision=3, flag="of the ray traced objects",
    ),
)  # fmt: skip
"""The values that an object or a material may have of its own. Dispersion counts beside the materials' nodes, too."""

SCENE = (
    Setting(
        "enabled", "BOOL", False, "Hybrid",
        "Draw the ray traced objects of this scene with the ray tracer, composited into EEVEE's picture",
        group="SWITCH", changes="SWITCH",
    ),
    Setting(
        "mode", "ENUM", "HYBRID", "Trace", "What the ray tracer draws",
        choices=(
            Choice("HYBRID", "Chosen Objects", "EEVEE draws the scene, the ray tracer draws the ray traced objects"),
            Choice("RASTER", "Nothing", "EEVEE draws everything, as if the add-on were off"),
            Choice("FULL", "Everything", "The ray tracer draws every pixel; EEVEE is not used"),
        ),
        group="MODE", flag="default: the file's own", changes="SCENE",
    ),
    Setting(
        "samples", "INT", 16, "Samples", "Samples of each ray traced pixel; 1 is no anti-aliasing",
        group="QUALITY", low=1, high=65536, soft_high=256, flag="samples of each ray traced pixel",
    ),
    Setting(
        "max_depth", "INT", 32, "Max Bounces", "The most reflections and refractions of a ray",
        group="QUALITY", low=0, high=1024, soft_high=64, flag="bounces",
    ),
    Setting(
        "cutoff", "FLOAT", 1 / 255, "Min Light",
        "Skip rays that contribute less than this share of a sample; 0 traces every ray",
        group="QUALITY", low=0.0, high=1.0, soft_high=0.1, precision=4,
        flag="skip rays below this share of a sample",
    ),
    Setting(
        "adaptive", "FLOAT", 0.05, "Noise Threshold",
        "Stop sampling a pixel when its contrast falls below this; 0 is off",
        group="QUALITY", low=0.0, high=0.99, soft_high=0.2, precision=3, on=0.05,
        flag="contrast; 0: all samples everywhere",
    ),
    Setting(
        "denoise", "BOOL", False, "Denoise",
        "Denoise what is random, and nothing else: light of rough surfaces, soft shadows, occlusion, fog, lens blur",
        group="QUALITY", flag="denoise rough reflections, soft shadows and other random light, nothing else",
    ),
    Setting(
        "time_budget", "FLOAT", 0.0, "Time Limit",
        "Seconds for a frame, EEVEE included. If they are short, samples go first; 0 is no limit",
        group="QUALITY", low=0.0, soft_high=3600.0, step=100, unit="TIME_ABSOLUTE", on=60.0,
        flag="for a frame, EEVEE included; samples go first; 0: no limit",
    ),
    Setting(
        "shadow_samples", "INT", 1, "Shadow Samples",
        "Shadow rays to each light that has a size, per sample; 0 is hard shadows",
        group="QUALITY", low=0, high=1024, soft_high=16, flag="0: hard shadows",
    ),
    Setting(
        "rough_samples", "INT", 1, "Rough Samples",
        "Rays per reflection and refraction of rough surfaces; 0 shows the blurred world, no objects",
        group="QUALITY", low=0, high=64, soft_high=16, flag="0: the world's blurred image",
    ),
    Setting(
        "occlusion_samples", "INT", 0, "Occlusion Samples",
        "Ambient occlusion rays per hit; 0 is off, as in EEVEE",
        group="LIGHT", low=0, high=64, soft_high=16, flag="0: no ambient occlusion",
    ),
    Setting(
        "occlusion_distance", "FLOAT", 0.0, "Occlusion Distance",
        "Objects farther away do not occlude; 0 takes the distance of EEVEE's Fast GI, if it has one",
        group="LIGHT", low=0.0, soft_high=100.0, unit="LENGTH", flag="0: as EEVEE's Fast GI",
    ),
    Setting(
        "traced_shadows", "ENUM", "AUTO", "Traced Shadows",
        "Trace the shadows of ray traced objects on what EEVEE draws: glass lets light through",
        choices=(
            Choice("AUTO", "Automatic", "On where a ray traced object lets light through, and with Caustics", 2),
            Choice("OFF", "Off", "EEVEE draws them: dark, whatever the object is made of", 0),
            Choice("ON", "On", "The ray tracer draws them all", 1),  # 0 and 1: a tick, in older files
        ),
        group="LIGHT", tick=("OFF", "ON"),
        flag="who draws the shadows of ray traced objects on what EEVEE draws: on, the ray tracer; off, EEVEE",
        changes="SCENE",
    ),
    Setting(
        "caustics", "ENUM", "NONE", "Caustics", "Light that ray traced objects focus; needs Traced Shadows",
        choices=(
            Choice("NONE", "None", "Light goes straight through: even shadows"),
            Choice(
                "SIMPLE", "Simple",
                "Brighten the middle of shadows by angle and IOR: a guess for round bodies, no rays",
            ),
            Choice("PHOTONS", "Photons", "Trace photons from the lights through the objects"),
        ),
        group="LIGHT", flag="of traced shadows", changes="SCENE",
    ),
    Setting(
        "photons", "INT", 1_000_000, "Photons", "Photons for the caustics of a frame: more make them less grainy",
        group="LIGHT", low=1, high=2_000_000_000, soft_high=100_000_000, flag="for caustics by photons",
    ),
    Setting(
        "raster_backed", "BOOL", True, "Use EEVEE Pixels in Reflections",
        "Reflections and refractions reuse EEVEE's own pixels of matte surfaces, and of unsupported nodes",
        group="LIGHT", flag="reuse EEVEE's own pixels in reflections where they are known, or shade everything there",
        changes="SCENE",
    ),
    Setting(
        "light_falloff", "ENUM", "EEVEE", "Light Falloff",
        "How far lights reach in the ray traced objects and in what they reflect",
        choices=(
            Choice("EEVEE", "As EEVEE", "Fade lights out at the distance where EEVEE does, so that both halves agree"),
            Choice("PHYSICAL", "Physical", "Inverse square without an end, as Cycles has it"),
        ),
        group="LIGHT", flag="default: the file's own",
    ),
    Setting(
        "passes", "FLAGS", frozenset(), "Passes", "Passes of the ray traced objects for the compositor",
        choices=(
            Choice("DEPTH", "Depth", "Distance along the view axis; 1e10 where no ray traced object is", 1),
            Choice("NORMAL", "Normal", "Normal in world space, at pixel centers as depth is", 2),
            Choice("SAMPLES", "Samples", "Camera rays of each pixel", 4),
            Choice(
                "SHADOW", "Shadow", "Share of the light that traced shadows leave on EEVEE's half; 1 is no shadow", 8,
            ),
            Choice("REFLECTION", "Reflection", "Light that the first surface mirrors", 16),
            Choice("REFRACTION", "Refraction", "Light that comes through the first surface", 32),
            Choice(
                "RASTER_BACKED", "Raster-Backed", "Share of the light that comes from EEVEE's own pixels", 64,
            ),
            Choice("RESIDUAL", "Residual", "Share of the light that was cut off; the node always has it", 128),
        ),
        group="PASSES", changes="PASSES",
    ),
    Setting(
        "threads", "INT", 0, "Threads", "Processor threads for the ray tracer; 0 uses all",
        group="MACHINE", low=0, high=1024, flag="0: all cores",
    ),
    Setting(
        "preview", "BOOL", False, "Ray Traced Preview",
        "Trace the ray traced objects in rendered viewports as soon as the view rests",
        group="VIEWPORT", changes="PREVIEW", animatable=False,
    ),
    Setting(
        "preview_budget", "FLOAT", 0.0, "Preview Time Limit",
        "Seconds to refine a viewport at rest; 0 goes on until all Samples are taken",
        group="VIEWPORT", low=0.0, high=3600.0, soft_high=60.0, subtype="TIME_ABSOLUTE", changes="PREVIEW",
        on=3.0, animatable=False,
    ),
    Setting(
        "tint", "BOOL", False, "Ray Traced Objects",
        "Color what is ray traced, as an overlay of viewports",
        group="VIEWPORT", changes="PREVIEW", animatable=False,
    ),
    Setting(
        "insets", "BOOL", False, "Insets", "Show mask and traced half as small pictures over the Render Result",
        group="EDITOR", changes="EDITOR", animatable=False,
    ),
    Setting(
        "shown", "ENUM", "PICTURE", "Show", "Picture of the last render that the Image Editor shows",
        choices=(
            Choice("PICTURE", "Picture", "The Render Result: both halves, and your compositor nodes"),
            Choice("RASTER", "EEVEE's Half", "What EEVEE drew, times 1 - mask"),
            Choice("TRACED", "Traced Half", "What the ray tracer drew, times the mask"),
            Choice("MASK", "Mask", "Share of each pixel that ray traced objects cover"),
            Choice("SLOT", "Other Slot", "What is in another slot of the Render Result: before and after"),
        ),
        group="EDITOR", changes="EDITOR", animatable=False,
    ),
    Setting(
        "compare_slot", "INT", 1, "Slot", "Slot of the Render Result that Show takes",
        group="EDITOR", low=1, high=64, soft_high=8, changes="EDITOR", animatable=False,
    ),
    Setting(
        "wipe", "FLOAT", 1.0, "Wipe",
        "Left of it is what Show names, right of it the Render Result. The line in the picture can be dragged",
        group="EDITOR", low=0.0, high=1.0, subtype="FACTOR", changes="EDITOR", animatable=False,
    ),
)  # fmt: skip
"""`Scene.hybrid`, in the order of the properties."""

RENDER = tuple(setting for setting in SCENE if setting.group in RENDER_GROUPS)
"""What a render can be given: as a flag, or as a keyword of `render(...)`."""

RETRACE = tuple(setting for setting in RENDER if setting.group != "MODE")
"""What may be given to a retrace, too: all but who draws what."""

BY_NAME = {setting.name: setting for setting in (*SURFACE, *SCENE)}


def checked(settings: Collection[Setting], values: Mapping[str, Any], caller: str) -> dict[str, Any]:
    """The values that are not None, as the properties take them.

    settings: those that `caller`, which is named in errors, can be given. Raises TypeError for a name that is not among
    them, ValueError for a value that cannot be; one line each.
    """
    known = {setting.name: setting for setting in settings}
    for name in values.keys() - known.keys():
        close = get_close_matches(name, known, n=1)
        raise TypeError(f"{caller} has no setting {name!r}" + (f"; did you mean {close[0]!r}?" if close else ""))
    return {name: known[name].checked(value) for name, value in values.items() if value is not None}


def described(settings: Collection[Setting]) -> str:
    """What there is, a line each: name, values, description; for `help()`."""
    lines = []
    for setting in settings:
        values = " ".join(setting.keys).lower() or "True False"
        if setting.kind in {"INT", "FLOAT"}:
            values = f"{setting.bounds[0]:g} to {setting.bounds[1]:g}" if setting.high else f"from {setting.low:g}"
        lines.append(f"    {setting.name} ({values}): {setting.description}")
    return "\n".join(lines)
