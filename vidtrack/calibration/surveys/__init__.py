"""The survey, judged by all cameras together: which points lie elsewhere, and what mistake put them there."""
