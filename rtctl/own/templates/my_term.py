"""My term: air drag, which grows with the square of the speed.

    F = -c v |v|

v in the unit of the node (rad/s, or m/s where it slides), F in Nm or N, c in Nm s^2/rad^2 or N s^2/m^2.

Source: P. R. N. Childs, Rotating Flow (2011), section 6.3, with a constant moment coefficient.
"""

from typing import Literal, NamedTuple

from rtctl.idiom import Settings, quantity, tick
from rtctl.plants.physics import Term, stand


class MyTermSettings(Settings):
    """Settings in the list `physics` of a plant."""

    term: Literal["my_term"] = "my_term"  # in a config the file: ./my_term.py:MyTerm
    node: str
    c: float = quantity(unit="", ge=0, le=1e4, help="drag at a speed of one, by the node's own unit")


class MyTermParams(NamedTuple):
    c: float


def build(settings: MyTermSettings, h: float) -> MyTermParams:
    """Params for substeps of `h` s; nothing is discretised."""
    return MyTermParams(settings.c)


@tick
def drag(p, v):
    """Force against the motion at the speed `v`."""
    return -p.c * v * abs(v)


MY_TERM = Term(
    name="my_term",
    words="air drag: hardly there at low speed, four times as strong at twice the speed",
    equation="F = -c v |v|",
    source="Childs 2011, section 6.3",
    settings=MyTermSettings,
    build=build,
    act={"force": "{m}.f[{i}] += {r} * my_term.drag({p}, {r} * {m}.vm[{i}])"},
    stands=(stand("body"),),  # a body; rtctl/plants/element.py lists the kinds of element, and traits to ask for
    look_alikes={
        "friction.viscous": "hold 0.5, 1 and 2 times the highest speed so far: viscous drag only doubles each time",
    },
    typical={"c": (1e-6, 1e-3)},
)
