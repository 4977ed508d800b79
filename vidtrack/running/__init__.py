"""Snakemake, started and shown: its text in a log, the jobs' progress on one display, the verdict last."""
