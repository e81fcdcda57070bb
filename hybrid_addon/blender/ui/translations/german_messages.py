# SPDX-License-Identifier: GPL-3.0-or-later
"""German: what the tracer and the translator say of a scene. {} stands for names and numbers, in their order."""

from __future__ import annotations

MESSAGES = {
    "{} leaves ray traced objects out: flag what should mirror or refract them, too": (
        "{} lässt Objekte mit Raytracing weg: auch das ankreuzen, was sie spiegeln oder brechen soll"
    ),
    "it shows the world blurred, but no objects: its roughness of {} is not traced (set Rough Samples to 1 or more)": (
        "zeigt die Welt verschwommen, aber keine Objekte: seine Rauheit von {} wird nicht verfolgt (Abtastwerte für "
        "Rauheit auf 1 oder mehr stellen)"
    ),
    "scene {} has no camera: add one and make it the active camera": (
        "Szene {} hat keine Kamera: eine hinzufügen und zur aktiven machen"
    ),
    "scene {} looks through {}, which is no camera but of type {}: choose a camera": (
        "Szene {} blickt durch {}; das ist keine Kamera, sondern vom Typ {}: eine Kamera wählen"
    ),
    "scene {} looks through {}, which is no camera but of type {}; choose a camera": (
        "Szene {} blickt durch {}; das ist keine Kamera, sondern vom Typ {}: eine Kamera wählen"
    ),
    "scene {} renders several views: switch Stereoscopy off (Properties > Output)": (
        "Szene {} rendert mehrere Ansichten: Stereoskopie ausschalten (Eigenschaften > Ausgabe)"
    ),
    "Embree does not load on {}: {}; install this system's zip": (
        "Embree lädt auf {} nicht: {}; die Zip-Datei für dieses System installieren"
    ),
    "the ray tracer failed: {}": "Der Raytracer ist gescheitert: {}",
    "the compositor does not use view layer {}: the ray traced half does not show": (
        "Der Compositor verwendet Ansichtsebene {} nicht: die verfolgte Hälfte ist nicht zu sehen"
    ),
    "Photons light what EEVEE draws, and it draws nothing: use Simple caustics": (
        "Photonen beleuchten, was EEVEE zeichnet, und es zeichnet nichts: einfache Kaustiken nehmen"
    ),
    "EEVEE alone took {} s of the Time Limit of {} s: lower its samples": (
        "EEVEE allein brauchte {} s des Zeitlimits von {} s: seine Abtastwerte verringern"
    ),
    "the Time Limit of {} s cost resolution: raise it, or lower Max Bounces": (
        "Das Zeitlimit von {} s hat Auflösung gekostet: es erhöhen oder die Abprallungen verringern"
    ),
    "Freestyle draws its lines over EEVEE's picture: there are none where the ray tracer draws everything": (
        "Freestyle zeichnet seine Linien über EEVEEs Bild: wo der Raytracer alles zeichnet, gibt es keine"
    ),
    "scene {} is linked from {}: enable Hybrid in that file": (
        "Szene {} ist aus {} verknüpft: Hybrid in jener Datei einschalten"
    ),
    "scene {} belongs to the add-on: choose your own scene": "Szene {} gehört dem Add-on: die eigene Szene wählen",
    "1 object is rough: set Rough Samples to 1 or more to see what rays bring": (
        "1 Objekt ist rau: Abtastwerte für Rauheit auf 1 oder mehr stellen zeigt, was Raytracing bringt"
    ),
    "EEVEE draws the shadows of what is clear black: Traced Shadows let light through, about {} s": (
        "EEVEE zeichnet die Schatten klarer Dinge schwarz: verfolgte Schatten lassen Licht durch, etwa {} s"
    ),
    "{} objects are rough: set Rough Samples to 1 or more to see what rays bring": (
        "{} Objekte sind rau: Abtastwerte für Rauheit auf 1 oder mehr stellen zeigt, was Raytracing bringt"
    ),
    "about {} s": "etwa {} s",
    "about {} min": "etwa {} min",
    "nothing that EEVEE cannot draw": "nichts, was EEVEE nicht zeichnen kann",
    "mirrors what the picture does not show ({} % of its light)": (
        "spiegelt, was das Bild nicht zeigt ({} % seines Lichts)"
    ),
    "mirrors glass or blended materials, which EEVEE leaves out of reflections ({} % of its light)": (
        "spiegelt Glas oder überblendete Materialien, die EEVEE in Spiegelungen weglässt ({} % seines Lichts)"
    ),
    "mirrors other mirrors ({} % of its light)": "spiegelt andere Spiegel ({} % seines Lichts)",
    "has glass behind its glass, which EEVEE leaves out ({} % of its light)": (
        "hat Glas hinter seinem Glas, das EEVEE weglässt ({} % seines Lichts)"
    ),
    "refracts light more than once ({} % of its light)": "bricht Licht mehr als einmal ({} % seines Lichts)",
    "EEVEE's picture": "EEVEEs Bild",
    "Reading EEVEE's picture": "EEVEEs Bild wird gelesen",
    "Translating the scene": "Die Szene wird exportiert",
    "Building": "Der Raytracer wird vorbereitet",
    "Tracing": "Raytracing",
    "Tracing {} %": "Raytracing {} %",
    "Tracing {} %, about {} left": "Raytracing {} %, noch etwa {}",
    "Stopped at {} %": "Abgebrochen bei {} %",
    "Stopped: EEVEE's picture alone": "Abgebrochen: nur EEVEEs Bild",
    "not enough memory for the preview": "Für die Vorschau reicht der Speicher nicht",
    "the preview is off": "Die Vorschau ist aus",
    "switch Scene Lights and Scene World on in Viewport Shading": (
        "In der Viewport-Schattierung Szenenlichter und Szenenwelt einschalten"
    ),
    "{} is being edited: leave its mode": "{} wird bearbeitet: den Modus verlassen",
}
