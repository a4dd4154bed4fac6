"""Published ratios of soft to hard tissue; docs/measurements/ratios.md names the sources."""

# (operation, landmark) → what is published, and the lowest and highest ratio within it: one standard
# deviation about the mean where it is published, else the range.
PUBLISHED = {
    ("advance", "lower_lip"): ("0.66 [2]; about 0.5 ± 0.3 [8]", 0.2, 0.8),
    ("advance", "b_soft"): ("1.00 [5]", 0.9, 1.1),
    ("advance", "pogonion_soft"): ("0.80–1.33 [1], 0.90–1.00 [5]", 0.8, 1.33),
    ("set-back", "upper_lip"): ("about 0.15 [7]", 0.0, 0.3),
    ("set-back", "lower_lip"): ("0.66 [2] … about 1.0 [7]", 0.66, 1.0),
    ("set-back", "b_soft"): ("1.00 [5]", 0.9, 1.1),
    ("set-back", "pogonion_soft"): ("0.90–1.00 [5]", 0.9, 1.0),
    ("chin", "pogonion_soft"): ("0.77–0.91 [3]", 0.77, 0.91),
    ("Le Fort I", "pronasale"): ("0.24–0.35 [4], 0.17 [2]", 0.17, 0.35),
    ("Le Fort I", "subnasale"): ("0.51 ± 0.13 [6], 0.60–0.90 [5]", 0.38, 0.9),
    ("Le Fort I", "upper_lip"): ("0.82 ± 0.13 [6], 0.60–1.00 [5]", 0.6, 1.0),
    ("impaction", "upper_lip"): ("0.2–0.5 [6]", 0.2, 0.5)}
