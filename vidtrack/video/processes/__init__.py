"""Reading beside the program that uses it: in threads and processes of their own."""
