"""What config.yaml may say: every key with its type, its default and its meaning; nothing else is allowed."""
