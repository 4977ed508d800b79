"""What the report says, before it is drawn."""
