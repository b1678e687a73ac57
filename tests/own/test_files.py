import sys

import pytest

from rtctl.own.files import OwnError, Source, is_own, keep, load, read, split, trust


def source(text, file="./try.py"):
    trust([text])
    return Source(file, "Try", text)


def test_kind_in_a_config_is_a_user_file_or_a_shipped_kind():
    assert is_own("./try.py:Try") and is_own("try.py")
    assert not is_own("pd") and not is_own(None) and not is_own({"kind": "pd"})
    assert split("../a b/try.py:Try") == ("../a b/try.py", "Try")
    with pytest.raises(OwnError, match=r"should be a file and a name in it, such as \./my_law\.py:MyLaw"):
        split("./try.py")


def test_changed_text_is_another_module_and_equal_text_the_same():
    one, two = load(source("x = 1\n")), load(source("x = 2\n"))
    assert (one.x, two.x) == (1, 2)
    assert one.__name__ != two.__name__
    assert load(source("x = 1\n")) is one
    assert sys.modules[one.__name__] is one


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a = 1\nretrn a\n", r"\./try\.py:2: not Python: invalid syntax"),
        ("import numpy\n1 / 0\n", r"\./try\.py:2: ZeroDivisionError while the file was read"),
        (
            "from rtctl.idiom import Settings\nclass A(Settings):\n    k = 1.0\n",
            r"\./try\.py:2: PydanticUserError while the file was read: [^\n]*$",
        ),
        ("import beside\n", r"\./try\.py:1: there is no module 'beside'; an own file may import what is installed"),
        ("from rtctl.laws import pdd\n", r"\./try\.py:1: cannot import name 'pdd' from 'rtctl\.laws'$"),
    ],
)
def test_error_in_a_user_file_names_the_line(text, message):
    for _ in range(2):  # no partial module is left
        with pytest.raises(OwnError, match=message):
            load(source(text))


def test_missing_or_binary_user_file_is_refused(tmp_path):
    (tmp_path / "try.py").write_text("x = 1\n")
    assert read("./try.py", tmp_path) == "x = 1\n"
    with pytest.raises(OwnError, match=r"\./tri\.py: no such file in .*; did you mean 'try\.py'"):
        read("./tri.py", tmp_path)
    (tmp_path / "led_nowhere.py").symlink_to(tmp_path / "gone")
    with pytest.raises(OwnError, match=r"no such file in .*; `rtctl new law NAME` writes one"):
        read("./led_nowhere.py", tmp_path)
    (tmp_path / "bad.py").write_bytes(b"x = 1\n\xff\n")
    with pytest.raises(OwnError, match=r"\./bad\.py:2: not UTF-8"):
        read("./bad.py", tmp_path)
    (tmp_path / "big.py").write_bytes(b"#" * (1 << 19))
    with pytest.raises(OwnError, match="256 KiB"):
        read("big.py", tmp_path)


def test_texts_of_user_files_are_saved(tmp_path):
    keep({}, tmp_path)
    assert not list(tmp_path.iterdir())
    keep({"../laws/try.py": "x = 1\n"}, tmp_path)
    assert (tmp_path / "own" / "try.py").read_text() == "x = 1\n"
