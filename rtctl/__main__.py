"""`python -m rtctl`: the command line, with nothing imported from the current folder but a `rtctl` that lies there.

Python finds `rtctl` before the first line here runs. In a folder of somebody else use the command `rtctl`, or
`python -P -m rtctl`.
"""

from rtctl.config.isolated import isolate

isolate()  # before the next import

import sys  # noqa: E402

from rtctl.cli.main import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
