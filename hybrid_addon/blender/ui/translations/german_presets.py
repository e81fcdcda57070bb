# SPDX-License-Identifier: GPL-3.0-or-later
"""German: the words of presets and of the asset library."""

from __future__ import annotations

PRESETS = {
    "Silver, as behind the glass of a mirror": "Silber, wie hinter dem Glas eines Spiegels",
    "Chrome": "Chrom",
    "Polished chrome: reflectance measured": "Poliertes Chrom: Reflexion gemessen",
    "Gold": "Gold",
    "Polished gold: reflectance measured": "Poliertes Gold: Reflexion gemessen",
    "Copper": "Kupfer",
    "Polished copper: reflectance measured": "Poliertes Kupfer: Reflexion gemessen",
    "Clear crown glass: IOR 1.517, Abbe number 64": "Klares Kronglas: IOR 1,517, Abbe-Zahl 64",
    "Window": "Fensterglas",
    "Float glass: IOR 1.52, a little green at its edge": "Floatglas: IOR 1,52, an der Kante etwas grün",
    "Frosted": "Milchglas",
    "Etched glass: IOR 1.517, roughness 0.35": "Geätztes Glas: IOR 1,517, Rauheit 0,35",
    "Clear water: IOR 1.333, blue in metres of it": "Klares Wasser: IOR 1,333, blau erst nach Metern",
    "Ice": "Eis",
    "Clear ice: IOR 1.309": "Klares Eis: IOR 1,309",
    "Ruby": "Rubin",
    "Ruby: IOR 1.766, red for a stone of 1 cm": "Rubin: IOR 1,766, rot bei einem Stein von 1 cm",
    "Car Paint": "Autolack",
    "Red paint under a clear coat": "Roter Lack unter Klarlack",
    "{} can wear no material": "{} kann kein Material haben",
    "They are linked from another file: nothing was changed": "Sie sind aus einer anderen Datei verknüpft: unverändert",
    "{} is missing: install the add-on again": "{} fehlt: das Add-on neu installieren",
    "Objects that wear {} now: {}": "Objekte, die jetzt {} tragen: {}",
    "The last render failed: {}": "Das letzte Rendern ist gescheitert: {}",
    "Volume": "Volumen",
    "Add Asset Library": "Asset-Bibliothek hinzufügen",
    "Show the materials and light rigs of the add-on (CC0) in the Asset Browser": (
        "Materialien und Lichtaufbauten des Add-ons (CC0) im Asset-Browser zeigen"
    ),
    "Materials and light rigs are in the Asset Browser: library Hybrid": (
        "Materialien und Lichtaufbauten sind im Asset-Browser: Bibliothek Hybrid"
    ),
}
