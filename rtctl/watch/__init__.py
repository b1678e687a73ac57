"""The model beside a running machine: residuals and missing force as they come, and an alarm when the model fails."""

from rtctl.callable_module import called

called(__name__, "rtctl.api_improve:watch")
