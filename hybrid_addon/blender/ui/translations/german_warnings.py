# SPDX-License-Identifier: GPL-3.0-or-later
"""German: what a picture lacks, why something cannot be done, and what a pixel's rays met. {} as in german_messages."""

from __future__ import annotations

SAYS = {
    "limits the blur of EEVEE's half alone, not that of ray traced objects: set it to 100 px": (
        "begrenzt nur die Unschärfe von EEVEEs Hälfte: auf 100 px stellen"
    ),
    "is refused: switch it off in Properties > Output": "geht nicht: in Eigenschaften > Ausgabe ausschalten",
    "replaces the rendered picture: switch Post Processing > Sequencer off": (
        "ersetzt das gerenderte Bild: Nachbearbeitung > Sequenzer ausschalten"
    ),
    "is Strand: EEVEE draws hair one pixel wide, and rays meet its radius: set it to Strip": (
        "ist Strand: EEVEE zeichnet Haare einen Pixel breit, Strahlen treffen ihren Radius: auf Strip stellen"
    ),
    "is off: EEVEE draws no surfaces and tells of none, so none is traced": (
        "ist aus: EEVEE zeichnet keine Oberflächen, also wird keine verfolgt"
    ),
    "is not traced: its objects are solid in reflections and refractions": (
        "wird nicht verfolgt: ihre Objekte sind in Spiegelungen und Brechungen undurchsichtig"
    ),
    "is not traced; it is solid in reflections": "wird nicht verfolgt; es ist in Spiegelungen undurchsichtig",
    "is off: ray traced, all of its layers show through one another": (
        "ist aus: mit Raytracing scheinen alle seine Schichten durcheinander durch"
    ),
    "is not followed, as in EEVEE: it shines to all sides of its front": (
        "wird nicht befolgt, wie in EEVEE: es leuchtet nach vorn in alle Richtungen"
    ),
    "is not traced; rays go straight on, as EEVEE draws it": (
        "wird nicht verfolgt; Strahlen gehen geradeaus, wie EEVEE es zeichnet"
    ),
    "is not traced; the surface is black": "wird nicht verfolgt; die Oberfläche ist schwarz",
    "is not traced: the volume does not glow by its heat": "wird nicht verfolgt: das Volumen glüht nicht",
    "is not followed where it is stepped, or of vectors": "wird in Stufen oder von Vektoren nicht befolgt",
    "is not traced; it is 1": "wird nicht verfolgt; es ist 1",
    "is not followed; its socket's own value is used: bake it to an image": (
        "wird nicht befolgt; es gilt der eigene Wert des Eingangs: in ein Bild backen"
    ),
    "is not followed; the surface is grey": "wird nicht befolgt; die Oberfläche ist grau",
    "is not followed: use a Mapping node": "wird nicht befolgt: einen Mapping-Node verwenden",
    "is traced as Microfiber": "wird als Mikrofaser verfolgt",
}
"""What becomes of a setting or an input that is not followed: the rest of a line that begins with its name."""

