"""Write data/bubble_phase_function.csv, where bubbles scatter light to.

python3 dev.py run tools/bubble_table.py
"""

from __future__ import annotations

import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parent))
    import load_checkout

    load_checkout.load()

from underwater_spectral.validation.bubbles import bubbles, write

TABLE = Path(__file__).resolve().parent.parent / "data" / "bubble_phase_function.csv"

if __name__ == "__main__":
    write(TABLE, bubbles())
