"""What the user should know of how targets were tracked."""
