"""Evidence: unnamed forces and errors of readings, rivals, posterior probabilities, held-out rows, the verdict."""
