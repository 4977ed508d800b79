"""What the page shows: sections, tables, which figure when; the stages computed it."""
