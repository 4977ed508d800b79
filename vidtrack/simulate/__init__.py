"""Makes what a laboratory makes, from a scenario; knows cameras and clocks, never an estimator."""
