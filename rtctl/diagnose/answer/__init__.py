"""What a reader gets: words, figures, report, model, config, experiment, free run."""
