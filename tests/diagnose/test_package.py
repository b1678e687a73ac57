"""The map of the package: each file stands in it once."""

import pkgutil
import re
from collections import Counter

import rtctl.diagnose


def test_the_map_names_each_file_once():
    rows = re.findall(r"^    .{18}(.*)$", rtctl.diagnose.__doc__ or "", re.MULTILINE)
    named = Counter(re.findall(r"[a-z_]+", re.sub(r"\(.*?\)", "", " ".join(rows).replace(" and ", " "))))
    files = {m.name for m in pkgutil.iter_modules(rtctl.diagnose.__path__)} - {"chain"}
    assert set(named) == files
    assert set(named.values()) == {1}
