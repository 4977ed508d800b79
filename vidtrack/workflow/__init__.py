"""Between Snakemake and the jobs: what each is asked to do, what it made of it, what has to run."""
