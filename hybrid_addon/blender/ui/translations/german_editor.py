# SPDX-License-Identifier: GPL-3.0-or-later
"""German: words of the Image Editor's tab, of the overlay, of rendering all cameras."""

from __future__ import annotations

EDITOR = {
    # the Image Editor
    "Why Is This Pixel Like This?": "Warum ist dieser Pixel so?",
    "Click a pixel to read its rays: the objects that they hit, and the light that each contributes": (
        "Einen Pixel anklicken: seine Strahlen, was sie trafen und was jeder von ihnen brachte, als Text"
    ),
    "Click a pixel of the picture.  Esc: Cancel": "Einen Pixel des Bildes anklicken.  Esc: Abbrechen",
    "{} more lines: text '{}'": "{} weitere Zeilen: Text '{}'",
    "From the left edge of the frame": "Vom linken Bildrand",
    "From the lower edge of the frame": "Vom unteren Bildrand",
    "Retrace": "Neu verfolgen",
    "Trace the ray traced objects again over the last render; EEVEE draws nothing again": (
        "Die Objekte mit Raytracing über dem letzten Bild neu verfolgen; EEVEE zeichnet nichts neu"
    ),
    "A render is running": "Es wird gerade gerendert",
    "Insets": "Einblendungen",
    "Show mask and traced half as small pictures over the Render Result": (
        "Maske und verfolgte Hälfte als zwei kleine Bilder über dem Renderergebnis"
    ),
    "Picture of the last render that the Image Editor shows": (
        "Was der Bildeditor vom letzten Rendern zeigt, in voller Größe"
    ),
    "Picture": "Bild",
    "The Render Result: both halves, and your compositor nodes": (
        "Das Renderergebnis: beide Hälften und die eigenen Compositor-Nodes"
    ),
    "EEVEE's Half": "EEVEEs Hälfte",
    "What EEVEE drew, times 1 - mask": "Was EEVEE gezeichnet hat, mal 1 - Maske",
    "Traced Half": "Verfolgte Hälfte",
    "What the ray tracer drew, times the mask": "Was der Raytracer gezeichnet hat, mal Maske",
    "Share of each pixel that ray traced objects cover": "Anteil jedes Pixels, den Objekte mit Raytracing bedecken",
    # the Image Editor: slots and the wipe
    "Slot": "Slot",
    "Slot {}": "Slot {}",
    "Slot of the Render Result that Show takes": "Slot des Renderergebnisses, den Zeigen nimmt",
    "Other Slot": "Anderer Slot",
    "What is in another slot of the Render Result: before and after": (
        "Was in einem anderen Slot des Renderergebnisses ist: vorher und nachher"
    ),
    "Wipe": "Teilung",
    "Left of it is what Show names, right of it the Render Result. The line in the picture can be dragged": (
        "Links davon ist, was Zeigen nennt, rechts das Renderergebnis. Die Linie im Bild lässt sich ziehen"
    ),
    # the manual
    "Hybrid Manual": "Hybrid-Handbuch",
    "Open the manual of this add-on in a browser: it lies in the add-on, no network is needed": (
        "Das Handbuch dieses Add-ons im Browser öffnen: es liegt im Add-on, ohne Netz"
    ),
    "The zip has the manual; here it is in docs/manual": "Die Zip-Datei hat das Handbuch; hier liegt es in docs/manual",
    # overlay, cameras
    "Ray Traced Objects": "Objekte mit Raytracing",
    "Color what is ray traced, as an overlay of viewports": "Färben, was Raytracing hat: ein Overlay der Ansichten",
    "Render All Cameras": "Alle Kameras rendern",
    "Render this frame from each camera into a file named after it, in the folder of Output": (
        "Dieses Bild von jeder Kamera in eine Datei mit ihrem Namen rendern, im Ordner der Ausgabe"
    ),
    "Cameras": "Kameras",
    "All": "Alle",
    "Every camera of the scene that is not hidden in renders": "Jede Kamera der Szene, die im Rendering sichtbar ist",
    "Selected": "Ausgewählte",
    "The selected cameras": "Die ausgewählten Kameras",
    "The scene has no camera": "Die Szene hat keine Kamera",
    "No camera is selected": "Keine Kamera ist ausgewählt",
    "Pictures rendered: {}, in {}": "Gerenderte Bilder: {}, in {}",
}
