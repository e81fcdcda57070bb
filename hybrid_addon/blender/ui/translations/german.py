# SPDX-License-Identifier: GPL-3.0-or-later
"""German: English words of the interface -> German ones. Words beside fields are short: see `layout.field`."""

from __future__ import annotations

GERMAN = {
    # objects, materials, collections
    "Ray Traced": "Mit Raytracing",
    "Draw this object with the ray tracer; EEVEE draws everything else": (
        "Dieses Objekt vom Raytracer zeichnen lassen; EEVEE zeichnet alles andere"
    ),
    "Draw all objects in this collection, in those below it, and its instances with the ray tracer": (
        "Alle Objekte dieser Sammlung, der darunter liegenden und ihre Instanzen vom Raytracer zeichnen lassen"
    ),
    "Surface": "Oberfläche",
    "Where reflectivity, opacity and IOR come from": "Woher Reflexion, Deckkraft und IOR kommen",
    "Where reflectivity, opacity and IOR of this material come from": (
        "Woher Reflexion, Deckkraft und IOR dieses Materials kommen"
    ),
    "From Material": "Vom Material",
    "Read them from the object's materials (metallic, transmission, alpha, IOR)": (
        "Aus den Materialien des Objekts lesen (Metallisch, Transmission, Alpha, IOR)"
    ),
    "From Nodes": "Von den Nodes",
    "Read them from the shader nodes (metallic, transmission, alpha, IOR)": (
        "Aus den Shader-Nodes lesen (Metallisch, Transmission, Alpha, IOR)"
    ),
    "Custom": "Eigene Werte",
    "Use the values below instead of the materials'": "Die Werte darunter statt derer der Materialien verwenden",
    "Use the values below instead of the nodes'; an object's own Custom wins over them": (
        "Die Werte darunter statt derer der Nodes verwenden; eigene Werte des Objekts gehen vor"
    ),
    "Reflectivity": "Reflexion",
    "Share of the light that is mirrored: 0 none, 1 a perfect mirror": (
        "Anteil des Lichts, der gespiegelt wird: 0 keiner, 1 ein vollkommener Spiegel"
    ),
    "Opacity": "Deckkraft",
    "1 is solid; below 1 the rest of the light passes through, bent by the IOR": (
        "1 ist undurchsichtig; darunter geht der Rest des Lichts hindurch, gebrochen nach dem IOR"
    ),
    "Index of refraction: water 1.33, glass 1.5, diamond 2.42. Type a value below 1 for a bubble": (
        "Brechungsindex: Wasser 1,33, Glas 1,5, Diamant 2,42. Für eine Blase einen Wert unter 1 eintippen"
    ),
    "Dispersion": "Dispersion",
    "Surface Program": "Programm",
    "A registered function that answers for this object instead of its material": (
        "Eine registrierte Funktion, die für die Oberfläche dieses Objekts statt seines Materials antwortet"
    ),
    "A registered function that answers for what wears this material; an object's own wins over it": (
        "Eine registrierte Funktion, die für alles mit diesem Material antwortet; die des Objekts geht vor"
    ),
    "How much glass splits white light into colors: 20 / Abbe number, as in glTF. Crown glass 0.34, flint glass 0.55, "
    "diamond 0.36; 0 splits none": (
        "Wie stark Glas weißes Licht in Farben zerlegt: 20 / Abbe-Zahl, wie in glTF. Kronglas 0,34, Flintglas 0,55, "
        "Diamant 0,36; 0 zerlegt keines"
    ),
    "Ray traced by its collection": "Raytracing durch die Sammlung",
    "Make all suggested objects and materials ray traced": "Raytracing für alles, was vorgeschlagen ist",
    "Some of its materials are ray traced": "Einige seiner Materialien haben Raytracing",
    "Only some of its materials need rays: {}": "Nur einige seiner Materialien brauchen Strahlen: {}",
    "Drawn as Perspective, as EEVEE draws it": "Wird perspektivisch gezeichnet, wie von EEVEE",
    "Hybrid is off in this scene": "Hybrid ist in dieser Szene aus",
    "Switch On": "Einschalten",
    "The object's own Custom values are used": "Es gelten die eigenen Werte des Objekts",
    # presets, menus, operators
    "Surface Preset": "Oberflächenvorgabe",
    "Surface Presets": "Oberflächenvorgaben",
    "Make the selected objects ray traced, with a common material in their active slot": (
        "Raytracing für die ausgewählten Objekte, mit einem gängigen Material im aktiven Slot"
    ),
    "Mirror": "Spiegel",
    "Glass": "Glas",
    "Water": "Wasser",
    "Diamond": "Diamant",
    "Diamond: IOR 2.417, and its fire (Abbe number 55)": "Diamant: IOR 2,417, und sein Feuer (Abbe-Zahl 55)",
    "Quality Preset": "Qualitätsvorgabe",
    "Quality Presets": "Qualitätsvorgaben",
    "Set everything that makes the picture better or faster together": (
        "Alles zusammen setzen, was das Bild besser oder schneller macht"
    ),
    "Draft": "Entwurf",
    "To look at: edges are a little rough": "Zum Ansehen: Kanten sind etwas rau",
    "Final": "Endgültig",
    "To deliver: no difference to see": "Zum Abgeben: kein Unterschied zu sehen",
    "Reference": "Referenz",
    "To measure against: nothing is left to chance": "Zum Vergleichen: nichts bleibt dem Zufall überlassen",
    "Set Ray Traced": "Raytracing setzen",
    "Clear Ray Traced": "Raytracing aufheben",
    "Draw the selected objects with the ray tracer, or with EEVEE again": (
        "Die ausgewählten Objekte vom Raytracer zeichnen lassen oder wieder von EEVEE"
    ),
    "Clear All Ray Traced": "Alles Raytracing aufheben",
    "Let EEVEE draw every object of this scene again: clears the ticks of objects and collections": (
        "EEVEE wieder alle Objekte der Szene zeichnen lassen: löscht die Häkchen von Objekten und Sammlungen"
    ),
    "Copy Hybrid to Selected": "Hybrid auf Auswahl kopieren",
    "Give the selected objects the active object's tick, surface and values": (
        "Den ausgewählten Objekten Häkchen, Oberfläche und Werte des aktiven Objekts geben"
    ),
    "Select All Ray Traced": "Alle mit Raytracing auswählen",
    "Select all objects that are ray traced, by themselves or by a collection": (
        "Alle Objekte mit Raytracing auswählen, durch sich selbst oder durch eine Sammlung"
    ),
    "Toggle Ray Traced Collection": "Raytracing der Sammlung umschalten",
    "Ray trace all objects of the active collection, or stop it": (
        "Raytracing für alle Objekte der aktiven Sammlung oder durch sie für keines"
    ),
    "Select an object with a surface": "Ein Objekt mit einer Oberfläche auswählen",
    "Select objects to copy to, and last the one to copy from": (
        "Die Zielobjekte auswählen und zuletzt das, von dem kopiert wird"
    ),
    "{} of the selected have no surface or are linked: left as they are": (
        "{} der ausgewählten haben keine Oberfläche oder sind verknüpft: sie bleiben, wie sie sind"
    ),
    "{} objects are ray traced": "{} Objekte mit Raytracing",
    "1 object is ray traced": "1 Objekt mit Raytracing",
    "{}: all its objects are ray traced": "{}: Raytracing für alle ihre Objekte",
    "{}: its objects follow their own ticks": "{}: für ihre Objekte gelten deren Häkchen",
    # the scene
    "Draw the ray traced objects of this scene with the ray tracer, composited into EEVEE's picture": (
        "Die Objekte dieser Szene mit Raytracing vom Raytracer zeichnen lassen und in EEVEEs Bild einsetzen"
    ),
    "Trace": "Verfolgen",
    "What the ray tracer draws": "Was der Raytracer zeichnet",
    "Chosen Objects": "Gewählte Objekte",
    "EEVEE draws the scene, the ray tracer draws the ray traced objects": (
        "EEVEE zeichnet die Szene, der Raytracer die Objekte mit Raytracing"
    ),
    "Nothing": "Nichts",
    "EEVEE draws everything, as if the add-on were off": "EEVEE zeichnet alles, als wäre das Add-on aus",
    "Everything": "Alles",
    "The ray tracer draws every pixel; EEVEE is not used": "Der Raytracer zeichnet jeden Pixel, ohne EEVEE",
    "Samples of each ray traced pixel; 1 is no anti-aliasing": (
        "Strahlen durch jeden Pixel mit Raytracing (Supersampling). 1 schaltet es aus"
    ),
    "Max Bounces": "Max. Abprallungen",
    "The most reflections and refractions of a ray": (
        "Wie oft ein Strahl nach der Kamera reflektiert oder gebrochen werden darf"
    ),
    "Noise Threshold": "Rauschschwelle",
    "Stop sampling a pixel when its contrast falls below this; 0 is off": (
        "Pixel enden früh, wo Objekte, Wege und, bis auf diesen Kontrast, Farben übereinstimmen; 0 ist aus"
    ),
    "Min Light": "Mindestlicht",
    "Skip rays that contribute less than this share of a sample; 0 traces every ray": (
        "Anteil seines Lichts, den ein Abtastwert an Strahlen verlieren darf, die wenig brächten; 0 folgt jedem Strahl"
    ),
    "Time Limit": "Zeitlimit",
    "Seconds for a frame, EEVEE included. If they are short, samples go first; 0 is no limit": (
        "Sekunden für ein Bild samt EEVEE; was nicht hineinpasst, entfällt, Abtastwerte zuerst. 0 ist ohne Grenze"
    ),
    "Denoise": "Entrauschen",
    "Denoise what is random, and nothing else: light of rough surfaces, soft shadows, occlusion, fog, lens blur": (
        "Entrauscht nur Zufälliges: Licht von Rauem, weiche Schatten, Verdeckung, Nebel, Unschärfe der Linse"
    ),
    "Rough Samples": "Abtastwerte für Rauheit",
    "Rays per reflection and refraction of rough surfaces; 0 shows the blurred world, no objects": (
        "Strahlen für jede Spiegelung und Brechung von Rauem; 0 zeigt dort die Welt verschwommen, und keine Objekte"
    ),
    "Occlusion Samples": "Abtastwerte für Verdeckung",
    "Ambient occlusion rays per hit; 0 is off, as in EEVEE": (
        "Strahlen, die finden, wie viel vom diffusen Licht der Welt in Ecken verdeckt ist; 0 verdeckt nichts, wie EEVEE"
    ),
    "Occlusion Distance": "Reichweite der Verdeckung",
    "Objects farther away do not occlude; 0 takes the distance of EEVEE's Fast GI, if it has one": (
        "Was weiter weg ist, verdeckt nichts; 0 nimmt die Reichweite von EEVEEs Fast GI, wenn es eine hat"
    ),
    "Shadow Samples": "Abtastwerte für Schatten",
    "Shadow rays to each light that has a size, per sample; 0 is hard shadows": (
        "Strahlen zu jedem Licht mit Ausdehnung, für jeden Abtastwert eines Pixels; 0 zeichnet harte Schatten"
    ),
    "Traced Shadows": "Schatten durch Raytracing",
    "Trace the shadows of ray traced objects on what EEVEE draws: glass lets light through": (
        "Die Schatten der Objekte mit Raytracing auf dem verfolgen, was EEVEE zeichnet: Glas lässt Licht durch"
    ),
    "Automatic": "Automatisch",
    "On where a ray traced object lets light through, and with Caustics": (
        "An, wo ein Objekt mit Raytracing Licht durchlässt, und mit Kaustiken"
    ),
    "Off": "Aus",
    "EEVEE draws them: dark, whatever the object is made of": (
        "EEVEE zeichnet sie: dunkel, woraus das Objekt auch ist"
    ),
    "On": "An",
    "The ray tracer draws them all": "Der Raytracer zeichnet sie alle",
    "Caustics": "Kaustiken",
    "Light that ray traced objects focus; needs Traced Shadows": (
        "Licht, das Objekte mit Raytracing bündeln, wo ihre Schatten verfolgt werden"
    ),
    "Light goes straight through: even shadows": "Licht geht gerade hindurch: gleichmäßige Schatten",
    "Brighten the middle of shadows by angle and IOR: a guess for round bodies, no rays": (
        "Die Mitte der Schatten nach Winkel und IOR aufhellen: geschätzt für runde Körper, ohne Strahlen"
    ),
    "Photons": "Photonen",
    "Trace photons from the lights through the objects": (
        "Photonen von den Lichtern durch die Objekte verfolgen, wie Licht wirklich geht"
    ),
    "Photons for the caustics of a frame: more make them less grainy": (
        "Photonen für die Kaustiken eines Bildes: mehr machen sie weniger körnig"
    ),
    "Use EEVEE Pixels in Reflections": "EEVEE-Pixel in Spiegelungen",
    "Use EEVEE Pixels": "EEVEE-Pixel nutzen",
    "Reflections and refractions reuse EEVEE's own pixels of matte surfaces, and of unsupported nodes": (
        "Spiegelungen und Brechungen zeigen EEVEEs Pixel von matten Oberflächen und nicht verfolgten Nodes"
    ),
    "Light Falloff": "Lichtabfall",
    "How far lights reach in the ray traced objects and in what they reflect": (
        "Wie weit Lichter in Objekten mit Raytracing reichen und in dem, was sie spiegeln"
    ),
    "As EEVEE": "Wie EEVEE",
    "Fade lights out at the distance where EEVEE does, so that both halves agree": (
        "Lichter dort enden lassen, wo EEVEE es tut, damit beide Hälften übereinstimmen"
    ),
    "Physical": "Physikalisch",
    "Inverse square without an end, as Cycles has it": "Quadratisch und ohne Ende, wie in Cycles",
    "Residual": "Rest",
    "Share of the light that was cut off; the node always has it": (
        "Abgebrochenes Licht, als Anteil; der Node hat es in jedem Fall"
    ),
    "Passes": "Durchgänge",
    "Passes of the ray traced objects for the compositor": "Pässe der Objekte mit Raytracing für den Compositor",
    "Distance along the view axis; 1e10 where no ray traced object is": (
        "Abstand entlang der Blickachse; 1e10, wo kein Objekt mit Raytracing ist"
    ),
    "Normal in world space, at pixel centers as depth is": "Normale im Weltraum, in Pixelmitten wie die Tiefe",
    "Camera rays of each pixel": "Kamerastrahlen des Pixels",
    "Share of the light that traced shadows leave on EEVEE's half; 1 is no shadow": (
        "Verfolgte Schatten: was von dem Licht bleibt auf dem, was EEVEE zeichnet; 1 ohne sie"
    ),
    "Reflection": "Spiegelung",
    "Light that the first surface mirrors": "Licht, das die erste Oberfläche spiegelt",
    "Refraction": "Brechung",
    "Light that comes through the first surface": "Licht, das durch die erste Oberfläche kommt",
    "Raster-Backed": "Aus dem Raster",
    "Share of the light that comes from EEVEE's own pixels": "Anteil des Lichtwegs, der an EEVEEs Pixeln endet",
    "Ray Traced Preview": "Vorschau mit Raytracing",
    "Trace the ray traced objects in rendered viewports as soon as the view rests": (
        "Die Objekte mit Raytracing in gerenderten Ansichten verfolgen, sobald die Ansicht ruht"
    ),
    "Preview Time Limit": "Zeitlimit der Vorschau",
    "Seconds to refine a viewport at rest; 0 goes on until all Samples are taken": (
        "Sekunden, die eine ruhende Ansicht verfeinert werden darf; 0 macht weiter, bis sie alle Abtastwerte hat"
    ),
    # what needs rays
    "What Needs Rays?": "Was braucht Raytracing?",
    "Find the objects that need rays: why, how much of the picture they cover, and the cost": (
        "Objekte finden, die EEVEE nicht zeichnen kann; sagen, warum, wie viel sie bedecken und was Strahlen kosten"
    ),
    "Tick All Suggested": "Alle Vorschläge übernehmen",
    "No object here needs rays": "Kein Objekt hier braucht Raytracing",
    "All of them: {}, {:.2g} s to build": "Alle zusammen: {}, {:.2g} s zum Aufbauen",
    "of which {:.2g} s for their shadows": "davon {:.2g} s für ihre Schatten",
    "An estimate from small pictures traced here": "Geschätzt nach kleinen Bildern, die hier verfolgt wurden",
    "Objects that need rays: {}": "Objekte, die Raytracing brauchen: {}",
    # beside fields, and titles of panels
    "Bounces": "Abprallungen",
    "Threshold": "Schwelle",
    "Traced": "Verfolgt",
    "Falloff": "Abfall",
    "Rough Surfaces": "Raue Oberflächen",
    "IOR": "IOR",
    "Processor threads for the ray tracer; 0 uses all": "Prozessor-Threads für den Raytracer; 0 nimmt alle",
    "Keep what is selected": "Behalten, was ausgewählt ist",
    "Hybrid": "Hybrid",
    "Analyse": "Analysieren",
    "Why This Pixel?": "Warum dieser Pixel?",
    # what a surface is
    "Solid": "Fest",
    "Metal": "Metall",
    "Transparent": "Durchsichtig",
    "Textured": "Mit Textur",
    "textured": "mit Textur",
    "A mix of {} surfaces": "Mischung aus {} Oberflächen",
    "Neither mirror nor glass: rays change little. Choose a preset, or change the material": (
        "Weder Spiegel noch Glas: Strahlen ändern wenig. Eine Vorgabe wählen oder das Material ändern"
    ),
    "and {} more materials": "und {} weitere Materialien",
    "Its objects follow their own ticks": "Für ihre Objekte gelten deren Häkchen",
    "All objects in here are ray traced: {}": "Alle Objekte hierin mit Raytracing: {}",
    # what a scene lacks, and the report
    "Hybrid needs EEVEE": "Hybrid braucht EEVEE",
    "Switch to EEVEE": "Auf EEVEE umstellen",
    "Render this scene with EEVEE, which draws all that is not ray traced": (
        "Diese Szene mit EEVEE rendern, das alles ohne Raytracing zeichnet"
    ),
    "1 warning: see Report": "1 Warnung: siehe Bericht",
    "{} warnings: see Report": "{} Warnungen: siehe Bericht",
    "Report": "Bericht",
    "{:.1f} s, of which EEVEE {:.1f} s": "{:.1f} s, davon EEVEE {:.1f} s",
    "{:.2f} million rays": "{:.2f} Millionen Strahlen",
    "{:.1f} % of the picture ray traced": "{:.1f} % des Bildes mit Raytracing",
    "{} rays went astray: please report it, with the file": (
        "{} Strahlen sind fehlgegangen: bitte melden, mit der Datei"
    ),
    "No warnings": "Keine Warnungen",
    "Select": "Auswählen",
    "Select the object that the warning names, or all that wear the material": (
        "Das Objekt auswählen, das die Warnung nennt, oder alle mit dem Material"
    ),
    "{} is not in this view layer": "{} ist nicht in dieser Ansichtsebene",
    "Say in the status bar, or in a popup if it is an error, what a render came to": (
        "In der Statusleiste, oder als Popup bei einem Fehler, sagen, was beim Rendern herauskam"
    ),
    "Hybrid is on: ticked objects are ray traced in renders": (
        "Hybrid ist an: Objekte mit Häkchen werden beim Rendern vom Raytracer gezeichnet"
    ),
    "Nothing rendered yet": "Noch nichts gerendert",
    "No object is ray traced: tick Hybrid in an object's properties, or press Analyse": (
        "Kein Objekt mit Raytracing: Hybrid in den Eigenschaften eines Objekts ankreuzen oder Analysieren drücken"
    ),
    "All ray traced objects are hidden in renders: click their camera icons in the Outliner": (
        "Alle Objekte mit Raytracing sind im Rendering verborgen: ihre Kamerasymbole im Outliner anklicken"
    ),
    "No ray traced object was in view in the last render: move the camera, or tick another object": (
        "Im letzten Rendering war kein Objekt mit Raytracing im Bild: die Kamera bewegen oder ein anderes ankreuzen"
    ),
    # saving presets
    "Add Quality Preset": "Qualitätsvorgabe hinzufügen",
    "Save the sampling of this scene as a preset, or remove one": (
        "Die Abtastung dieser Szene als Vorgabe speichern oder eine entfernen"
    ),
    "Add Surface Preset": "Oberflächenvorgabe hinzufügen",
    "Save this object's own values as a preset, or remove one": (
        "Die eigenen Werte dieses Objekts als Vorgabe speichern oder eine entfernen"
    ),
}
