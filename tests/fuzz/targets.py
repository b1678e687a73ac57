"""Everything that reads what comes from outside, by name, with its share of the inputs."""

import messages
import readers
from target import Kind

TARGETS: dict[str, Kind] = {
    "request": Kind(messages.request, 40),
    "reply": Kind(messages.reply, 20),
    "frame": Kind(messages.frame, 14),
    "telemetry": Kind(messages.telemetry, 10),
    "unit": Kind(readers.unit, 7),
    "trigger": Kind(readers.trigger, 4),
    "setting": Kind(readers.setting, 1),
    "command": Kind(messages.command, 1),
    "key": Kind(readers.key_file, 1),
    "yaml": Kind(readers.yaml_text, 0.5),
    "case": Kind(readers.case, 0.5),
    "config": Kind(readers.config, 0.3),
    "repair": Kind(readers.repaired, 0.1),
    "orders": Kind(readers.journal, 0.5),
    "parquet": Kind(readers.parquet, 0.5),
    "stream": Kind(readers.stream, 0.2),
}
