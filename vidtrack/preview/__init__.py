"""What an experiment will give, found out by the stages themselves from a few pictures; nothing is written."""
