"""`python -m rtctl.manual FILE`: write the man page, which the wheel carries."""

import sys
from pathlib import Path

from rtctl.config.files import write_text
from rtctl.manual.man_page import man_page

if __name__ == "__main__":
    file = Path(sys.argv[1])
    file.parent.mkdir(parents=True, exist_ok=True)
    write_text(file, man_page())
