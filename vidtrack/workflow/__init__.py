"""Between Snakemake and the jobs: what each has to do, what it made, and which have to run."""