WARNINGS = {
    "not denoised: {}": "nicht entrauscht: {}",
    "Open Image Denoise 2, which Blender ships, was not found": (
        "Open Image Denoise 2, das Blender mitbringt, wurde nicht gefunden"
    ),
    # what of the scene is not followed
    "{} of node {}": "{} von Node {}",
    "{} ({} such: {})": "{} ({} solche: {})",
    "node {}: Holdout is not traced; the surface is black": (
        "Node {}: Holdout wird nicht verfolgt; die Oberfläche ist schwarz"
    ),
    "volumes are not ray traced": "Volumen haben kein Raytracing",
    "Grease Pencil is not ray traced": "Grease Pencil hat kein Raytracing",
    "metaballs are not ray traced: convert them to meshes": "Metabälle haben kein Raytracing: in Meshes umwandeln",
    "what it has baked lights EEVEE's half alone: ray traced objects have the world's light": (
        "was sie gebacken hat, beleuchtet nur EEVEEs Hälfte: Objekte mit Raytracing haben das Licht der Welt"
    ),
    "rough reflections of ray traced objects show the world instead of it": (
        "raue Spiegelungen von Objekten mit Raytracing zeigen stattdessen die Welt"
    ),
    "object {} has no attribute {} for its material, which is black there": (
        "Objekt {} hat kein Attribut {} für sein Material, das dort schwarz ist"
    ),
    "object {} has {} for its normal map, which is left out": (
        "Objekt {} hat {} für seine Normal Map, die weggelassen wird"
    ),
    "object {} has {} for its texture, which is one colour all over": (
        "Objekt {} hat {} für seine Textur, die überall dieselbe Farbe hat"
    ),
    "object {}: {} of {} vertices are not finite; their triangles are left out": (
        "Objekt {}: {} von {} Vertices sind nicht endlich; ihre Dreiecke fehlen"
    ),
    "object {}: attribute {} of its instances cannot be read; it is 0 there": (
        "Objekt {}: Attribut {} seiner Instanzen ist nicht lesbar; es ist dort 0"
    ),
    "object {}: its hair, curves or points are not displaced": (
        "Objekt {}: seine Haare, Kurven oder Punkte werden nicht verschoben"
    ),
    "object {}: shown by {}, which is not ray traced: tick {} instead": (
        "Objekt {}: gezeigt von {}, das kein Raytracing hat: stattdessen {} ankreuzen"
    ),
    "object {}: {} is missing from {}": "Objekt {}: {} fehlt in {}",
    "object {}: its NURBS curves are traced through their control points": (
        "Objekt {}: seine NURBS-Kurven gehen durch ihre Kontrollpunkte"
    ),
    "object {}: the alpha of attribute {} is 1 for its hair": "Objekt {}: das Alpha von Attribut {} ist für Haare 1",
    "object {}: hair has no attribute {}, and is black there: only colours of face corners, in bytes, reach it": (
        "Objekt {}: Haare haben kein Attribut {} und sind dort schwarz: nur Farben von Flächenecken, in Bytes, "
        "erreichen sie"
    ),
    "object {}: it has no surface, only a volume, which EEVEE draws: untick Ray Traced": (
        "Objekt {}: es hat keine Oberfläche, nur ein Volumen, das EEVEE zeichnet: Häkchen entfernen"
    ),
    "object {}: instances that are not ray traced, too, keep EEVEE's shadow for all": (
        "Objekt {}: auch Instanzen ohne Raytracing: für alle bleibt EEVEEs Schatten"
    ),
    "object {} of background scene {} instances others, is instanced, or is linked: only EEVEE draws it; link it to "
    "scene {} to have it ray traced": (
        "Objekt {} der Hintergrundszene {} instanziert andere, wird instanziert oder ist verknüpft: nur EEVEE zeichnet "
        "es; mit Szene {} verknüpfen, um es zu verfolgen"
    ),
    "{}: its volume cannot be read, rays meet nothing of it: {}": (
        "{}: sein Volumen kann nicht gelesen werden, Strahlen treffen nichts davon: {}"
    ),
    "{}: this Blender has no module openvdb: rays meet nothing of the volume": (
        "{}: dieses Blender hat kein Modul openvdb: Strahlen treffen nichts vom Volumen"
    ),
    "{}: there is no surface program {}: drawn with its material (registered: {})": (
        "{}: es gibt kein Oberflächenprogramm {}: mit dem Material gezeichnet (angemeldet: {})"
    ),
    "it is left out of what rays meet: its volume cannot be followed": (
        "Strahlen treffen nichts davon: seinem Volumen kann nicht gefolgt werden"
    ),
    "what its volume absorbs varies, which is not traced behind a surface: it absorbs nothing": (
        "was sein Volumen absorbiert, ändert sich, und hinter einer Oberfläche wird das nicht verfolgt: es absorbiert "
        "nichts"
    ),
    "camera {}: Advanced > Trace: Everything draws it as a panorama": (
        "Kamera {}: „Erweitert > Verfolgen: Alles“ zeichnet sie als Panorama"
    ),
    "camera {}: its type {} is Cycles' alone; drawn as Perspective, as EEVEE draws it": (
        "Kamera {}: ihren Typ {} kennt nur Cycles; perspektivisch gezeichnet, wie von EEVEE"
    ),
    "image {}: cannot read {}; it is drawn pink": "Bild {}: {} ist nicht lesbar; es ist pink",
    "image {}: only the current frame of it is used": "Bild {}: nur sein aktuelles Einzelbild wird verwendet",
    "image {}: colour space {} cannot be converted; its values are used as is": (
        "Bild {}: Farbraum {} lässt sich nicht umrechnen; die Werte gelten, wie sie sind"
    ),
    "image {}: cannot read its tile {}; it is drawn pink": "Bild {}: Kachel {} ist nicht lesbar; sie ist pink",
    "node {} has no image; it is drawn black": "Node {} hat kein Bild; schwarz gezeichnet",
    "node {} has no image; it is drawn pink": "Node {} hat kein Bild; pink gezeichnet",
    "light {} is nowhere (its matrix is singular or not finite) and gives no light": (
        "Licht {} ist nirgends (seine Matrix ist singulär oder nicht endlich) und leuchtet nicht"
    ),
    "light {} has no area and gives no light (EEVEE drops it, too)": (
        "Licht {} hat keine Fläche und leuchtet nicht (auch in EEVEE nicht)"
    ),
    "light {}: its nodes are ignored, as EEVEE ignores them; colour and power are used": (
        "Licht {}: seine Nodes gelten nicht, wie in EEVEE; Farbe und Stärke gelten"
    ),
    "node {}: its thin film has the colours of Rec. 709, not of {}": (
        "Node {}: seine dünne Schicht hat die Farben von Rec. 709, nicht von {}"
    ),
    "it has no active output; it is black": "hat keinen aktiven Ausgang; es ist schwarz",
    "skies are not drawn in the working space {}": "Himmel werden im Arbeitsfarbraum {} nicht gezeichnet",
    "{} of node {} is always {}, as for the camera": "{} von Node {} ist immer {}, wie für die Kamera",
    "{} varies, which is not traced: rays meet nothing of the volume": (
        "{} ändert sich im Raum, was nicht verfolgt wird: Strahlen treffen das Volumen nicht"
    ),
    "behind a surface scattering is not traced, only what the volume absorbs": (
        "hinter einer Oberfläche wird Streuung nicht verfolgt, nur, was das Volumen absorbiert"
    ),
    "behind a surface emission is not traced: the volume does not glow": (
        "hinter einer Oberfläche wird Emission nicht verfolgt: das Volumen leuchtet nicht"
    ),
    "volume node {} ({}) is not traced": "Volumen-Node {} ({}) wird nicht verfolgt",
    "fog of {} is not traced: the mesh is open or flat, and only a closed one has an inside": (
        "Nebel von {} wird nicht verfolgt: das Mesh ist offen oder flach, nur ein geschlossenes hat ein Inneres"
    ),
    "the film is transparent: see-through ray traced surfaces are as opaque as EEVEE draws them, and light that is "
    "added to them is lost where EEVEE draws nothing": (
        "Der Film ist transparent: durchsichtige Oberflächen mit Raytracing sind so deckend, wie EEVEE sie zeichnet; "
        "hinzugefügtes Licht geht verloren, wo EEVEE nichts zeichnet"
    ),
    "fog lies about see-through ray traced surfaces: what is behind them is too bright or too dark": (
        "Nebel um durchsichtige Oberflächen mit Raytracing: was dahinter liegt, ist zu hell oder zu dunkel"
    ),
    "with {} sample ray traced objects stand still, without motion blur: take {} or more": (
        "Mit {} Abtastwert stehen Objekte mit Raytracing still, ohne Bewegungsunschärfe: {} oder mehr nehmen"
    ),
    "drivers read {} of the active scene or view layer: what they move may be elsewhere in the traced half": (
        "Treiber lesen {} der aktiven Szene oder Ansichtsebene: was sie bewegen, kann in der verfolgten Hälfte "
        "anderswo sein"
    ),
    "{} is a library override; Blender will not save its Hybrid settings: tick and untick Ray Traced once in {}, and "
    "save that file": (
        "{} ist eine Bibliotheksüberschreibung; Blender speichert ihre Hybrid-Einstellungen nicht: in {} einmal das "
        "Häkchen setzen und entfernen und jene Datei speichern"
    ),
    # what a frame cost
    "the frame took {} s, over its Time Limit of {} s: before the tracer {} s, exporting and preparing the scene {} s, "
    "tracing {} s": (
        "Das Bild brauchte {} s, über sein Zeitlimit von {} s: vor dem Raytracer {} s, Szene exportieren und "
        "vorbereiten {} s, Raytracing {} s"
    ),
    "{} of the picture is darker than it should be, by {} of its light": (
        "{} des Bildes sind um {} ihres Lichts zu dunkel"
    ),
    "{}: rays{}need more than {} bounces: raise Max Bounces": (
        "{}: Strahlen{}brauchen mehr als {} Abprallungen: Max. Abprallungen erhöhen"
    ),
    "{}: lower the Min Light of {}": "{}: Mindestlicht {} verringern",
    "not enough memory: {}": "Nicht genug Speicher: {}",
    "{}, of {} that are free; {}": "{}, von {}, die frei sind; {}",
    "lower the resolution or the samples": "Auflösung oder Abtastwerte verringern",
    # what cannot be done
    "{} is neither an object nor a material: pass bpy.data.objects['NAME']": (
        "{} ist weder Objekt noch Material: bpy.data.objects['NAME'] übergeben"
    ),
    "it has no nodes: tick Use Nodes to have it ray traced by itself": (
        "Es hat keine Nodes: Nodes verwenden ankreuzen, um es selbst zu verfolgen"
    ),
    "it is a volume: only surfaces can be ray traced by themselves": (
        "Es ist ein Volumen: nur Oberflächen können selbst Raytracing haben"
    ),
    "metaball {} wears it, which only EEVEE draws: give the metaball another one": (
        "Metaball {} trägt es, und ihn zeichnet nur EEVEE: dem Metaball ein anderes geben"
    ),
    "{} is not a scene: pass bpy.context.scene": "{} ist keine Szene: bpy.context.scene übergeben",
    "{} is a metaball: convert it to a mesh (Object > Convert) to ray trace it": (
        "{} ist ein Metaball: in ein Mesh umwandeln (Objekt > Umwandeln), um ihn zu verfolgen"
    ),
    "{} is a {}: only objects with a surface can be ray traced": (
        "{} ist vom Typ {}: nur Objekte mit einer Oberfläche können Raytracing haben"
    ),
    "{} is linked from {}: make a library override first": (
        "{} ist aus {} verknüpft: zuerst eine Bibliotheksüberschreibung machen"
    ),
    "preset is {}: it must be one of {}": "Vorgabe ist {}: es muss eine von diesen sein: {}",
    "Blender's render gave no composite: it was cancelled": "Blenders Rendering gab kein Bild: es wurde abgebrochen",
    "cannot write {}: {}": "{} ist nicht zu schreiben: {}",
    "cannot read {}: {}": "{} ist nicht zu lesen: {}",
    "cannot write into Blender's temporary folder {}: {}": (
        "In Blenders temporären Ordner {} ist nicht zu schreiben: {}"
    ),
    "Blender does not evaluate scene {}: does it render?": "Blender wertet Szene {} nicht aus: rendert sie?",
    "EEVEE needs OpenGL and {}: install a graphics driver or Mesa (Debian: apt install {}), or use mode full, which "
    "needs none": (
        "EEVEE braucht OpenGL, und {}: einen Grafiktreiber oder Mesa installieren (Debian: apt install {}) oder Modus "
        "full nehmen, der keins braucht"
    ),
    "EGL finds no driver": "EGL findet keinen Treiber",
    "the EGL driver has no OpenGL": "der EGL-Treiber hat kein OpenGL",
    "libEGL.so.1 is not installed": "libEGL.so.1 ist nicht installiert",
    "scene {} renders with {}: set Render Engine to EEVEE for hybrid rendering": (
        "Szene {} rendert mit {}: für Hybrid die Render-Engine auf EEVEE stellen"
    ),
    "scene {} has the add-on's internal engine: set Render Engine to EEVEE and tick Hybrid": (
        "Szene {} hat die interne Engine des Add-ons: die Render-Engine auf EEVEE stellen und Hybrid ankreuzen"
    ),
    "scene {} has no mask view layer: switch Hybrid off and on again": (
        "Szene {} hat keine Maskenebene: Hybrid aus- und wieder einschalten"
    ),
    "scene {} has no compositor": "Szene {} hat keinen Compositor",
    "scene {} has no camera; add one and make it the active camera": (
        "Szene {} hat keine Kamera; eine hinzufügen und zur aktiven machen"
    ),
    "set Viewport Shading to Rendered": "Die Viewport-Schattierung auf Gerendert stellen",
    "the view transform {} cannot be shown: {}": "Die Ansichtstransformation {} ist nicht darstellbar: {}",
    "Blender keeps no render result in this file: render once with F12 and save it": (
        "Blender hat in dieser Datei kein Renderergebnis: einmal mit F12 rendern und speichern"
    ),
    "depth of field blurs EEVEE's picture, but not its depth": "Tiefenschärfe: in EEVEEs Bild, nicht in seiner Tiefe",
    "motion blur blurs EEVEE's picture, but not its depth": (
        "Bewegungsunschärfe ist in EEVEEs Bild, nicht in seiner Tiefe"
    ),
    "a volume lies between EEVEE's picture and its surfaces": (
        "Zwischen EEVEEs Bild und seinen Oberflächen liegt ein Volumen"
    ),
    "Grease Pencil lies over EEVEE's picture, but is not in its depth": (
        "Grease Pencil liegt über EEVEEs Bild und ist nicht in seiner Tiefe"
    ),
    # why there is no retrace
    "cannot retrace: {}": "Kein neues Verfolgen: {}",
    "{} changed what EEVEE draws: press F12": "{} hat geändert, was EEVEE zeichnet: F12 drücken",
    "switch Hybrid on and render first": "Erst Hybrid einschalten und rendern",
    "only where chosen objects are traced, and there are some, there is a picture of EEVEE to trace over": (
        "Nur wo gewählte Objekte verfolgt werden und es welche gibt, gibt es EEVEEs Bild dafür"
    ),
    "there is no render to trace over: press F12 first": "Es gibt noch kein Rendering: erst F12 drücken",
    "the last render shows frame {}: go there, or press F12": (
        "Das letzte Rendering zeigt Bild {}: dorthin gehen oder F12 drücken"
    ),
    "{} since the last render: press F12": "{} seit dem letzten Rendering: F12 drücken",
    "{} has changed since the last render: render with F12": (
        "{} hat sich seit dem letzten Rendering geändert: mit F12 rendern"
    ),
    "the scene's settings have changed": "Die Einstellungen der Szene haben sich geändert",
    "{} is new or gone": "{} ist neu oder fort",
    "{} has changed": "{} hat sich geändert",
    "the compositor uses Cryptomatte, which EEVEE draws: press F12": (
        "Der Compositor verwendet Cryptomatte, das EEVEE zeichnet: F12 drücken"
    ),
    "the compositor uses more of EEVEE than its picture, in node {}: press F12": (
        "Der Compositor verwendet mehr von EEVEE als sein Bild, in Node {}: F12 drücken"
    ),
    # the Image Editor
    "pixel {}, {} lies outside the frame of {} x {}": "Pixel {}, {} liegt außerhalb des Bildes von {} x {}",
    "click within the picture": "In das Bild klicken",
    "this is the slot that is shown: choose another one": "Dieser Slot wird gezeigt: einen anderen wählen",
    "nothing is rendered yet": "Noch nichts gerendert",
    "slot {} is empty: render into it": "Slot {} ist leer: in ihn rendern",
    "seen as the viewport shows it, not as it renders: {}": (
        "gesehen, wie die Ansicht es zeigt, nicht, wie es gerendert wird: {}"
    ),
}
"""Warnings and errors of less general kinds."""

