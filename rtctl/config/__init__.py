"""YAML to settings: loading, units, error messages for people, JSON Schema."""
