"""Finds the physics that a simulation lacks: from a recording and the owner's model to names, nodes and sizes.

Data flow through the folders one way; each imports from those before it (tests/diagnose/test_package.py).

    record        recordings as files hold them: columns, edges, sensors, laws of exchange format 1
    model         a machine as somebody believes it, and its simulation under a recording
    likelihood    noise, errors of laws, the likelihood of a recording, and the fit of a model by it
    search        hypotheses, and combinations of them by evidence
    evidence      forces and errors of readings without a name, rivals, probabilities, held-out rows, the verdict
    answer        words, figures, report, model, config, experiment, free run

Beside them: many bundles (bundles, folder), hidden effects (conceal, seal), and the numbers that a verdict hangs on
(calibration).
"""

from rtctl.callable_module import called

called(__name__, "rtctl.api_diagnosis:diagnose")
