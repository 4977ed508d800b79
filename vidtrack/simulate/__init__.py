"""Makes what a laboratory makes, from a scenario; uses cameras and clocks, never an estimator."""
