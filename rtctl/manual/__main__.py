"""`python -m rtctl.manual FILE`: write the man page, which the wheel carries."""

import sys
from pathlib import Path

from rtctl.manual.man_page import man_page

if __name__ == "__main__":
    file = Path(sys.argv[1])
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(man_page())
