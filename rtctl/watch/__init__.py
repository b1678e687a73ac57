"""The model beside a running machine: residuals and missing force as they come, and an alarm when the model fails."""
