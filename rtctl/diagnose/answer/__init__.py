"""Results of a diagnosis: words, figures, report, model, config, experiment, free run."""
