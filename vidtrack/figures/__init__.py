"""Tables in, figures out; reads, computes and saves nothing."""
