"""Make the maths font that report.html embeds: a subset of STIX Two Math, its MATH table kept.

    pip install fonttools brotli
    pip download --no-deps ziamath==0.13 && unzip -j ziamath-0.13-*.whl 'ziamath/fonts/*.ttf'
    python docs/make_font.py STIXTwoMath-Regular.ttf

The same font and the same versions give the same bytes; the tests need neither of them.
"""

from __future__ import annotations

import sys
from pathlib import Path

from fontTools.subset import Options, Subsetter
from fontTools.ttLib import TTFont

TARGET = Path(__file__).parents[1] / "templates" / "report" / "fonts" / "stix-two-math.woff2"
# Inclusive ranges of what a formula of the page can contain.
RANGES = (
    (0x0020, 0x007E),  # letters, digits, ASCII operators
    (0x00A0, 0x00A0),
    (0x00B1, 0x00B1),
    (0x00B7, 0x00B7),
    (0x00D7, 0x00D7),
    (0x02D9, 0x02D9),
    (0x0302, 0x0304),  # combining accents: hat, bar
    (0x0307, 0x0307),  # dot
    (0x0391, 0x03A9),  # Greek
    (0x03B1, 0x03D5),
    (0x03F5, 0x03F5),
    (0x2013, 0x2015),  # dashes and the bar over a letter
    (0x2026, 0x2026),
    (0x2032, 0x2033),  # primes
    (0x203E, 0x203E),
    (0x2061, 0x2062),  # invisible operators
    (0x210E, 0x210E),  # the italic h
    (0x2113, 0x2113),
    (0x2192, 0x2192),
    (0x2208, 0x2208),
    (0x220F, 0x220F),
    (0x2211, 0x2212),
    (0x221A, 0x221A),
    (0x221E, 0x221E),
    (0x2223, 0x2223),
    (0x2225, 0x2225),
    (0x2248, 0x2248),
    (0x2260, 0x2260),
    (0x2264, 0x2265),
    (0x22C5, 0x22C5),
    (0x22EF, 0x22EF),
    (0x1D434, 0x1D467),  # italic letters
    (0x1D6E2, 0x1D71B),  # italic Greek
)


def main(source: str) -> None:
    """Write the subset beside its licence."""
    font = TTFont(source, recalcTimestamp=False)
    options = Options()
    options.flavor = "woff2"
    options.hinting = False
    options.recalc_timestamp = False
    options.name_IDs = [0, 1, 2, 3, 4, 5, 6, 13, 14]
    # Larger brackets and roots are found through MATH. The special script sizes (ssty) would
    # double the file, the other features are for running text.
    options.layout_features = []
    subsetter = Subsetter(options)
    subsetter.populate(unicodes=[code for low, high in RANGES for code in range(low, high + 1)])
    subsetter.subset(font)
    font.flavor = "woff2"
    font.save(TARGET)


if __name__ == "__main__":
    main(sys.argv[1])
