"""Property tests that throw random input at everything a user can call; `make fuzz` runs them at length."""
