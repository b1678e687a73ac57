"""The emulated machines: equations of motion, and the terms of physics that stand at their nodes."""
