import pytest

from rtctl import machines
from rtctl.config.load import load_settings
from rtctl.config.yaml_file import find
from rtctl.machines.profiles import PROFILES
from rtctl.plants.physics import elements


@pytest.mark.parametrize("kind", [kind for kind, profile in PROFILES.items() if profile.duty is not None])
def test_nominal_duty_is_positive_at_every_node(kind):
    duty = PROFILES[kind].duty
    config = load_settings(find(kind), machines.CONFIGS[kind], [])
    for element in elements(kind):
        use = duty.use(element.node, config)
        assert use.speed > 0.0 and use.travel > 0.0 and use.force > 0.0 and use.inertia > 0.0
    assert duty.volts(config) > 0.0 and duty.recording > 0.0
