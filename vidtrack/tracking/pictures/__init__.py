"""What is wrong with the pictures themselves: damaged, repeated, mixed, in another order, at other times."""
