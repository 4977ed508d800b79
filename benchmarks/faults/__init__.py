"""What killed, stopped, hindered and disturbed runs leave behind. See `__main__`."""
