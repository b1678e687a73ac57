"""The errors that a fit sees: which rows and sensors count, and what they weigh."""
