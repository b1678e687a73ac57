"""Forces and errors of readings without a name, rivals, their probabilities, held-out rows, the verdict."""