WARNINGS |= {f"{{}} {english}": f"{{}} {own}" for english, own in SAYS.items()}

PIXEL = {
    "pixel {}, {}: no ray traced object here; EEVEE draws it": "Pixel {}, {}: kein Raytracing hier, EEVEE zeichnet es",
    "pixel {}, {}: radiance {}": "Pixel {}, {}: Strahldichte {}",
    "; of it {}": "; davon {}",
    "; cut off, of unit radiance: {}": "; abgebrochen, von Strahldichte 1: {}",
    ": not followed": ": nicht verfolgt",
    ", past {}": ", vorbei an {}",
    "light {}": "Licht {}",
    ", through fog that leaves {} %": ", durch Nebel, der {} % lässt",
    "it leaves the scene": "verlässt die Szene",
    "{} m to {}, surface {}": "{} m bis {}, Oberfläche {}",
    "from inside at {}°": "von innen, {}°",
    ", answered by surface program {}": ", beantwortet vom Oberflächenprogramm {}",
    "from outside at {}°": "von außen, {}°",
    "camera": "Kamera",
    "reflected": "gespiegelt",
    "refracted": "gebrochen",
    "straight": "geradeaus",
    "light": "Licht",
    "emission": "Emission",
    "world": "Welt",
    "lamps": "Lampen",
    "fog": "Nebel",
}
"""Of a pixel's ray tree (report/pixel.py)."""

KINDS = {
    "object": "Objekt",
    "material": "Material",
    "world": "Welt",
    "light": "Licht",
    "camera": "Kamera",
    "image": "Bild",
    "scene": "Szene",
    "collection": "Sammlung",
    "things": "Dinge",
}
"""Kinds of datablocks, as a warning names them before a name."""
