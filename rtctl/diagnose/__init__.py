"""Diagnosis of missing physics: from a recording and the nominal model to named effects, nodes and sizes.

Data flow through the folders one way; each folder imports from the folders before it (tests/diagnose/test_package.py).

    record        recordings as files hold them: columns, edges, sensors, laws of exchange format 1
    model         the nominal model of a machine, and its simulation under a recording
    likelihood    noise, errors of laws, the likelihood of a recording, and the fit of a model
    search        hypotheses, and combinations of them by evidence
    evidence      unnamed forces and errors of readings, rivals, probabilities, held-out rows, the verdict
    answer        words, figures, report, model, config, experiment, free run

Beside the folders: many bundles (bundles, folder, elsewhere), hidden effects (conceal, seal), and the thresholds of a
verdict (calibration).
"""

from rtctl.callable_module import called

called(__name__, "rtctl.api_diagnosis:diagnose")
